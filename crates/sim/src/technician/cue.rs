//! Cues: everything shown or told to the person.

use nalgebra::Point2;

use boresight_geometry::frame::CaptureTime;

/// Cue for the person.
#[derive(Clone, Debug, PartialEq)]
pub struct Cue {
    /// Capture time of the frame behind the cue.
    pub seen_at: CaptureTime,
    /// Contents of the cue.
    pub kind: CueKind,
}

/// Contents of a [`Cue`].
#[derive(Clone, Debug, PartialEq)]
pub enum CueKind {
    /// Bring the board onto the ghost drawn in the picture.
    Show {
        /// Target image positions of all inner corners, in numbering order.
        ghost_px: Vec<Point2<f64>>,
        /// Number of the target; changes with the target pose.
        target: u64,
    },
    /// Sentence on the screen. It replaces the previous one, read or not.
    Sentence {
        /// Request of the sentence.
        instruction: Instruction,
        /// Number of words to read.
        words: usize,
    },
    /// View taken.
    Taken,
    /// Session finished.
    Finished,
}

/// Request of a sentence. Amounts belong to the frame behind the sentence.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Instruction {
    /// Keep the board in place.
    HoldStill,
    /// Bring the whole board into the picture.
    ShowBoard,
    /// Bring the whole board into the picture before the ghost is followed again.
    ShowWholeFirst,
    /// Bring the board onto the ghost more exactly.
    MatchGhost,
    /// Move along the line of sight.
    Distance {
        /// Target distance over the current distance.
        ratio: f64,
    },
    /// Shift the board in the picture.
    Shift {
        /// Distance to the right, in pixels; negative to the left.
        right_px: f64,
        /// Distance down, in pixels; negative up.
        down_px: f64,
    },
    /// Tip the board to the given direction and tilt.
    Tip {
        /// Target direction in the picture in which the board recedes, clockwise from the right.
        azimuth_rad: f64,
        /// Target tilt of the board.
        tilt_rad: f64,
    },
}
