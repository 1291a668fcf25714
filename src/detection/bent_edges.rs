//! Corrects corners for edges that the lens bends.
//!
//! The edge model has straight edges. Fitted to an edge of curvature κ, a straight one passes the corner at a distance of
//! ½ κ ⟨t²⟩, where ⟨t²⟩ is the mean squared distance along the edge of the pixels that determine it: 0.02 to 0.08 px
//! near the rim of a wide lens, several times the noise. Perspective keeps lines straight, so the second difference of
//! three corners in line, across the line, shows κ alone; and as they lie whole squares apart while the patch reaches
//! less than half a square, the correction adds next to no noise.

use nalgebra::{Matrix2, Point2, Vector2};

use super::edge_model::EdgeFit;
use crate::geometry::Corner;

/// Standard deviation of a correction as a share of it: ⟨t²⟩ is computed for a whole patch of even weights.
const CORRECTION_ERROR: f64 = 0.1;

/// Moves the corners of `fits`, row by row, onto the bent edges. `corners` has one for each fit; corners of a board
/// that isn't whole stay where they are.
pub(super) fn correct(fits: &[Option<EdgeFit>], columns: usize, corners: &mut [Corner]) {
    let rows = fits.len() / columns.max(1);
    let at = |column: usize, row: usize| fits.get(row * columns + column)?.as_ref();
    for (index, corner) in corners.iter_mut().enumerate() {
        let (column, row) = (index % columns, index / columns);
        let Some(fit) = at(column, row) else { continue };
        let across = Line { count: columns, place: column };
        let down = Line { count: rows, place: row };
        let along_row = across.bend(|column| at(column, row).map(|fit| fit.corner.px));
        let along_column = down.bend(|row| at(column, row).map(|fit| fit.corner.px));
        let (Some(first), Some(second)) = (along_row, along_column) else { continue };
        let [first_px2, second_px2] = fit.mean_squared_reach_px2();
        let normals = Matrix2::from_rows(&[first.normal.transpose(), second.normal.transpose()]);
        let offsets_px = Vector2::new(
            0.5 * first.curvature_per_px * first_px2,
            0.5 * second.curvature_per_px * second_px2,
        );
        let Some(shift_px) = normals.lu().solve(&offsets_px) else { continue };
        corner.px -= shift_px;
        let error_px = shift_px * CORRECTION_ERROR;
        corner.covariance_px2 += error_px * error_px.transpose();
    }
}

/// A corner's place in a row or column of corners.
#[derive(Clone, Copy)]
struct Line {
    count: usize,
    place: usize,
}

/// How an edge bends at a corner: towards `normal` if the curvature is positive.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Bend {
    curvature_per_px: f64,
    /// Unit vector across the edge.
    normal: Vector2<f64>,
}

impl Line {
    /// The bend at the corner. A lens bends a straight line about evenly, so the curvature is that of a line fitted to
    /// the curvatures along the row or column, or their mean if there are fewer than three: less noise, and the ends have
    /// one, too. `None` with fewer than three corners.
    fn bend(self, px: impl Fn(usize) -> Option<Point2<f64>>) -> Option<Bend> {
        let Self { count, place } = self;
        if count < 3 {
            return None;
        }
        let inner = |place: usize| Bend::of(px(place - 1)?, px(place)?, px(place + 1)?);
        let middle = (count as f64 - 1.0) / 2.0;
        let (mut sum, mut moment, mut squares) = (0.0, 0.0, 0.0);
        for place in 1..count - 1 {
            let (from_middle, curvature) = (place as f64 - middle, inner(place)?.curvature_per_px);
            sum += curvature;
            moment += from_middle * curvature;
            squares += from_middle * from_middle;
        }
        let slope = if count >= 5 { moment / squares } else { 0.0 };
        let curvature_per_px = sum / (count as f64 - 2.0) + slope * (place as f64 - middle);
        let normal = inner(place.clamp(1, count - 2))?.normal;
        Some(Bend { curvature_per_px, normal })
    }
}

impl Bend {
    /// The parabola through three points. `None` if two coincide.
    fn of(before: Point2<f64>, at: Point2<f64>, after: Point2<f64>) -> Option<Self> {
        let along = (after - before).try_normalize(1e-9)?;
        let normal = Vector2::new(-along.y, along.x);
        let (back, ahead) = (before - at, after - at);
        let (back_px, ahead_px) = (-along.dot(&back), along.dot(&ahead));
        if !(back_px > 0.0 && ahead_px > 0.0) {
            return None;
        }
        let slopes = normal.dot(&ahead) / ahead_px + normal.dot(&back) / back_px;
        Some(Self { curvature_per_px: 2.0 * slopes / (back_px + ahead_px), normal })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points at −3, −2 … 3 squares on a circle of that radius, seen from outside its centre.
    fn circle(radius_px: f64, square_px: f64, count: usize) -> Vec<Point2<f64>> {
        let middle = (count as f64 - 1.0) / 2.0;
        let point = |i: usize| {
            let angle_rad = (i as f64 - middle) * square_px / radius_px;
            Point2::new(radius_px * angle_rad.sin(), radius_px * (1.0 - angle_rad.cos()))
        };
        (0..count).map(point).collect()
    }

    #[test]
    fn the_curvature_is_that_of_the_circle_at_every_place() {
        for count in [3, 4, 7] {
            let points = circle(2000.0, 30.0, count);
            for place in 0..count {
                let bend = Line { count, place }.bend(|i| points.get(i).copied()).expect("a line");
                let relative = bend.curvature_per_px * bend.normal.y.signum() * 2000.0;
                assert!(
                    (relative - 1.0).abs() < 2e-3,
                    "{count} corners, place {place}: {relative}"
                );
            }
        }
        assert!(Line { count: 2, place: 0 }.bend(|_| Some(Point2::origin())).is_none());
    }

    #[test]
    fn a_straight_line_seen_in_perspective_has_no_bend() {
        let px = |i: usize| {
            let t = i as f64;
            Some(Point2::new(10.0 + 30.0 * t, 5.0 + 12.0 * t) / (1.0 + 0.1 * t))
        };
        for place in 0..5 {
            let bend = Line { count: 5, place }.bend(px).expect("a line");
            assert!(bend.curvature_per_px.abs() < 1e-12, "{bend:?}");
        }
    }
}
