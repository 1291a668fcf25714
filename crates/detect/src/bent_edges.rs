//! Corrects corners for edges bent by the lens.
//!
//! The edge model has straight edges. Fitted to an edge of curvature κ, a straight edge passes the
//! corner at a distance of ½ κ ⟨t²⟩, where ⟨t²⟩ is the mean squared distance along the edge of the
//! pixels that determine it: 0.02 to 0.08 px near the rim of a wide lens, several times the noise.
//! Perspective keeps lines straight, so the second difference of three corners in line, across the
//! line, shows κ alone. The corners lie whole squares apart while the patch reaches less than half
//! a square, so the correction adds next to no noise.

use nalgebra::{Matrix2, Point2, Vector2};

use super::{edge_model::EdgeFit, neighbours::Lines};
use boresight_geometry::Corner;

/// Relative standard deviation of a correction: ⟨t²⟩ is computed for a whole patch of even weights.
const CORRECTION_ERROR: f64 = 0.1;

/// Moves corners onto the bent edges. Reuses its buffer.
#[derive(Clone, Debug, Default)]
pub(super) struct BentEdges {
    /// Curvatures of the columns of corners.
    down: Vec<Option<Curvature>>,
}

impl BentEdges {
    /// Moves the corners of `fits`, row by row, onto the bent edges. `corners` has one for each
    /// fit. Corners without two neighbours in line are unchanged.
    pub(super) fn correct(
        &mut self,
        fits: &[Option<EdgeFit>],
        lines: Lines,
        corners: &mut [Corner],
    ) {
        let columns = lines.columns;
        let rows = fits.len() / columns.max(1);
        let fit = |column: usize, row: usize| fits.get(row * columns + column)?.as_ref();
        let px = |column: usize, row: usize| fit(column, row).map(|fit| fit.corner.px);
        self.down.clear();
        self.down.extend((0..columns).map(|column| Curvature::along(rows, |row| px(column, row))));
        for row in 0..rows {
            let Some(across) = Curvature::along(columns, |column| px(column, row)) else {
                continue;
            };
            for (column, down) in self.down.iter().enumerate() {
                let (Some(down), Some(fit)) = (down, fit(column, row)) else { continue };
                let normals = normal(columns, column, |column| px(column, row)).zip(normal(
                    rows,
                    row,
                    |row| px(column, row),
                ));
                let Some((first, second)) = normals else { continue };
                let [first_px2, second_px2] = fit.mean_squared_reach_px2();
                let offsets_px = Vector2::new(
                    0.5 * across.at(column) * first_px2,
                    0.5 * down.at(row) * second_px2,
                );
                let normals = Matrix2::from_rows(&[first.transpose(), second.transpose()]);
                let Some(shift_px) = normals.lu().solve(&offsets_px) else { continue };
                let corner = &mut corners[row * columns + column];
                corner.px -= shift_px;
                let error_px = shift_px * CORRECTION_ERROR;
                corner.covariance_px2 += error_px * error_px.transpose();
            }
        }
    }
}

/// Curvature of a row or column of corners per pixel, towards [`normal`] if positive. A lens bends
/// a straight line about evenly, so the curvature is a line fitted to the curvatures at the inner
/// corners, or their mean if there are fewer than three. This reduces noise, and gives the ends a
/// curvature, too.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Curvature {
    /// Curvature at the middle of the board.
    mean: f64,
    /// Change between adjacent corners.
    slope: f64,
    middle: f64,
}

impl Curvature {
    /// Curvature of a row; `None` without three adjacent corners.
    fn along(count: usize, px: impl Fn(usize) -> Option<Point2<f64>>) -> Option<Self> {
        if count < 3 {
            return None;
        }
        let middle = (count as f64 - 1.0) / 2.0;
        let (mut looked_at, mut places) = (0.0, 0.0);
        let (mut sum, mut moment, mut squares) = (0.0, 0.0, 0.0);
        for place in 1..count - 1 {
            let (before, at, after) = (px(place - 1), px(place), px(place + 1));
            let (Some(before), Some(at), Some(after)) = (before, at, after) else { continue };
            let curvature = parabola(before, at, after)?;
            let from_middle = place as f64 - middle;
            looked_at += 1.0;
            places += from_middle;
            sum += curvature;
            moment += from_middle * curvature;
            squares += from_middle * from_middle;
        }
        if looked_at < 1.0 {
            return None;
        }
        let (mean, place) = (sum / looked_at, places / looked_at);
        let slope = match looked_at >= 3.0 {
            true => (moment - places * mean) / (squares - places * place),
            false => 0.0,
        };
        Some(Self { mean: mean - slope * place, slope, middle })
    }

    fn at(&self, place: usize) -> f64 {
        self.mean + self.slope * (place as f64 - self.middle)
    }
}

/// Unit vector across a line of at least three corners at `place`; at the ends, the next corner's.
/// `None` if neighbours are missing or two coincide.
fn normal(
    count: usize,
    place: usize,
    px: impl Fn(usize) -> Option<Point2<f64>>,
) -> Option<Vector2<f64>> {
    let inner = place.clamp(1, count - 2);
    let (before, after) = match (px(inner - 1), px(inner + 1)) {
        (Some(before), Some(after)) => (before, after),
        (Some(before), None) => (before, px(inner)?),
        (None, after) => (px(inner)?, after?),
    };
    let along = (after - before).try_normalize(1e-9)?;
    Some(across(along))
}

fn across(along: Vector2<f64>) -> Vector2<f64> {
    Vector2::new(-along.y, along.x)
}

/// Curvature of the parabola through three points. `None` if the points aren't in order along a
/// line.
fn parabola(before: Point2<f64>, at: Point2<f64>, after: Point2<f64>) -> Option<f64> {
    let along = (after - before).try_normalize(1e-9)?;
    let normal = across(along);
    let (back, ahead) = (before - at, after - at);
    let (back_px, ahead_px) = (-along.dot(&back), along.dot(&ahead));
    if !(back_px > 0.0 && ahead_px > 0.0) {
        return None;
    }
    let slopes = normal.dot(&ahead) / ahead_px + normal.dot(&back) / back_px;
    Some(2.0 * slopes / (back_px + ahead_px))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points at −3, −2 … 3 squares on a circle of the given radius, from outside the centre.
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
                let px = |i: usize| points.get(i).copied();
                let curvature = Curvature::along(count, px).expect("a line").at(place);
                let normal = normal(count, place, px).expect("a line");
                let relative = curvature * normal.y.signum() * 2000.0;
                assert!(
                    (relative - 1.0).abs() < 2e-3,
                    "{count} corners, place {place}: {relative}"
                );
            }
        }
        assert!(Curvature::along(2, |_| Some(Point2::origin())).is_none());
    }

    #[test]
    fn a_straight_line_seen_in_perspective_has_no_bend() {
        let px = |i: usize| {
            let t = i as f64;
            Some(Point2::new(10.0 + 30.0 * t, 5.0 + 12.0 * t) / (1.0 + 0.1 * t))
        };
        for place in 0..5 {
            let curvature = Curvature::along(5, px).expect("a line").at(place);
            assert!(curvature.abs() < 1e-12, "{curvature}");
        }
    }
}
