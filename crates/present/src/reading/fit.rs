//! Data for the drawings of a fit, in the window and in the report.

use nalgebra::{Point2, Point3, Rotation3, Vector2, Vector3};

use boresight_geometry::Camera;

/// Bars of the histogram.
pub const BARS: usize = 25;
/// Half width of cloud and histogram, in standard deviations.
pub const SPAN: f64 = 4.0;
/// Number of rings around the principal point.
const RINGS: usize = 8;
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

/// Corners at about the same distance from the principal point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ring {
    /// Distance of the nearest corner.
    pub from_px: f64,
    /// Distance of the farthest corner.
    pub to_px: f64,
    /// Mean residual outwards: far from zero, the lens model misses something there.
    pub mean_px: f64,
    /// RMS of the residuals outwards.
    pub rms_px: f64,
}

/// Distance of a corner `at` a pixel from the principal point, and its residual's part outwards.
pub fn outwards(pp_px: &Point2<f64>, at: &Point2<f64>, off_px: &Vector2<f64>) -> [f64; 2] {
    let from_pp = at - pp_px;
    let distance_px = from_pp.norm();
    [distance_px, from_pp.dot(off_px) / distance_px.max(1e-9)]
}

/// Rings of about equally many corners, from the middle out, of distances and residuals outwards.
pub fn rings(mut corners: Vec<[f64; 2]>) -> Vec<Ring> {
    corners.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let ring = |corners: &[[f64; 2]]| {
        let count = corners.len() as f64;
        Ring {
            from_px: corners[0][0],
            to_px: corners[corners.len() - 1][0],
            mean_px: corners.iter().map(|corner| corner[1]).sum::<f64>() / count,
            rms_px: (corners.iter().map(|corner| corner[1].powi(2)).sum::<f64>() / count).sqrt(),
        }
    };
    corners.chunks(corners.len().div_ceil(RINGS).max(1)).map(ring).collect()
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ring_whose_corners_are_off_outwards_is_told_from_noise() {
        let pp = Point2::new(320.0, 240.0);
        // The outermost of eight rings is 0.2 px too far out, all others are off to the side.
        let corners = (0..80).map(|i| {
            let (sin, cos) = libm::sincos(2.4 * f64::from(i));
            let (out, aside) = (Vector2::new(cos, sin), Vector2::new(-sin, cos));
            let at = pp + out * f64::from(4 * i);
            outwards(&pp, &at, &if i < 70 { 0.1 * aside } else { 0.2 * out })
        });
        let rings = rings(corners.rev().collect());
        assert_eq!(rings.len(), RINGS);
        for (i, ring) in rings.iter().enumerate() {
            let off_px = if i < 7 { 0.0 } else { 0.2 };
            assert!((ring.mean_px - off_px).abs() < 1e-9, "{ring:?}");
            assert!((ring.rms_px - off_px).abs() < 1e-9, "{ring:?}");
            assert!((ring.from_px - 40.0 * i as f64).abs() < 1e-9, "{ring:?}");
            assert!((ring.to_px - 40.0 * i as f64 - 36.0).abs() < 1e-9, "{ring:?}");
        }
        assert_eq!(super::rings(Vec::new()), []);
    }
}
