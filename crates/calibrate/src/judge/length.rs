//! Error of a measured length by a given lens, held to a fresh one.

use nalgebra::Point2;

use super::{Answer, closest::Closest};
use crate::{
    AcceptanceGoal, Calibration,
    acceptance::{TWO_SIDED_95, quantile, spans_in},
};

/// Error of a length across the optical axis, measured at a known distance where the board was. In
/// metres, at most this at 95 % of the places, in each of eight directions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LengthError {
    /// Length and distance, with the largest error that doesn't matter.
    pub goal: AcceptanceGoal,
    /// Difference between the given and the fresh lens.
    pub off_m: f64,
    /// Lower bound of the true error, with a probability of 97.5 % at each place.
    pub least_m: f64,
    /// Upper bound of the true error, with a probability of 97.5 % at each place.
    pub most_m: f64,
}

impl LengthError {
    /// Error by the lens `closest` to that of `fresh`. `None` if `goal` is about no length, or if
    /// the length fits nowhere between the `is_covered` pixels.
    pub(super) fn of(
        goal: AcceptanceGoal,
        closest: &Closest,
        fresh: &Calibration,
        is_covered: impl Fn(&Point2<f64>) -> bool,
    ) -> Option<Self> {
        let AcceptanceGoal::Length { length_m, at_m, .. } = goal else { return None };
        // By the given lens, turned as the fresh one is.
        let on_plane = |px: &Point2<f64>| {
            Point2::from_homogeneous(closest.turn.inverse() * closest.camera.ray_from_px(px)?)
        };
        let span = length_m / at_m;
        let errors: Vec<[f64; 2]> = spans_in(&fresh.camera, fresh.image_size, span)
            .filter(|placed| placed.place_px.iter().all(&is_covered))
            .map(|placed| {
                let [start, end] = placed.place_px.map(|px| on_plane(&px));
                let measured =
                    start.zip(end).map_or(f64::INFINITY, |(start, end)| (end - start).norm());
                let sd = placed.sd(&fresh.covariance_all);
                [(measured - span).abs(), TWO_SIDED_95 * sd]
            })
            .collect();
        let at_most = |error: fn(&[f64; 2]) -> f64| {
            let all = errors.iter().map(|both| (error(both), ())).collect();
            Some(at_m * quantile(all, errors.len())?.0)
        };
        Some(Self {
            goal,
            off_m: at_most(|[off, _]| *off)?,
            least_m: at_most(|[off, doubt]| (off - doubt).max(0.0))?,
            most_m: at_most(|[off, doubt]| off + doubt)?,
        })
    }

    /// Answer by the limit of the goal.
    pub(super) fn answer(&self) -> Answer {
        Answer::of([self.least_m, self.most_m], self.goal.limit())
    }
}
