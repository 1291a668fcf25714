//! `boresight batch gather`.

use std::{
    collections::BTreeMap,
    io::{BufWriter, Write},
    path::PathBuf,
};

use anyhow::Context;
use clap::Args;

#[cfg(feature = "parquet")]
use crate::batch::gather_parquet as parquet;
use crate::batch::{Change, Changes, Gathered, Store, changes, gather};
use boresight_app::Exit;
use boresight_files::Overwrite;
use boresight_terminal::{harmless, print, say};

/// Put the results of a batch in one table.
///
/// Prints one JSON object a line, sorted by id: the same bytes whatever the number of shards and
/// the order in which they ran. DuckDB, Polars and pandas read it as it is. If a session has no
/// result yet, the exit code is 1.
#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// The folder of results, or s3://BUCKET/PREFIX.
    #[arg(value_name = "OUT")]
    out: PathBuf,
    /// Print which decisions and verdicts differ from the recorded ones instead, and how often.
    #[arg(long)]
    changes: bool,
    /// Write the table to this file as Parquet instead, one column a number.
    #[arg(long, value_name = "FILE.parquet", conflicts_with = "changes")]
    parquet: Option<PathBuf>,
    /// Replace the Parquet file if it's there.
    #[arg(long, requires = "parquet")]
    force: bool,
    /// Print the changes as JSON.
    #[arg(long, requires = "changes")]
    json: bool,
}

impl Arguments {
    pub(super) fn run(self) -> anyhow::Result<Exit> {
        let store = Store::at(&self.out)?;
        let gathered = if self.changes {
            let (changes, gathered) = changes(&store)?;
            if self.json {
                print(&serde_json::to_string(&changes)?)?;
            } else {
                print(table(&changes).trim_end())?;
            }
            gathered
        } else if let Some(file) = &self.parquet {
            let overwrite = if self.force { Overwrite::Allowed } else { Overwrite::Never };
            let gathered = parquet(&store, file, overwrite)?;
            say(&format!("Written: {}", file.display()));
            gathered
        } else {
            let mut out = BufWriter::new(std::io::stdout().lock());
            let gathered = gather(&store, &mut |line| {
                writeln!(out, "{}", harmless(line)).context("could not write to stdout")
            })?;
            out.flush().context("could not write to stdout")?;
            gathered
        };
        let Gathered { rows, failed, missing, named, damaged } = gathered;
        for damage in damaged {
            say(&damage);
        }
        if failed > 0 {
            say(&format!("{failed} of {rows} sessions couldn't be worked on: see their code."));
        }
        if missing == 0 {
            return Ok(Exit::Good);
        }
        let more = missing.saturating_sub(named.len() as u64);
        let more = if more > 0 { format!(", and {more} more") } else { String::new() };
        say(&format!("{missing} sessions have no result: {}{more}", named.join(", ")));
        say("Run the same `boresight batch run` again: only what is missing is worked on.");
        Ok(Exit::Failed)
    }
}

#[cfg(not(feature = "parquet"))]
fn parquet(_: &Store, _: &std::path::Path, _: Overwrite) -> anyhow::Result<Gathered> {
    Err(boresight_app::MissingFeature::PARQUET.into())
}

fn table(changes: &Changes) -> String {
    let Changes { sessions, decisions, different, different_sessions, .. } = changes;
    let mut text = format!(
        "Decisions that differ: {different} of {decisions}, in {different_sessions} of {sessions} sessions\n"
    );
    add(&mut text, &changes.kinds);
    if changes.unknown_kinds > 0 {
        let more = changes.unknown_kinds;
        text += &format!(
            "  {more:>8}  in long sessions, beyond the thousand of each that are looked at\n"
        );
    }
    let count: u64 = changes.verdicts.values().map(|change| change.count).sum();
    text += &format!("Verdicts that differ: {count} of {sessions}\n");
    add(&mut text, &changes.verdicts);
    if !changes.failed.is_empty() {
        let count: u64 = changes.failed.values().map(|change| change.count).sum();
        text += &format!("Sessions that couldn't be worked on: {count}\n");
        add(&mut text, &changes.failed);
    }
    text
}

/// Adds a line for each change, the most frequent first.
fn add(text: &mut String, changes: &BTreeMap<String, Change>) {
    let mut lines: Vec<(&String, &Change)> = changes.iter().collect();
    lines.sort_by_key(|(_, change)| std::cmp::Reverse(change.count));
    for (kind, Change { count, sessions, named }) in lines {
        let more = if *sessions > named.len() as u64 { ", …" } else { "" };
        *text += &format!("  {count:>8}  {kind}  ({sessions}: {}{more})\n", named.join(", "));
    }
}
