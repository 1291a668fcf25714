//! `boresight demo`.

use std::path::PathBuf;

use clap::Args;

use super::{guide, guide_rig};
use boresight_app::{Exit, Host, Opening, REPORT_FILE, session::rig_run::RigRun, window::desktop};
use boresight_present::text;
use boresight_run::config::Config;
use boresight_terminal::{announcer, say, stop_flag};

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
            let host = Host::new(announcer(), stop_flag()?);
            #[cfg(feature = "window")]
            if self.window {
                let host = host.announced_by(announcer().from_behind());
                return guide_rig::in_window(run, host, self.json);
            }
            return guide_rig::in_terminal(run, &host, self.json);
        }
        say(text::demo::BEGINNING);
        let opening = Opening {
            out: self.out,
            max_frames: Some(MOST_FRAMES),
            ..Opening::new(&format!("sim:demo:{}", self.seed), Config::load(None, &[])?)
        };
        let host = Host::new(announcer(), stop_flag()?).paced(!self.fast);
        let finished = guide::in_terminal(&host, &opening, None);
        let concluded = guide::printed(host.conclude(finished)?, self.json)?;
        let report = concluded.path.join(REPORT_FILE);
        if !self.no_open && report.is_file() && desktop::has_display() {
            // The path is on the screen in any case.
            desktop::show(&report).ok();
        }
        say(text::demo::WHAT_NOW);
        Ok(concluded.exit)
    }
}
