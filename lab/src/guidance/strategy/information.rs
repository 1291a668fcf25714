//! The next best pose by information: the least trace of the intrinsics' covariance.
//!
//! Source: Peng & Sturm, "Calibration Wizard: A Guidance System for Camera Calibration Based on
//! Modelling Geometric and Corner Uncertainty", ICCV 2019. The first three views are free, as in
//! its first step; the search here is over random poses.

use nalgebra::Isometry3;
use rand_chacha::ChaCha8Rng;

use super::{hand_held, sample};
use crate::guidance::situation::Situation;
use boresight_geometry::LensParameter;
use boresight_guide::guidance::information::{
    LensMatrix, PARAMETERS, information_in_picture, prior_information, view_information,
};

/// Number of candidate poses per view.
pub(super) const CANDIDATES: usize = 120;
/// Ranges of tilt and fill possible for a person.
pub(super) const LIMITS: ([f64; 2], [f64; 2]) = ([0.02, 0.9], [0.4, 0.9]);

/// Number of views before the first suggestion.
pub(super) const FREE_VIEWS: usize = 3;

/// Candidate with the smallest remaining trace, after three free views.
pub(super) fn wish(situation: &Situation<'_>, rng: &mut ChaCha8Rng) -> Option<Isometry3<f64>> {
    if situation.shown.len() < FREE_VIEWS {
        return hand_held::wish(situation, rng);
    }
    best(situation, rng, nalgebra::Matrix::trace)
}

/// Candidate with the smallest `cost` of the remaining covariance.
pub(super) fn best(
    situation: &Situation<'_>,
    rng: &mut ChaCha8Rng,
    cost: impl Fn(&LensMatrix) -> f64,
) -> Option<Isometry3<f64>> {
    let Situation { board, lens_estimate, noise_px, .. } = *situation;
    let known = known(situation);
    sample::random(situation, LIMITS, CANDIDATES, rng)
        .into_iter()
        .filter_map(|pose| {
            let added = view_information(&pose, board, &lens_estimate.camera, noise_px)?;
            let covariance = covariance(situation, &(known + added))?;
            Some((cost(&covariance), pose))
        })
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, pose)| pose)
}

/// Information of the views so far and of the weak priors.
pub(super) fn known(situation: &Situation<'_>) -> LensMatrix {
    let Situation { poses, board, lens_estimate, noise_px, .. } = *situation;
    let points_m = board.corners_in_board_m();
    let seen = |pose| information_in_picture(pose, &points_m, lens_estimate, noise_px * noise_px);
    poses.iter().filter_map(seen).fold(prior_information(lens_estimate), |sum, view| sum + view)
}

/// Covariance of the fitted parameters; zero for the others.
pub(super) fn covariance(
    situation: &Situation<'_>,
    information: &LensMatrix,
) -> Option<LensMatrix> {
    let free = situation.model.freedom(true).parameters();
    // Shared focal length of fx and fy.
    let ordered = LensParameter::ALL
        .into_iter()
        .filter(|parameter| parameter.is_browns() && *parameter != LensParameter::Fy);
    let is_free: Vec<bool> = ordered.map(|parameter| free.contains(&parameter)).collect();
    let mut held = *information;
    for i in (0..PARAMETERS).filter(|i| !is_free[*i]) {
        held.row_mut(i).fill(0.0);
        held.column_mut(i).fill(0.0);
        held[(i, i)] = 1.0;
    }
    let mut covariance = held.cholesky()?.inverse();
    for i in (0..PARAMETERS).filter(|i| !is_free[*i]) {
        covariance[(i, i)] = 0.0;
    }
    Some(covariance)
}
