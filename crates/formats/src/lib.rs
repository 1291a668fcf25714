//! Calibrations as files.
//!
//! | file | holds |
//! |---|---|
//! | `calibration_file`, `from_calibration`, `named_covariance` | `boresight.calibration/1`: the type, and how a [`Calibration`](boresight_calibrate::Calibration) becomes one |
//! | `field_of_view` | the angles that a file's camera sees |
//! | `check_file` | `boresight.check/1` |
//! | `schema` | reading files that name their schema |
//! | [`corner_table`] | corners of many pictures, as other detectors write them |
//! | [`import`] | calibrations of this and other programs → [`OldCalibration`](import::OldCalibration) |
//! | [`export`] | a calibration → the formats of other programs |
//!
//! Text comes in, text goes out; nothing here opens a file.

mod calibration_file;
mod check_file;
pub mod corner_table;
pub mod export;
mod field_of_view;
mod from_calibration;
pub mod import;
mod named_covariance;
mod nullable;
mod schema;

pub use calibration_file::{
    AcceptanceEntry, BoardEntry, CALIBRATION_SCHEMA, CalibrationFile, CameraEntry, CandidateEntry,
    DistortionEntry, EstimateEntry, FindingEntry, FocalEntry, FocalLengths, LensEntry, LineEntry,
    MarkersEntry, PoseEntry, PrincipalPointEntry, ProjectionEntry, SigmaEntry, ViewEntry,
};
pub use check_file::{CHECK_SCHEMA, ChangeEntry, ChangeSigma, CheckFile, LensNow, VisibleEntry};
pub use from_calibration::{FindingWords, ViewName};
pub use named_covariance::{LensCovariance, NamedCovariance};
pub use schema::NotRead;
