//! The program without a command line and without a window.
//!
//! A session is opened by the name of its source, run, concluded, compared with an older
//! calibration, reported and exported. The command line and the window both build on this crate; a
//! library user can do the same without either.
//!
//! | file | does |
//! |---|---|
//! | `announcer` | where sentences for the person go |
//! | `saved_session` | opens a session folder; the only caller of [`boresight_run::recording::replay`] |
//! | `camera`, `source` | what a source's name means, and how it's opened |
//! | `opening` | a new session, or one that is resumed: source, folder and state |
//! | `run` | a session from its first frame to its stored result |
//! | `result`, `verdict` | what a session found: the file, the sentences and the exit status |
//! | `calibration_views` | the views of a calibration without a session, from pictures or a corner table |
//! | `comparison` | new views against an older calibration |
//! | `report`, `session_report` | the HTML report of a calibration file or of a session folder |
//! | `export` | a result in the formats of other programs |
//! | `recordings`, `redetect`, `doctor` | recordings: listed, stepped through, searched again, verified |
//! | `device_entry`, `devices_file` | the cameras of a computer as a file |
//! | `paths` | where things are kept |
//! | `bundle` | what a bug report needs, in one file |
//! | `desktop` | whether there is one, and files that it opens |
//! | `cue_link`, `truth` | the simulated person's eyes, and what the simulation knows |
//! | `session_folders` | the sessions below a folder |
//! | `bag_copy`, `camera_driver` | a calibration in a copy of a recorded bag, and for the camera's own driver |
//! | `host` | what the window asks of the program |
//! | `lookout`, `printed_board`, `memory` | what the start page shows of cameras, prints, and remembers |
//! | `board_from_code` | the board that a code in its margin names |
//! | `voice` | the computer's voice |
//! | `prometheus`, `session_metrics` | how a batch or a session goes, for Prometheus |
//! | `watch` | installed cameras that are watched without a board |
//! | `weighed_picture` | a picture with the grids that the detector weighed |
//! | `error_code`, `explain` | the stable name of an error, and the next action |
//! | `missing_feature` | what this build leaves out |
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
pub mod watch;
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
