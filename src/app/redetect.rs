//! A recording decided again: the board found again in its pictures, and how decisions differ.

use std::collections::BTreeMap;

use serde_json::Value;

use super::JournalReading;
use crate::{
    board::Checkerboard,
    detection::{Prediction, Track},
    pipeline::detect_many,
    recording::{Difference, Line, stored_frame},
    session::{Input, Observation},
};

/// Finds the board again in every stored picture of `journal` and replaces the recorded observations. Calls
/// `progress` after each picture. Returns the numbers of pictures searched and of frames observed.
///
/// # Errors
///
/// If a picture can't be read or a thread can't be started.
pub fn redetect(
    journal: &mut JournalReading,
    board: &Checkerboard,
    threads: usize,
    progress: impl Fn() + Sync,
) -> anyhow::Result<(usize, usize)> {
    let stored = journal.stored();
    let JournalReading { path, lines, .. } = journal;
    let load = |index: usize| stored_frame(path, &stored[index]);
    let predictions = predictions(lines);
    let near = |index: usize| predictions.get(&stored[index].frame).cloned();
    let found = detect_many(stored.len(), threads, board, load, near, |_| progress())?;
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
    Ok((stored.len(), observed))
}

/// Where the board was looked for first in each frame, as when the session was recorded: a function
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

/// How the two decisions differ, in the names of the journal: the outcome with the reason for a refusal, else
/// the fields that changed.
pub fn change(difference: &Difference) -> String {
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
