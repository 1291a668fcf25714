//! What the page asks for.

use anyhow::{Context as _, ensure};
use serde::Deserialize;

use boresight_geometry::markers::MarkerChoice;
use boresight_guide::session::Command;
use boresight_present::browser::Asked;
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

/// The command of the page in `text`; those that end or leave a session are the page's business.
pub(crate) fn command(text: &str) -> anyhow::Result<Command> {
    ensure!(text.len() < 1000, "no command is that long");
    let asked: Asked = serde_json::from_str(text)?;
    asked.command().context("the session has no such command")
}
