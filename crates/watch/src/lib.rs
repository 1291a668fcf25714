//! Watches an installed camera without a board: ordinary pictures of the scene are compared with pictures from the days
//! after installation, through the calibrated lens.
//!
//! ```text
//! picture ─ level ─▶ View ─ measure ─▶ turn with covariance, or why not ─ glass ─▶ Answer ─▶ Input ─ Watch ─▶ Decision
//!              nearest references ◀─ gallery ◀─ learn, adopt (station)                     cycle, sequential, condition
//! ```
//!
//! The fold has two halves. A [`Station`] turns pictures into [`Input`]s and keeps the references; a [`Watch`] turns inputs
//! into [`Decision`]s. Inputs are recorded, so that a replay of them gives every state again. Nothing here reads a clock, a
//! file, or another thread. The formulas are in `docs/method.md`, section 8.
//!
//! | module | holds |
//! |---|---|
//! | `level` | a picture with local brightness and contrast levelled, in three sizes |
//! | `patches`, `reference` | patches at corners, found again by normalised correlation; those of one picture |
//! | `turn`, `fit` | pan, tilt, roll and focal ratio through any lens model; the robust fit, with the lens's own error |
//! | `measure`, `compare`, `far`, `shift` | one picture against the nearest references; a camera that points elsewhere |
//! | `gallery`, `station` | references: learned, adopted, retired |
//! | `overlay`, `texture`, `glass`, `condition` | text in the picture; sharpness and contrast of one picture; over days |
//! | `slot`, `cycle`, `sequential` | estimates that count as one; what repeats daily; a test whether the camera has left it |
//! | `input`, `state`, `watch` | the fold |
//! | `adjust`, `outline` | the way back, for who pushes the camera; the edges that are drawn over the live picture |
#![forbid(unsafe_code)]

mod adjust;
mod compare;
mod condition;
mod cycle;
mod far;
mod fit;
mod gallery;
mod glass;
mod input;
mod level;
mod measure;
mod outline;
mod overlay;
mod patches;
mod reference;
mod sequential;
mod shift;
mod slot;
mod state;
mod station;
mod texture;
mod turn;
mod watch;

pub use adjust::{Adjust, Advice, Axis};
pub use compare::agreeing;
pub use cycle::{Cycle, Sample};
pub use far::turn_back;
pub use fit::{Fit, SIGMA_OF_MEDIAN, Sighting, fit, lens_covariance};
pub use gallery::{Gallery, Glance, SIZE, choose};
pub use glass::{CELLS, Glass};
pub use input::{Answer, Input, LearnedSample, Picture, turn_of};
pub use level::{Thumb, View};
pub use measure::{Causes, Measured, NEAREST, NoAnswer};
pub use overlay::Mask;
pub use patches::{COARSE_HALF, FINE_HALF, Patch};
pub use reference::{Landmark, Reference};
pub use sequential::{RELEVANT, Sequential, Verdict};
pub use state::{Cause, Decision, Finding, State};
pub use station::{Looked, Shelf, Station};
pub use texture::Texture;
pub use turn::{Lens, Turn, px_per_turn};
pub use watch::Watch;
