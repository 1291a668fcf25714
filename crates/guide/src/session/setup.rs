use crate::guidance::GuidanceParams;
use boresight_calibrate::CalibrationParams;
use boresight_geometry::{boards::Board, frame::ImageSize};

/// Setup of a session. Fixed from its first input to its last.
#[derive(Clone, Debug, PartialEq)]
pub struct SessionSetup {
    /// Board in front of the camera.
    pub board: Board,
    /// Size of the pictures.
    pub image_size: ImageSize,
    /// Settings of the planner.
    pub guidance: GuidanceParams,
    /// Settings of the solver.
    pub calibration: CalibrationParams,
}
