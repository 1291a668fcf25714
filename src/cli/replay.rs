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
    board_args::setting,
    conclusion::{Conclusion, conclude},
    print, recordings, say,
    window::or_say_why,
};
use crate::{
    board::Checkerboard,
    detection::{Prediction, Track},
    pipeline::detect_many,
    recording::{
        Difference, Line, Rounding, SessionFolder, Stored, replay, stored_frame, take_rounding,
    },
    session::{Input, Observation, Session},
    ui,
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
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = setting)]
    settings: Vec<String>,
    /// Watch it in a window: step through the decisions, see why each frame was taken or not.
    #[arg(long)]
    gui: bool,
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
        let stored: Vec<Stored> = lines.iter().filter_map(|line| line.stored.clone()).collect();
        let mut steps = Vec::new();
        let mut differences = replay(&mut session, lines, |session, decision| {
            if self.gui {
                steps.push(session.snapshot(*decision));
            }
            // The same text that a recording holds, so that equal checksums mean equal decisions.
            checksum.update(serde_json::to_string(decision).unwrap_or_default().as_bytes());
            checksum.update(b"\n");
        });
        let crc32 = format!("{:08x}", checksum.finalize());
        let Rounding { count: rounded, largest } = take_rounding(&mut differences);
        say(&format!("{} of {count} decisions differ from the recording", differences.len()));
        for difference in differences.iter().take(TOLD) {
            say(&format!("  line {} of the journal: {}", difference.line, change(difference)));
        }
        if differences.len() > TOLD {
            say(&format!("  and {} more", differences.len() - TOLD));
        }
        if rounded > 0 {
            say(&format!(
                "{rounded} more differ by rounding only, at most {largest:.0e}, as between two processors"
            ));
        }
        let Conclusion { exit, mut report } = conclude(&session, &header);
        let asked_for_change = self.redetect || !self.settings.is_empty();
        let exit = if differences.is_empty() || asked_for_change { exit } else { Exit::Failed };
        if self.json {
            report["session"] = json!(path.display().to_string());
            report["decisions"] = json!({ "count": count, "crc32": crc32, "different": differences, "rounded": rounded });
            print(&report.to_string())?;
        }
        if self.gui {
            let replayed = recordings::watched(path, steps, &differences, stored)?;
            or_say_why(ui::run_replay(replayed))?;
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
    let predictions = predictions(lines);
    let near = |index: usize| predictions.get(&stored[index].frame).cloned();
    let found = detect_many(stored.len(), threads, board, load, near, |_| bar.inc(1))?;
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

/// Where the board was looked for first in each frame, as it was when the session was recorded: a function
/// of what had been seen before it.
fn predictions(lines: &[Line]) -> BTreeMap<u64, Prediction> {
    let mut track = Track::default();
    let mut predictions = BTreeMap::new();
    for line in lines {
        match Input::from(line.input.clone()) {
            Input::Observed(Observation { frame_id, kind, captured_at, seen, .. }) => {
                predictions.extend(track.predict(kind, captured_at).map(|near| (frame_id.0, near)));
                track.add(kind, captured_at, &seen);
            }
            Input::Resumed => track = Track::default(),
            _ => {}
        }
    }
    predictions
}

/// What a decision says differently, in the recording's own names: the outcome with the reason for a
/// refusal, else the field that changed.
fn change(difference: &Difference) -> String {
    let parsed = |text: &str| serde_json::from_str(text).unwrap_or(Value::Null);
    let (recorded, replayed): (Value, Value) =
        (parsed(&difference.recorded), parsed(&difference.replayed));
    let (before, after) = (outcome(&recorded), outcome(&replayed));
    if before != after {
        return format!("{before} -> {after}");
    }
    let fields = replayed.as_object().map(|fields| fields.iter()).into_iter().flatten();
    let changed: Vec<&str> = fields
        .filter(|(name, value)| recorded.get(*name) != Some(value))
        .map(|(name, _)| name.as_str())
        .collect();
    format!("{after}, other numbers in: {}", changed.join(", "))
}

fn outcome(decision: &Value) -> String {
    let word = |pointer: &str| decision.pointer(pointer).and_then(Value::as_str);
    match (word("/outcome/outcome"), word("/outcome/refusal/why")) {
        (Some(outcome), Some(why)) => format!("{outcome} ({why})"),
        (Some(outcome), None) => outcome.into(),
        (None, _) => "unreadable".into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_change_of_outcome_comes_before_a_change_of_numbers() {
        let refused = r#"{"outcome":{"outcome":"refused","refusal":{"why":"too_far","fill":0.4}}}"#;
        let nearer = r#"{"outcome":{"outcome":"refused","refusal":{"why":"too_far","fill":0.5}}}"#;
        let accepted = r#"{"outcome":{"outcome":"accepted","view":0}}"#;
        let change = |recorded: &str, replayed: &str| {
            let (recorded, replayed) = (recorded.to_owned(), replayed.to_owned());
            change(&Difference { line: 1, recorded, replayed })
        };
        assert_eq!(change(refused, accepted), "refused (too_far) -> accepted");
        assert_eq!(change(refused, nearer), "refused (too_far), other numbers in: outcome");
        assert_eq!(change("nonsense", accepted), "unreadable -> accepted");
    }
}
