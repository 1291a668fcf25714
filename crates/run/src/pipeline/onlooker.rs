//! Onlooker at a session beside the window, with the right to give commands.

use std::sync::Arc;

use crossbeam_channel::{Sender, TrySendError};

use boresight_geometry::frame::Frame;
use boresight_guide::session::{Command, Input, Snapshot};

/// Observer of a running session. Every call comes on a pipeline thread and must return at once.
pub trait Onlooker: Send + Sync {
    /// The threads run; `commands` reaches the session until it ends.
    fn began(&self, commands: CommandLink) {
        let _ = commands;
    }

    /// A frame was captured and is not searched yet.
    fn captured(&self, frame: &Arc<Frame>) {
        let _ = frame;
    }

    /// The session has judged a frame, obeyed a command, or handled a camera event; the decision is
    /// on disk.
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

/// Link to a session's inbox. Commands are recorded like the window's.
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

/// Reason for a command not to reach the session.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NotSent {
    /// The inbox is full; try again.
    #[error("the session is busy")]
    Busy,
    /// The session has ended.
    #[error("the session has ended")]
    Over,
}
