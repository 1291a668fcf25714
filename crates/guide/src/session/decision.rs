//! Decisions of a session, as recorded and compared data.

use serde::Serialize;

use super::view_number::ViewNumber;
use crate::guidance::{Advice, Progress, Refusal, Role};

/// Decision on an input.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Decision {
    /// Frame judged; `None` if the input wasn't a frame.
    pub frame: Option<u64>,
    /// See [`Outcome`].
    pub outcome: Outcome,
    /// Next action for the person.
    pub advice: Advice,
    /// Progress of the session.
    pub progress: Progress,
    /// Number of accepted views.
    pub accepted: usize,
    /// Serial number of the target pose: incremented with each change of the accepted views and
    /// each new target.
    pub target_serial: u32,
}

/// Effect on the views.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case", tag = "outcome")]
pub enum Outcome {
    /// The frame was refused, or isn't taken yet.
    Refused {
        /// Reason for the refusal.
        refusal: Refusal,
    },
    /// A frame of the hold was taken: the sharpest, not necessarily the newest.
    Accepted {
        /// Number of the new view.
        view: ViewNumber,
        /// Frame of the view.
        frame: u64,
        /// Role of the view.
        role: Role,
    },
    /// A view was removed. If focus or zoom moved, the newest of several: see
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
    /// The views are unchanged.
    Noted,
}
