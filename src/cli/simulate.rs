//! `boresight simulate`.

use std::path::PathBuf;

use clap::Args;

use super::{board_args::BoardArguments, guide::run};
use crate::app::{Exit, Opening};

/// Record a simulated session: every picture, every decision, and the true values.
///
/// A simulated technician follows the guidance with human reaction time, speed and mistakes.
/// truth.json holds the true lens and the board's true pose in every frame.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  boresight simulate random:7 --out recordings/seven")]
pub(super) struct Arguments {
    /// Scene file (TOML), or random:SEED for a random camera [default: an everyday webcam].
    #[arg(value_name = "SCENARIO")]
    scenario: Option<String>,
    /// Folder for the new session.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    #[command(flatten)]
    board: BoardArguments,
    /// Stop after this many pictures.
    #[arg(long, value_name = "N", default_value_t = 18_000)]
    max_frames: u64,
    /// Save only the pictures of accepted views.
    #[arg(long)]
    accepted_only: bool,
    /// Print the result as JSON on the last line of stdout.
    #[arg(long)]
    json: bool,
}

impl Arguments {
    pub(super) fn run(self) -> anyhow::Result<Exit> {
        let config = self.board.config()?;
        let source = self.scenario.as_ref().map_or("sim".into(), |name| format!("sim:{name}"));
        let opening = Opening {
            out: Some(self.out),
            record_stream: !self.accepted_only,
            max_frames: self.max_frames,
            ..Opening::new(&source, config)
        };
        run(&opening, self.json)
    }
}
