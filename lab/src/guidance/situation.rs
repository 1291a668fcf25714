use nalgebra::Isometry3;

use boresight_calibrate::LensModel;
use boresight_geometry::{Corner, boards::Board};
use boresight_guide::guidance::{GuidanceParams, LensEstimate, View};

/// Knowledge available to a strategy.
#[derive(Clone, Copy, Debug)]
pub struct Situation<'a> {
    /// The camera as estimated from the views so far.
    pub lens_estimate: &'a LensEstimate,
    /// Views with a principal line.
    pub views: &'a [View],
    /// Corners of all counted views.
    pub shown: &'a [Vec<Corner>],
    /// Estimated poses of the views in `shown`.
    pub poses: &'a [Isometry3<f64>],
    /// Board held up.
    pub board: &'a Board,
    /// Limits of our planner.
    pub params: &'a GuidanceParams,
    /// Number of poses requested so far.
    pub asked: usize,
    /// Fitted lens model.
    pub model: LensModel,
    /// Standard deviation of a corner coordinate.
    pub noise_px: f64,
}
