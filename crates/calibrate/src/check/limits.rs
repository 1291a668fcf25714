//! Limits of a Good calibration.

use boresight_geometry::frame::ImageSize;

/// Projection error of a Good calibration without an acceptance goal, relative to the picture's
/// longer side: 2.6 px at 1280, or 2 mm at the distance where the picture shows a metre. This is
/// the resolution of a tape measure; finer work states its own goal.
const GOAL: f64 = 0.002;
/// Share of the picture within the limit: most of it.
const VALID_SHARE: f64 = 0.5;
/// Multiple of the goal from which a calibration is unfinished.
const UNFINISHED: f64 = 3.0;
/// Typical error of projection to aim at without a goal of the person's, in pixels.
pub const DEFAULT_TYPICAL_GOAL_PX: f64 = 0.3;
/// Typical error of a corner coordinate. Detectors reach 0.1 px; a pixel means blur or a wrong
/// board.
const NOISE_PX: f64 = 1.0;
/// Least number of distinct views.
const VIEWS: usize = 4;

/// Limits of a Good calibration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Largest error of projection in the valid area, in pixels: a 95 % bound.
    pub goal_px: f64,
    /// Ratio of the 95 % bound of the projection error to the goal from which a calibration is
    /// unfinished.
    pub unfinished: f64,
    /// Smallest share of the picture in the valid area.
    pub valid_share: f64,
    /// Largest typical error of a corner coordinate, in pixels.
    pub noise_px: f64,
    /// Least number of distinct views.
    pub views: usize,
}

impl Limits {
    /// Limits for pictures of `image_size`.
    ///
    /// ```
    /// # use boresight_calibrate::Limits;
    /// # use boresight_geometry::frame::ImageSize;
    /// // Two thousandths of the longer side.
    /// let limits = Limits::of(ImageSize { width_px: 1280, height_px: 720 });
    /// assert_eq!(limits.goal_px, 2.56);
    /// ```
    pub fn of(image_size: ImageSize) -> Self {
        let goal_px = GOAL * f64::from(image_size.width_px.max(image_size.height_px));
        Self {
            goal_px,
            unfinished: UNFINISHED,
            valid_share: VALID_SHARE,
            noise_px: NOISE_PX,
            views: VIEWS,
        }
    }
}
