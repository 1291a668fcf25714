//! What the drawings of a fit show, in the window and in the report.

use nalgebra::{Point2, Point3, Rotation3, Vector2, Vector3};

use boresight_geometry::Camera;

/// Bars of the histogram.
pub const BARS: usize = 25;
/// Half the width of cloud and histogram, in standard deviations.
pub const SPAN: f64 = 4.0;
/// How far the boards' point of view is above the camera's axis, rad.
const ABOVE_RAD: f64 = 0.45;

/// How often each size of a residual's component occurs.
#[derive(Clone, Debug, PartialEq)]
pub struct Histogram {
    /// Components within each bar, from [`SPAN`] standard deviations below zero to as many above it.
    pub counts: [u32; BARS],
    /// All components.
    all: f64,
}

impl Histogram {
    /// The components of `offs_px`, whose standard deviation is `rms_px`.
    pub fn of(offs_px: &[Vector2<f64>], rms_px: f64) -> Self {
        let mut counts = [0; BARS];
        for value in offs_px.iter().flat_map(|off| [off.x, off.y]) {
            let place = (value / rms_px + SPAN) / (2.0 * SPAN) * BARS as f64;
            if (0.0..BARS as f64).contains(&place) {
                counts[place as usize] += 1;
            }
        }
        Self { counts, all: 2.0 * offs_px.len() as f64 }
    }

    /// What a normal distribution would have in a bar at `sds` standard deviations.
    pub fn normal(&self, sds: f64) -> f64 {
        let step = 2.0 * SPAN / BARS as f64;
        self.all * step * libm::exp(-0.5 * sds * sds) / std::f64::consts::TAU.sqrt()
    }

    /// Height that bars and curve stay within.
    pub fn most(&self) -> f64 {
        self.counts.iter().map(|count| f64::from(*count)).fold(self.normal(0.0), f64::max)
    }
}

/// Turns space so that it's seen from above the camera's axis, and from `aside_rad` to its side.
pub fn from_aside(aside_rad: f64) -> Rotation3<f64> {
    Rotation3::from_axis_angle(&Vector3::x_axis(), ABOVE_RAD)
        * Rotation3::from_axis_angle(&Vector3::y_axis(), aside_rad)
}

/// Where the rays of the corners of a picture of that size are at that depth, around the picture.
pub fn field(camera: &Camera, (width_px, height_px): (f64, f64), depth_m: f64) -> Vec<Point3<f64>> {
    [(0.0, 0.0), (width_px, 0.0), (width_px, height_px), (0.0, height_px)]
        .into_iter()
        .filter_map(|(x, y)| camera.normalized_from_px(&Point2::new(x - 0.5, y - 0.5)))
        .map(|at| Point3::new(at.x * depth_m, at.y * depth_m, depth_m))
        .collect()
}
