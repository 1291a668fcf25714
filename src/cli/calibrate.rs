//! `boresight calibrate`.

use std::{
    path::{Path, PathBuf},
    thread::available_parallelism,
};

use anyhow::bail;
use clap::Args;

#[cfg(feature = "report")]
use super::this_command::this_command;
use super::{accept_args::AcceptArguments, lens_args::LensArguments, this_command::with_board};
#[cfg(feature = "report")]
use boresight_app::session::{
    certificate::{Circumstances, certificate},
    report::versions,
    session_report,
};
use boresight_app::{
    Exit, announce_result,
    commands::{
        calibration_views::{CalibrationViews, from_pictures, from_session, from_table, is_table},
        rig::{CameraInput, by_number, cameras_in, known_lens, named},
    },
    session::{
        run::say_how_to_leave_out,
        source::{is_recording, is_session},
    },
};
use boresight_calibrate::{CalibrationParams, Verdict, calibrate_rig};
use boresight_capture::Upright;
use boresight_files::{Overwrite, may_save, save};
use boresight_formats::{FindingEntry, RigFile};
use boresight_geometry::boards::Board;
use boresight_present::text::{self, rig as words};
#[cfg(feature = "report")]
use boresight_present::{
    report::{CameraSection, Provenance, Report, page},
    text::report as report_words,
};
use boresight_terminal::{
    announcer,
    board_args::{BoardArguments, Size},
    print,
    progress::{FINDING, Progress},
    say,
    stdin::Given,
    usage::WrongUsage,
};

/// Calibrate from pictures of the board, a corner table, or the views of a session.
///
/// A corner table has lines `filename x y level` (.vnl), row by row over the board, or is the output
/// of detect --json (.jsonl); it needs --image-size. A session is calibrated from the corners in its journal, with its board and
/// settings.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Arguments {
    /// Pictures (PNG, JPEG, BMP, PGM, PPM, TIFF, WebP) or folders of them, one corner table (.vnl,
    /// .jsonl), or one session folder; - reads a table or a picture from standard input.
    #[arg(required = true, value_name = "IMAGES|CORNERS.vnl|SESSION")]
    inputs: Vec<PathBuf>,
    /// Several cameras that see one board: a folder or corner table each (NAME=PATH names the
    /// camera), or one folder of them. Pictures with the same number were taken at the same moment.
    #[arg(long, conflicts_with_all = ["varying_focal", "report"])]
    rig: bool,
    /// Earlier calibration of a rig's camera, whose lens has not been touched since.
    #[arg(long, value_name = "NAME=FILE", requires = "rig")]
    known_lens: Vec<PathBuf>,
    #[command(flatten)]
    board: BoardArguments,
    #[command(flatten)]
    goal: AcceptArguments,
    #[command(flatten)]
    lens: LensArguments,
    /// Width and height of the corner table's pictures.
    #[arg(long, value_name = "WxH")]
    image_size: Option<Size>,
    /// Estimate a separate focal length for each view, for a zoom or autofocus that can't be
    /// locked. The result is the principal point.
    #[arg(long)]
    varying_focal: bool,
    /// Read the pixels as they're stored, not turned as the pictures' EXIF orientation says.
    #[arg(long)]
    as_stored: bool,
    /// Write the result to this file (JSON).
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Write a report to this file (HTML).
    #[arg(long, value_name = "FILE")]
    report: Option<PathBuf>,
    /// Overwrite existing files.
    #[arg(long)]
    force: bool,
    /// Print the result as JSON on stdout.
    #[arg(long)]
    json: bool,
}

