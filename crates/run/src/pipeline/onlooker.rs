//! Onlooker beside the window, who sees a session and may give commands.

use std::sync::Arc;

use crossbeam_channel::{Sender, TrySendError};

use boresight_geometry::frame::Frame;
use boresight_guide::session::{Command, Input, Snapshot};

/// Sees everything of a session while it runs. Every call comes on one of the pipeline's threads and must return at
/// once.
pub trait Onlooker: Send + Sync {
    /// The threads run; `commands` reaches the session until it ends.
    fn began(&self, commands: CommandLink) {
        let _ = commands;
    }

    /// A frame was captured; the detector hasn't searched it yet.
    fn captured(&self, frame: &Arc<Frame>) {
        let _ = frame;
    }

    /// Called after the session has judged a frame, obeyed a command, or heard of its camera; the decision is on disk.
    fn decided(&self, snapshot: &Snapshot) {
        let _ = snapshot;
    }

    /// True if the person asked for the end of the session.
    fn wants_end(&self) -> bool {
        false
    }
}

/// Onlookers at a session.
pub type Onlookers = Vec<Arc<dyn Onlooker>>;

/// A way into a session's inbox. Its commands are recorded as the window's are.
#[derive(Clone, Debug)]
pub struct CommandLink {
    inbox: Sender<Input>,
}

impl CommandLink {
    pub(super) fn new(inbox: Sender<Input>) -> Self {
        Self { inbox }
    }

    /// Hands a command to the session without waiting.
    ///
    /// # Errors
    ///
    /// [`NotSent`].
    pub fn send(&self, command: Command) -> Result<(), NotSent> {
        self.inbox.try_send(Input::Command(command)).map_err(|err| match err {
            TrySendError::Full(_) => NotSent::Busy,
            TrySendError::Disconnected(_) => NotSent::Over,
        })
    }
}

/// Why a command didn't reach the session.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NotSent {
    /// The inbox is full; try again.
    #[error("the session is busy")]
    Busy,
    /// The session has ended.
    #[error("the session has ended")]
    Over,
}
