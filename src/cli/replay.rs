//! `boresight replay`.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
    thread::available_parallelism,
};

use clap::Args;
use serde_json::{Value, json};

use super::{
    Exit,
    conclusion::{Conclusion, conclude},
    print, say,
};
use crate::{
    board::Checkerboard,
    pipeline::detect_many,
    recording::{Difference, Line, SessionFolder, Stored, replay, stored_frame},
    session::Session,
};

/// Run recorded sessions through the same decisions again, from the corners that were recorded.
///
/// Example: boresight replay sessions/2026-11-21T08-00-00Z --set guidance.min_tilt_deg=35
///
/// Without --set and --redetect every decision must come out as it was recorded; exit code 1 says that
/// one did not. Nothing in the session is changed.
#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// Session folders.
    #[arg(required = true, value_name = "SESSION")]
    sessions: Vec<PathBuf>,
    /// Find the board anew in the stored pictures; frames without one keep their recorded corners.
    #[arg(long)]
    redetect: bool,
    /// Threads that look at pictures; by default one a core. Decisions do not depend on it.
    #[arg(long, value_name = "N", requires = "redetect")]
    threads: Option<usize>,
    /// Ask "what if": change one setting, for example guidance.min_tilt_deg=25. May be repeated.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    settings: Vec<String>,
    /// Print one JSON object per session on stdout.
    #[arg(long)]
    json: bool,
}

/// Differences told in full; the rest are counted.
const TOLD: usize = 5;

impl Arguments {
    pub(super) fn run(self) -> anyhow::Result<Exit> {
        let mut worst = Exit::Good;
        for path in &self.sessions {
            say(&format!("Session: {}", path.display()));
            worst = worst.max(self.replay(path)?);
        }
        Ok(worst)
    }

    fn replay(&self, path: &Path) -> anyhow::Result<Exit> {
        let header = SessionFolder::header(path)?;
        let config = header.config.with(&self.settings)?;
        let contents = SessionFolder::journal(path)?;
        if contents.cut {
            say("The last line was cut; nobody had been told of it. It is left out.");
        }
        let mut lines = contents.lines;
        if self.redetect {
            let threads =
                self.threads.unwrap_or_else(|| available_parallelism().map_or(1, usize::from));
            redetect(path, &config.board()?, threads, &mut lines)?;
        }
        let count = lines.len();
        let mut session = Session::new(config.session(header.image_size())?);
        let mut checksum = crc32fast::Hasher::new();
        let differences = replay(&mut session, lines, |_, decision| {
            // The same text that a recording holds, so that equal checksums mean equal decisions.
            checksum.update(serde_json::to_string(decision).unwrap_or_default().as_bytes());
            checksum.update(b"\n");
        });
        let crc32 = format!("{:08x}", checksum.finalize());
        say(&format!("{} of {count} decisions differ from the recording", differences.len()));
        for difference in differences.iter().take(TOLD) {
            say(&format!("  line {}: {}", difference.line, changes(difference)));
        }
        if differences.len() > TOLD {
            say(&format!("  and {} more", differences.len() - TOLD));
        }
        let Conclusion { exit, mut report } = conclude(&session);
        let asked_for_change = self.redetect || !self.settings.is_empty();
        let exit = if differences.is_empty() || asked_for_change { exit } else { Exit::Failed };
        if self.json {
            report["session"] = json!(path.display().to_string());
            report["decisions"] =
                json!({ "count": count, "crc32": crc32, "different": differences });
            print(&report.to_string())?;
        }
        Ok(exit)
    }
}

/// Finds the board anew in every stored picture and puts what is seen in the place of what was.
fn redetect(
    path: &Path,
    board: &Checkerboard,
    threads: usize,
    lines: &mut [Line],
) -> anyhow::Result<()> {
    let stored: Vec<Stored> = lines.iter().filter_map(|line| line.stored.clone()).collect();
    let bar = indicatif::ProgressBar::new(stored.len() as u64).with_message("finding the board");
    let load = |index: usize| stored_frame(path, &stored[index]);
    let found = detect_many(stored.len(), threads, board, load, |_| bar.inc(1))?;
    bar.finish_and_clear();
    let mut seen = BTreeMap::new();
    for (stored, found) in stored.iter().zip(found) {
        seen.insert(stored.frame, found?);
    }
    let mut observed = 0;
    for observation in lines.iter_mut().filter_map(|line| line.input.observed_mut()) {
        observed += 1;
        if let Some(seen) = seen.remove(&observation.frame()) {
            observation.see(&seen);
        }
    }
    say(&format!("Looked again at {} of {observed} frames", stored.len()));
    Ok(())
}

/// What a decision says differently, field by field.
fn changes(difference: &Difference) -> String {
    let parsed = |text: &str| serde_json::from_str(text).unwrap_or(Value::Null);
    let (recorded, replayed): (Value, Value) =
        (parsed(&difference.recorded), parsed(&difference.replayed));
    let (Some(recorded), Some(replayed)) = (recorded.as_object(), replayed.as_object()) else {
        return format!("{} -> {}", difference.recorded, difference.replayed);
    };
    let changed: Vec<String> = replayed
        .iter()
        .filter(|(key, value)| recorded.get(*key) != Some(value))
        .map(|(key, value)| {
            let before = recorded.get(key).map_or_else(|| "nothing".into(), Value::to_string);
            format!("{key} {before} -> {value}")
        })
        .collect();
    changed.join(", ")
}