const EXAMPLES: &str = "\
Examples:
  boresight calibrate pictures
  boresight calibrate --board 9x6 --square 25mm pictures/*.png
  boresight calibrate --board 9x6 --out camera.json --report camera.html pictures/*.png
  boresight calibrate --board 9x6 --square 25mm --image-size 1280x720 corners.vnl
  boresight calibrate sessions/2026-11-21T08-00-00Z --lens rational
  boresight calibrate --rig left=pictures/left right=pictures/right --out rig.json
  boresight detect pictures/*.png | boresight calibrate - --image-size 1280x720";

impl Arguments {
    pub(super) fn run(mut self) -> anyhow::Result<Exit> {
        if self.rig {
            return self.run_rig();
        }
        let given = Given::of_pictures(&self.inputs)?;
        self.inputs.clone_from(&given.files);
        if let Some(recording) = self.inputs.iter().find(|path| is_recording(path)) {
            bail!(
                "{recording:?} is a recording, whose views are chosen first: boresight guide --headless --source {recording:?}"
            );
        }
        #[cfg(not(feature = "report"))]
        if self.report.is_some() {
            return Err(boresight_app::MissingFeature::REPORT.into());
        }
        let of_session = match self.inputs.as_slice() {
            [folder] if is_session(folder) => Some(from_session(folder, &announcer())?),
            _ => None,
        };
        let mut config = match &of_session {
            Some(taken) => {
                let mut recorded = taken.saved.header.config.clone();
                let foreign_logo = recorded.certificate.take_foreign_logo();
                let config = self.board.config_over(&recorded)?;
                let is_left_out = self.report.is_some() && config.certificate.logo.is_empty();
                if let Some(logo) = foreign_logo.filter(|_| is_left_out) {
                    say(&text::certificate::logo_of_session(&logo));
                }
                config
            }
            None => self.board.config_for(&self.inputs)?,
        };
        config.camera.as_stored |= self.as_stored;
        self.goal.apply(&mut config);
        config.calibration.varying_focal |= self.varying_focal;
        self.lens.apply(&mut config);
        let board = config.board()?;
        let overwrite = if self.force { Overwrite::Allowed } else { Overwrite::Never };
        for path in self.out.iter().chain(&self.report) {
            may_save(path, overwrite)?;
        }
        if self.out.is_some() && self.out == self.report {
            bail!("--out and --report name the same file: give each its own");
        }
        let mut noise_floor_px = None;
        let mut session = None;
        let mut views = match of_session {
            Some(taken) => {
                noise_floor_px = taken.noise_floor_px;
                session = Some(taken.saved);
                taken.views
            }
            None => {
                let upright = config.camera.upright();
                views_of((&self.inputs, upright), self.image_size, &board, self.report.is_some())?
            }
        };
        let threads = available_parallelism().map_or(1, usize::from);
        let params = CalibrationParams { threads, noise_floor_px, ..config.calibration() };
        let (result, file) =
            views.calibrated_with_file(&board, &params, session.as_ref(), &announcer());
        if let Some(session) = session_of_pictures(&self.inputs, &views) {
            say(&format!(
                "These are a session's pictures. It knows the corners of boards that were cut off, too: boresight calibrate {}",
                session.display()
            ));
        }
        if let Some(choice) = views.instead {
            say(&text::agreed(&with_board(choice)));
        }
        let exit = announce_result(result.as_ref(), &file, &announcer());
        if let (Some(saved), [folder]) = (&session, self.inputs.as_slice()) {
            say_how_to_leave_out(folder, &saved.header, result.as_ref().ok(), &announcer());
        }
        let json = serde_json::to_string_pretty(&file.to_json()?)?;
        if let Some(path) = &self.out {
            save(path, json.as_bytes(), overwrite)?;
            say(&format!("Written: {}", path.display()));
        }
        #[cfg(feature = "report")]
        if let Some(path) = &self.report {
            let mut notes = Vec::new();
            let (camera, taken_with) = match &session {
                Some(saved) => {
                    let camera = session_report::camera_of(saved)?;
                    (camera, session_report::taken_with(&saved.header, &saved.session))
                }
                None => (CameraSection::default(), Circumstances::default()),
            };
            let known = Circumstances {
                made: Some(jiff::Timestamp::now()),
                file: self.out.as_deref().map(|path| (path, json.as_bytes())),
                ..taken_with
            };
            let certificate = Some(certificate(&config.certificate, known, &mut notes));
            let report = Report {
                name: report_words::files(&folder_name(&self.inputs), self.inputs.len()),
                calibration: file,
                notes,
                certificate,
                typical_goal_px: None,
                camera,
                corners: views.corners,
                pictures: views.pictures,
                check: None,
                refused: Vec::new(),
                provenance: Provenance { rows: versions(&[]), command: this_command() },
            };
            save(path, page(&report).as_bytes(), overwrite)?;
            for note in &report.notes {
                say(note);
            }
            say(&format!("Report: {}", path.display()));
        }
        if self.json {
            print(&json)?;
        }
        Ok(exit)
    }
}

impl Arguments {
    /// Calibrates several cameras.
    fn run_rig(&self) -> anyhow::Result<Exit> {
        let inputs = cameras_in(&self.inputs)?;
        let pictures = inputs.iter().flat_map(|camera| &camera.files);
        let pictures: Vec<PathBuf> = pictures.filter(|path| !is_table(path)).cloned().collect();
        let mut config = self.board.config_for(&pictures)?;
        config.camera.as_stored |= self.as_stored;
        self.goal.apply(&mut config);
        self.lens.apply(&mut config);
        let board = config.board()?;
        let overwrite = if self.force { Overwrite::Allowed } else { Overwrite::Never };
        if let Some(path) = &self.out {
            may_save(path, overwrite)?;
        }
        let upright = config.camera.upright();
        let mut cameras = Vec::with_capacity(inputs.len());
        for CameraInput { name, files } in &inputs {
            let views = views_of((files, upright), self.image_size, &board, false)?;
            cameras.push(by_number(name, views)?);
        }
        let names: Vec<String> = inputs.into_iter().map(|camera| camera.name).collect();
        for known in &self.known_lens {
            let (Some(name), path) = named(known) else {
                return Err(WrongUsage("--known-lens takes NAME=FILE".into()).into());
            };
            let Some(camera) = names.iter().position(|other| *other == name) else {
                let usage = format!("--known-lens: no camera is called {name:?}");
                return Err(WrongUsage(usage).into());
            };
            cameras[camera].known_lens = Some(known_lens(&path)?);
        }
        let threads = available_parallelism().map_or(1, usize::from);
        let params = CalibrationParams { threads, ..config.calibration() };
        let found = calibrate_rig(&cameras, &board, &params);
        let file = RigFile::of(found.as_ref(), &names, &board, words::RIG_WORDS);
        if let Ok(rig) = &found {
            say(&words::verdict(rig));
        }
        for FindingEntry { code, message, action, .. } in &file.findings {
            say(&format!("  {code}: {message}. {action}"));
        }
        if let Ok(rig) = &found {
            for ((name, lens), of) in names.iter().zip(&rig.rig.cameras).zip(&rig.cameras) {
                say(&words::camera(name, lens, of));
            }
            // Where the pictures contradict each other, no number between cameras is a fact.
            let is_told = rig.verdict != Verdict::Untrustworthy || rig.is_unfinished();
            for pair in rig.pairs.iter().filter(|_| is_told) {
                say(&words::pair(pair, &names, params.board_scale_sd));
            }
        }
        let json = serde_json::to_string_pretty(&file)?;
        if let Some(path) = &self.out {
            save(path, json.as_bytes(), overwrite)?;
            say(&format!("Written: {}", path.display()));
        }
        if self.json {
            print(&json)?;
        }
        let is_usable = found.is_ok_and(|rig| rig.verdict != Verdict::Untrustworthy);
        Ok(if is_usable { Exit::Good } else { Exit::NotTrustworthy })
    }
}

/// Views of pictures, or of one corner table of pictures of `image_size`.
pub(super) fn views_of(
    (inputs, upright): (&[PathBuf], Upright),
    image_size: Option<Size>,
    board: &Board,
    with_thumbnails: bool,
) -> anyhow::Result<CalibrationViews> {
    match inputs {
        [table] if is_table(table) => {
            let Size(image_size) = image_size.ok_or_else(|| {
                let wanted = "a corner table needs --image-size WxH, the size of its pictures";
                WrongUsage(wanted.into())
            })?;
            from_table(table, image_size, board, with_thumbnails)
        }
        inputs if inputs.iter().any(|path| is_table(path)) => {
            bail!("give pictures, or one corner table, not both")
        }
        inputs => {
            let progress = Progress::new(FINDING, inputs.len());
            let step = || progress.step();
            let views =
                from_pictures((inputs, upright), board, with_thumbnails, &announcer(), step)?;
            progress.finish();
            Ok(views)
        }
    }
}

/// Session of the stored pictures, if some couldn't be used.
fn session_of_pictures<'a>(inputs: &'a [PathBuf], views: &CalibrationViews) -> Option<&'a Path> {
    let session = inputs.first()?.parent()?.parent()?;
    (is_session(session) && views.names.iter().any(|view| view.reason.is_some())).then_some(session)
}

/// Folder name of the first input.
#[cfg(feature = "report")]
fn folder_name(inputs: &[PathBuf]) -> String {
    let first = inputs.first().map(|path| std::path::absolute(path).unwrap_or(path.clone()));
    let folder = first.as_deref().and_then(Path::parent).and_then(Path::file_name);
    folder.unwrap_or_default().to_string_lossy().into_owned()
}
