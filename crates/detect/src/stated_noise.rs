//! The stated covariance of a fitted point: what the noise of its pixels makes of it, above a floor.

use nalgebra::{Matrix2, SMatrix};

/// Variance of a grey level that's rounded to a whole number.
pub(super) const ROUNDING_VARIANCE: f64 = 1.0 / 12.0;
const CORRELATION_POWER: f64 = 0.4;

/// Factor by which correlated residuals, as from clutter and shadows, inflate the variance over independent ones:
/// `((1+ρ)/(1−ρ))^0.4` for a correlation `ρ` of neighbouring pixels.
///
/// The exponent was measured on rendered pictures. It lies between 0 (no effect) and 1 (a correlation that decays
/// exponentially along a line), because residuals that are equal on both sides of an edge don't move the corner.
pub(super) fn correlation_excess(correlation: f64) -> f64 {
    let rho = correlation.clamp(0.0, 0.9);
    libm::pow((1.0 + rho) / (1.0 - rho), CORRELATION_POWER)
}

/// Covariance of the first two parameters, a position in pixels, with a floor of that standard deviation.
pub(super) fn position_px2<const N: usize>(
    covariance: &SMatrix<f64, N, N>,
    floor_px: f64,
) -> Matrix2<f64> {
    // A computed inverse is symmetric only up to rounding; a recording stores three numbers.
    let [xx, xy, yy] = [covariance[(0, 0)], covariance[(1, 0)], covariance[(1, 1)]];
    Matrix2::new(xx, xy, xy, yy) + floor_px2(floor_px)
}

/// `covariance_px2` of pixels with `noise`, if it is at least `least`: the floor stays.
pub(super) fn with_least_noise_px2(
    covariance_px2: Matrix2<f64>,
    floor_px: f64,
    (noise, least): (f64, f64),
) -> Matrix2<f64> {
    let floor = floor_px2(floor_px);
    (covariance_px2 - floor) * (least / noise).max(1.0) + floor
}

fn floor_px2(floor_px: f64) -> Matrix2<f64> {
    Matrix2::from_diagonal_element(floor_px * floor_px)
}
