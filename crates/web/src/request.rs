//! Requests from the page, and errors told to it.

use anyhow::{Context as _, ensure};
use serde::Deserialize;
use wasm_bindgen::prelude::JsError;

use boresight_geometry::boards::{BoardChoice, Pattern};
use boresight_guide::session::Command;
use boresight_present::browser::Asked;
use boresight_run::config::{Config, PlanName};

/// Request for a new session.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Request {
    /// Source, by the page's name.
    pub(crate) source: String,
    /// Inner corners: columns, rows.
    board: [u16; 2],
    #[serde(rename = "markers", default)]
    pattern: Pattern,
    /// Side of a square.
    square_m: f64,
    plan: PlanName,
}

impl Request {
    /// Settings, checked like a settings file.
    pub(crate) fn config(&self) -> anyhow::Result<Config> {
        let mut config = Config::load(None, &[])?;
        config.board = config.board.chosen(BoardChoice::of(self.board, self.pattern));
        config.board.square_mm = self.square_m * 1e3;
        config.guidance.plan = self.plan;
        config.check()?;
        Ok(config)
    }
}

/// Command of the page in `text`; the page handles commands to end or leave a session.
pub(crate) fn command(text: &str) -> anyhow::Result<Command> {
    ensure!(text.len() < 1000, "no command is that long");
    let asked: Asked = serde_json::from_str(text)?;
    asked.command().context("the session has no such command")
}

/// Error for the page.
#[expect(clippy::needless_pass_by_value, reason = "`map_err` gives it away")]
pub(crate) fn told(err: anyhow::Error) -> JsError {
    JsError::new(&format!("{err:#}"))
}
