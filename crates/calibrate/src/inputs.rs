use std::borrow::Cow;

use nalgebra::Point2;

use super::{
    check::{correction::Correction, heavy_tails::TailWeights},
    params::CalibrationParams,
    solve::{
        bundle::Observations, free_homography::FreeHomographies, initial_guess::AsSeen,
        lens_model::LensFamily, model_choice::ModelChoice,
    },
};
use boresight_geometry::{Corner, board::Checkerboard, frame::ImageSize};

/// Number of different views that determine the lens without weak priors.
pub(super) const VIEWS_WITHOUT_PRIOR: usize = 4;

/// The arguments of a calibration, and everything derived from the corners before adjustment.
pub(super) struct Inputs<'a> {
    pub(super) views: Cow<'a, [Vec<Corner>]>,
    pub(super) board: &'a Checkerboard,
    pub(super) board_m: &'a [Point2<f64>],
    pub(super) image_size: ImageSize,
    pub(super) params: &'a CalibrationParams,
    pub(super) observations: Observations,
    pub(super) as_seen: AsSeen,
    pub(super) free: Option<FreeHomographies>,
    pub(super) distinct: usize,
    /// Number of given views, repeats of a held pose included.
    pub(super) given: usize,
    /// Square root of the variance added to the stated covariances, see `check::noise_inflation`.
    pub(super) excess_px: f64,
    /// Factor on the covariances of each view's corners; empty if it isn't known.
    pub(super) view_noise: Vec<f64>,
    /// Smallest [`noise_factor`](crate::Bundle::noise_factor) that is believed.
    pub(super) noise_floor: f64,
    /// Weights of the corners, if their errors have heavy tails. `observations` carry them, `views` don't.
    pub(super) tails: Option<TailWeights>,
    /// The family whose models are fitted.
    pub(super) family: LensFamily,
    /// Correction for the cause of a misfit, if one is applied.
    pub(super) correction: Option<&'a Correction>,
    /// Codes of families of lens models that couldn't be fitted.
    pub(super) left_out: Vec<&'static str>,
}

/// The lens models fitted, and which priors that took.
pub(super) struct Solution {
    pub(super) choice: ModelChoice,
    pub(super) prior_used: bool,
    pub(super) focal_prior_used: bool,
}
