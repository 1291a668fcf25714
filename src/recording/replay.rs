//! Runs recorded inputs through the same fold and compares the decisions.

use super::Line;
use crate::session::{Decision, Input, Session};

/// A decision that came out differently.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct Difference {
    /// Line of the journal, from 1.
    pub line: usize,
    /// Decision in the recording.
    pub recorded: String,
    /// Decision now.
    pub replayed: String,
}

/// Handles the input of every line, tells `seen` of each, and returns the decisions that differ.
pub fn replay(
    session: &mut Session,
    lines: Vec<Line>,
    mut seen: impl FnMut(&Session, &Decision),
) -> Vec<Difference> {
    let mut differences = Vec::new();
    for (index, line) in lines.into_iter().enumerate() {
        let recorded = line.decision.get().to_owned();
        let decision = session.handle(&Input::from(line.input));
        // A decision is numbers, flags and fixed names; it always has a JSON form.
        let replayed = serde_json::to_string(&decision).unwrap_or_default();
        if replayed != recorded {
            differences.push(Difference { line: index + 1, recorded, replayed });
        }
        seen(session, &decision);
    }
    differences
}
