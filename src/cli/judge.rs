//! `boresight judge`.

use std::path::{Path, PathBuf};

use clap::Args;

use super::{guide, views::views_of};
use boresight_app::{
    Exit, Host, Opening, SavedSession,
    commands::judgement::{Fresh, judgement},
    session::{
        comparison,
        export::{Format, export_text},
        source::is_session,
    },
};
use boresight_calibrate::{AcceptanceGoal, Answer};
use boresight_capture::film_length_mm;
use boresight_files::{Overwrite, entries, may_save, save};
use boresight_formats::{
    JudgementFile,
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
    stop_flag,
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
/// corners, and needs no pictures; of any other file alone, only what it shows is reported. A
/// folder with a calibration and its pictures needs no other name; of a folder of such folders,
/// each is a camera, and a table lists the worst first. With --source, the guide takes the
/// pictures.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Arguments {
    /// Calibrations to judge, then pictures or folders of them, one corner table (.vnl), or one
    /// session folder.
    #[arg(required = true, value_name = "FILE|PICTURES|CORNERS.vnl|SESSION")]
    inputs: Vec<PathBuf>,
    /// Live source of the pictures, as for guide, which takes them in the terminal.
    #[arg(long, value_name = "SOURCE")]
    source: Option<String>,
    #[command(flatten)]
    board: BoardArguments,
    /// Largest acceptable error: "1px" for projection, or "length 800mm at 2m <= 0.5mm" for a
    /// length measured at a distance [default: 0.2 % of the picture's longer side].
    #[arg(long, value_name = "GOAL")]
    accept: Option<AcceptanceGoal>,
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
  boresight judge cameras
  boresight judge ost.yaml --source /dev/video0 --board 9x6 --square 25mm
  boresight judge camera.xml pictures --board 9x6 --accept 1px --out better.xml
  boresight judge old.yaml new.yaml corners.vnl";

/// A calibration with the path of its file.
type Named = (PathBuf, OldCalibration);

/// Answer about a calibration, its error in pixels, and its file.
type Told<'a> = (Answer, Option<f64>, &'a Path);

/// Calibrations of one camera, the first of which a better one may replace, with its pictures.
struct Camera {
    files: Vec<Named>,
    pictures: Vec<PathBuf>,
}

impl Arguments {
    pub(super) fn run(self) -> anyhow::Result<Exit> {
        let mut cameras = self.cameras()?;
        self.may_write(&cameras)?;
        if let Some(source) = &self.source {
            match &mut cameras[..] {
                [camera] if camera.pictures.is_empty() => {
                    camera.pictures.push(self.guided(source)?);
                }
                _ => return Err(wrong("--source takes the pictures: name only calibrations")),
            }
        }
        let several = cameras.len() > 1;
        let mut told = Vec::new();
        for camera in &cameras {
            match self.judged(camera) {
                // Nothing stops the other cameras.
                Err(err) if several => {
                    let path = camera.files[0].0.as_path();
                    say(&format!("{}: CAN'T TELL: {err:#}", path.display()));
                    told.push((Answer::CannotTell, None, path));
                }
                answers => told.extend(answers?),
            }
        }
        let px = |off_px: Option<f64>| off_px.unwrap_or(f64::INFINITY);
        told.sort_by(|a, b| a.0.cmp(&b.0).then(px(a.1).total_cmp(&px(b.1))));
        let worst = told.last().map(|(answer, ..)| *answer);
        if several {
            told.reverse();
        }
        if told.len() > 1 && told.iter().any(|(_, off_px, _)| off_px.is_some()) {
            let nearest = "Nearest to the lens of the pictures first:";
            say(if several { "Worst first:" } else { nearest });
            for (answer, off_px, path) in &told {
                let off = off_px.map_or_else(|| "-".into(), |px| format!("{px:.2} px"));
                say(&format!("  {off:>10}  {:11}  {}", answer.code(), path.display()));
            }
        }
        Ok(match worst {
            Some(Answer::Off) => Exit::Recalibrate,
            Some(Answer::CannotTell) => Exit::NotTrustworthy,
            _ => Exit::Good,
        })
    }

