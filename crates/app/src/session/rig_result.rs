//! Result of several cameras: announced, and written.

use std::path::Path;

use image::GrayImage;

use super::verdict::Exit;
use crate::{Announcer, cores};
use boresight_calibrate::{CalibrationParams, RigViews, Verdict, calibrate_rig};
use boresight_files::{Overwrite, save};
use boresight_formats::{FindingEntry, RigFile};
use boresight_present::{grade::Grade, text::rig as words};
use boresight_run::config::Config;
#[cfg(feature = "report")]
use {
    super::certificate::{Circumstances, certificate},
    boresight_present::report::{Certificate, RowPictures, rig_page},
};

/// Result of several cameras.
#[derive(Clone, Debug)]
pub struct RigEnded {
    /// Exit code of the program.
    pub exit: Exit,
    /// Grade; `None` without a rig.
    pub grade: Option<Grade>,
    /// Verdict, findings, numbers and written files, in words.
    pub lines: Vec<String>,
    /// `boresight.rig/1`; `None` if the session failed.
    pub file: Option<RigFile>,
    /// Text of the file; empty if the session failed.
    pub json: String,
}

/// Picture of a camera, by name, at the instant with a number.
pub type PictureOf<'a> = &'a dyn Fn(&str, u64) -> Option<GrayImage>;

/// Files to write a rig to.
#[derive(Clone, Copy)]
pub struct RigFiles<'a> {
    /// The rig.
    pub out: Option<&'a Path>,
    /// Page about the rig; never written by a build without reports.
    pub report: Option<&'a Path>,
    /// Pictures for the page.
    pub picture: PictureOf<'a>,
    /// True if they are rendered.
    pub is_simulated: bool,
    /// What to do with files that exist.
    pub overwrite: Overwrite,
}

/// Calibrates the cameras `names` with their views, announces the result, and writes it.
///
/// # Errors
///
/// If the board is none, or a file can't be written.
pub fn conclude_rig(
    names: &[String],
    cameras: &[RigViews],
    config: &Config,
    RigFiles { out, report, picture, is_simulated, overwrite }: RigFiles<'_>,
    announcer: &Announcer,
) -> anyhow::Result<RigEnded> {
    let board = config.board()?;
    let params = CalibrationParams { threads: cores(), ..config.calibration() };
    let found = calibrate_rig(cameras, &board, &params);
    let file = RigFile {
        simulated: is_simulated,
        ..RigFile::of(found.as_ref(), names, &board, &params, words::RIG_WORDS)
    };
    let mut lines: Vec<String> = found.iter().map(|_| words::verdict(&file)).collect();
    for FindingEntry { code, message, action, .. } in &file.findings {
        lines.push(format!("  {code}: {message}. {action}"));
    }
    if let Ok(rig) = &found {
        for ((name, lens), of) in names.iter().zip(&rig.rig.cameras).zip(&rig.cameras) {
            lines.push(words::camera(name, lens, of));
        }
        // Where the pictures contradict each other, no number between cameras is a fact.
        let is_known = rig.verdict != Verdict::Untrustworthy || rig.is_unfinished();
        for pair in rig.pairs.iter().filter(|_| is_known) {
            lines.push(words::pair(pair, names, params.board_scale_sd));
        }
    }
    for line in &lines {
        announcer.say(line);
    }
    let json = serde_json::to_string_pretty(&file)?;
    let mut written = Vec::new();
    if let Some(path) = out {
        save(path, json.as_bytes(), overwrite)?;
        written.push(format!("Written: {}", path.display()));
    }
    #[cfg(feature = "report")]
    if let Some(path) = report {
        let (made, known) = (Some(jiff::Timestamp::now()), out.map(|out| (out, json.as_bytes())));
        let mut notes = Vec::new();
        let known = Circumstances { made, file: known, ..Circumstances::default() };
        let certificate = certificate(&config.certificate, known, &mut notes);
        written.push(write_rig_page(&file, picture, &certificate, (path, overwrite))?);
        written.extend(notes);
    }
    #[cfg(not(feature = "report"))]
    let _ = (report, picture);
    for line in written {
        announcer.say(&line);
        lines.push(line);
    }
    let is_usable = found.as_ref().is_ok_and(|rig| rig.verdict != Verdict::Untrustworthy);
    let exit = if is_usable { Exit::Good } else { Exit::NotTrustworthy };
    let grade = found.is_ok().then(|| Grade::of_rig(&file));
    Ok(RigEnded { exit, grade, lines, file: Some(file), json })
}

/// Writes the page about `rig`, with `certificate` as its first sheet, to a path; the news of it.
///
/// # Errors
///
/// If the file can't be written.
#[cfg(feature = "report")]
pub fn write_rig_page(
    rig: &RigFile,
    picture: PictureOf<'_>,
    certificate: &Certificate,
    (path, overwrite): (&Path, Overwrite),
) -> anyhow::Result<String> {
    let names: Vec<&str> = rig.cameras.iter().map(|camera| camera.name.as_str()).collect();
    let rows = RowPictures::of(rig, picture);
    let page = rig_page(&names.join(", "), rig, rows.as_ref(), certificate);
    save(path, page.as_bytes(), overwrite)?;
    Ok(format!("Report: {}", path.display()))
}
