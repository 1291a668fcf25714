//! What the page asks for.

use anyhow::ensure;
use serde::Deserialize;

use boresight_geometry::markers::MarkerChoice;
use boresight_guide::session::{Command, ViewNumber};
use boresight_run::config::{Config, PlanName};

/// A new session.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Request {
    /// Source, as the page calls it.
    pub(crate) source: String,
    /// Inner corners: columns, rows.
    board: [u16; 2],
    #[serde(default)]
    markers: Option<MarkerChoice>,
    /// Side of a square.
    square_m: f64,
    plan: PlanName,
}

impl Request {
    /// The settings, checked as a settings file is.
    pub(crate) fn config(&self) -> anyhow::Result<Config> {
        let mut config = Config::load(None, &[])?;
        config.board = config.board.chosen(self.board, self.markers);
        config.board.square_mm = self.square_m * 1e3;
        config.guidance.plan = self.plan;
        config.check()?;
        Ok(config)
    }
}

/// A command of the page; those that end or leave a session are the page's business.
#[derive(Deserialize)]
#[serde(rename_all = "snake_case", tag = "command", deny_unknown_fields)]
pub(crate) enum Asked {
    TakeNow {},
    Undo {},
    Restore {},
    Remove { view: u32 },
    Pause {},
    Resume {},
    More {},
}

impl Asked {
    pub(crate) fn of(text: &str) -> anyhow::Result<Command> {
        ensure!(text.len() < 1000, "no command is that long");
        Ok(match serde_json::from_str(text)? {
            Self::TakeNow {} => Command::ForceNext,
            Self::Undo {} => Command::UndoLast,
            Self::Restore {} => Command::Restore,
            Self::Remove { view } => Command::Remove { view: ViewNumber(view) },
            Self::Pause {} => Command::Pause,
            Self::Resume {} => Command::Resume,
            Self::More {} => Command::TakeMore,
        })
    }
}
