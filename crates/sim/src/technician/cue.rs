//! Cues: everything that the person is shown and told.

use nalgebra::Point2;

use boresight_geometry::frame::CaptureTime;

/// A cue for the person.
#[derive(Clone, Debug, PartialEq)]
pub struct Cue {
    /// Capture time of the frame that caused it.
    pub seen_at: CaptureTime,
    /// Contents of the cue.
    pub kind: CueKind,
}

/// Contents of a [`Cue`].
#[derive(Clone, Debug, PartialEq)]
pub enum CueKind {
    /// Bring the board onto the ghost drawn in the picture.
    Show {
        /// Wanted image positions of all inner corners, in numbering order.
        ghost_px: Vec<Point2<f64>>,
        /// Changes when the wanted pose changes.
        target: u64,
    },
    /// A sentence on the screen. It replaces the one before, read or not.
    Sentence {
        /// Request of the sentence.
        instruction: Instruction,
        /// Number of words to read.
        words: usize,
    },
    /// The view has been taken.
    Taken,
    /// Nothing more is wanted.
    Finished,
}

/// Request of a sentence. Amounts belong to the frame that caused it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Instruction {
    /// Keep the board where it is.
    HoldStill,
    /// Bring the whole board into the picture.
    ShowBoard,
    /// Bring the whole board into the picture before the ghost is followed again.
    ShowWholeFirst,
    /// Bring the board onto the ghost more exactly.
    MatchGhost,
    /// Move along the line of sight.
    Distance {
        /// Wanted distance over the distance now.
        ratio: f64,
    },
    /// Shift the board in the picture.
    Shift {
        /// Distance to the right, in pixels; negative to the left.
        right_px: f64,
        /// Distance down, in pixels; negative up.
        down_px: f64,
    },
    /// Tip the board until it recedes like this.
    Tip {
        /// Wanted direction in the picture in which it recedes, clockwise from the right.
        azimuth_rad: f64,
        /// Wanted tilt of the board.
        tilt_rad: f64,
    },
}
