//! `boresight demo`.

use std::path::PathBuf;

use clap::Args;

use super::{guide, guide_rig::Guide};
use boresight_app::{Exit, Opening, REPORT_FILE, session::rig_run::RigRun, window::desktop};
use boresight_present::text;
use boresight_run::{config::Config, pipeline::Onlookers};
use boresight_terminal::{announcer, operation::Operation, say};

/// Try a guided session in half a minute: no camera, no board, no display needed.
///
/// A simulated person holds a simulated board in front of a simulated webcam, and follows what
/// boresight says: the same guidance, calibration, verdict and report as with your camera. The lens
/// is known here, so the end says how far off the result is. Session, verdict and report are marked
/// SIMULATED. Where there is a desktop, the report is opened.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Arguments {
    /// Folder for the session and its report [default: a new one in ./sessions].
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Another person: other hands, other moves.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Run as fast as this computer can instead of at a person's pace.
    #[arg(long)]
    fast: bool,
    /// Two cameras without a trigger, and a board on a tripod.
    #[arg(long)]
    rig: bool,
    /// Watch both cameras in a window.
    #[cfg(feature = "window")]
    #[arg(long, requires = "rig", conflicts_with = "fast")]
    window: bool,
    /// Don't open the report.
    #[arg(long)]
    no_open: bool,
    /// Print the result as JSON on the last line of stdout.
    #[arg(long)]
    json: bool,
}

const EXAMPLES: &str = "\
Examples:
  boresight demo
  boresight demo --fast --seed 2 --out demo
  boresight demo --rig";

/// Maximum number of pictures: a minute and a half of the person's time.
const MOST_FRAMES: u64 = 2_700;

impl Arguments {
    pub(super) fn run(self) -> anyhow::Result<Exit> {
        if self.rig {
            say(text::demo::BEGINNING_RIG);
            let run = RigRun::simulated(self.seed, self.out, MOST_FRAMES)?;
            let run = if self.fast { run.fast() } else { run };
            let (operation, as_json) = (Operation::default(), self.json);
            let guide = |announcer| Guide {
                announcer,
                voice: None,
                #[cfg(feature = "serve")]
                phone: None,
                operation,
                as_json,
            };
            #[cfg(feature = "window")]
            if self.window {
                return guide(announcer().from_behind()).in_window(run);
            }
            return guide(announcer()).in_terminal(run);
        }
        say(text::demo::BEGINNING);
        let opening = Opening {
            out: self.out,
            max_frames: Some(MOST_FRAMES),
            ..Opening::new(&format!("sim:demo:{}", self.seed), Config::load(None, &[])?)
        };
        let finished = guide::in_terminal(&opening, !self.fast, Onlookers::new(), announcer())?;
        let report = finished.path.join(REPORT_FILE);
        let exit = guide::conclude(finished, self.json)?;
        if !self.no_open && report.is_file() && desktop::has_display() {
            // The path is on the screen in any case.
            desktop::show(&report).ok();
        }
        say(text::demo::WHAT_NOW);
        Ok(exit)
    }
}
