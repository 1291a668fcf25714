//! How far the board moved while the shutter was open.
//!
//! Defocus blurs all edges alike, motion only those across it: the two families of the board's edges
//! differ. Uniform motion by `m` px adds `m²/12` to the variance of the blur across it. Motion along a
//! diagonal of the squares blurs both families alike and does not show, so that this is a lower bound.

use image::GrayImage;

use super::edge_model::{EdgeFit, Scratch, edge_variances_px2};

/// Corners that are enough to tell.
const LOOKED_AT: usize = 10;
/// Differences below so many of their standard errors are none.
const SIGNIFICANT: f64 = 3.0;

/// Motion in pixels of the fitted board; 0 if both families of edges are equally sharp.
pub(super) fn motion_px(image: &GrayImage, fits: &[Option<EdgeFit>], scratch: &mut Scratch) -> f64 {
    let stride = fits.len().div_ceil(LOOKED_AT).max(1);
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
