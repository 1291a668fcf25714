use std::sync::Arc;

use nalgebra::Point2;

use super::{CameraState, Decision};
use crate::{
    calibration::Calibration,
    guidance::{Role, Target},
};

/// What a window or a command line shows: plain data, cheap to clone.
#[derive(Clone, Debug)]
pub struct Snapshot {
    /// The newest decision.
    pub decision: Decision,
    /// The pose asked for.
    pub target: Option<Target>,
    /// Principal point as believed now.
    pub pp_px: Point2<f64>,
    /// The calibration so far.
    pub calibration: Option<Arc<Calibration>>,
    /// The accepted views.
    pub views: Vec<ViewSummary>,
    /// The live camera, if the source is one.
    pub camera: CameraState,
    /// Whether the source has no more frames.
    pub source_ended: bool,
    /// Whether the person paused.
    pub paused: bool,
    /// Workers that failed, with the reason.
    pub failures: Vec<(String, String)>,
}

/// An accepted view in short.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ViewSummary {
    /// Its number.
    pub id: u32,
    /// What it is for.
    pub role: Role,
    /// Direction in which the board recedes.
    pub slot_rad: f64,
    /// Tilt of the board.
    pub tilt_rad: Option<f64>,
}
