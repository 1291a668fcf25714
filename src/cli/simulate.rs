//! `boresight simulate`.

use std::{path::PathBuf, sync::Arc};

use clap::Args;

use super::{board_args::BoardArguments, guide::conclude, progress::Progress, terminal::stop_flag};
use boresight_app::{Announcer, Exit, Opening};

/// Record a simulated session: every picture, every decision, and the true values.
///
/// A simulated technician follows the guidance with human reaction time, speed and mistakes.
/// truth.json holds the true lens and the board's true pose in every frame.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Arguments {
    /// Scene file (TOML), or random:SEED for a random camera [default: an ordinary webcam:
    /// 1280x720, 30 pictures/s, 16 ms exposure, 15 ms readout, corner noise about 0.1 px, board bent by 0.2 mm].
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

const EXAMPLES: &str = "\
Examples:
  boresight simulate --out recordings/webcam
  boresight simulate random:7 --out recordings/seven
  boresight simulate scene.toml --accepted-only --out recordings/scene";

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
        let progress = Arc::new(Progress::new("views", 1));
        let above = Arc::clone(&progress);
        let announcer = Announcer::new(move |line| above.say(line));
        let finished =
            opening.open(&announcer)?.carry_out_seen(&*stop_flag()?, &announcer, |snapshot| {
                let taken = snapshot.views.len();
                progress.at(taken, taken + snapshot.views_to_go.unwrap_or(1));
            });
        progress.finish();
        conclude(finished?, self.json)
    }
}
