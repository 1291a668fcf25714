//! `boresight doctor`.

use std::path::PathBuf;

use clap::Args;

use super::version;
use boresight_app::{
    Exit,
    commands::{
        bundle,
        doctor::{Diagnosis, DoctorFile, verify},
    },
};
use boresight_present::text;
use boresight_run::recording::{Recovered, recover};
use boresight_terminal::{print, say};

/// Check a session for damage, or pack what a bug report needs. Read-only.
///
/// Checks header, journal and pictures, and whether the decisions can be reproduced.
///
/// --bundle packs version, system, cameras and, if you name one, a session without its pictures. It
/// hides names of files, serial numbers, addresses, commands, your home folder and what the
/// certificate states.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Arguments {
    /// The session folder.
    #[arg(required_unless_present = "bundle")]
    session: Option<PathBuf>,
    /// Write what a bug report needs to this new file (tar). The session is only read.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["recover", "json"])]
    bundle: Option<PathBuf>,
    /// Copy everything before the first damage into this new folder.
    #[arg(long, value_name = "NEW", requires = "session")]
    recover: Option<PathBuf>,
    /// Print the result as JSON on stdout.
    #[arg(long)]
    json: bool,
}

const EXAMPLES: &str = "\
Examples:
  boresight doctor sessions/2026-11-21T08-00-00Z
  boresight doctor sessions/2026-11-21T08-00-00Z --recover saved
  boresight doctor sessions/2026-11-21T08-00-00Z --bundle report.tar
  boresight doctor --bundle report.tar";

impl Arguments {
    pub(super) fn run(self) -> anyhow::Result<Exit> {
        if let Some(out) = &self.bundle {
            let files = bundle::write(out, version::LONG, self.session.as_deref())?;
            say(&text::doctor::bundled(out, &files));
            return Ok(Exit::Good);
        }
        // Required without --bundle.
        let session = self.session.unwrap_or_default();
        let found = verify(&session)?;
        if found.cut {
            say(text::replay::CUT);
        }
        let recovered = match &self.recover {
            Some(new) => Some(recover(&session, new)?),
            None => None,
        };
        let Diagnosis { lines, pictures, views, problems, different_decisions, .. } = &found;
        if let (Some(first), true) = (found.first_difference, problems.is_empty()) {
            // The recording is intact all the same.
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
        if let (Some(recovered), Some(new)) = (recovered, &self.recover) {
            let Recovered { lines, lost_pictures } = recovered;
            say(&text::doctor::recovered(lines, lost_pictures, &new.display().to_string()));
            return Ok(Exit::Good);
        }
        if !problems.is_empty() {
            say(&text::doctor::next(found.newer, &session.display().to_string()));
            let count = match problems.len() {
                1 => "1 problem".to_owned(),
                count => format!("{count} problems"),
            };
            say(&format!("boresight: {count} in {session:?}"));
            return Ok(Exit::Failed);
        }
        say("No damage found.");
        Ok(Exit::Good)
    }
}
