//! `boresight report`.

use std::path::{Component, Path, PathBuf};

use anyhow::{Context, bail};
use clap::Args;
use serde_json::{Value, json};

use super::{Exit, print, say, session_report};
use crate::{
    capture::read_picture,
    frame::ImageSize,
    recording::save::{Overwrite, save},
    report::{CalibrationFile, CameraSection, Provenance, Report, Thumbnail, page},
    text::report as words,
};

/// Write the report of a calibration: one HTML file with everything in it, for any screen and for two
/// sheets of paper.
///
/// Example: boresight report sessions/2026-11-21T08-00-00Z
///
/// A session's report stands in its folder and is made anew each time. A calibration.json from `calibrate`
/// gives a page beside it, with the pictures if they lie beside it, too.
#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// A session folder, or a calibration.json.
    #[arg(value_name = "SESSION|FILE")]
    input: PathBuf,
    /// Where to write it; by default report.html in the session, or the file's name with .html beside it.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Replace the file if it exists.
    #[arg(long)]
    force: bool,
    /// Print where the report is, and the verdict, as JSON on stdout.
    #[arg(long)]
    json: bool,
}

impl Arguments {
    pub(super) fn run(self) -> anyhow::Result<Exit> {
        let session = self.session();
        let report = match &session {
            Some(path) => session_report::of_folder(path)?,
            None => of_file(&self.input)?,
        };
        let own = session.map(|path| session_report::page_path(&path));
        let (path, overwrite) = match (&self.out, own) {
            // The session's own page follows from its journal.
            (None, Some(own)) => (own, Overwrite::Allowed),
            (out, _) => {
                let path = out.clone().unwrap_or_else(|| self.input.with_extension("html"));
                (path, if self.force { Overwrite::Allowed } else { Overwrite::Never })
            }
        };
        save(&path, page(&report).as_bytes(), overwrite)?;
        for note in &report.notes {
            say(note);
        }
        say(words::verdict(&report.facts.verdict));
        say(&format!("Report: {}", path.display()));
        if self.json {
            let page = path.display().to_string();
            let verdict = &report.facts.verdict;
            print(
                &json!({ "schema": "boresight.report/1", "page": page, "verdict": verdict })
                    .to_string(),
            )?;
        }
        Ok(match report.facts.verdict.as_str() {
            "good" | "care" => Exit::Good,
            _ => Exit::NotTrustworthy,
        })
    }

    /// The session, if the input is one, or the result of one.
    fn session(&self) -> Option<PathBuf> {
        if self.input.is_dir() {
            return Some(self.input.clone());
        }
        let is_result = self.input.file_name().is_some_and(|name| name == "calibration.json");
        let folder = self.input.parent()?;
        (is_result && folder.join("session.toml").is_file()).then(|| match folder.as_os_str() {
            here if here.is_empty() => PathBuf::from("."),
            _ => folder.to_path_buf(),
        })
    }
}

/// The report of a calibration file by itself.
fn of_file(path: &Path) -> anyhow::Result<Report> {
    let text = std::fs::read_to_string(path).with_context(|| format!("could not read {path:?}"))?;
    let value: Value = serde_json::from_str(&text)
        .with_context(|| format!("not a calibration that boresight wrote: {path:?}"))?;
    let schema = value["schema"].as_str().unwrap_or_default();
    if schema != CALIBRATION_SCHEMA {
        bail!("its schema is {schema:?}, this version reads {CALIBRATION_SCHEMA:?}: {path:?}");
    }
    let facts = CalibrationFile::read(&value)
        .with_context(|| format!("not a whole calibration: {path:?}"))?;
    let [width_px, height_px] = facts.image_size;
    let folder = path.parent().unwrap_or(Path::new("."));
    let size = ImageSize { width_px, height_px };
    let used = facts.views.iter().filter(|view| view.used);
    let pictures = used.map(|view| picture_beside(folder, &view.name, size)).collect();
    let mut rows = versions(&[]);
    rows.push((words::name::FILE.into(), path.display().to_string()));
    Ok(Report {
        name: path.file_name().unwrap_or_default().to_string_lossy().into_owned(),
        facts,
        notes: Vec::new(),
        camera: CameraSection::default(),
        corners: Vec::new(),
        pictures,
        drift: None,
        refused: Vec::new(),
        provenance: Provenance { rows, command: this_command() },
    })
}

const CALIBRATION_SCHEMA: &str = "boresight.calibration/1";

/// The picture of that name below `folder`, if it is there and of that size. A name that leads out of the
/// folder is none.
pub(super) fn picture_beside(folder: &Path, name: &str, size: ImageSize) -> Option<Thumbnail> {
    let inside = Path::new(name).components().all(|part| matches!(part, Component::Normal(_)));
    let path = folder.join(name);
    if name.is_empty() || !inside || !path.is_file() {
        return None;
    }
    let thumbnail = Thumbnail::of(&read_picture(&path).ok()?)?;
    (thumbnail.full_size() == size).then_some(thumbnail)
}

/// Program and schemas: the calibration's and `more`.
pub(super) fn versions(more: &[&str]) -> Vec<(String, String)> {
    let schemas = [&[CALIBRATION_SCHEMA], more].concat().join(", ");
    vec![
        (words::name::PROGRAM.into(), format!("boresight {}", env!("CARGO_PKG_VERSION"))),
        (words::name::SCHEMAS.into(), schemas),
    ]
}

/// The command line of this run, as a shell reads it.
pub(super) fn this_command() -> String {
    let arguments = std::env::args_os().skip(1);
    let words = arguments.map(|argument| quoted(&argument.to_string_lossy()));
    std::iter::once("boresight".to_owned()).chain(words).collect::<Vec<_>>().join(" ")
}

/// A word as a shell reads it.
pub(super) fn quoted(word: &str) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "_./:=,@%+-".contains(c);
    if !word.is_empty() && word.chars().all(is_plain) {
        word.into()
    } else {
        format!("'{}'", word.replace('\'', r"'\''"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_quoted_where_a_shell_needs_it() {
        assert_eq!(quoted("pictures/0.png"), "pictures/0.png");
        assert_eq!(quoted("my picture.png"), "'my picture.png'");
        assert_eq!(quoted("it's; rm *"), r"'it'\''s; rm *'");
        assert_eq!(quoted(""), "''");
    }
}
