//! `boresight doctor`.

use std::path::{Path, PathBuf};

use anyhow::bail;
use clap::Args;
use serde_json::json;

use super::{Exit, print, say};
use crate::{
    frame::FrameId,
    recording::{Journal, RecordingError, SessionFolder, replay, stored_frame, take_rounding},
    session::Session,
};

/// Verify a session folder: its header, every line of its journal, every stored picture; and tell
/// whether the recorded decisions come out again. Changes nothing.
///
/// Example: boresight doctor sessions/2026-11-21T08-00-00Z
#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// The session folder.
    session: PathBuf,
    /// Copy what is whole, up to the first damage, into this new folder.
    #[arg(long, value_name = "NEW")]
    recover: Option<PathBuf>,
    /// Print the result as JSON on stdout.
    #[arg(long)]
    json: bool,
}

impl Arguments {
    pub(super) fn run(self) -> anyhow::Result<Exit> {
        let header = SessionFolder::header(&self.session)?;
        let mut problems: Vec<String> = Vec::new();
        let journal = self.session.join("journal.jsonl");
        if !journal.exists() {
            problems.push(format!("the journal is gone: {journal:?}"));
        }
        let contents = match SessionFolder::journal(&self.session) {
            Ok(contents) => contents,
            Err(err @ RecordingError::Damaged { .. }) => {
                problems.push(err.to_string());
                Journal::read_until_damage(&journal)?
            }
            Err(err) => return Err(err.into()),
        };
        let lines = contents.lines.len();
        if contents.cut {
            say(
                "The last line was cut; nobody had been told of it. It is dropped when the session goes on.",
            );
        }
        let mut pictures = 0;
        for line in &contents.lines {
            if let Some(stored) = &line.stored {
                pictures += 1;
                if let Err(err) = stored_frame(&self.session, stored) {
                    problems.push(err.to_string());
                }
            }
        }
        if let Some(new) = &self.recover {
            recover(&self.session, new, &contents.lines)?;
            say(&format!("Recovered {lines} lines into {}", new.display()));
        }
        let mut session = Session::new(header.config.session(header.image_size())?);
        let mut differences = replay(&mut session, contents.lines, |_, _| ());
        take_rounding(&mut differences);
        if let Some(first) = differences.first() {
            // Another build may decide otherwise; what was recorded is whole all the same.
            say(&format!(
                "{} decisions come out differently, the first at line {}: usual for a recording of another version.",
                differences.len(),
                first.line
            ));
        }
        let views = session.accepted().len();
        say(&format!("{lines} journal lines, {pictures} pictures, {views} views"));
        for problem in &problems {
            say(&format!("  {problem}"));
        }
        if self.json {
            print(&json!({
                "schema": "boresight.doctor/1", "whole": problems.is_empty(), "problems": problems,
                "lines": lines, "pictures": pictures, "views": views, "cut": contents.cut,
                "different_decisions": differences.len(),
            }).to_string())?;
        }
        if !problems.is_empty() {
            if self.recover.is_none() {
                say(&format!(
                    "What is whole can be copied into a new session: boresight doctor {} --recover NEW",
                    self.session.display()
                ));
            }
            bail!("{} problems in {:?}", problems.len(), self.session);
        }
        say("Whole.");
        Ok(Exit::Good)
    }
}

/// Copies header, pictures and the whole lines.
fn recover(from: &Path, to: &Path, lines: &[crate::recording::Line]) -> anyhow::Result<()> {
    if to.exists() {
        bail!("there is already something at {to:?}: name a new folder");
    }
    let failed = |source| RecordingError::Write { source, path: to.to_path_buf() };
    std::fs::create_dir_all(to.join("frames")).map_err(failed)?;
    std::fs::copy(from.join("session.toml"), to.join("session.toml")).map_err(failed)?;
    for stored in lines.iter().filter_map(|line| line.stored.as_ref()) {
        let name = FrameId(stored.frame).stored_name();
        if from.join(&name).exists() {
            std::fs::copy(from.join(&name), to.join(&name)).map_err(failed)?;
        }
    }
    let bytes = std::fs::read(from.join("journal.jsonl"))?;
    let whole: Vec<u8> =
        bytes.split_inclusive(|byte| *byte == b'\n').take(lines.len()).flatten().copied().collect();
    std::fs::write(to.join("journal.jsonl"), whole).map_err(failed)?;
    Ok(())
}
