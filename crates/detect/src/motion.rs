//! Estimates the motion of the board during the exposure.
//!
//! Defocus blurs all edges equally, motion only the edges across it, so the two families of edges
//! on the board differ. Uniform motion by `m` px adds `m²/12` to the variance of the blur: the
//! variance of a box of width `m`. Motion along a diagonal of the squares blurs both families
//! equally and remains invisible, so the estimate is a lower bound.

use image::GrayImage;

use super::edge_model::{EdgeFit, Scratch, edge_variances_px2};

/// Number of sampled corners, to bound the work.
const SAMPLED_CORNERS: usize = 10;
/// Significance threshold in standard errors of the mean.
const SIGNIFICANT: f64 = 3.0;

/// Motion in pixels; 0 if both families of edges are equally sharp, or fewer than four corners were
/// fitted.
pub(super) fn motion_px(image: &GrayImage, fits: &[Option<EdgeFit>], scratch: &mut Scratch) -> f64 {
    let stride = fits.len().div_ceil(SAMPLED_CORNERS).max(1);
    let (mut count, mut sum, mut squares) = (0.0, 0.0, 0.0);
    for fit in fits.iter().step_by(stride).flatten() {
        let [along, across] = edge_variances_px2(image, fit, scratch);
        let difference = along - across;
        count += 1.0;
        sum += difference;
        squares += difference * difference;
    }
    if count < 4.0 {
        return 0.0;
    }
    let mean: f64 = sum / count;
    let standard_error = ((squares / count - mean * mean).max(0.0) / count).sqrt();
    if mean.abs() > SIGNIFICANT * standard_error { (12.0 * mean.abs()).sqrt() } else { 0.0 }
}
