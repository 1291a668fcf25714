//! The program without a command line and without a window.
//!
//! A session is opened by the name of its source, run, concluded, compared with an older
//! calibration, reported and exported. The command line and the window both build on this crate; a
//! library user can do the same without either.
//!
//! | file | does |
//! |---|---|
//! | `announcer` | sentences for the person |
//! | `saved_session` | opens a session folder; the only user of `recording::replay` |
//! | `camera`, `source` | parsing and opening of source names |
//! | `opening` | a new or resumed session: source, folder and state |
//! | `run` | a session from its first frame to its stored result |
//! | `result`, `verdict` | result of a session: file, sentences and exit status |
//! | `calibration_views` | views from pictures or a corner table, without a session |
//! | `comparison` | new views against an older calibration |
//! | `report`, `session_report` | the HTML report of a calibration file or of a session folder |
//! | `export` | a result in the formats of other programs |
//! | `recordings` | recordings: listed and stepped through |
//! | `redetect`, `doctor` | recordings: searched again; verified |
//! | `device_entry`, `devices_file` | the cameras of a computer as a file |
//! | `paths` | locations of files |
//! | `bundle` | contents of a bug report, in one file |
//! | `desktop` | detection of a desktop, and files to open |
//! | `cue_link`, `truth` | the simulated person's eyes, and the simulation's truth |
//! | `session_folders` | the sessions below a folder |
//! | `bag_copy` | a calibration in a copy of a recorded bag |
//! | `camera_driver` | a calibration for the camera's own driver |
//! | `host` | the window's interface to the program |
//! | `lookout`, `printed_board`, `memory` | cameras, prints and memory of the start page |
//! | `board_from_code` | the board from its margin code |
//! | `voice` | the computer's voice |
//! | `prometheus`, `session_metrics` | progress of a batch or a session, for Prometheus |
//! | `watch` | installed cameras, watched without a board |
//! | `weighed_picture` | a picture with the grids weighed by the detector |
//! | `error_code`, `explain` | the stable name of an error, and the next action |
//! | `missing_feature` | parts missing from this build |
//!
//! Errors are [`anyhow::Error`]s with a typed cause; [`explain()`] turns an error into the next
//! action.

#![forbid(unsafe_code)]

mod announcer;
mod bag_copy;
pub mod board_from_code;
pub mod board_sheet;
pub mod bundle;
pub mod calibration_views;
pub mod camera;
mod camera_announcer;
mod camera_driver;
#[cfg(feature = "report")]
pub mod certificate;
pub mod comparison;
mod cue_link;
pub mod desktop;
#[cfg(all(target_os = "linux", feature = "live"))]
pub mod device_entry;
pub mod devices_file;
pub mod doctor;
mod error_code;
pub mod explain;
pub mod export;
pub mod host;
pub mod json;
pub mod lookout;
pub mod memory;
mod missing_feature;
pub mod opening;
pub mod paths;
pub mod plan_board;
pub mod printed_board;
pub mod prometheus;
pub mod recordings;
pub mod redetect;
#[cfg(feature = "report")]
pub mod report;
pub mod result;
pub mod run;
mod saved_session;
pub mod session_folders;
mod session_metrics;
#[cfg(feature = "report")]
pub mod session_report;
pub mod source;
pub mod truth;
mod verdict;
mod voice;
mod weighed_picture;

pub use announcer::Announcer;
pub use bag_copy::BagCopy;
pub use camera_driver::{Lines, set_camera_info, state_topic};
pub use cue_link::PersonCues;
pub use error_code::error_code;
pub use explain::explain;
pub use host::{AppHost, BoardFromCode};
pub use memory::usual_path as usual_memory;
pub use missing_feature::MissingFeature;
pub use opening::Opening;
pub use run::{FinishedRun, Run};
pub use saved_session::{DecidedAgain, JournalReading, SavedSession};
pub use session_metrics::{SessionMetrics, verdict_name};
pub use verdict::{Exit, announce_result};
pub use voice::{NoVoice, Voice};
pub use weighed_picture::weighed_picture;

/// Name of the report in the session's folder.
pub const REPORT_FILE: &str = "report.html";
/// Name of the table of corners in the session's folder.
pub const CORNERS_FILE: &str = "corners.vnl";
/// Name of the result in the session's folder.
pub const RESULT_FILE: &str = "calibration.json";
