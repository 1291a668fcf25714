//! `boresight batch plan`.

use std::{
    io::{BufWriter, Write},
    path::PathBuf,
};

use anyhow::Context;
use clap::Args;

use crate::batch::plan;
use boresight_app::Exit;
use boresight_terminal::{harmless, say};

/// List the sessions and recorded bags in and below folders, one a line, for `batch run`.
///
/// Every folder with a session.toml is listed, damaged ones, too, and every bag (MCAP, .db3). Links
/// aren't followed. The list holds absolute paths: all workers must see the sessions under the same
/// names.
#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// Folders of sessions and bags, or one of them; in an object store: s3://BUCKET/PREFIX.
    #[arg(required = true, value_name = "ROOT")]
    roots: Vec<PathBuf>,
}

impl Arguments {
    pub(super) fn run(self) -> anyhow::Result<Exit> {
        let mut out = BufWriter::new(std::io::stdout().lock());
        let (mut count, mut bytes) = (0_u64, 0_u64);
        let left_out = plan(&self.roots, &mut |item| {
            count += 1;
            bytes = bytes.saturating_add(item.bytes);
            let line = serde_json::to_string(item)?;
            writeln!(out, "{}", harmless(&line)).context("could not write to stdout")
        })?;
        out.flush().context("could not write to stdout")?;
        for folder in &left_out {
            say(&format!("Left out, since its name isn't UTF-8: {folder:?}"));
        }
        if count == 0 {
            say(
                "There is no session and no recorded bag in or below these folders: a session is a folder with a session.toml.",
            );
            return Ok(Exit::Failed);
        }
        say(&format!("{count} sessions and bags of {:.1} MB", bytes as f64 / 1e6));
        Ok(if left_out.is_empty() { Exit::Good } else { Exit::Failed })
    }
}
