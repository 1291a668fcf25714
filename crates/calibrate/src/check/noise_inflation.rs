//! Inflates the covariances of corners to match the residuals.
//!
//! The detector's covariances cover the noise of the picture, but not errors of the print, of the flatness of the board or
//! of the fine shape of the lens. On real boards the latter dominate, and weights from picture noise alone would let the
//! sharpest view decide the result. So the covariance of each corner is taken as `s² (C + ρ I)`. ρ is estimated by maximum
//! likelihood from the residuals of the free homographies, which assume neither a common focal length nor a principal
//! point; s² is estimated by the adjustment (σ₀²).

use nalgebra::{Matrix2, Vector2};

use boresight_geometry::Corner;

/// Least gain in −2 log L for a nonzero ρ: the 0.999 quantile of χ² with 1 degree of freedom.
const MIN_GAIN: f64 = 10.8;
/// Ratio of consecutive trial values of ρ; 10 % accuracy of a standard deviation is plenty for a weight.
const STEP: f64 = 1.2;

/// ρ: the variance in px² to add to the covariance of every corner, from the residuals of free homographies with the stated
/// covariances. Zero if the residuals agree with the stated
/// covariances up to a common factor.
pub(crate) fn excess_variance_px2(residuals_px: &[(Vector2<f64>, Matrix2<f64>)]) -> f64 {
    // For each corner, its mean squared residual and its mean stated variance.
    let corners: Vec<(f64, f64)> = residuals_px
        .iter()
        .map(|(residual_px, stated_px2)| {
            (residual_px.norm_squared() / 2.0, stated_px2.trace() / 2.0)
        })
        .filter(|(squared, stated)| squared.is_finite() && *stated > 0.0)
        .collect();
    let Some(least) = corners.iter().map(|(_, stated)| *stated).reduce(f64::min) else {
        return 0.0;
    };
    let most = corners.iter().map(|(squared, _)| *squared).fold(least, f64::max);
    let count = corners.len() as f64;
    // −2 log L of two coordinates per corner at the best s², up to a constant.
    let cost = |rho: f64| {
        let (squares, logs) = corners.iter().fold((0.0, 0.0), |(squares, logs), (q, v)| {
            (squares + q / (v + rho), logs + (v + rho).ln())
        });
        2.0 * (count * (squares / count).ln() + logs)
    };
    let mut best = (cost(0.0) - MIN_GAIN, 0.0);
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
pub(crate) fn inflated(views: &[Vec<Corner>], rho: f64) -> Vec<Vec<Corner>> {
    let more = Matrix2::from_diagonal_element(rho);
    let inflate = |c: &Corner| Corner { covariance_px2: c.covariance_px2 + more, ..*c };
    views.iter().map(|corners| corners.iter().map(inflate).collect()).collect()
}
