//! Acceptance: judges a calibration by the error allowed for its use, in the unit of that use.
//!
//! | file | holds |
//! |---|---|
//! | `goal` | the goal and its text form: `0.2px`, `length 800mm at 2m <= 0.5mm` |
//! | `evaluate` | lens covariance → 95 % bound of the error limited by the goal |

mod evaluate;
mod goal;

pub use evaluate::{Acceptance, ErrorBound, acceptance};
pub(crate) use evaluate::{quantile, spans_in};
pub(crate) use goal::TWO_SIDED_95;
pub use goal::{AcceptanceGoal, NotAGoal};
