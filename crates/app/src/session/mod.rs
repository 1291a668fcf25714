//! Sessions: from the name of a source to a stored result and its report.
//!
//! | file | does |
//! |---|---|
//! | `camera`, `source` | meaning of a source's name, and opening |
//! | `cue_link`, `truth` | eyes of the simulated person, and the truth of the simulation |
//! | `opening` | a new session, or a resumed one: source, folder and state |
//! | `saved_session`, `session_folders` | a stored session as state; sessions below a folder |
//! | `host`, `rig_host` | host of sessions for window, terminal and phone, with companions |
//! | `run` | a session from its first frame to its stored result |
//! | `rig_run` | sessions of several cameras, led to common places |
//! | `rig_result` | result of several cameras |
//! | `result`, `verdict` | result: file, sentences and exit status |
//! | `scene` | the scene behind the board, as a witness of the focal length |
//! | `comparison` | new views against an older calibration |
//! | `board_from_code` | the board named by a code in its margin |
//! | `report`, `session_report`, `certificate` | HTML report of a calibration file or a session folder |
//! | `export` | a result in the formats of other programs |
//! | `session_metrics` | progress of a session, for Prometheus |
//! | `devices_file`, `device_entry` | cameras of a computer as a file |

pub mod board_from_code;
pub mod camera;
mod camera_announcer;
#[cfg(feature = "report")]
pub mod certificate;
pub mod comparison;
mod cue_link;
#[cfg(all(target_os = "linux", feature = "live"))]
pub mod device_entry;
pub mod devices_file;
pub mod export;
pub mod host;
pub mod opening;
#[cfg(feature = "report")]
pub mod report;
pub mod result;
mod rig_host;
pub mod rig_result;
pub mod rig_run;
pub mod run;
mod saved_session;
pub(crate) mod scene;
pub mod session_folders;
mod session_metrics;
#[cfg(feature = "report")]
pub mod session_report;
pub mod source;
pub mod truth;
mod verdict;

pub use board_from_code::BoardFromCode;
pub use cue_link::PersonCues;
pub use host::{Companion, Host};
pub use opening::Opening;
pub use run::{FinishedRun, Run};
pub use saved_session::{DecidedAgain, JournalReading, SavedSession};
pub use session_metrics::{SessionMetrics, verdict_name};
pub use verdict::{Exit, announce_result};
