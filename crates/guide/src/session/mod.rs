//! Guided session: its state, and the only code to change it.
//!
//! The program is a fold: [`Session::handle`] applies one [`Input`] and returns the decision. It
//! reads no clock, file, thread or random number, so a recording of the inputs replays to the same
//! decisions, bit for bit, on every processor.
//!
//! # State
//!
//! Ground:
//!
//! - Holds: accepted and removed views, next view number, observed facts (noise, focal length
//!   before the first view, smallest distance of the board, whether a part of it is identified),
//!   whether the person follows, paused, source ended, failures, camera.
//! - Changed by: every input. A refused frame changes only the observed facts.
//!
//! Derived:
//!
//! - Holds: lens estimate, calibration, measured views, progress, target, information of the views,
//!   forecast, reach of a far board, prediction of the newest pair, summaries.
//! - Changed by: a change of the accepted views, or a requested pose found impossible; all of it is
//!   recomputed. A receding ghost changes the target only.
//!
//! Tracking:
//!
//! - Holds: motion window, exposure, hold, patience, time since the pose was requested, forced next
//!   frame, newest frame.
//! - Changed by: every frame. Cleared when views or camera change, except exposure, and when the
//!   run changes.
//!
//! | input | ground | derived | tracking |
//! |---|---|---|---|
//! | `Observed`, refused | facts | target or all, if impossible | all but forced frame |
//! | `Observed`, accepted | one more view | recomputed | motion, hold cleared |
//! | `Command`: undo, remove, restore | views move | recomputed | motion, hold cleared |
//! | `Command`: pause, resume | paused | – | pausing ends the hold |
//! | `Command`: force next | – | – | forced frame |
//! | `Led` | leadership | recomputed | hold cleared |
//! | `Camera` | camera, views dropped | recomputed with views | cleared while not ready |
//! | `WorkerFailed`, `SourceEnded` | noted | – | – |
//! | `Resumed` | run state reset; views stay | – | cleared |
//! | `Stop` | – | – | – |
//!
//! A focus or zoom change drops the views taken since, accepted or removed.
//!
//! Camera events may overtake frames on their way through the detector. No harm is done: each
//! carries the time until or from which frames are good, and frames are judged by their own
//! timestamps.
//!
//! The front page of the [crate] has an example.

mod accepted;
mod calm;
mod camera;
mod decision;
mod ending;
mod far_board;
mod handle;
mod held_out_pair;
mod input;
mod judging;
mod precision;
mod prompt;
mod seen;
mod setup;
mod snapshot;
mod state;
mod view_number;
mod wheel;

pub use accepted::AcceptedView;
#[doc(hidden)]
pub use calm::Shown;
#[doc(hidden)]
pub use camera::{CameraState, Stream};
pub use decision::{Decision, Outcome};
pub use ending::Ending;
#[doc(hidden)]
pub use far_board::FarBoard;
#[doc(hidden)]
pub use held_out_pair::HeldOutPair;
pub use input::{Command, Input, Observation};
#[doc(hidden)]
pub use precision::precision_of;
pub use prompt::Prompt;
#[doc(hidden)]
pub use prompt::{Across, Edge, Gravity, Upright};
pub use setup::SessionSetup;
#[doc(hidden)]
pub use snapshot::lateral_offset_px;
pub use snapshot::{LiveView, Snapshot, ViewSummary};
#[doc(hidden)]
pub use snapshot::{Measured, PairSummary};
pub use state::Session;
pub use view_number::ViewNumber;
#[doc(hidden)]
pub use wheel::WheelSlot;
