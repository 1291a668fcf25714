//! Stable names of errors.

use crate::session::comparison::NoKnownLens;
use boresight_capture::CaptureError;
use boresight_files::FileError;
use boresight_formats::import::NotImported;
use boresight_geometry::{boards::InvalidBoard, markers::InvalidMarkers};
use boresight_run::{config::ConfigError, recording::RecordingError};
use boresight_sim::SceneError;

/// Stable name of an error, for programs; `FAILED` if unnamed.
pub fn error_code(err: &anyhow::Error) -> &'static str {
    err.chain().find_map(of_cause).unwrap_or("FAILED")
}

fn of_cause(cause: &(dyn std::error::Error + 'static)) -> Option<&'static str> {
    if let Some(err) = cause.downcast_ref::<RecordingError>() {
        return Some(err.code());
    }
    if let Some(err) = cause.downcast_ref::<FileError>() {
        return Some(err.code());
    }
    if let Some(err) = cause.downcast_ref::<CaptureError>() {
        return Some(match err {
            CaptureError::Camera { fault, .. } => fault.code(),
            CaptureError::Read { .. } | CaptureError::Decode { .. } => "PICTURE-UNREADABLE",
            CaptureError::Bag { .. } => "BAG",
            CaptureError::NoPictures { .. } => "NO-PICTURES",
        });
    }
    if cause.is::<InvalidBoard>() || cause.is::<InvalidMarkers>() {
        return Some("BOARD");
    }
    if cause.is::<NotImported>() || cause.is::<NoKnownLens>() {
        return Some("OLD-CALIBRATION");
    }
    (cause.is::<ConfigError>() || cause.is::<SceneError>()).then_some("SETTINGS")
}
