//! Recordings to step through in a window.

use std::{
    collections::BTreeSet,
    path::{Path, PathBuf},
};

use anyhow::bail;
use image::GrayImage;

use super::JournalReading;
use boresight_files::entries;
use boresight_guide::session::Snapshot;
use boresight_present::text;
use boresight_run::recording::{Replayed, SessionFolder, Stored, stored_frame};

/// Most recordings offered.
const MOST_OFFERED: usize = 50;

/// Loads the stored picture of a frame; `None` if none was stored or it can't be read.
pub type LoadPicture = Box<dyn Fn(u64) -> Option<GrayImage> + Send>;

/// A recorded session.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Recording {
    /// Folder of the recording.
    pub folder: PathBuf,
    /// When, of what.
    pub what: String,
}

/// A recording, decided again.
pub struct DecidedRecording {
    /// The state after each input; at least one.
    pub steps: Vec<Snapshot>,
    /// The steps at which this build decides differently, from 0.
    pub different: Vec<usize>,
    /// The folder, as the person named it.
    pub name: String,
    /// Loads stored pictures.
    pub load: LoadPicture,
}

/// The recordings in `folders`, newest first.
pub fn within(folders: &BTreeSet<PathBuf>) -> Vec<Recording> {
    let folders = folders.iter().flat_map(|folder| entries(folder));
    let mut found: Vec<(String, Recording)> = folders
        .filter_map(|folder| {
            let header = SessionFolder::header(&folder).ok()?;
            let what =
                text::replay::recording(&header.created, &header.source, header.image_size());
            Some((header.created, Recording { folder, what }))
        })
        .collect();
    found.sort_by(|(a, one), (b, other)| b.cmp(a).then_with(|| other.folder.cmp(&one.folder)));
    found.into_iter().map(|(_, recording)| recording).take(MOST_OFFERED).collect()
}

/// Decides the recording in `folder` again.
///
/// # Errors
///
/// If the folder can't be read, or its journal is empty.
pub fn open(folder: &Path) -> anyhow::Result<DecidedRecording> {
    let journal = JournalReading::of(folder)?;
    let mut steps = Vec::new();
    let again = journal.decide_again(&journal.header.config, |session, decision| {
        steps.push(session.snapshot(*decision));
    })?;
    decided(folder, steps, &again.replayed, journal.contents.stored)
}

/// A recording to step through: the state after each input, and where this build decides differently.
///
/// # Errors
///
/// If there is no step.
pub fn decided(
    folder: &Path,
    steps: Vec<Snapshot>,
    replayed: &Replayed,
    stored: Vec<Stored>,
) -> anyhow::Result<DecidedRecording> {
    if steps.is_empty() {
        bail!("this recording is empty");
    }
    let different = replayed.different_lines.iter().map(|line| line - 1).collect();
    let name = folder.display().to_string();
    let folder = folder.to_path_buf();
    let load = move |frame: u64| {
        let stored = stored.iter().find(|stored| stored.frame == frame)?;
        stored_frame(&folder, stored).ok()
    };
    Ok(DecidedRecording { steps, different, name, load: Box::new(load) })
}
