//! Precision within reach of a calibration with a board small in the picture.
//!
//! An installed camera may be far from any place a person can reach. Noise fixes the principal
//! point with the second power of the board's size, so a small board can't, whatever its poses; but
//! it can fix the projection, with pairs in several places of the picture. The forecast asks the
//! planner itself. Source: `docs/method.md`, section 3.7.

use super::{
    gain::Knowledge,
    params::GuidanceParams,
    poses::best_pair,
    view::{LensEstimate, View},
};
use boresight_geometry::boards::Board;

/// Number of pairs in the forecast.
const PAIRS: usize = 4;

/// Standard deviations within reach of a plan.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Reach {
    /// Standard deviation of the principal point, worse axis.
    pub pp_sigma_px: f64,
    /// Standard deviation of projection, mean over the picture.
    pub projection_sigma_px: f64,
}

impl Reach {
    /// The smaller standard deviations of both: a larger board can be shown as small as a smaller
    /// board.
    #[must_use]
    pub fn or(self, other: Self) -> Self {
        Self {
            pp_sigma_px: self.pp_sigma_px.min(other.pp_sigma_px),
            projection_sigma_px: self.projection_sigma_px.min(other.projection_sigma_px),
        }
    }
}

/// Forecast with four reflected pairs in all, the `accepted` views included, of boards spanning at
/// most `target_span_fraction` of the picture, with corner errors of `noise_px` per axis. `None` if
/// the board fits nowhere.
pub fn reach(
    accepted: &[View],
    board: &Board,
    lens_estimate: &LensEstimate,
    noise_px: Option<f64>,
    params: &GuidanceParams,
) -> Option<Reach> {
    let mut knowledge = Knowledge::new(accepted, board, lens_estimate, params).with_noise(noise_px);
    for _ in accepted.len().div_ceil(2)..PAIRS {
        let (_, pose) = best_pair(&[], &[], board, &knowledge, lens_estimate, params)?;
        knowledge = knowledge.with_pair(&pose);
    }
    let (pp_sigma_px, projection_sigma_px) = knowledge.sigmas_px();
    Some(Reach { pp_sigma_px, projection_sigma_px })
}
