//! `boresight paths`.

use anyhow::Context;
use clap::Args;

use boresight_app::{Exit, commands::paths::paths};
use boresight_present::text::paths as words;
use boresight_terminal::print;

/// Say where sessions, settings and indexes are kept.
///
/// Nothing needs to be there yet. Sessions, the history's index and watched cameras lie below the
/// folder in which you start a command.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Arguments {
    /// Print one JSON object on stdout.
    #[arg(long)]
    json: bool,
}

const EXAMPLES: &str = "\
Examples:
  boresight paths
  boresight paths --json";

impl Arguments {
    pub(super) fn run(self) -> anyhow::Result<Exit> {
        let folder = std::env::current_dir().context("the folder you are in has gone")?;
        let found = paths(&folder);
        if self.json {
            print(&serde_json::to_string(&found)?)?;
            return Ok(Exit::Good);
        }
        let window = found.window.as_deref();
        let rows = [
            (words::SESSIONS, Some(found.sessions.as_path())),
            (words::HISTORY, Some(found.history.as_path())),
            (words::WATCH, Some(found.watch.as_path())),
            (words::WINDOW, window),
        ];
        for (name, path) in rows {
            let path = path.map_or(words::NOWHERE.into(), |path| path.display().to_string());
            print(&format!("{name:<18}{path}"))?;
        }
        Ok(Exit::Good)
    }
}