    /// Refuses `--out` and `--report` that can't be written.
    fn may_write(&self, cameras: &[Camera]) -> anyhow::Result<()> {
        let of_one = |count: usize, option: &str| match count {
            1 => Ok(()),
            _ => Err(wrong(&format!("{option} is about one calibration: name one"))),
        };
        if let Some(out) = &self.out {
            of_one(cameras.len(), "--out")?;
            let Camera { files, pictures } = &cameras[0];
            if pictures.is_empty() && self.source.is_none() && files[0].1.corners.is_none() {
                let wanted =
                    "--out needs pictures, or a file with its corners: it writes their lens";
                return Err(wrong(wanted));
            }
            may_save(out, self.overwrite())?;
        }
        #[cfg(not(feature = "report"))]
        if self.report.is_some() {
            return Err(boresight_app::MissingFeature::REPORT.into());
        }
        if let Some(page) = &self.report {
            of_one(cameras.iter().map(|camera| camera.files.len()).sum(), "--report")?;
            may_save(page, self.overwrite())?;
        }
        Ok(())
    }

    /// Answers about the calibrations of one camera, with the error and the file of each.
    fn judged<'a>(&self, camera: &'a Camera) -> anyhow::Result<Vec<Told<'a>>> {
        let Camera { files, pictures } = camera;
        let size = self.image_size.or_else(|| Some(Size(files[0].1.image_size)));
        let shared = if pictures.is_empty() { None } else { Some(self.fresh(pictures, size)?) };
        let params = self.board.config()?.calibration();
        let mut told = Vec::with_capacity(files.len());
        for (number, judged) in files.iter().enumerate() {
            let (path, old) = judged;
            let own = || Fresh::of_own_corners(old, &params, &announcer());
            let own = if shared.is_none() { own() } else { None };
            let fresh = shared.as_ref().or(own.as_ref());
            let (answer, file) = judgement(path, old, fresh, self.accept);
            let by = command(&file, old.format).map_or_else(String::new, |by| format!(" ({by})"));
            say(&format!("{}: {}. {}{by}", path.display(), file.message, file.action));
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
                self.write_better(out, judged, fresh)?;
            }
            told.push((answer, file.off_px, &**path));
        }
        Ok(told)
    }

    /// Folder of a session of the live `source`, whose views the guide takes.
    fn guided(&self, source: &str) -> anyhow::Result<PathBuf> {
        let board_code = self.board.open_to_code()?;
        let opening = Opening { board_code, ..Opening::new(source, self.board.config()?) };
        let host = Host::new(announcer(), stop_flag()?);
        Ok(host.conclude(guide::in_terminal(&host, &opening, None))?.path)
    }

    fn overwrite(&self) -> Overwrite {
        if self.force { Overwrite::Allowed } else { Overwrite::Never }
    }

    /// Cameras among the inputs: one, if its calibrations are named. Without, each named folder
    /// that holds some, with its pictures; or else each folder in those.
    fn cameras(&self) -> anyhow::Result<Vec<Camera>> {
        let (files, pictures): (Vec<PathBuf>, Vec<PathBuf>) =
            self.inputs.iter().cloned().partition(|path| path.is_file() && has_ending(path));
        let read = |path: PathBuf| comparison::read(&path).map(|old| (path, old));
        if !files.is_empty() {
            let files = files.into_iter().map(read).collect::<anyhow::Result<_>>()?;
            return Ok(vec![Camera { files, pictures }]);
        }
        let camera = |folder: &PathBuf| {
            let files = entries(folder).into_iter().filter(|path| has_ending(path));
            let files: Vec<Named> = files.filter_map(|path| read(path).ok()).collect();
            let is_one = !files.is_empty() && !is_session(folder);
            is_one.then(|| Camera { files, pictures: vec![folder.clone()] })
        };
        let mut cameras: Vec<Camera> = pictures.iter().filter_map(camera).collect();
        if cameras.is_empty() {
            let folders = pictures.iter().flat_map(|at| entries(at));
            cameras = folders.filter_map(|folder| camera(&folder)).collect();
        } else if let [one] = &mut cameras[..] {
            // Its pictures may be elsewhere.
            one.pictures = pictures;
        }
        if cameras.is_empty() {
            let wanted = "no calibration among the inputs: name its file before the pictures";
            return Err(wrong(wanted));
        }
        Ok(cameras)
    }

    /// Lens of `pictures`, or of a corner table of pictures of `table_size`. Another board than the
    /// default one is found if the pictures agree on it.
    fn fresh(&self, pictures: &[PathBuf], table_size: Option<Size>) -> anyhow::Result<Fresh> {
        if let [folder] = pictures
            && is_session(folder)
        {
            let saved = SavedSession::open(folder)?;
            saved.announce(&announcer());
            let config = self.board.config_over(&saved.header.config)?;
            return Fresh::of_session(&saved.session, &config, &announcer());
        }
        let given = Given::of_pictures(pictures)?;
        let mut config = self.board.config_for(&given.files)?;
        config.camera.as_stored |= self.as_stored;
        let upright = config.camera.upright();
        let found = |board: &Board| views_of((&given.files, upright), table_size, board, false);
        let mut board = config.board()?;
        let mut views = found(&board)?;
        if let Some(shown) = views.instead
            && !self.board.names_board()?
        {
            say(&format!("The pictures show {shown}: searching for that."));
            config.board = config.board.chosen(shown);
            board = config.board()?;
            views = found(&board)?;
        }
        let exif_mm = given.files.first().and_then(|picture| film_length_mm(picture));
        Ok(Fresh { exif_mm, ..Fresh::of(views, board, &config.calibration(), &announcer()) })
    }

    /// Writes the lens of the pictures, in the format of the name `out` or of the judged file; in
    /// boresight's own to a JSON file if that is none.
    fn write_better(&self, out: &Path, judged: &Named, fresh: &Fresh) -> anyhow::Result<()> {
        let (path, old) = judged;
        if fresh.lens.is_err() {
            say("The pictures give no lens: nothing is written.");
            return Ok(());
        }
        let is_json = |path: &Path| path.extension().is_some_and(|ending| ending == "json");
        let is_own = is_json(out) && !is_json(path);
        let by_kind = || if is_own { Format::Json } else { format_of(old.format, out) };
        let format = Format::of_file(out).unwrap_or_else(by_kind);
        let json = serde_json::to_string_pretty(&fresh.file.to_json()?)?;
        let text = export_text(&json, format, old.source.as_deref(), &announcer())?;
        save(out, text.as_bytes(), self.overwrite())?;
        say(&format!("Written: {} ({})", out.display(), format.label()));
        Ok(())
    }
}

