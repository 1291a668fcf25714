//! Decisions of a session, as data that is recorded and compared.

use serde::Serialize;

use super::view_number::ViewNumber;
use crate::guidance::{Advice, Progress, Refusal, Role};

/// Decision on one input.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Decision {
    /// The frame judged; `None` if the input wasn't a frame.
    pub frame: Option<u64>,
    /// See [`Outcome`].
    pub outcome: Outcome,
    /// The next action for the person.
    pub advice: Advice,
    /// Progress of the session.
    pub progress: Progress,
    /// Number of accepted views.
    pub accepted: usize,
    /// Incremented each time the accepted views change and a new target pose is chosen.
    pub target_serial: u32,
}

/// Effect on the views.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case", tag = "outcome")]
pub enum Outcome {
    /// The frame wasn't taken, or not yet.
    Refused {
        /// Reason for the refusal.
        refusal: Refusal,
    },
    /// A frame of the hold was taken: the sharpest, not necessarily the newest.
    Accepted {
        /// Number of the new view.
        view: ViewNumber,
        /// The frame it comes from.
        frame: u64,
        /// Role of the view.
        role: Role,
    },
    /// A view was removed. If focus or zoom moved, it is the newest of several: see
    /// [`Snapshot::just_removed`](super::Snapshot::just_removed).
    Removed {
        /// Number of the removed view.
        view: ViewNumber,
    },
    /// A removed view was restored.
    Restored {
        /// Number of the restored view.
        view: ViewNumber,
    },
    /// The views stayed as they were.
    Noted,
}
