//! What the watch says of a camera.

use nalgebra::Vector4;

use crate::measure::NoAnswer;

/// State of a watched camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum State {
    /// Too few pictures so far to know how it looks when it stays.
    Learning {
        /// Pictures with an answer.
        pictures: usize,
        /// Time between the first and the last of them.
        hours: f64,
    },
    /// It points and focuses as it did.
    Ok,
    /// It points elsewhere. The lens calibration stays valid, the camera's pose doesn't.
    Moved(Cause),
    /// Zoom or focus has changed: the lens calibration is void.
    Zoom,
    /// The picture is blurred: focus or the glass.
    Blurred,
    /// No picture has had an answer for an unusually long time.
    CannotTell {
        /// Why the newest picture has none, or that none comes.
        reason: NoAnswer,
        /// If none comes, why the newest one has no answer, unless it has.
        before: Option<NoAnswer>,
    },
}

/// What moved the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cause {
    /// The camera has turned.
    Turned,
    /// The lens was knocked: the principal point has moved.
    Knocked,
    /// One or the other: through this lens they look alike.
    Either,
}

/// Something that a person should know besides the state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Finding {
    /// It moves slowly.
    Creeps {
        /// Distance in a day along pan, tilt, roll and focal length, px; only the largest isn't zero.
        px_per_day: Vector4<f64>,
        /// When it will matter, seconds since 1970.
        matters_secs: f64,
    },
    /// Dirty or covered in one place for a day and a night.
    Dirty {
        /// Column and row of the darkest cell, of 8 by 6.
        cell: [usize; 2],
    },
    /// Everything has had little contrast for two days.
    Hazy,
    /// It was also shifted: part of the scene no longer agrees with a turn.
    AlsoShifted,
    /// The mount sways more than it did: the limits have followed.
    SwaysMore {
        /// Largest scatter at first, px.
        was_px: f64,
        /// Largest scatter now, px.
        is_px: f64,
    },
    /// It shakes within seconds.
    Shakes {
        /// By so much, px.
        by_px: f64,
    },
}

/// The answer of the fold to an input.
#[derive(Clone, Debug, PartialEq)]
pub struct Decision {
    /// The state.
    pub state: State,
    /// Since when, seconds since 1970.
    pub since_secs: f64,
    /// How far the camera is from the cycle, the median of six hours: pan, tilt, roll and focal length in px of the picture.
    pub off_px: Vector4<f64>,
    /// The smallest change that would be found within two days, px; infinite while learning.
    pub smallest_visible_px: Vector4<f64>,
    /// When the references were learned or accepted, seconds since 1970.
    pub reference_secs: f64,
    /// The newest answer, seconds since 1970.
    pub answered_secs: Option<f64>,
    /// What else is to know.
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

    /// Every name that [`Self::code`] gives.
    pub const CODES: [&'static str; 6] = ["LEARNING", "OK", "MOVED", "ZOOM", "LENS", "CANNOT-TELL"];
}

impl Finding {
    /// Stable name, for files and programs.
    pub fn code(self) -> &'static str {
        match self {
            Self::Creeps { .. } => "CREEPS",
            Self::Dirty { .. } => "DIRTY",
            Self::Hazy => "HAZY",
            Self::AlsoShifted => "ALSO-SHIFTED",
            Self::SwaysMore { .. } => "SWAYS-MORE",
            Self::Shakes { .. } => "SHAKES",
        }
    }
}
