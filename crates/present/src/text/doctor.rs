//! Findings of `doctor`.

use std::path::Path;

/// The header differs from the one with which the journal was recorded.
pub const FOREIGN_HEADER: &str =
    "every decision comes out differently: session.toml doesn't belong to this journal";

/// Lines are missing from the journal, as `reason` shows.
pub fn lines_missing(reason: &str) -> String {
    format!("lines are missing from journal.jsonl: {reason}")
}

/// The result has more views than the journal.
pub fn fewer_views(in_result: usize, in_journal: usize) -> String {
    format!("calibration.json has {in_result} views, the journal {in_journal}")
}

/// Report of the copies in a new session.
pub fn recovered(lines: usize, lost_pictures: usize, to: &str) -> String {
    let pictures = match lost_pictures {
        0 => String::new(),
        1 => ". One picture is damaged or missing; its view is kept without it".into(),
        n => format!(". {n} pictures are damaged or missing; their views are kept without them"),
    };
    format!("Recovered {lines} lines into {to}{pictures}")
}

/// Problem of decisions that the rules they were recorded under don't give.
pub fn other_decisions(count: usize, first_line: usize) -> String {
    format!(
        "{count} decisions don't follow from what was recorded, the first at line {first_line}: somebody has changed the journal or its settings. The pictures of the views are as they were"
    )
}

/// The bundle for a bug report, and what isn't in it.
pub fn bundled(out: &Path, files: &[String]) -> String {
    let out = out.display();
    format!(
        "Written: {out} ({})\nLeft out: pictures, names of files, serial numbers, addresses, commands, the certificate's fields.\nLook through it before you send it: tar -xf {out}",
        files.join(", ")
    )
}