fn wrong(wanted: &str) -> anyhow::Error {
    WrongUsage(wanted.into()).into()
}

/// What does a judgement's action in the terminal.
fn command(judged: &JudgementFile, format: OldFormat) -> Option<&'static str> {
    Some(match (judged.reason.as_deref(), &*judged.answer, format) {
        (Some("NO-PICTURES"), _, OldFormat::Mrcal) => "boresight judge FILE CORNERS.vnl",
        (Some("NO-PICTURES"), _, OldFormat::Kalibr) => "boresight judge FILE --source BAG",
        (Some("NO-PICTURES"), ..) => "boresight judge FILE PICTURES",
        (Some("LENS-IMPOSSIBLE"), ..) => "boresight calibrate PICTURES",
        (None | Some("MISSES-PICTURE"), "off", _) => "--out FILE",
        (None, "cannot-tell", _) => "--accept GOAL",
        _ => return None,
    })
}

fn has_ending(path: &Path) -> bool {
    let is_cameras = path.file_name().is_some_and(|name| name == "cameras.txt");
    let ending = path.extension().map(|ending| ending.to_string_lossy().to_ascii_lowercase());
    is_cameras || ending.is_some_and(|ending| ENDINGS.contains(&&*ending))
}

/// Format to write to `out` for the file of a format that was read.
fn format_of(read: OldFormat, out: &Path) -> Format {
    let ends = |ending: &str| out.extension().is_some_and(|of_out| of_out == ending);
    Format::Camera(match read {
        OldFormat::Own => return Format::Json,
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
    })
}
