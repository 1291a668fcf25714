//! `boresight judge`.

use std::path::{Path, PathBuf};

use anyhow::Context;
use clap::Args;

use super::views::views_of;
use boresight_app::{
    Exit,
    commands::{
        calibration_views::from_session,
        judgement::{Fresh, judgement},
    },
    session::{
        comparison,
        export::{Format, export_text},
        source::is_session,
    },
};
use boresight_calibrate::{Answer, CalibrationParams};
use boresight_files::{Overwrite, entries, may_save, save};
use boresight_formats::{
    export::CameraFormat,
    import::{OldCalibration, OldFormat},
};
use boresight_geometry::boards::Board;
#[cfg(feature = "report")]
use boresight_present::report::judgement_page;
use boresight_terminal::{
    announcer,
    board_args::{BoardArguments, Size},
    print, say,
    stdin::Given,
    usage::WrongUsage,
};

/// Ends of calibration files' names.
const ENDINGS: [&str; 6] = ["yaml", "yml", "xml", "json", "cameramodel", "xmp"];

/// Judge a calibration of any program: is it true, and if not, by how much and why?
///
/// A fresh lens from the same pictures, with its uncertainty, is the evidence: TRUE if the
/// calibration's error is surely within the limit, OFF if it's surely beyond, else CAN'T TELL. Its
/// residuals are shown, and are no evidence: a wrong lens fits its own views, too. The error is the
/// root mean square where the board was, after the best turn of the camera.
///
/// Reads every format that convert reads. A file of OpenCV's sample or PhotonVision brings its
/// corners, and needs no pictures; of any other file alone, only what it shows is reported. A folder
/// with a calibration and its pictures needs no other name.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Arguments {
    /// Calibrations to judge, then pictures or folders of them, one corner table (.vnl), or one
    /// session folder.
    #[arg(required = true, value_name = "FILE|PICTURES|CORNERS.vnl|SESSION")]
    inputs: Vec<PathBuf>,
    #[command(flatten)]
    board: BoardArguments,
    /// Error of projection above which a calibration is off, in pixels [default: 0.2 % of the
    /// picture's longer side].
    #[arg(long, value_name = "PX", value_parser = super::check::pixels)]
    limit: Option<f64>,
    /// Width and height of the corner table's pictures [default: those of the first calibration].
    #[arg(long, value_name = "WxH")]
    image_size: Option<Size>,
    /// Read the pixels as they're stored, not turned as the pictures' EXIF orientation says.
    #[arg(long)]
    as_stored: bool,
    /// Write the lens of the pictures to this file, in the format of its name, or of the judged
    /// file.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Write a page with the difference over the picture to this file (HTML).
    #[arg(long, value_name = "FILE")]
    report: Option<PathBuf>,
    /// Overwrite existing files.
    #[arg(long)]
    force: bool,
    /// Print each judgement as a line of JSON on stdout.
    #[arg(long)]
    json: bool,
}

const EXAMPLES: &str = "\
Examples:
  boresight judge ost.yaml
  boresight judge ost.yaml pictures
  boresight judge out_camera_data.xml
  boresight judge calibrationdata
  boresight judge camera.xml pictures --board 9x6 --limit 1px --out better.xml
  boresight judge old.yaml new.yaml corners.vnl";

/// A calibration with the path of its file.
type Named = (PathBuf, OldCalibration);

impl Arguments {
    pub(super) fn run(self) -> anyhow::Result<Exit> {
        let (judged, pictures) = self.sorted()?;
        if let Some(out) = &self.out {
            if pictures.is_empty() && judged[0].1.corners.is_none() {
                let wanted =
                    "--out needs pictures, or a file with its corners: it writes their lens";
                return Err(WrongUsage(wanted.into()).into());
            }
            may_save(out, self.overwrite())?;
        }
        #[cfg(not(feature = "report"))]
        if self.report.is_some() {
            return Err(boresight_app::MissingFeature::REPORT.into());
        }
        if let Some(page) = &self.report {
            if judged.len() > 1 {
                let wanted = "--report is about one calibration: name one file";
                return Err(WrongUsage(wanted.into()).into());
            }
            may_save(page, self.overwrite())?;
        }
        let size = self.image_size.or_else(|| Some(Size(judged[0].1.image_size)));
        let shared = if pictures.is_empty() { None } else { Some(self.fresh(&pictures, size)?) };
        let params = self.board.config()?.calibration();
        let mut answers = Vec::with_capacity(judged.len());
        for (number, (path, old)) in judged.iter().enumerate() {
            let own = || Fresh::of_own_corners(old, &params, &announcer());
            let own = if shared.is_none() { own() } else { None };
            let fresh = shared.as_ref().or(own.as_ref());
            let (answer, file) = judgement(path, old, fresh, self.limit);
            say(&format!("{}: {}. {}", path.display(), file.message, file.action));
            file.doubts.iter().for_each(|doubt| say(&format!("  {doubt}.")));
            if self.json {
                print(&file.to_json()?.to_string())?;
            }
            #[cfg(feature = "report")]
            if let Some(page) = &self.report {
                let text = judgement_page(&file, fresh.map(|fresh| &fresh.file));
                save(page, text.as_bytes(), self.overwrite())?;
                say(&format!("Report: {}", page.display()));
            }
            if let (Some(out), Some(fresh), 0) = (&self.out, fresh, number) {
                self.write_better(out, old, fresh)?;
            }
            answers.push((answer, file.off_px, path));
        }
        if answers.len() > 1 && shared.is_some() {
            answers.sort_by(|a, b| {
                let off = |off_px: Option<f64>| off_px.unwrap_or(f64::INFINITY);
                off(a.1).total_cmp(&off(b.1))
            });
            say("Nearest to the lens of the pictures first:");
            for (_, off_px, path) in &answers {
                let off = off_px.map_or_else(|| "none".into(), |px| format!("{px:.2} px"));
                say(&format!("  {off:>10}  {}", path.display()));
            }
        }
        let has = |wanted: Answer| answers.iter().any(|(answer, ..)| *answer == wanted);
        Ok(match (has(Answer::Off), has(Answer::CannotTell)) {
            (true, _) => Exit::Recalibrate,
            (false, true) => Exit::NotTrustworthy,
            (false, false) => Exit::Good,
        })
    }

