//! How far corners are off beyond what the detector claims.
//!
//! A detector knows the noise of the picture, not the errors of the print, the flatness of the board or
//! the finest shape of the lens. On real boards those dominate, and weights from picture noise alone
//! would let the sharpest view decide everything. So each corner's variance is taken as
//! `s² (C + ρ I)`, with ρ found by maximum likelihood from residuals that assume neither a common focal
//! length nor a principal point; s² is left to the adjustment itself.

use nalgebra::Matrix2;

use crate::{
    calibration::solve::{bundle::Observations, free_homography::FreeHomographies},
    geometry::Corner,
};

/// Twice the gain in log likelihood from which the excess is believed: χ²₁ at 0.1 %.
const BELIEVED: f64 = 10.8;
/// Ratio of neighbouring trial values of ρ.
const STEP: f64 = 1.2;

/// ρ: variance, px², to be added to every corner's claimed covariance. Zero if the residuals are as
/// the claims say, up to a common factor.
pub(in crate::calibration) fn excess_variance_px2(
    observations: &Observations,
    free: &FreeHomographies,
) -> f64 {
    let residuals = free.residuals_px(observations);
    // One number a corner: its mean squared residual and its mean claimed variance.
    let corners: Vec<(f64, f64)> = residuals
        .iter()
        .map(|(residual_px, claimed_px2)| {
            (residual_px.norm_squared() / 2.0, claimed_px2.trace() / 2.0)
        })
        .filter(|(squared, claimed)| squared.is_finite() && *claimed > 0.0)
        .collect();
    let Some(least) = corners.iter().map(|(_, claimed)| *claimed).reduce(f64::min) else {
        return 0.0;
    };
    let most = corners.iter().map(|(squared, _)| *squared).fold(least, f64::max);
    let count = corners.len() as f64;
    // −2 log L of two coordinates a corner, s² at its best, constants left out.
    let cost = |rho: f64| {
        let (squares, logs) = corners.iter().fold((0.0, 0.0), |(squares, logs), (q, v)| {
            (squares + q / (v + rho), logs + (v + rho).ln())
        });
        2.0 * (count * (squares / count).ln() + logs)
    };
    let mut best = (cost(0.0) - BELIEVED, 0.0);
    let mut rho = 0.01 * least;
    while rho <= most {
        let here = cost(rho);
        if here < best.0 {
            best = (here, rho);
        }
        rho *= STEP;
    }
    best.1
}

/// `views` with `rho` added to the variance of every corner.
pub(in crate::calibration) fn inflated(views: &[Vec<Corner>], rho: f64) -> Vec<Vec<Corner>> {
    let more = Matrix2::from_diagonal_element(rho);
    let widen = |c: &Corner| Corner { px: c.px, covariance_px2: c.covariance_px2 + more };
    views.iter().map(|corners| corners.iter().map(widen).collect()).collect()
}
