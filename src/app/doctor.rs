//! Verifies a session folder, and copies what is whole.

use std::path::Path;

use anyhow::bail;
use serde::{Deserialize, Serialize};

use super::JournalReading;
use crate::{
    frame::FrameId,
    recording::{Journal, RecordingError, SessionFolder, stored_frame},
};

/// What a verification found.
#[derive(Clone, Debug)]
pub struct Diagnosis {
    /// Whole lines of the journal.
    pub lines: usize,
    /// Whether the last line was cut by a crash.
    pub cut: bool,
    /// Stored pictures.
    pub pictures: usize,
    /// Accepted views at the end.
    pub views: usize,
    /// Decisions that this build makes differently, rounding apart.
    pub different_decisions: usize,
    /// Line of the first of them, from 1.
    pub first_difference: Option<usize>,
    /// What is damaged or missing; empty if the folder is whole.
    pub problems: Vec<String>,
}

/// `boresight.doctor/1`: what `doctor --json` prints.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
pub struct DoctorFile {
    /// [`DOCTOR_SCHEMA`].
    #[cfg_attr(feature = "schemas", schemars(extend("const" = "boresight.doctor/1")))]
    pub schema: String,
    /// True if there are no problems.
    pub whole: bool,
    /// What is damaged or missing, in sentences.
    pub problems: Vec<String>,
    /// Whole lines of the journal.
    pub lines: usize,
    /// Stored pictures.
    pub pictures: usize,
    /// Accepted views at the end.
    pub views: usize,
    /// Whether the last line was cut by a crash.
    pub cut: bool,
    /// Decisions that this build makes differently, rounding apart.
    pub different_decisions: usize,
}

/// Name and version of [`DoctorFile`].
pub const DOCTOR_SCHEMA: &str = "boresight.doctor/1";

impl From<&Diagnosis> for DoctorFile {
    fn from(found: &Diagnosis) -> Self {
        Self {
            schema: DOCTOR_SCHEMA.into(),
            whole: found.problems.is_empty(),
            problems: found.problems.clone(),
            lines: found.lines,
            pictures: found.pictures,
            views: found.views,
            cut: found.cut,
            different_decisions: found.different_decisions,
        }
    }
}

/// Verifies header, journal and stored pictures of the session at `path`. Changes nothing.
///
/// # Errors
///
/// If the header can't be read, or the journal can't be opened.
pub fn verify(path: &Path) -> anyhow::Result<Diagnosis> {
    let header = SessionFolder::header(path)?;
    let mut problems: Vec<String> = Vec::new();
    let journal = path.join("journal.jsonl");
    if !journal.exists() {
        problems.push(format!("the journal is missing: {journal:?}"));
    }
    let contents = match SessionFolder::journal(path) {
        Ok(contents) => contents,
        Err(err @ RecordingError::Damaged { .. }) => {
            problems.push(err.to_string());
            Journal::read_until_damage(&journal)?
        }
        Err(err) => return Err(err.into()),
    };
    let reading = JournalReading::new(path, header, contents);
    let stored = reading.stored();
    for stored in &stored {
        if let Err(err) = stored_frame(path, stored) {
            problems.push(err.to_string());
        }
    }
    let (lines, cut) = (reading.lines.len(), reading.cut);
    let saved = reading.session().map_err(|err| problems.push(format!("{err:#}"))).ok();
    let differences = saved.as_ref().map_or(&[][..], |saved| &saved.differences);
    Ok(Diagnosis {
        lines,
        cut,
        pictures: stored.len(),
        views: saved.as_ref().map_or(0, |saved| saved.session.accepted().len()),
        different_decisions: differences.len(),
        first_difference: differences.first().map(|difference| difference.line),
        problems,
    })
}

/// Copies header, pictures and the first `lines` journal lines of the session `from` into the new folder `to`.
///
/// # Errors
///
/// If something is at `to` already, or a file can't be copied.
pub fn recover(from: &Path, to: &Path, lines: usize) -> anyhow::Result<()> {
    if to.exists() {
        bail!("there is already something at {to:?}: name a new folder");
    }
    let journal = Journal::read_until_damage(&from.join("journal.jsonl"))?;
    let failed = |source| RecordingError::Write { source, path: to.to_path_buf() };
    std::fs::create_dir_all(to.join("frames")).map_err(failed)?;
    std::fs::copy(from.join("session.toml"), to.join("session.toml")).map_err(failed)?;
    for stored in journal.lines.iter().filter_map(|line| line.stored.as_ref()) {
        let name = FrameId(stored.frame).stored_name();
        if from.join(&name).exists() {
            std::fs::copy(from.join(&name), to.join(&name)).map_err(failed)?;
        }
    }
    let bytes = std::fs::read(from.join("journal.jsonl"))?;
    let whole: Vec<u8> =
        bytes.split_inclusive(|byte| *byte == b'\n').take(lines).flatten().copied().collect();
    std::fs::write(to.join("journal.jsonl"), whole).map_err(failed)?;
    Ok(())
}
