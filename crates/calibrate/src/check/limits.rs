//! What a GOOD calibration keeps to.

use boresight_geometry::frame::ImageSize;

/// Error of projection that a calibration must stay below to be GOOD, without a goal of the person's own: 2.6 px at 1280,
/// or 2 mm at the distance where the picture shows a metre. It's what a tape measure shows, and follows from that use
/// alone; finer work states its own goal. Relative to the picture's longer side.
const GOAL: f64 = 0.002;
/// Share of the picture that must keep to it: most of it.
const VALID_SHARE: f64 = 0.5;
/// An error so many times the goal can't be told from a failure: a covariance is a linear approximation.
const UNUSABLE: f64 = 10.0;
/// Typical error of a corner coordinate. Detectors reach 0.1 px; a pixel means blur or a wrong board.
const NOISE_PX: f64 = 1.0;
/// Least number of different views.
const VIEWS: usize = 4;

/// Limits of a GOOD calibration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Largest error of projection in the valid area, in pixels: a 95 % bound.
    pub goal_px: f64,
    /// Error of projection in pixels from which a calibration isn't usable at all: a 95 % bound.
    pub unusable_px: f64,
    /// Smallest share of the picture that the valid area covers.
    pub valid_share: f64,
    /// Largest typical error of a corner coordinate, in pixels.
    pub noise_px: f64,
    /// Fewest views that differ.
    pub views: usize,
}

impl Limits {
    /// The limits for pictures of `image_size`.
    pub fn of(image_size: ImageSize) -> Self {
        let goal_px = GOAL * f64::from(image_size.width_px.max(image_size.height_px));
        Self {
            goal_px,
            unusable_px: UNUSABLE * goal_px,
            valid_share: VALID_SHARE,
            noise_px: NOISE_PX,
            views: VIEWS,
        }
    }
}
