//! Guided session: its state, and the only code that changes it.
//!
//! The program is a fold: [`Session::handle`] applies one [`Input`] and returns what it decided. It reads no
//! clock, file, thread or random number, so a recording of the inputs replays to the same decisions, bit for
//! bit, on every processor.
//!
//! # State
//!
//! | part | holds | changed by |
//! |---|---|---|
//! | ground | accepted and removed views, next view number, what frames have shown (noise, focal length before the first view, how near the board comes, whether parts of it are told), whether the person follows, paused, source ended, failures, camera | every input; a refused frame changes only what frames have shown |
//! | derived | lens estimate, calibration, measured views, progress, target, what the views tell, forecast, what a far board reaches, how well the newest pair was predicted, summaries | a change of the accepted views, or frames that show that the pose asked for can't be met: all of it is recomputed. A ghost that recedes changes the target only |
//! | tracking | motion window, exposure, hold, patience, how long the pose has been asked for, forced next frame, newest frame | every frame; forgotten when views or camera change, except exposure, and when the run changes |
//!
//! | input | ground | derived | tracking |
//! |---|---|---|---|
//! | `Observed`, refused | what it showed | the target or all of it, if the pose can't be met | all but the forced next frame |
//! | `Observed`, accepted | one more view | recomputed | motion and hold forgotten |
//! | `Command`: undo, remove, restore | views move between accepted and removed | recomputed | motion and hold forgotten |
//! | `Command`: pause, resume | paused | – | pausing ends the hold |
//! | `Command`: force next | – | – | forced next frame |
//! | `Camera` | camera; focus or zoom that moved drops the views taken since, accepted or removed | recomputed if an accepted view was dropped | forgotten while nothing may be taken |
//! | `WorkerFailed`, `SourceEnded` | noted | – | – |
//! | `Resumed` | not paused, no failures, another camera; views stay | – | forgotten |
//! | `Stop` | – | – | – |
//!
//! Camera events may overtake frames on their way through the detector. That is harmless because each carries
//! the time until or from which frames are good, and frames are judged by their own time stamps.
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
pub use calm::Shown;
pub use camera::{CameraState, Stream};
pub use decision::{Decision, Outcome};
pub use ending::Ending;
pub use far_board::FarBoard;
pub use held_out_pair::HeldOutPair;
pub use input::{Command, Input, Observation};
pub use precision::precision_of;
pub use prompt::{Across, Edge, Gravity, Prompt, Upright};
pub use setup::SessionSetup;
pub use snapshot::{LiveView, Measured, PairSummary, Snapshot, ViewSummary, lateral_offset_px};
pub use state::Session;
pub use view_number::ViewNumber;
pub use wheel::WheelSlot;
