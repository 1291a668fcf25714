use super::view_number::ViewNumber;
use crate::guidance::Target;
use boresight_detect::{Detection, Miss};
use boresight_geometry::{
    device::CameraEvent,
    frame::{CaptureTime, FrameId, FrameKind, ImageSize, SceneScale},
};

/// Everything that can happen to a session, in the order of events.
///
/// A recording is a header and a list of inputs; a replay is a loop over that list.
#[derive(Clone, Debug, PartialEq)]
pub enum Input {
    /// The detector searched a frame.
    Observed(Observation),
    /// The person gave a command.
    Command(Command),
    /// A rig leads the session: from now on, it takes forced frames only, and requests the given
    /// pose; as it plans by itself, if `None`.
    Led(Option<Target>),
    /// The live camera reported an event. Camera events may overtake frames, so each carries the
    /// times from or until which frames are good.
    Camera(CameraEvent),
    /// A worker thread failed; the views stay.
    WorkerFailed {
        /// Name of the thread.
        worker: String,
        /// Error message of the thread.
        reason: String,
    },
    /// The session is resumed in another run; the driver's clock may have restarted.
    Resumed,
    /// The scene behind the board was compared between the pictures of accepted views.
    Scene(Vec<(ViewNumber, SceneScale)>),
    /// The source has no more frames.
    SourceEnded,
    /// The last input of the run.
    Stop,
}

/// Result of the detector for a frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Observation {
    /// Number of the frame in the session.
    pub frame_id: FrameId,
    /// Driver's timestamp.
    pub captured_at: CaptureTime,
    /// Video frame or photograph.
    pub kind: FrameKind,
    /// File name, or empty.
    pub name: String,
    /// Size of the picture.
    pub image_size: ImageSize,
    /// Detection of the board, or the reason for a miss.
    pub seen: Result<Detection, Miss>,
}

/// Command of a person.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Command {
    /// Take the next frame with a board without checking any limit.
    ForceNext,
    /// Remove the newest view.
    UndoLast,
    /// Remove a view.
    Remove {
        /// Number of the view.
        view: ViewNumber,
    },
    /// Restore the view that was removed last.
    Restore,
    /// Take nothing until [`Command::Resume`].
    Pause,
    /// Leave the paused state.
    Resume,
    /// Take two more views, in parts of the picture without a board so far, though the plan is
    /// complete.
    TakeMore,
}
