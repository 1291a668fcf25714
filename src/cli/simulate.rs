//! `boresight simulate`.

use std::{
    path::PathBuf,
    sync::{
        Arc, Mutex, PoisonError,
        atomic::{AtomicBool, Ordering},
    },
    time::Duration,
};

use clap::Args;

use super::guide::printed;
use boresight_app::{Announcer, Exit, Host, Opening};
use boresight_guide::session::Snapshot;
use boresight_present::text;
use boresight_run::pipeline::Onlooker;
use boresight_terminal::{
    announcer as terminal_announcer, board_args::BoardArguments, progress::Progress, stop_flag,
};

/// Record a simulated session: every picture, every decision, and the true values.
///
/// A simulated technician follows the guidance with human reaction time, speed and mistakes.
/// truth.json holds the true lens and the board's true pose in every frame. If nothing is taken for
/// two minutes of the scene's time, the session ends and says what was asked for.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Arguments {
    /// Scene file (TOML), or random:SEED for a random camera [default: an ordinary webcam:
    /// 1280x720, 30 pictures/s, 16 ms exposure, 15 ms readout, corner noise about 0.1 px, board
    /// bent by 0.2 mm].
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

/// Longest time without a new view, in the scene's own time.
const PATIENCE: Duration = Duration::from_secs(120);

/// Last change of the number of views.
#[derive(Default)]
struct Newest {
    views: usize,
    at_nanos: u64,
}

impl Newest {
    /// Notes the number of views; true if it was constant for [`PATIENCE`].
    fn is_long_ago(&mut self, views: usize, now_nanos: u64) -> bool {
        if views != self.views {
            *self = Self { views, at_nanos: now_nanos };
        }
        now_nanos.saturating_sub(self.at_nanos) > PATIENCE.as_nanos() as u64
    }
}

impl Arguments {
    pub(super) fn run(self) -> anyhow::Result<Exit> {
        let config = self.board.config()?;
        // `guide` calls it sim:random:SEED.
        let scenario = self.scenario.as_deref();
        let scenario = scenario.map(|name| name.strip_prefix("sim:").unwrap_or(name));
        let source = scenario.map_or("sim".into(), |name| format!("sim:{name}"));
        let opening = Opening {
            out: Some(self.out),
            record_stream: !self.accepted_only,
            max_frames: Some(self.max_frames),
            ..Opening::new(&source, config)
        };
        let progress = Arc::new(Progress::new("views", 1));
        let above = Arc::clone(&progress);
        let announcer = Announcer::new(move |line| above.say(line));
        let host = Host::new(announcer, stop_flag()?);
        let patience =
            Patience { progress, newest: Mutex::default(), is_over: AtomicBool::new(false) };
        let patience = Arc::new(patience);
        let watched = host.clone().watched_by(Arc::clone(&patience) as _);
        let finished = watched.open(&opening).and_then(|run| watched.finish(run));
        patience.progress.finish();
        let host = host.announced_by(terminal_announcer());
        Ok(printed(host.conclude(finished)?, self.json)?.exit)
    }
}

/// Shows the progress, and ends a session in which nothing is taken.
struct Patience {
    progress: Arc<Progress>,
    newest: Mutex<Newest>,
    is_over: AtomicBool,
}

impl Onlooker for Patience {
    fn decided(&self, snapshot: &Snapshot) {
        let taken = snapshot.views.len();
        self.progress.at(taken, taken + snapshot.views_to_go.unwrap_or(1));
        let now = snapshot.live.as_ref().map_or(0, |live| live.captured_at.nanos);
        let mut newest = self.newest.lock().unwrap_or_else(PoisonError::into_inner);
        if newest.is_long_ago(taken, now) && !self.is_over.swap(true, Ordering::Relaxed) {
            let gave_up = text::simulated_gave_up(PATIENCE.as_secs(), snapshot.shown.prompt);
            self.progress.say(&gave_up);
        }
    }

    fn wants_end(&self) -> bool {
        self.is_over.load(Ordering::Relaxed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn patience_ends_and_begins_again_with_each_view() {
        let secs = |secs: u64| secs * 1_000_000_000;
        let mut newest = Newest::default();
        assert!(!newest.is_long_ago(0, secs(119)));
        assert!(!newest.is_long_ago(1, secs(121)));
        assert!(!newest.is_long_ago(1, secs(240)));
        // A view taken back counts, too.
        assert!(!newest.is_long_ago(0, secs(241)));
        assert!(newest.is_long_ago(0, secs(362)));
    }
}
