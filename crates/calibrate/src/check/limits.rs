//! The limits within which a calibration is GOOD, as far as they are lengths or shares of the picture.

use boresight_geometry::frame::ImageSize;

/// Limits of standard deviations, relative to the picture's width (PP, projection) or to the focal length. Conventions:
/// at 1280 px, care is advised from 2.6 px of PP and 1.3 px of projection.
const PP_SD: f64 = 0.002;
const F_SD: f64 = 0.004;
const PROJECTION_SD: f64 = 0.001;
/// Limit of projection in the worst place of the picture, usually a corner that no board has covered; relative to the
/// picture's width.
const PROJECTION_MAX_SD: f64 = 0.004;
/// Fraction of the picture that the boards should cover; outside, the distortion is extrapolated. A convention.
const COVERAGE: f64 = 0.4;
/// Typical error of a corner coordinate. Detectors reach 0.1 px; a pixel means blur or a wrong board.
const NOISE_PX: f64 = 1.0;
/// Least number of different views.
const VIEWS: usize = 4;

/// Limits of a GOOD calibration. Standard deviations are in pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Largest standard deviation of the principal point, in its worst direction.
    pub pp_sd_px: f64,
    /// Largest standard deviation of the focal length.
    pub f_sd_px: f64,
    /// Largest mean standard deviation of projection over the picture.
    pub projection_sd_px: f64,
    /// Largest standard deviation of projection in the worst place of the picture.
    pub projection_max_sd_px: f64,
    /// Largest typical error of a corner coordinate.
    pub noise_px: f64,
    /// Smallest share of the picture that the boards cover.
    pub coverage: f64,
    /// Fewest views that differ.
    pub views: usize,
}

impl Limits {
    /// The limits for pictures of `image_size` and the focal length `f_px`.
    pub fn of(image_size: ImageSize, f_px: f64) -> Self {
        let width_px = f64::from(image_size.width_px);
        Self {
            pp_sd_px: PP_SD * width_px,
            f_sd_px: F_SD * f_px,
            projection_sd_px: PROJECTION_SD * width_px,
            projection_max_sd_px: PROJECTION_MAX_SD * width_px,
            noise_px: NOISE_PX,
            coverage: COVERAGE,
            views: VIEWS,
        }
    }
}
