use std::borrow::Cow;

use nalgebra::Point2;

use super::{
    causes::Correction,
    check::heavy_tails::TailWeights,
    params::CalibrationParams,
    solve::{
        bundle::Observations, free_homography::FreeHomographies, initial_guess::AsSeen,
        lens_model::LensFamily, model_choice::ModelChoice,
    },
};
use boresight_geometry::{Corner, boards::Board, frame::ImageSize};

/// Number of distinct views that determine the lens without weak priors.
pub(super) const VIEWS_WITHOUT_PRIOR: usize = 4;

/// Arguments of a calibration, with everything derived from the corners before adjustment.
pub(super) struct Inputs<'a> {
    pub(super) views: Cow<'a, [Vec<Corner>]>,
    pub(super) board: &'a Board,
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
    /// Factor on the covariances of each view's corners; empty if unknown.
    pub(super) view_noise: Vec<f64>,
    /// Smallest credible [`noise_factor`](crate::Bundle::noise_factor).
    pub(super) noise_floor: f64,
    /// Weights of the corners, if the errors have heavy tails; applied to `observations`, not to
    /// `views`.
    pub(super) tails: Option<TailWeights>,
    /// Family of the fitted models.
    pub(super) family: LensFamily,
    /// Correction for the cause of a misfit, if applied.
    pub(super) correction: Option<&'a Correction>,
}

/// Fitted lens models, and the priors used.
pub(super) struct Solution {
    pub(super) choice: ModelChoice,
    pub(super) prior_used: bool,
    pub(super) focal_prior_used: bool,
}
