//! What the session decides: plain data that is recorded and compared.

use serde::Serialize;

use crate::guidance::{Advice, Progress, Refusal, Role};

/// What one input led to.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Decision {
    /// The frame judged; `None` if the input was no frame.
    pub frame: Option<u64>,
    /// See [`Outcome`].
    pub outcome: Outcome,
    /// What the person should do next.
    pub advice: Advice,
    /// How far the session is.
    pub progress: Progress,
    /// Number of accepted views.
    pub accepted: usize,
    /// Changes whenever another pose is asked for.
    pub target_serial: u32,
}

/// What happened to the views.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case", tag = "outcome")]
pub enum Outcome {
    /// The frame was not taken.
    Refused {
        /// Why.
        refusal: Refusal,
    },
    /// A frame of the hold was taken: the sharpest, not necessarily the last.
    Accepted {
        /// Number of the new view.
        view: u32,
        /// The frame it comes from.
        frame: u64,
        /// What it is for.
        role: Role,
    },
    /// A view was taken back.
    Removed {
        /// Its number.
        view: u32,
    },
    /// A view that had been taken back is there again.
    Restored {
        /// Its number.
        view: u32,
    },
    /// Nothing changed for the views.
    Noted,
}
