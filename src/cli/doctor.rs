//! `boresight doctor`.

use std::path::PathBuf;

use anyhow::bail;
use clap::Args;

use super::terminal::{print, say};
use crate::{
    app::Exit,
    app::doctor::{Diagnosis, DoctorFile, recover, verify},
    text,
};

/// Check a session for damage: header, journal, pictures, and whether the decisions can be reproduced.
/// Read-only.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  boresight doctor sessions/2026-11-21T08-00-00Z")]
pub(super) struct Arguments {
    /// The session folder.
    session: PathBuf,
    /// Copy everything before the first damage into this new folder.
    #[arg(long, value_name = "NEW")]
    recover: Option<PathBuf>,
    /// Print the result as JSON on stdout.
    #[arg(long)]
    json: bool,
}

impl Arguments {
    pub(super) fn run(self) -> anyhow::Result<Exit> {
        let found = verify(&self.session)?;
        if found.cut {
            say(text::replay::CUT);
        }
        if let Some(new) = &self.recover {
            recover(&self.session, new, found.lines)?;
            say(&format!("Recovered {} lines into {}", found.lines, new.display()));
        }
        let Diagnosis { lines, pictures, views, problems, different_decisions, .. } = &found;
        if let Some(first) = found.first_difference {
            // What was recorded is whole all the same.
            say(&format!(
                "{different_decisions} decisions differ, the first at line {first}: normal for a recording by another version. The recorded views are kept."
            ));
        }
        say(&format!("{lines} journal lines, {pictures} pictures, {views} views"));
        for problem in problems {
            say(&format!("  {problem}"));
        }
        if self.json {
            print(&serde_json::to_value(DoctorFile::from(&found))?.to_string())?;
        }
        if !problems.is_empty() {
            if self.recover.is_none() {
                say(&format!(
                    "To copy the undamaged part into a new session: boresight doctor {} --recover NEW",
                    self.session.display()
                ));
            }
            bail!("{} problems in {:?}", problems.len(), self.session);
        }
        say("Whole.");
        Ok(Exit::Good)
    }
}