    fn overwrite(&self) -> Overwrite {
        if self.force { Overwrite::Allowed } else { Overwrite::Never }
    }

    /// Calibrations and pictures among the inputs. Without a calibration by name, those in the
    /// named folders.
    fn sorted(&self) -> anyhow::Result<(Vec<Named>, Vec<PathBuf>)> {
        let (files, pictures): (Vec<PathBuf>, Vec<PathBuf>) =
            self.inputs.iter().cloned().partition(|path| path.is_file() && has_ending(path));
        let read = |path: PathBuf| comparison::read(&path).map(|old| (path, old));
        let judged: Vec<Named> = if files.is_empty() {
            let inside = pictures.iter().filter(|path| path.is_dir() && !is_session(path));
            let files = inside.flat_map(|folder| entries(folder)).filter(|path| has_ending(path));
            files.filter_map(|path| read(path).ok()).collect()
        } else {
            files.into_iter().map(read).collect::<anyhow::Result<_>>()?
        };
        if judged.is_empty() {
            let wanted = "no calibration among the inputs: name its file before the pictures";
            return Err(WrongUsage(wanted.into()).into());
        }
        Ok((judged, pictures))
    }

    /// Lens of `pictures`, or of a corner table of pictures of `table_size`. Another board than the
    /// default one is found if the pictures agree on it.
    fn fresh(&self, pictures: &[PathBuf], table_size: Option<Size>) -> anyhow::Result<Fresh> {
        let of_session = match pictures {
            [folder] if is_session(folder) => Some(from_session(folder, &announcer())?),
            _ => None,
        };
        let given = Given::of_pictures(pictures)?;
        let mut config = match &of_session {
            Some(taken) => self.board.config_over(&taken.saved.header.config)?,
            None => self.board.config_for(&given.files)?,
        };
        config.camera.as_stored |= self.as_stored;
        let mut noise_floor_px = None;
        let upright = config.camera.upright();
        let found = |board: &Board| views_of((&given.files, upright), table_size, board, false);
        let mut board = config.board()?;
        let mut views = match of_session {
            Some(taken) => {
                noise_floor_px = taken.noise_floor_px;
                taken.views
            }
            None => found(&board)?,
        };
        if let Some(shown) = views.instead
            && !self.board.names_board()?
        {
            say(&format!("The pictures show {shown}: searching for that."));
            config.board = config.board.chosen(shown);
            board = config.board()?;
            views = found(&board)?;
        }
        let params = CalibrationParams { noise_floor_px, ..config.calibration() };
        Ok(Fresh::of(views, board, &params, &announcer()))
    }

    /// Writes the lens of the pictures, in the format of the name `out` or of `old`.
    fn write_better(&self, out: &Path, old: &OldCalibration, fresh: &Fresh) -> anyhow::Result<()> {
        if fresh.lens.is_err() {
            say("The pictures give no lens: nothing is written.");
            return Ok(());
        }
        let format =
            Format::of_file(out).or_else(|| format_of(old.format, out)).with_context(|| {
                format!("the name {out:?} doesn't tell its format: use a usual name of it")
            })?;
        let json = serde_json::to_string_pretty(&fresh.file.to_json()?)?;
        let text = export_text(&json, format, old.source.as_deref(), &announcer())?;
        save(out, text.as_bytes(), self.overwrite())?;
        say(&format!("Written: {} ({})", out.display(), format.label()));
        Ok(())
    }
}

fn has_ending(path: &Path) -> bool {
    let is_cameras = path.file_name().is_some_and(|name| name == "cameras.txt");
    let ending = path.extension().map(|ending| ending.to_string_lossy().to_ascii_lowercase());
    is_cameras || ending.is_some_and(|ending| ENDINGS.contains(&&*ending))
}

/// Format to write for the file of a format that was read.
fn format_of(read: OldFormat, out: &Path) -> Option<Format> {
    let ends = |ending: &str| out.extension().is_some_and(|of_out| of_out == ending);
    Some(Format::Camera(match read {
        OldFormat::Own => return Some(Format::Json),
        OldFormat::OpenCv if ends("xml") => CameraFormat::OpencvXml,
        OldFormat::OpenCv if ends("json") => CameraFormat::OpencvJson,
        OldFormat::OpenCv => CameraFormat::OpencvYaml,
        OldFormat::Ros => CameraFormat::RosYaml,
        OldFormat::Kalibr => CameraFormat::Kalibr,
        OldFormat::Mrcal => CameraFormat::Mrcal,
        OldFormat::Colmap => CameraFormat::Colmap,
        OldFormat::OrbSlam3 => CameraFormat::OrbSlam3,
        OldFormat::Nerf => CameraFormat::Nerf,
        OldFormat::Metashape => CameraFormat::Metashape,
        OldFormat::Realitycapture => CameraFormat::Realitycapture,
        OldFormat::Basalt => CameraFormat::Basalt,
        OldFormat::Vins => CameraFormat::Vins,
        OldFormat::Photonvision => CameraFormat::Photonvision,
        OldFormat::Gyroflow => CameraFormat::Gyroflow,
        OldFormat::Open3d => CameraFormat::Open3d,
    }))
}
