//! `boresight detect`.

use std::{path::PathBuf, time::Instant};

use anyhow::bail;
use clap::Args;

use super::{
    board_args::BoardArguments,
    progress::{FINDING, Progress},
    stdin::Given,
    terminal::print,
};
use boresight_app::{Exit, json::DetectedLine};
use boresight_capture::read_picture;
use boresight_detect::{Detector, DetectorParams};
use boresight_formats::corner_table::{self, Digits};
use boresight_present::text;

/// Detect the board's corners in pictures.
///
/// Prints a corner table, or one JSON object per picture.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Arguments {
    /// Pictures, PNG or JPEG; - reads one from standard input.
    #[arg(required = true, value_name = "IMAGE")]
    images: Vec<PathBuf>,
    #[command(flatten)]
    board: BoardArguments,
    /// Print one JSON object per picture instead of the table.
    #[arg(long)]
    json: bool,
}

const EXAMPLES: &str = "\
Examples:
  boresight detect pictures/*.png > corners.vnl
  boresight detect --board 9x6 pictures/*.png > corners.vnl
  boresight detect --board 9x6 --json picture.png";

impl Arguments {
    pub(super) fn run(self) -> anyhow::Result<Exit> {
        let given = Given::of(&self.images)?;
        let board = self.board.config_for(&given.files)?.board()?;
        let mut detector = Detector::new(DetectorParams::default());
        let mut unreadable = 0;
        if !self.json {
            print(corner_table::HEADER.trim_end())?;
        }
        let progress = Progress::new(FINDING, self.images.len());
        for path in &given.files {
            let image = match read_picture(path) {
                Ok(image) => image,
                Err(err) => {
                    unreadable += 1;
                    progress.say(&format!("boresight: {:#}", anyhow::Error::from(err)));
                    progress.step();
                    continue;
                }
            };
            let name = given.name(path);
            let started = Instant::now();
            let seen = detector.detect(&image, &board);
            let millis = started.elapsed().as_secs_f64() * 1e3;
            if let Err(miss) = &seen {
                progress.say(&format!("{name}: {}", text::miss(miss)));
            }
            let line = if self.json {
                serde_json::to_string(&DetectedLine::of(&name, &board, &seen, millis))?
            } else {
                let corners = seen.as_ref().ok().map(|detection| detection.corners.as_slice());
                corner_table::lines(&name, corners, Digits::FourDecimals)
            };
            progress.aside(|| print(line.trim_end()))?;
            progress.step();
        }
        progress.finish();
        if unreadable > 0 {
            bail!("{unreadable} of {} files could not be read", self.images.len());
        }
        Ok(Exit::Good)
    }
}
