//! Acceptance: judges a calibration by the error that its use allows, in the unit of that use.
//!
//! | file | holds |
//! |---|---|
//! | `goal` | the goal, and how a person writes it: `0.2px`, `length 800mm at 2m <= 0.5mm` |
//! | `evaluate` | lens covariance → 95 % bound of the error that the goal limits |

mod evaluate;
mod goal;

pub use evaluate::{Acceptance, ErrorBound, acceptance};
pub use goal::{AcceptanceGoal, NotAGoal};
