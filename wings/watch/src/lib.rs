//! Watches an installed camera without a board: ordinary pictures of the scene are compared with
//! pictures from the days after installation, through the calibrated lens.
//!
//! ```text
//! picture ─ level ─▶ View ─ measure ─▶ turn with covariance, or why not ─ glass ─▶ Answer ─▶ Input ─ Watch ─▶ Decision
//!              nearest references ◀─ gallery ◀─ learn, adopt (station)                     cycle, sequential, condition
//! ```
//!
//! The fold has two halves. A [`Station`] turns pictures into [`Input`]s and keeps the references;
//! a [`Watch`] turns inputs into [`Decision`]s. Inputs are recorded, and replaying them reproduces
//! every state. Nothing here reads a clock, a file, or another thread. The formulas are in
//! `docs/method.md`, section 8.
//!
//! | module | holds |
//! |---|---|
//! | [`boresight_scene`] | a picture against a reference: patches, turn, the robust fit |
//! | `compare`, `no_answer` | one picture against the nearest references |
//! | `far` | a camera that points elsewhere |
//! | `gallery`, `seasons`, `station` | references: learned, adopted, retired |
//! | `overlay` | what isn't the scene: text, the camera's own mount |
//! | `glass`, `condition` | sharpness and contrast of a picture; over days |
//! | `slot`, `cycle`, `sequential` | correlated estimates; the daily cycle; a test for leaving it |
//! | `input`, `state`, `watch` | the fold |
//! | `adjust` | pushing the camera back |
#![forbid(unsafe_code)]

mod adjust;
mod compare;
mod condition;
mod cycle;
mod far;
mod gallery;
mod glass;
mod input;
mod no_answer;
mod overlay;
mod seasons;
mod sequential;
mod slot;
mod state;
mod station;
mod watch;

pub use adjust::{Adjust, Advice, Axis};
pub use boresight_scene::{
    COARSE_HALF, Causes, FINE_HALF, Fit, Landmark, Lens, Measured, Patch, Reference,
    SIGMA_OF_MEDIAN, Sighting, Texture, Thumb, Turn, View, fit, lens_covariance, px_per_turn,
};
pub use compare::agreeing;
pub use cycle::{Cycle, Sample};
pub use far::turn_back;
pub use gallery::{Gallery, Glance, SIZE, choose};
pub use glass::Glass;
pub use input::{Answer, Input, LearnedSample, Picture, turn_of};
pub use no_answer::NoAnswer;
pub use overlay::Mask;
pub use sequential::{RELEVANT, Sequential, Verdict};
pub use slot::{DAY_SECS, HOUR_SECS};
pub use state::{Cause, Decision, Finding, State};
pub use station::{Looked, Shelf, Station};
pub use watch::Watch;
