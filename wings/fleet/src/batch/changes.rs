//! Decisions and verdicts different from the recorded.

use std::collections::BTreeMap;

use serde::Serialize;

use super::{
    gather::{Gathered, gather_rows},
    row::Row,
    store::Store,
};

/// Maximum number of sessions named for each change.
const NAMED: usize = 3;

/// Count of a kind of change and sessions.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Change {
    /// Number of changes.
    pub count: u64,
    /// Number of sessions with the change.
    pub sessions: u64,
    /// First sessions with the change.
    pub named: Vec<String>,
}

/// Decisions and verdicts different from the recorded, over all sessions of a batch.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Changes {
    /// Compared sessions.
    pub sessions: u64,
    /// Compared decisions.
    pub decisions: u64,
    /// Decisions different by more than rounding.
    pub different: u64,
    /// Sessions with a different decision.
    pub different_sessions: u64,
    /// Different decisions by kind, `before -> after`.
    pub kinds: BTreeMap<String, Change>,
    /// Different decisions of long sessions, of unexamined kind.
    pub unknown_kinds: u64,
    /// Different verdicts, `before -> after`.
    pub verdicts: BTreeMap<String, Change>,
    /// Failed rows, by code.
    pub failed: BTreeMap<String, Change>,
}

impl Change {
    fn add(&mut self, count: u64, session: &str) {
        self.count += count;
        self.sessions += 1;
        if self.named.len() < NAMED {
            self.named.push(session.to_owned());
        }
    }
}

impl Changes {
    fn add(&mut self, row: &Row) {
        if !row.is_ok() {
            self.failed.entry(row.code.clone()).or_default().add(1, &row.session);
            return;
        }
        self.sessions += 1;
        if let Some(decisions) = &row.decisions {
            self.decisions += decisions.count as u64;
            self.different += decisions.different as u64;
            self.different_sessions += u64::from(decisions.different > 0);
            let mut known = 0;
            for (kind, &count) in &decisions.kinds {
                self.kinds.entry(kind.clone()).or_default().add(count as u64, &row.session);
                known += count;
            }
            self.unknown_kinds += decisions.different.saturating_sub(known) as u64;
        }
        if let Some(before) = &row.recorded_verdict
            && row.verdict.as_ref() != Some(before)
        {
            let after = row.verdict.as_deref().unwrap_or("none");
            let kind = format!("{before} -> {after}");
            self.verdicts.entry(kind).or_default().add(1, &row.session);
        }
    }
}

/// The changes in the rows of `store`, and the missing rows.
///
/// # Errors
///
/// If there is no batch, or its manifest can't be read.
pub fn changes(store: &Store) -> anyhow::Result<(Changes, Gathered)> {
    let mut changes = Changes::default();
    let gathered = gather_rows(store, &mut |row| changes.add(&row))?;
    Ok((changes, gathered))
}
