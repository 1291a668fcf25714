//! The program without a command line and without a window.
//!
//! A session is opened by the name of its source, run, concluded, compared with an older
//! calibration, reported and exported. The command line and the window both build on this crate; a
//! library user can do the same without either.
//!
//! | room | holds |
//! |---|---|
//! | [`session`] | a session from the name of its source to its stored result and report |
//! | [`commands`] | work of commands without a session |
//! | [`window`] | the back room of the window |
//! | [`prometheus`], `voice`, `announcer` | metrics; the computer's voice; sentences for the person |
//! | [`mod@explain`] | the next action, and the stable name of an error |
//! | `missing_feature` | parts left out of a build |
//!
//! Errors are [`anyhow::Error`]s with a typed cause; [`explain()`] turns an error into the next
//! action.

#![forbid(unsafe_code)]

mod announcer;
pub mod commands;
mod cores;
pub mod explain;
mod missing_feature;
pub mod prometheus;
pub mod session;
mod voice;
pub mod window;

pub use announcer::Announcer;
pub use commands::{BagCopy, Lines, set_camera_info, state_topic, weighed_picture};
pub use cores::cores;
pub use explain::{error_code, explain};
pub use missing_feature::MissingFeature;
pub use session::{
    BoardFromCode, Companion, DecidedAgain, Exit, FinishedRun, Host, JournalReading, Opening,
    PersonCues, Run, SavedSession, SessionMetrics, announce_result, verdict_name,
};
pub use voice::{NoVoice, Voice};
pub use window::{Services, usual_memory};

/// Name of the report in the session's folder.
pub const REPORT_FILE: &str = "report.html";
/// Name of the table of corners in the session's folder.
pub const CORNERS_FILE: &str = "corners.vnl";
/// Name of the result in the session's folder.
pub const RESULT_FILE: &str = "calibration.json";
/// Result of several cameras in their session's folder.
pub const RIG_RESULT: &str = "rig.json";
/// Page about them.
pub const RIG_REPORT: &str = "rig.html";
