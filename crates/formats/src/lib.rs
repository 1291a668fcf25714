//! Calibrations as text: boresight's own, and those of OpenCV, ROS, Kalibr, mrcal, COLMAP, MATLAB,
//! ORB-SLAM3, Nerfstudio, Metashape and others.
//!
//! ```
//! use boresight_formats::{
//!     export::{self, ExportedCamera},
//!     import::{self, OldFormat},
//! };
//!
//! const ROS: &str = "
//! image_width: 1280
//! image_height: 720
//! camera_name: front
//! camera_matrix: {rows: 3, cols: 3, data: [950.0, 0.0, 648.25, 0.0, 951.0, 353.5, 0.0, 0.0, 1.0]}
//! distortion_model: plumb_bob
//! distortion_coefficients: {rows: 1, cols: 5, data: [-0.21, 0.06, 0.001, -0.0005, 0.0]}
//! ";
//! let read = import::read(ROS)?;
//! assert_eq!(read.format, OldFormat::Ros);
//! assert_eq!(read.camera.f_px.x, 950.0);
//!
//! let (camera, image_size) = (read.camera, read.image_size);
//! let exported = ExportedCamera { name: "front", camera, image_size, rms_px: 0.1 };
//! let kalibr = export::kalibr_camchain(&exported)?;
//! assert!(kalibr.contains("distortion_model: radtan"));
//! // Every number comes back bit for bit.
//! assert_eq!(import::read(&kalibr)?.camera, camera);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Modules
//!
//! | module | holds |
//! |---|---|
//! | `calibration_file`, `named_covariance` | the type of `boresight.calibration/1` |
//! | `from_calibration` | [`Calibration`](boresight_calibrate::Calibration) → file |
//! | `field_of_view` | viewing angles of a file's camera |
//! | `check_file` | `boresight.check/1` |
//! | `judgement_file` | `boresight.judgement/1` |
//! | `rig_file` | `boresight.rig/1`: several cameras and their mutual places |
//! | `schema` | reading files with a schema |
//! | [`corner_table`] | corners of many pictures, from other detectors |
//! | [`import`] | files of many programs → [`OldCalibration`](import::OldCalibration) |
//! | [`export`] | a calibration → the formats of other programs |
//!
//! # Features
//!
//! | feature | brings |
//! |---|---|
//! | `schemas` (off by default) | JSON Schema of the files, for the tests of this repository |
//!
//! # Environment
//!
//! Text comes in, text goes out: no files, clocks, random numbers, threads or unsafe code. Compiles
//! for `wasm32-unknown-unknown`.
//!
//! # Limitations
//!
//! - Of a file with several cameras, the first is read.
//! - MATLAB's files are written, not read.
//! - Only boresight's own file states the covariance. A lens beyond a format is refused, never
//!   truncated.
//! - A lens with more coefficients than k1, k2, p1, p2, k3, k4, k5 and k6 is refused.
//! - Other programs may change their formats. boresight's own only grows: see `docs/versioning.md`.

#![forbid(unsafe_code)]

mod board_entry;
mod calibration_file;
mod check_file;
pub mod corner_table;
pub mod export;
mod field_of_view;
mod from_calibration;
pub mod import;
mod judgement_file;
mod named_covariance;
mod nullable;
mod rig_file;
mod schema;

#[doc(hidden)]
pub use board_entry::{BoardEntry, MarkersEntry};
#[doc(hidden)]
pub use calibration_file::{
    AcceptanceEntry, CALIBRATION_SCHEMA, CalibrationFile, CameraEntry, CandidateEntry,
    DistortionEntry, EstimateEntry, FindingEntry, FocalEntry, FocalLengths, LensEntry, LineEntry,
    PoseEntry, PrincipalPointEntry, ProjectionEntry, SigmaEntry, ViewEntry,
};
#[doc(hidden)]
pub use check_file::{CHECK_SCHEMA, ChangeEntry, ChangeSigma, CheckFile, LensNow, VisibleEntry};
#[doc(hidden)]
pub use from_calibration::{FindingWords, ViewName};
#[doc(hidden)]
pub use judgement_file::{FreshLens, JUDGEMENT_SCHEMA, JudgementFile};
#[doc(hidden)]
pub use named_covariance::{LensCovariance, NamedCovariance};
#[doc(hidden)]
pub use rig_file::{
    RIG_SCHEMA, RigCameraEntry, RigCovariance, RigFile, RigGoalEntry, RigInstantEntry,
    RigPairEntry, RigWords,
};
pub use schema::NotRead;

/// Compiles and runs the example of the README.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
