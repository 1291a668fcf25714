//! Verifies a session folder.

use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::{JournalReading, RESULT_FILE};
use boresight_files::{self as files, Links};
use boresight_formats::CalibrationFile;
use boresight_guide::guidance::RULES;
use boresight_present::text;
use boresight_run::recording::{
    Journal, JournalContents, RecordingError, SessionFolder, stored_frame, views_taken,
};

/// What a verification found.
#[derive(Clone, Debug)]
pub struct Diagnosis {
    /// Complete lines of the journal.
    pub lines: usize,
    /// True if a crash cut the last line.
    pub cut: bool,
    /// Stored pictures.
    pub pictures: usize,
    /// Accepted views at the end.
    pub views: usize,
    /// Decisions made differently by this build, rounding apart.
    pub different_decisions: usize,
    /// Line of the first different decision, from 1.
    pub first_difference: Option<usize>,
    /// Damaged or missing items; empty for an intact folder.
    pub problems: Vec<String>,
    /// True for a recording of a newer version: nothing is damaged, and this version can't copy it.
    pub newer: bool,
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

/// Verifies header, journal, stored pictures and result of the session at `path`. Changes nothing.
///
/// # Errors
///
/// If the header can't be read, or the journal can't be opened.
pub fn verify(path: &Path) -> anyhow::Result<Diagnosis> {
    let header = SessionFolder::header(path)?;
    let mut problems: Vec<String> = Vec::new();
    match SessionFolder::read(path) {
        Err(RecordingError::File(err)) if !err.is_missing() => return Err(err.into()),
        Err(err) => problems.push(said(&err.into())),
        Ok(_) => {}
    }
    let contents = match Journal::read_until_damage(&path.join("journal.jsonl")) {
        Ok(contents) => contents,
        Err(RecordingError::File(err)) if err.is_missing() => JournalContents::default(),
        Err(err) => return Err(err.into()),
    };
    let is_whole = problems.is_empty();
    if is_whole {
        let fewer = fewer_views(path, &contents);
        problems.extend(fewer.map(|reason| text::doctor::lines_missing(&reason)));
    }
    let is_proven = contents.header_crc32.is_some();
    let has_these_rules = header.guidance_rules == RULES;
    let reading = JournalReading::new(path, header, contents);
    for stored in &reading.contents.stored {
        if let Err(err) = stored_frame(path, stored) {
            problems.push(said(&err.into()));
        }
    }
    let JournalContents { lines, stored, cut, .. } = reading.contents.clone();
    let lines = lines.len();
    let mut newer = false;
    let unread = |err: anyhow::Error| {
        newer = matches!(err.downcast_ref(), Some(RecordingError::Newer { .. }));
        problems.push(said(&err));
    };
    let saved = reading.session().map_err(unread).ok();
    let different = saved.as_ref().map_or(&[][..], |saved| &saved.replayed.different_lines);
    // Without a checksum of the header, other rules may change every decision.
    if is_whole
        && has_these_rules
        && !is_proven
        && lines >= FOREIGN_LINES
        && different.len() == lines
    {
        problems.push(text::doctor::FOREIGN_HEADER.into());
    } else if let (true, true, Some(first)) = (is_whole, has_these_rules, different.first()) {
        problems.push(text::doctor::other_decisions(different.len(), *first));
    }
    Ok(Diagnosis {
        lines,
        cut,
        pictures: stored.len(),
        views: saved.as_ref().map_or(0, |saved| saved.session.accepted().len()),
        different_decisions: different.len(),
        first_difference: different.first().copied(),
        problems,
        newer,
    })
}

/// Minimum number of lines, all decided differently, to suspect other rules.
const FOREIGN_LINES: usize = 5;

/// An error with causes, in a sentence.
fn said(err: &anyhow::Error) -> String {
    format!("{err:#}")
}

/// A sentence if the result has more views than the journal ever accepted.
fn fewer_views(path: &Path, contents: &JournalContents) -> Option<String> {
    let text = files::read_text(&path.join(RESULT_FILE), files::TEXT_LIMIT, Links::Refused).ok()?;
    let tree: serde_json::Value = serde_json::from_str(&text).ok()?;
    let in_result = CalibrationFile::read(&tree).ok()?.used().count();
    let taken = views_taken(contents).ok()?;
    (in_result > taken).then(|| text::doctor::fewer_views(in_result, taken))
}
