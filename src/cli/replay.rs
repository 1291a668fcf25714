//! `boresight replay`.

use std::path::{Path, PathBuf};

use clap::Args;

#[cfg(not(feature = "window"))]
use boresight_app::MissingFeature;
use boresight_app::{
    Exit, JournalReading,
    commands::redetect::{change, redetect},
    cores,
    session::result::{Conclusion, conclude},
};
use boresight_guide::guidance::RULES;
use boresight_present::text;
use boresight_run::recording::{Replayed, Rounding};
use boresight_terminal::{
    announcer,
    board_args::setting,
    print,
    progress::{FINDING, Progress},
    say,
};

/// Re-run recorded sessions and compare every decision.
///
/// Without --set and --redetect, every decision must match; otherwise it exits with 1. The session
/// isn't changed.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Arguments {
    /// Session folders.
    #[arg(required = true, value_name = "SESSION")]
    sessions: Vec<PathBuf>,
    /// Detect corners again in stored pictures (other frames keep their recorded corners).
    #[arg(long)]
    redetect: bool,
    /// Threads for detection [default: one per core]. Doesn't affect decisions.
    #[arg(long, value_name = "N", requires = "redetect")]
    threads: Option<usize>,
    /// Ask "what if": change one setting, for example guidance.hold_secs=0.5. Can be repeated.
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = setting)]
    settings: Vec<String>,
    /// Step through the decisions in a window and see why each frame was taken or not.
    #[arg(long)]
    gui: bool,
    /// Print one JSON object per session on stdout.
    #[arg(long)]
    json: bool,
}

const EXAMPLES: &str = "\
Examples:
  boresight replay sessions/2026-11-21T08-00-00Z
  boresight replay sessions/2026-11-21T08-00-00Z --set guidance.hold_secs=0.5
  boresight replay sessions/2026-11-21T08-00-00Z --redetect --json";

/// Differences shown in full; the rest are counted.
const SHOWN: usize = 5;

impl Arguments {
    pub(super) fn run(self) -> anyhow::Result<Exit> {
        #[cfg(not(feature = "window"))]
        if self.gui {
            return Err(MissingFeature::WINDOW.into());
        }
        let mut worst = Exit::Good;
        for path in &self.sessions {
            say(&format!("Session: {}", path.display()));
            worst = worst.max(self.replay(path)?);
        }
        Ok(worst)
    }

    fn replay(&self, path: &Path) -> anyhow::Result<Exit> {
        let mut journal = JournalReading::of(path)?;
        let config = journal.header.config.with(&self.settings)?;
        let other_rules = text::replay::other_rules(journal.header.guidance_rules, RULES);
        if journal.contents.cut {
            say(text::replay::CUT);
        }
        if self.redetect {
            let threads = self.threads.unwrap_or_else(cores);
            let progress = Progress::new(FINDING, journal.contents.stored.len());
            let (searched, observed) =
                redetect(&mut journal, &config.board()?, threads, || progress.step())?;
            progress.finish();
            say(&format!("Searched {searched} of {observed} frames again"));
        }
        let mut steps = Vec::new();
        let progress = Progress::new("replaying", journal.contents.lines.len());
        let (again, crc32) = journal.decide_again_summed(&config, |session, decision| {
            if self.gui {
                steps.push(session.snapshot(*decision));
            }
            progress.step();
        })?;
        progress.finish();
        let count = journal.contents.lines.len();
        let Replayed { different_lines, differences, rounding, .. } = &again.replayed;
        let different_count = different_lines.len();
        let Rounding { count: rounded, largest } = *rounding;
        say(&format!("{different_count} of {count} decisions differ from the recording"));
        if let Some(other) = other_rules.filter(|_| different_count > 0) {
            say(other);
        }
        for difference in differences.iter().take(SHOWN) {
            say(&format!("  line {} of the journal: {}", difference.line, change(difference)));
        }
        if different_count > SHOWN {
            say(&format!("  and {} more", different_count - SHOWN));
        }
        if rounded > 0 {
            say(&format!(
                "{rounded} more differ only by floating-point rounding, by {largest:.0e} at most (for example, another version)"
            ));
        }
        let Conclusion { exit, result } = conclude(&again.session, &journal.header, &announcer());
        let asked_for_change = self.redetect || !self.settings.is_empty();
        let exit = if different_count == 0 || asked_for_change { exit } else { Exit::Failed };
        if self.json {
            let result = again.to_json(&result, path, count, &crc32)?;
            print(&result.to_string())?;
        }
        if self.gui {
            #[cfg(feature = "window")]
            boresight_window::open::replay(boresight_app::window::recordings::decided(
                path,
                steps,
                &again.replayed,
                journal.contents.stored,
            )?)?;
        }
        Ok(exit)
    }
}
