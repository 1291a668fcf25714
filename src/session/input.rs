use crate::{
    detection::{Detection, Miss},
    device::CameraEvent,
    frame::{CaptureTime, FrameId, FrameKind, ImageSize},
};

/// Everything that can happen to a session, in the order it happened.
///
/// A recording is a header and a list of these; a replay is a loop over that list.
#[derive(Clone, Debug, PartialEq)]
pub enum Input {
    /// The detector looked at a frame.
    Observed(Observation),
    /// The person asked for something.
    Command(Command),
    /// The live camera said something.
    Camera(CameraEvent),
    /// A worker is gone; the views stay.
    WorkerFailed {
        /// Its name.
        worker: String,
        /// What it said.
        reason: String,
    },
    /// The session goes on after an interruption; clocks may have started anew.
    Resumed,
    /// The source has no more frames.
    SourceEnded,
    /// No further input follows in this run.
    Stop,
}

/// What the detector saw in a frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Observation {
    /// Number of the frame in this session.
    pub frame_id: FrameId,
    /// Driver's time stamp.
    pub captured_at: CaptureTime,
    /// Whether the frame is one of a stream.
    pub kind: FrameKind,
    /// File name, or empty.
    pub name: String,
    /// Size of the picture.
    pub image_size: ImageSize,
    /// The board, or why not.
    pub seen: Result<Detection, Miss>,
}

/// What a person can ask for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Command {
    /// Take the next frame with a board, whatever the planner thinks of it.
    ForceNext,
    /// Take back the newest view.
    UndoLast,
    /// Take back one view.
    Remove {
        /// Its number.
        view: u32,
    },
    /// Bring back the view that was taken back last.
    Restore,
    /// Take nothing until [`Command::Resume`].
    Pause,
    /// Go on.
    Resume,
}
