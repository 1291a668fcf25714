//! `boresight calibrate`.

use std::path::{Path, PathBuf};

use anyhow::bail;
use clap::Args;
use image::GrayImage;

#[cfg(feature = "report")]
use super::this_command::this_command;
use super::{
    accept_args::AcceptArguments, guide_rig::is_rig, lens_args::LensArguments, rig,
    this_command::with_board, views::views_of,
};
#[cfg(feature = "report")]
use boresight_app::session::{
    certificate::{Circumstances, certificate},
    report::versions,
    session_report,
};
use boresight_app::{
    Exit, announce_result,
    commands::{
        calibration_views::{CalibrationViews, from_session},
        rig::{cameras_in, known_lens, named},
    },
    cores,
    session::{
        rig_result::{RigFiles, conclude_rig},
        rig_run::saved_rig,
        run::say_how_to_leave_out,
        source::{is_recording, is_session},
    },
};
use boresight_calibrate::{CalibrationParams, RigViews};
use boresight_files::{Overwrite, may_save, save};
use boresight_present::text;
#[cfg(feature = "report")]
use boresight_present::{
    cause_picture::CausePicture,
    report::{CameraSection, Provenance, Report, page},
    text::report as words,
};
use boresight_run::config::Config;
use boresight_terminal::{
    announcer,
    board_args::{BoardArguments, Size},
    print, say,
    stdin::Given,
    usage::WrongUsage,
};

/// Calibrate from pictures of the board, a corner table, or the views of a session.
///
/// A corner table has lines `filename x y level` (.vnl), row by row over the board, or is the
/// output of detect --json (.jsonl); it needs --image-size. A session is calibrated from the
/// corners in its journal, with its board and settings.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Arguments {
    /// Pictures (PNG, JPEG, BMP, PGM, PPM, TIFF, WebP) or folders of them, one corner table (.vnl,
    /// .jsonl), or one session folder; - reads a table or a picture from standard input.
    #[arg(required = true, value_name = "IMAGES|CORNERS.vnl|SESSION")]
    inputs: Vec<PathBuf>,
    /// Several cameras that see one board: a folder or corner table each (NAME=PATH names the
    /// camera), one folder of them, or the session of guide --rig. Pictures with the same number
    /// were taken at the same moment.
    #[arg(long, conflicts_with = "varying_focal")]
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

/// Picture of a rig's camera at an instant, and true if it's rendered.
type Pictures = (Box<dyn Fn(&str, u64) -> Option<GrayImage>>, bool);

impl Arguments {
    fn overwrite(&self) -> Overwrite {
        if self.force { Overwrite::Allowed } else { Overwrite::Never }
    }

    /// Views of several cameras, with the settings.
    fn rig_views(&self) -> anyhow::Result<(Vec<String>, Vec<RigViews>, Config, Pictures)> {
        if let [folder] = self.inputs.as_slice()
            && is_rig(folder)
        {
            let saved = saved_rig(folder, &announcer())?;
            let mut config = self.board.config_over(&saved.config)?;
            self.goal.apply(&mut config);
            self.lens.apply(&mut config);
            let (names, views) = (saved.names.clone(), saved.views.clone());
            let is_simulated = saved.is_simulated;
            let pictures = move |name: &str, number| saved.picture(name, number);
            return Ok((names, views, config, (Box::new(pictures), is_simulated)));
        }
        let inputs = cameras_in(&self.inputs)?;
        let mut config = self.board.config_for(&rig::pictures(&inputs))?;
        config.camera.as_stored |= self.as_stored;
        self.goal.apply(&mut config);
        self.lens.apply(&mut config);
        for path in self.out.iter().chain(&self.report) {
            may_save(path, self.overwrite())?;
        }
        let upright = config.camera.upright();
        let files = inputs.clone();
        let pictures = move |name: &str, number| {
            let camera = files.iter().find(|camera| camera.name == name)?;
            camera.picture(number, upright)
        };
        let (names, mut cameras) = rig::views(inputs, upright, self.image_size, &config.board()?)?;
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
        Ok((names, cameras, config, (Box::new(pictures), false)))
    }

    pub(super) fn run(mut self) -> anyhow::Result<Exit> {
        #[cfg(not(feature = "report"))]
        if self.report.is_some() {
            return Err(boresight_app::MissingFeature::REPORT.into());
        }
        if self.rig {
            let (names, cameras, config, (pictures, is_simulated)) = self.rig_views()?;
            let files = RigFiles {
                out: self.out.as_deref(),
                report: self.report.as_deref(),
                picture: &*pictures,
                is_simulated,
                overwrite: self.overwrite(),
            };
            let ended = conclude_rig(&names, &cameras, &config, files, &announcer())?;
            if self.json {
                print(&ended.json)?;
            }
            return Ok(ended.exit);
        }
        let given = Given::of_pictures(&self.inputs)?;
        self.inputs.clone_from(&given.files);
        if let Some(recording) = self.inputs.iter().find(|path| is_recording(path)) {
            bail!(
                "{recording:?} is a recording, whose views are chosen first: boresight guide --headless --source {recording:?}"
            );
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
        let overwrite = self.overwrite();
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
        let params = CalibrationParams { threads: cores(), noise_floor_px, ..config.calibration() };
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
            let number = |place: usize| {
                file.used().nth(place).map_or_else(String::new, |(number, _)| number.to_string())
            };
            let cause = result.as_ref().ok().and_then(|it| CausePicture::of(it, &number));
            let report = Report {
                name: words::files(&folder_name(&self.inputs), self.inputs.len()),
                calibration: file,
                notes,
                certificate,
                camera,
                corners: views.corners,
                pictures: views.pictures,
                cause,
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
