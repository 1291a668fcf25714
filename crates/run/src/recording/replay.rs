//! Runs recorded inputs through the same fold and compares the decisions.

use serde::Deserialize;
use serde_json::Value;

use super::{Line, RecordingError};
use boresight_guide::{
    guidance::Role,
    session::{Decision, Input, Session, ViewNumber},
};

/// Effect of a recorded decision on the views.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case", tag = "outcome")]
pub enum RecordedOutcome {
    /// A view was accepted.
    Accepted {
        /// Number of the view.
        view: ViewNumber,
        /// Frame of the view.
        frame: u64,
        /// Role of the view.
        role: Role,
    },
    /// A view was removed.
    Removed {
        /// Number of the view.
        view: ViewNumber,
    },
    /// A removed view was restored.
    Restored {
        /// Number of the view.
        view: ViewNumber,
    },
    /// The views are unchanged.
    #[serde(other)]
    Unchanged,
}

impl RecordedOutcome {
    /// Outcome in the JSON text of a decision; `None` if missing.
    fn of(decision: &str) -> Option<Self> {
        #[derive(Deserialize)]
        struct Recorded {
            outcome: RecordedOutcome,
        }
        serde_json::from_str::<Recorded>(decision).ok().map(|recorded| recorded.outcome)
    }
}

impl Line {
    /// Effect of the recorded decision on the views; `None` if unreadable.
    pub fn outcome(&self) -> Option<RecordedOutcome> {
        RecordedOutcome::of(self.decision.get())
    }
}

/// Relative tolerance (absolute near zero) for two numbers to differ by rounding only. Versions may
/// compute the same number in another order.
const ROUNDING: f64 = 1e-7;

/// A decision with another result in the replay.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct Difference {
    /// Line of the journal, from 1.
    pub line: usize,
    /// Decision in the recording.
    pub recorded: String,
    /// JSON text of the replayed decision.
    pub replayed: String,
}

impl Difference {
    /// True if the recorded and the replayed decision have different effects on the views.
    pub fn changes_views(&self) -> bool {
        RecordedOutcome::of(&self.recorded) != RecordedOutcome::of(&self.replayed)
    }

    /// Largest relative difference of two numbers, if only rounding differs, as between versions.
    /// `None` for another decision.
    pub fn rounding(&self) -> Option<f64> {
        let parsed = |text: &str| serde_json::from_str::<Value>(text).ok();
        let largest = apart(&parsed(&self.recorded)?, &parsed(&self.replayed)?);
        (largest <= ROUNDING).then_some(largest)
    }
}

/// Decisions with differences by rounding only.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Rounding {
    /// Number of decisions.
    pub count: usize,
    /// Largest [`Difference::rounding`]; 0 if none.
    pub largest: f64,
}

/// Comparison of replayed with recorded decisions.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Replayed {
    /// Lines of the journal, from 1, with decisions differing by more than rounding.
    pub different_lines: Vec<usize>,
    /// The first [`MOST_KEPT`] of the differing decisions.
    pub differences: Vec<Difference>,
    /// True if any of the differing decisions has another effect on the views.
    pub changes_views: bool,
    /// Decisions with differences by rounding only.
    pub rounding: Rounding,
}

/// Number of differing decisions with texts kept: all texts of a long session would fill the
/// memory.
pub const MOST_KEPT: usize = 1000;

impl Replayed {
    fn add(&mut self, difference: Difference) {
        if let Some(rounding) = difference.rounding() {
            // Equal values in another order or spelling are no difference.
            self.rounding.count += usize::from(rounding > 0.0);
            self.rounding.largest = self.rounding.largest.max(rounding);
            return;
        }
        self.changes_views |= difference.changes_views();
        self.different_lines.push(difference.line);
        if self.differences.len() < MOST_KEPT {
            self.differences.push(difference);
        }
    }
}

