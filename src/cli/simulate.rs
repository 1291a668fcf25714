//! `boresight simulate`.

use std::path::PathBuf;

use anyhow::bail;
use clap::Args;

use super::{Exit, board_args::BoardArguments, guide::open, run::Run, source::SourceName};
use crate::{
    recording::{Header, SessionFolder},
    session::Session,
};

/// Record a guided session of the simulated camera: every picture, every decision, and the truth.
///
/// Example: boresight simulate random:7 --out recordings/seven
///
/// A simulated technician follows the guidance with a person's reaction time, speed and mistakes.
/// truth.json holds the lens and the board's pose in every frame.
#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// A scene file (TOML), or random:SEED for a camera drawn at random; by default an everyday webcam.
    #[arg(value_name = "SCENARIO")]
    scenario: Option<String>,
    /// Folder of the new session.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    #[command(flatten)]
    board: BoardArguments,
    /// Stop after this many pictures.
    #[arg(long, value_name = "N", default_value_t = 18_000)]
    max_frames: u64,
    /// Store only the pictures of the accepted views.
    #[arg(long)]
    accepted_only: bool,
    /// Print the result as JSON, as the last line on stdout.
    #[arg(long)]
    json: bool,
}

impl Arguments {
    pub(super) fn run(self) -> anyhow::Result<Exit> {
        let config = self.board.config()?;
        let spelled = self.scenario.as_ref().map_or("sim".into(), |name| format!("sim:{name}"));
        let (source, judged, truth) =
            open(&SourceName::parse(&spelled, &config)?, self.max_frames)?;
        let Some(image_size) = source.identity().image_size else {
            bail!("the scene does not say its picture size");
        };
        let session = Session::new(config.session(image_size)?);
        let folder = SessionFolder::create(&self.out, &Header::new(&spelled, image_size, config))?;
        let run = Run {
            folder,
            session,
            source,
            judged,
            truth,
            record_stream: !self.accepted_only,
            first_frame: 0,
            resumed: false,
        };
        run.finish(self.json)
    }
}
