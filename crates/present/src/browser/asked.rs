//! Commands from a page to a session.

use serde::Deserialize;

use boresight_guide::session::{Command, ViewNumber};

/// Command of a page, as JSON.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case", tag = "command", deny_unknown_fields)]
#[expect(missing_docs, reason = "the names of the page's buttons")]
pub enum Asked {
    TakeNow {},
    Undo {},
    Restore {},
    Remove { view: u32 },
    Pause {},
    Resume {},
    End {},
    More {},
    Leave {},
}

impl Asked {
    /// Session command; `None` for commands to end or leave a session, which its owner handles.
    #[must_use]
    pub fn command(self) -> Option<Command> {
        Some(match self {
            Self::TakeNow {} => Command::ForceNext,
            Self::Undo {} => Command::UndoLast,
            Self::Restore {} => Command::Restore,
            Self::Remove { view } => Command::Remove { view: ViewNumber(view) },
            Self::Pause {} => Command::Pause,
            Self::Resume {} => Command::Resume,
            Self::More {} => Command::TakeMore,
            Self::End {} | Self::Leave {} => return None,
        })
    }
}
