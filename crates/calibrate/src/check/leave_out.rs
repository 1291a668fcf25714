//! Repeats the estimate with some views left out.
//!
//! The spread of these estimates shows the dependence of the result on single views. It is *not* a
//! measure of accuracy: for evenly spread tilt azimuths, the centroid of the skip-n estimates
//! equals the full estimate for any lines (`docs/method.md`, section 0).

use nalgebra::{Point2, Vector2};

use crate::solve::bundle::Bundle;
use boresight_geometry::{LensParameter, LensParts};

/// Lists the indices of all views except `skipped` consecutive indices, cyclically: one list per
/// first view skipped.
///
/// A single list of all views if `skipped` is 0 or at least `view_count`.
pub fn consecutive(view_count: usize, skipped: usize) -> Vec<Vec<usize>> {
    if skipped == 0 || skipped >= view_count {
        return vec![(0..view_count).collect()];
    }
    (0..view_count)
        .map(|first| {
            let mut kept: Vec<usize> =
                (first + skipped..first + view_count).map(|i| i % view_count).collect();
            kept.sort_unstable();
            kept
        })
        .collect()
}

/// Mean and scatter of repeated estimates of a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spread {
    /// Mean, in pixels.
    pub centroid_px: Point2<f64>,
    /// Standard deviation along x and y in pixels, divided by n rather than n − 1.
    pub sd_px: Vector2<f64>,
}

impl Spread {
    /// Spread of `points_px`; `None` without points.
    pub fn of(points_px: &[Point2<f64>]) -> Option<Self> {
        let count = points_px.len() as f64;
        if points_px.is_empty() {
            return None;
        }
        let sum = points_px.iter().fold(Vector2::zeros(), |sum, point| sum + point.coords);
        let centroid_px = Point2::from(sum / count);
        let squares = points_px.iter().fold(Vector2::zeros(), |sum, point| {
            let off: Vector2<f64> = point - centroid_px;
            sum + off.component_mul(&off)
        });
        Some(Self { centroid_px, sd_px: (squares / count).map(f64::sqrt) })
    }
}

/// Principal points with each view left out in turn, against the shift expected from noise.
#[derive(Clone, Debug, PartialEq)]
pub struct LeaveOneOut {
    /// Principal point without view i, to first order, in pixels; `None` if the other views don't
    /// determine it.
    pub pp_px: Vec<Option<Point2<f64>>>,
    /// `√(mean squared shift / mean expected squared shift)`: near 1 if the views agree.
    pub ratio: f64,
}

/// Leaves each view out of `bundle` in turn, for corners with `noise_factor` times the stated
/// error.
///
/// Without view i, an efficient estimate moves by a random step of covariance `C₋ᵢ − C` (Hausman
/// 1978). `None` if fewer than two of the reduced problems can be solved.
pub(crate) fn leave_one_out(bundle: &Bundle, noise_factor: f64) -> Option<LeaveOneOut> {
    let covariance = bundle.covariance(noise_factor)?;
    let full = covariance.pp();
    let (mut squared, mut expected, mut count) = (0.0, 0.0, 0);
    let pp_px = (0..bundle.state.cam_from_board.len())
        .map(|view| {
            let (shift, without) = bundle.without_view(view, noise_factor)?;
            let shift = Vector2::from(LensParameter::PP.map(|axis| shift[axis.index()]));
            squared += shift.norm_squared();
            expected += (without.pp() - full).trace();
            count += 1;
            Some(bundle.state.camera.pp_px + shift)
        })
        .collect();
    (count >= 2 && expected > 0.0)
        .then(|| LeaveOneOut { pp_px, ratio: (squared / expected).sqrt() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn consecutive_views_wrap_around() {
        assert_eq!(consecutive(4, 1), [[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]]);
        assert_eq!(consecutive(4, 3), [[3], [0], [1], [2]]);
        assert_eq!(consecutive(3, 0), [[0, 1, 2]]);
        assert_eq!(consecutive(3, 3), [[0, 1, 2]]);
    }

    #[test]
    fn spread_of_a_square() {
        let corners = [(0.0, 0.0), (2.0, 0.0), (2.0, 4.0), (0.0, 4.0)];
        let spread = Spread::of(&corners.map(|(x, y)| Point2::new(x, y))).expect("not empty");
        assert_eq!(spread.centroid_px, Point2::new(1.0, 2.0));
        assert_eq!(spread.sd_px, Vector2::new(1.0, 2.0));
        assert_eq!(Spread::of(&[]), None);
    }
}