/// Largest relative difference between the numbers of two values; infinite if anything else
/// differs.
fn apart(a: &Value, b: &Value) -> f64 {
    let all = |pairs: &mut dyn Iterator<Item = f64>| pairs.fold(0.0, f64::max);
    match (a, b) {
        (Value::Number(a), Value::Number(b)) if a.is_f64() && b.is_f64() => {
            let (a, b) = (a.as_f64().unwrap_or(f64::NAN), b.as_f64().unwrap_or(f64::NAN));
            (a - b).abs() / a.abs().max(b.abs()).max(1.0)
        }
        (Value::Array(a), Value::Array(b)) if a.len() == b.len() => {
            all(&mut a.iter().zip(b).map(|(a, b)| apart(a, b)))
        }
        (Value::Object(a), Value::Object(b)) if a.len() == b.len() => {
            all(&mut a.iter().map(|(name, a)| b.get(name).map_or(f64::INFINITY, |b| apart(a, b))))
        }
        (a, b) if a == b => 0.0,
        _ => f64::INFINITY,
    }
}

/// Handles the input of every line, calls `seen` after each, and compares the decisions.
///
/// # Errors
///
/// The first error among `lines`.
pub fn replay(
    session: &mut Session,
    lines: impl IntoIterator<Item = Result<Line, RecordingError>>,
    mut seen: impl FnMut(&Session, &Decision),
) -> Result<Replayed, RecordingError> {
    let mut compared = Replayed::default();
    for (index, line) in lines.into_iter().enumerate() {
        let Line { input, decision: recorded, .. } = line?;
        let decision = session.handle(&Input::from(input));
        // A decision is numbers, flags and fixed names; it always has a JSON form.
        let replayed = serde_json::to_string(&decision).unwrap_or_default();
        if replayed != recorded.get() {
            let recorded = recorded.get().to_owned();
            compared.add(Difference { line: index + 1, recorded, replayed });
        }
        seen(session, &decision);
    }
    Ok(compared)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounding_is_told_from_another_decision() {
        let rounding = |recorded: &str, replayed: &str| {
            Difference { line: 1, recorded: recorded.into(), replayed: replayed.into() }.rounding()
        };
        let recorded = r#"{"outcome":"refused","pose":{"tilt_rad":0.7,"view":3},"all":[1e-9,2.5]}"#;
        assert_eq!(rounding(recorded, recorded), Some(0.0));
        let rounded = recorded.replace("0.7", "0.70000000001").replace("1e-9", "-1e-9");
        let largest = rounding(recorded, &rounded).expect("only rounding");
        assert!((5e-12..5e-9).contains(&largest), "{largest}");
        for (was, is) in [
            ("0.7", "0.7001"),
            ("refused", "accepted"),
            (":3", ":4"),
            (":3", ":null"),
            ("tilt_rad", "tilt"),
            (",2.5", ""),
        ] {
            assert_eq!(rounding(recorded, &recorded.replace(was, is)), None, "{was} -> {is}");
        }
        assert_eq!(rounding(recorded, "cut"), None);
    }

    #[test]
    fn rounding_is_counted_apart_and_not_all_texts_are_kept() {
        let difference = |line: usize, replayed: &str| Difference {
            line,
            recorded: r#"{"tilt_rad":0.5}"#.into(),
            replayed: format!(r#"{{"tilt_rad":{replayed}}}"#),
        };
        let mut compared = Replayed::default();
        compared.add(difference(1, "0.50000000001"));
        compared.add(difference(2, "0.6"));
        compared.add(difference(3, "0.50000000002"));
        assert_eq!(compared.different_lines, [2]);
        assert_eq!(compared.differences, [difference(2, "0.6")]);
        let Rounding { count, largest } = compared.rounding;
        assert_eq!(count, 2);
        assert!((1.9e-11..2.1e-11).contains(&largest), "{largest}");
        assert!(!compared.changes_views);
        for line in 4..4 + 2 * MOST_KEPT {
            compared.add(difference(line, "0.7"));
        }
        assert_eq!(compared.different_lines.len(), 1 + 2 * MOST_KEPT);
        assert_eq!(compared.differences.len(), MOST_KEPT);
    }
}
