//! A file's principal line as a line to draw and to intersect.

use nalgebra::{Matrix4, Point2, Vector2};

use boresight_formats::LineEntry;
use boresight_geometry::PrincipalLine;

/// Line in the picture, in pixels: a point on it and its direction, a unit vector.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Line {
    pub(super) through_px: Point2<f64>,
    pub(super) along: Vector2<f64>,
}

impl From<LineEntry> for Line {
    fn from(entry: LineEntry) -> Self {
        let (sin, cos) = libm::sincos(entry.phi_rad);
        let [x, y] = entry.x0_px;
        Self {
            through_px: Point2::new(x + entry.c_px * cos, y + entry.c_px * sin),
            along: Vector2::new(-sin, cos),
        }
    }
}

/// Line for unweighted intersection: its covariance is zero.
pub(super) fn unweighted_line(entry: &LineEntry, slot_rad: f64) -> PrincipalLine {
    PrincipalLine {
        phi_rad: entry.phi_rad,
        c_px: entry.c_px,
        v_px: 0.0,
        d_px: 0.0,
        vanishing_point_px: Line::from(*entry).through_px,
        origin_px: entry.x0_px.into(),
        tilt_azimuth_rad: slot_rad,
        covariance: Matrix4::zeros(),
    }
}
