//! State of a watched camera, and findings.

use nalgebra::Vector4;

use crate::no_answer::NoAnswer;

/// State of a watched camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum State {
    /// Too few pictures so far to know the normal look.
    Learning {
        /// Number of pictures with an answer.
        pictures: usize,
        /// Time between the first and the last such picture.
        hours: f64,
    },
    /// Pointing and focus unchanged.
    Ok,
    /// Camera points elsewhere. The lens calibration stays valid, the camera's pose doesn't.
    Moved(Cause),
    /// Zoom or focus changed: the lens calibration is void.
    Zoom,
    /// Blurred picture: focus or the glass.
    Blurred,
    /// No answer for an unusually long time.
    CannotTell {
        /// Reason of the newest picture, or that no pictures arrive.
        reason: NoAnswer,
        /// Reason of the newest picture, if pictures no longer arrive and it wasn't answered.
        before: Option<NoAnswer>,
    },
}

/// Cause of a moved picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cause {
    /// Turned camera.
    Turned,
    /// Knocked lens: the principal point has moved.
    Knocked,
    /// Turned camera or knocked lens: through this lens they look alike.
    Either,
}

/// Finding for a person besides the state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Finding {
    /// Compared with a few pictures only, until learned: the limits are wide.
    Pinned,
    /// Shifted, too: part of the scene no longer agrees with a turn.
    AlsoShifted,
    /// Mount sways more than before: the limits have followed.
    SwaysMore {
        /// Original largest scatter, px.
        was_px: f64,
        /// Largest scatter now, px.
        is_px: f64,
    },
    /// Part of the picture left out: it stays while the scene moves.
    LeftOut {
        /// Share of the picture.
        percent: u32,
    },
    /// Shaking within seconds.
    Shakes {
        /// Amplitude, px.
        by_px: f64,
    },
}

/// Decision of the fold on an input.
#[derive(Clone, Debug, PartialEq)]
pub struct Decision {
    /// The state.
    pub state: State,
    /// Start of the state, seconds since 1970.
    pub since_secs: f64,
    /// Distance of the camera from the cycle, the median of six hours: pan, tilt, roll and focal
    /// length in px of the picture.
    pub off_px: Vector4<f64>,
    /// Smallest change found within two days, px; infinite while learning.
    pub smallest_visible_px: Vector4<f64>,
    /// Time of learning or accepting the references, seconds since 1970.
    pub reference_secs: f64,
    /// Time of the newest answer, seconds since 1970.
    pub answered_secs: Option<f64>,
    /// Share of the patches looked for that usually agrees; `None` while learning.
    pub usual_seen: Option<f64>,
    /// Why the newest picture has no answer, or one that vouches for nothing.
    pub lacks: Option<NoAnswer>,
    /// Findings besides the state.
    pub findings: Vec<Finding>,
}

impl State {
    /// Stable name, for files and programs.
    pub fn code(self) -> &'static str {
        match self {
            Self::Learning { .. } => "LEARNING",
            Self::Ok => "OK",
            Self::Moved(Cause::Knocked) | Self::Blurred => "LENS",
            Self::Moved(_) => "MOVED",
            Self::Zoom => "ZOOM",
            Self::CannotTell { .. } => "CANNOT-TELL",
        }
    }

    /// All names of [`Self::code`].
    pub const CODES: [&'static str; 6] = ["LEARNING", "OK", "MOVED", "ZOOM", "LENS", "CANNOT-TELL"];
}

impl Finding {
    /// Stable name, for files and programs.
    pub fn code(self) -> &'static str {
        match self {
            Self::Pinned => "PINNED",
            Self::AlsoShifted => "ALSO-SHIFTED",
            Self::SwaysMore { .. } => "SWAYS-MORE",
            Self::LeftOut { .. } => "LEFT-OUT",
            Self::Shakes { .. } => "SHAKES",
        }
    }
}
