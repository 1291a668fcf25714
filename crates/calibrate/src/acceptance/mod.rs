//! Whether a calibration is good enough for what it's needed for, in the unit of that need.
//!
//! | file | holds |
//! |---|---|
//! | `goal` | the goal, and how a person writes it: `0.2px`, `length 800mm at 2m <= 0.5mm` |
//! | `evaluate` | lens covariance → 95 % bound of the error that the goal limits |

mod evaluate;
mod goal;

pub use evaluate::{Acceptance, ErrorBound, acceptance};
pub use goal::{AcceptanceGoal, NotAGoal};
