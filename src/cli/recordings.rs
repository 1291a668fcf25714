//! Recordings to be watched in a window.

use std::{
    collections::BTreeSet,
    path::{Path, PathBuf},
};

use anyhow::Context;

use crate::{
    recording::{Difference, SessionFolder, Stored, replay, stored_frame, take_rounding},
    session::{Session, Snapshot},
    text,
    ui::{desk::Recording, replay::Replayed},
};

/// Recordings that a person is offered at most.
const MOST_OFFERED: usize = 50;

/// The recordings in `folders`, newest first.
pub(super) fn within(folders: &BTreeSet<PathBuf>) -> Vec<Recording> {
    let entries = folders.iter().flat_map(|folder| std::fs::read_dir(folder).into_iter().flatten());
    let mut found: Vec<(String, Recording)> = entries
        .filter_map(|entry| {
            let folder = entry.ok()?.path();
            let header = SessionFolder::header(&folder).ok()?;
            let what = text::replay::recording(&header);
            Some((header.created, Recording { folder, what }))
        })
        .collect();
    found.sort_by(|(a, one), (b, other)| b.cmp(a).then_with(|| other.folder.cmp(&one.folder)));
    found.into_iter().map(|(_, recording)| recording).take(MOST_OFFERED).collect()
}

/// Decides the recording in `folder` again.
pub(super) fn open(folder: &Path) -> anyhow::Result<Replayed> {
    let header = SessionFolder::header(folder)?;
    let lines = SessionFolder::journal(folder)?.lines;
    let mut session = Session::new(header.config.session(header.image_size())?);
    let stored = lines.iter().filter_map(|line| line.stored.clone()).collect();
    let mut steps = Vec::new();
    let mut differences = replay(&mut session, lines, |session, decision| {
        steps.push(session.snapshot(*decision));
    });
    take_rounding(&mut differences);
    watched(folder, steps, &differences, stored)
}

/// What a window shows of the recording in `folder`.
pub(super) fn watched(
    folder: &Path,
    steps: Vec<Snapshot>,
    differences: &[Difference],
    stored: Vec<Stored>,
) -> anyhow::Result<Replayed> {
    let different: Vec<usize> = differences.iter().map(|d| d.line - 1).collect();
    let name = folder.display().to_string();
    let folder = folder.to_path_buf();
    let load = move |frame: u64| {
        let stored = stored.iter().find(|stored| stored.frame == frame)?;
        stored_frame(&folder, stored).ok()
    };
    Replayed::new(steps, &different, name, Box::new(load))
        .context("there is nothing in this recording")
}
