//! Findings of `doctor`.

use std::path::Path;

/// Finding of a header that differs from the recorded journal's header.
pub const FOREIGN_HEADER: &str =
    "every decision comes out differently: session.toml doesn't belong to this journal";

/// Finding of lines missing from the journal, as shown by `reason`.
pub fn lines_missing(reason: &str) -> String {
    format!("lines are missing from journal.jsonl: {reason}")
}

/// Finding of more views in the result than in the journal.
pub fn fewer_views(in_result: usize, in_journal: usize) -> String {
    format!("calibration.json has {in_result} views, the journal {in_journal}")
}

/// Action for an unreadable `session`; a session recorded by a newer version isn't damaged.
pub fn next(newer: bool, session: &str) -> String {
    if newer {
        return "Nothing is damaged: use the newer boresight that recorded it.".into();
    }
    format!(
        "To copy the undamaged part into a new session: boresight doctor {session} --recover NEW"
    )
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

/// Problem of decisions that differ under the recorded rules.
pub fn other_decisions(count: usize, first_line: usize) -> String {
    let which = match count {
        1 => format!("the decision at line {first_line} doesn't"),
        _ => format!("{count} decisions, the first at line {first_line}, don't"),
    };
    format!(
        "{which} follow from what was recorded: somebody has changed the journal or its settings. The pictures of the views are as they were"
    )
}

/// Bundle for a bug report, and the omissions.
pub fn bundled(out: &Path, files: &[String]) -> String {
    let out = out.display();
    format!(
        "Written: {out} ({})\nLeft out: pictures, names of files, serial numbers, addresses, commands, the certificate's fields.\nLook through it before you send it: tar -xf {out}",
        files.join(", ")
    )
}
