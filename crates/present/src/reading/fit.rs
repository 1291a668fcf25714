//! Data for the drawings of a fit, in the window and in the report.

use nalgebra::{Point2, Point3, Rotation3, Vector2, Vector3};

use boresight_geometry::Camera;

/// Bars of the histogram.
pub const BARS: usize = 25;
/// Half width of cloud and histogram, in standard deviations.
pub const SPAN: f64 = 4.0;
/// Elevation of the viewpoint of the boards above the camera's axis, rad.
const ABOVE_RAD: f64 = 0.45;

/// Histogram of residual components.
#[derive(Clone, Debug, PartialEq)]
pub struct Histogram {
    /// Components per bar, from [`SPAN`] standard deviations below zero to as many above.
    pub counts: [u32; BARS],
    /// Number of all components.
    all: f64,
}

impl Histogram {
    /// Histogram of the components of `offs_px` with standard deviation `rms_px`.
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

    /// Count expected from a normal distribution in a bar at `sds` standard deviations.
    pub fn normal(&self, sds: f64) -> f64 {
        let step = 2.0 * SPAN / BARS as f64;
        self.all * step * libm::exp(-0.5 * sds * sds) / std::f64::consts::TAU.sqrt()
    }

    /// Maximum height of bars and curve.
    pub fn most(&self) -> f64 {
        self.counts.iter().map(|count| f64::from(*count)).fold(self.normal(0.0), f64::max)
    }
}

/// Rotation to a viewpoint above the camera's axis and `aside_rad` to its side.
pub fn from_aside(aside_rad: f64) -> Rotation3<f64> {
    Rotation3::from_axis_angle(&Vector3::x_axis(), ABOVE_RAD)
        * Rotation3::from_axis_angle(&Vector3::y_axis(), aside_rad)
}

/// Corners of the field of view at depth `depth_m`, around the picture.
pub fn field(camera: &Camera, (width_px, height_px): (f64, f64), depth_m: f64) -> Vec<Point3<f64>> {
    [(0.0, 0.0), (width_px, 0.0), (width_px, height_px), (0.0, height_px)]
        .into_iter()
        .filter_map(|(x, y)| camera.normalized_from_px(&Point2::new(x - 0.5, y - 0.5)))
        .map(|at| Point3::new(at.x * depth_m, at.y * depth_m, depth_m))
        .collect()
}
