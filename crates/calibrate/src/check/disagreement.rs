//! Compares the principal points of the bundle and of the free homographies, which assume no common
//! lens.
//!
//! Both come from the same corners. If they differ by much more than their standard deviations
//! allow, there is an error that neither of them states.

use nalgebra::{Matrix2, SymmetricEigen, Vector2};

use crate::solve::{free_homography::FreeHomographies, model_choice::ModelChoice};

/// Distance in standard deviations from which the principal points contradict each other: a
/// probability of 0.1 % in two dimensions (Rayleigh distribution).
pub(crate) const CONTRADICTION_SIGMAS: f64 = 3.7;

/// Distance between two principal points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Disagreement {
    pub(crate) distance_px: f64,
    /// Square root of `χ²` with two degrees of freedom.
    pub(crate) sigmas: f64,
}

impl Disagreement {
    /// Compares the chosen model with the free homographies. The errors of the corners have
    /// `overdispersion` times the effect of independent errors; `pp_doubt_px2` is the part of the
    /// principal point's covariance from doubt about the lens model.
    pub(crate) fn between(
        choice: &ModelChoice,
        free: &FreeHomographies,
        noise_floor: f64,
        overdispersion: f64,
        pp_doubt_px2: &Matrix2<f64>,
    ) -> Self {
        let variance = free.noise_factor().max(noise_floor).powi(2) * overdispersion.max(1.0);
        let covariance_px2 = free.pp_unit_covariance_px2 * variance + pp_doubt_px2;
        let off_px = choice.fit().camera.pp_px - free.pp_px;
        let sigmas = distance2(&off_px, &covariance_px2, covariance_px2.trace()).sqrt();
        Self { distance_px: off_px.norm(), sigmas }
    }
}

/// `offᵀ C⁺ off`; directions in which `C` is below a thousandth of `scale` are ignored.
pub(super) fn distance2(off: &Vector2<f64>, covariance: &Matrix2<f64>, scale: f64) -> f64 {
    let eigen = SymmetricEigen::new(*covariance);
    (0..2)
        .filter(|i| eigen.eigenvalues[*i] > 1e-3 * scale)
        .map(|i| eigen.eigenvectors.column(i).dot(off).powi(2) / eigen.eigenvalues[i])
        .sum()
}
