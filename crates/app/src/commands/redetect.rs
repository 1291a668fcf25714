//! A recording decided again: the board found again in its pictures, and how decisions differ.

use std::collections::{BTreeMap, BTreeSet};

use serde_json::Value;

use crate::JournalReading;
use boresight_detect::{Prediction, Track};
use boresight_geometry::boards::Board;
use boresight_guide::session::{Input, Observation};
use boresight_run::{
    pipeline::detect_many,
    recording::{Difference, JournalContents, RecordingError, stored_frame},
};

/// Finds the board again in every stored picture of `journal` and replaces the recorded
/// observations. Calls `progress` after each picture. Returns the numbers of pictures searched and
/// of frames observed.
///
/// # Errors
///
/// If a picture can't be read or a thread can't be started.
pub fn redetect(
    journal: &mut JournalReading,
    board: &Board,
    threads: usize,
    progress: impl Fn() + Sync,
) -> anyhow::Result<(usize, usize)> {
    let JournalReading { path, contents, .. } = &*journal;
    let stored = &contents.stored;
    let load = |index: usize| stored_frame(path, &stored[index]);
    let (predictions, observed) = predictions(contents)?;
    let near = |index: usize| predictions.get(&stored[index].frame).cloned();
    let found = detect_many(stored.len(), threads, board, load, near, |_| progress())?;
    let searched = stored.len();
    let mut seen = BTreeMap::new();
    for (stored, found) in stored.iter().zip(found) {
        seen.insert(stored.frame, found?);
    }
    journal.seen_again = seen;
    Ok((searched, observed))
}

/// Initial search regions of the board in each stored frame, as at recording time: a function of
/// earlier observations. Also the number of frames observed.
fn predictions(
    contents: &JournalContents,
) -> Result<(BTreeMap<u64, Prediction>, usize), RecordingError> {
    let stored: BTreeSet<u64> = contents.stored.iter().map(|stored| stored.frame).collect();
    let mut track = Track::default();
    let mut predictions = BTreeMap::new();
    let mut observed = 0;
    for line in &contents.lines {
        match Input::from(line?.input) {
            Input::Observed(Observation { frame_id, kind, captured_at, seen, .. }) => {
                observed += 1;
                if stored.contains(&frame_id.0) {
                    let near = track.predict(kind, captured_at);
                    predictions.extend(near.map(|near| (frame_id.0, near)));
                }
                track.add(kind, captured_at, &seen);
            }
            Input::Resumed => track = Track::default(),
            _ => {}
        }
    }
    Ok((predictions, observed))
}

/// Difference between two decisions, in the names of the journal: the outcome with the reason for a
/// refusal, else the changed fields.
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

/// Difference between the outcomes of two decisions, as in [`change`]; equal outcomes from other
/// numbers are a single kind.
pub fn kind(difference: &Difference) -> String {
    let parsed = |text: &str| serde_json::from_str(text).unwrap_or(Value::Null);
    let before = outcome(&parsed(&difference.recorded));
    let after = outcome(&parsed(&difference.replayed));
    if before == after { format!("{after}, other numbers") } else { format!("{before} -> {after}") }
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
