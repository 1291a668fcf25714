//! A result in the formats of other programs.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use anyhow::{Context, bail};
use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};
use serde_json::Value;

use crate::{Announcer, SavedSession, session::source::result_named_by};
use boresight_calibrate::Verdict;
use boresight_files::{Links, Overwrite, TEXT_LIMIT, read_text, save};
use boresight_formats::{
    CalibrationFile, RigFile, corner_table,
    export::{
        CameraFormat, ExportedCamera, ExportedRig, RigFormat, SolvedView, board_csv,
        colmap_cameras_with_sd, mrcal_cameramodel_with_views, views_csv,
    },
    import,
};
use boresight_geometry::{Corner, LensMatrix, frame::ImageSize};
use boresight_guide::session::Session;
use boresight_present::text;
use boresight_run::recording::RigSessionFile;

/// A file format.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// The lens in the format of another program.
    Camera(CameraFormat),
    /// The cameras of a rig in the format of another program.
    Rig(RigFormat),
    /// Everything, in boresight's schema.
    Json,
    /// Each view with numbers, as comma-separated values.
    ViewsCsv,
    /// The corners of the accepted views; needs the session folder.
    Vnl,
}

/// Formats offered for a camera, in order. [`Format::all`] has all.
pub const FORMATS: [Format; 9] = [
    Format::Camera(CameraFormat::OpencvYaml),
    Format::Camera(CameraFormat::RosYaml),
    Format::Camera(CameraFormat::Kalibr),
    Format::Camera(CameraFormat::Colmap),
    Format::Camera(CameraFormat::Mrcal),
    Format::Camera(CameraFormat::Matlab),
    Format::Json,
    Format::ViewsCsv,
    Format::Vnl,
];

/// Formats offered for a camera, or for several if `is_rig`, in order.
pub fn offered(is_rig: bool) -> Vec<Format> {
    match is_rig {
        true => RigFormat::ALL.into_iter().map(Format::Rig).collect(),
        false => FORMATS.into(),
    }
}

impl Format {
    /// Every format.
    pub fn all() -> impl Iterator<Item = Self> {
        let cameras = CameraFormat::ALL.into_iter().map(Self::Camera);
        let rigs = RigFormat::ALL.into_iter().map(Self::Rig);
        cameras.chain(rigs).chain([Self::Json, Self::ViewsCsv, Self::Vnl])
    }

    /// Format by [`code`](Self::code).
    pub fn by_code(code: &str) -> Option<Self> {
        Self::all().find(|format| format.code() == code)
    }

    /// Format by file name: its usual name, or a unique extension.
    pub fn of_file(path: &Path) -> Option<Self> {
        let named = path.file_name()?.to_str()?;
        if let Some(usual) = Self::all().find(|format| format.file() == named) {
            return Some(usual);
        }
        let ending = path.extension()?;
        let mut same = Self::all().filter(|f| Path::new(f.file()).extension() == Some(ending));
        same.next().filter(|_| same.next().is_none())
    }

    /// Short name, for buttons.
    pub fn label(self) -> &'static str {
        match self {
            Self::Camera(format) => format.label(),
            Self::Rig(format) => format.label(),
            Self::Json => "JSON",
            Self::ViewsCsv => "Photos (CSV)",
            Self::Vnl => "Corners (VNL)",
        }
    }

    /// Stable name, for files and programs.
    pub fn code(self) -> &'static str {
        match self {
            Self::Camera(format) => format.code(),
            Self::Rig(format) => format.code(),
            Self::Json => "json",
            Self::ViewsCsv => "views-csv",
            Self::Vnl => "vnl",
        }
    }

    /// Usual file name.
    pub fn file(self) -> &'static str {
        match self {
            Self::Camera(format) => format.file(),
            Self::Rig(format) => format.file(),
            Self::Json => "camera.json",
            Self::ViewsCsv => "views.csv",
            Self::Vnl => "corners.vnl",
        }
    }

    /// Purpose of the format.
    pub fn about(self) -> &'static str {
        match self {
            Self::Camera(format) => format.about(),
            Self::Rig(format) => format.about(),
            Self::Json => "Everything, in boresight's schema",
            Self::ViewsCsv => "The result for each view, as comma-separated values",
            Self::Vnl => {
                "The corners of the accepted views, `filename x y level`; needs the session folder"
            }
        }
    }
}

/// Board that a calibration found bent, stretched or uneven: its lens belongs to these points.
#[derive(Clone, Debug, PartialEq)]
pub struct FoundBoard {
    /// What to know about it, for a person.
    pub note: String,
    /// The points as comma-separated values, for a file beside one that can't say so.
    pub csv: Option<String>,
}

/// An exported result.
#[derive(Clone, Debug)]
pub struct Exported {
    /// The file's text.
    pub text: String,
    /// The board, if the calibration corrected it.
    pub board: Option<FoundBoard>,
    /// True if the calibration must not be used; its findings give the reason.
    pub untrustworthy: bool,
}

/// Reads the calibration in the file `path`, of any supported program, into boresight's schema: as
/// text and parsed. Files of other programs give only the lens, and a finding to say so;
/// `image_size` is for those that don't state the size of the pictures.
///
/// # Errors
///
/// If the file can't be read, is in no known format, or is for pictures of another size.
pub fn read_any(
    path: &Path,
    image_size: Option<ImageSize>,
    announcer: &Announcer,
) -> anyhow::Result<(String, CalibrationFile)> {
    let text = read_text(path, TEXT_LIMIT, Links::Followed)?;
    let imported =
        || import::read_sized(&text, image_size).with_context(|| format!("could not use {path:?}"));
    let tree = serde_json::from_str::<Value>(&text).ok();
    let is_ours =
        |tree: &Value| tree["schema"].as_str().is_some_and(|s| s.starts_with("boresight."));
    if let Some(tree) = tree.filter(is_ours) {
        let file = CalibrationFile::read(&tree);
        let file = file.with_context(|| format!("not a calibration: {path:?}"))?;
        if image_size.is_some() {
            imported()?;
        }
        return Ok((text, file));
    }
    let mut old = imported()?;
    if old.camera_count > 1 {
        announcer.say(&text::first_of_cameras(old.camera_count));
    }
    // Kalibr names a camera by its topic, such as /cam0/image_raw.
    let plain = |source: String| source.trim_matches('/').split('/').next().map(Into::into);
    old.source = old.source.and_then(plain);
    let file = CalibrationFile::of_imported(&old, text::imported(old.format.name()));
    Ok((serde_json::to_string_pretty(&file.to_json()?)?, file))
}

/// Converts the result in `input`, a session folder or a calibration in any readable format, into
/// `format`. Calls the camera `name`; without it, by the name in another program's file, or by the
/// name of the folder or file. `image_size` is for a file that doesn't state it.
///
/// # Errors
///
/// If the result can't be read, or if the format can't hold the lens.
pub fn export(
    input: &Path,
    format: Format,
    name: Option<&str>,
    image_size: Option<ImageSize>,
    announcer: &Announcer,
) -> anyhow::Result<Exported> {
    if format == Format::Vnl {
        let text = corners(input, announcer)?;
        return Ok(Exported { text, board: None, untrustworthy: false });
    }
    let path = result_named_by(input)?;
    if let Some(rig) = rig_in(&path)? {
        let untrustworthy = rig.verdict == Verdict::Untrustworthy.code();
        return Ok(Exported { text: of_rig(&rig, format, name)?, board: None, untrustworthy });
    }
    let (text, file) = read_any(&path, image_size, announcer)?;
    let untrustworthy = file.known_verdict() == Some(Verdict::Untrustworthy);
    let board = found_board(&file, format);
    let stem = input.file_stem().unwrap_or_default().to_string_lossy();
    // A file of another program has no board, and may name its camera.
    let own_name = file.source.as_deref().filter(|_| file.board.is_none()).unwrap_or(&stem);
    let name = name.unwrap_or(own_name);
    if format == Format::Camera(CameraFormat::Mrcal) && input.is_dir() {
        let saved = SavedSession::open(input)?;
        let text = mrcal_with_views(&saved.session, &text, &file, name, announcer)?;
        return Ok(Exported { text, board, untrustworthy });
    }
    let text = export_text(&text, format, Some(name), announcer)?;
    Ok(Exported { text, board, untrustworthy })
}

/// Rig in the file `path`; `None` if it's another file.
fn rig_in(path: &Path) -> anyhow::Result<Option<RigFile>> {
    let text = read_text(path, TEXT_LIMIT, Links::Followed)?;
    let tree = serde_json::from_str::<Value>(&text).ok().filter(RigFile::is_one);
    let read = tree.map(|tree| RigFile::read(&tree)).transpose();
    read.with_context(|| format!("could not use {path:?}"))
}

/// Rig in `format`: all cameras, the two of `NAME,NAME` for a pair, or the lens of the camera
/// `name`.
fn of_rig(rig: &RigFile, format: Format, name: Option<&str>) -> anyhow::Result<String> {
    let all = ExportedRig::of(rig).context("the file has no cameras")?;
    let names: Vec<&str> = rig.cameras.iter().map(|camera| camera.name.as_str()).collect();
    let names = names.join(", ");
    match format {
        Format::Rig(format) => {
            let cannot = || format!("{} can't hold this rig", format.label());
            let Some(name) = name.filter(|_| format.is_of_two()) else {
                return format.write(&all).with_context(cannot);
            };
            let of = name.split_once(',');
            let pair = of.and_then(|(first, second)| all.pair([first.trim(), second.trim()]));
            let pair = pair.with_context(|| {
                format!("--name names two of the cameras {names}, for example --name left,right")
            })?;
            format.write(&pair).with_context(cannot)
        }
        Format::Camera(format) => {
            let camera = name.and_then(|name| all.camera(name)).with_context(|| {
                format!("it's a rig: --name names one of its cameras, {names}, or --format is one of a rig, such as opencv-stereo")
            })?;
            format.write(&camera).with_context(|| cannot_hold(format))
        }
        Format::Json => Ok(serde_json::to_string_pretty(rig)?),
        Format::ViewsCsv | Format::Vnl => bail!("a rig has no {} file", format.code()),
    }
}

/// Board of `file`, if the calibration corrected it, for an export in `format`. `None` for formats
/// without a lens.
pub fn found_board(file: &CalibrationFile, format: Format) -> Option<FoundBoard> {
    let note = text::board_as_found(file.board_off_mm()?);
    let points_mm = file.board.as_ref()?.points_mm.as_ref()?;
    let csv = match format {
        Format::Camera(format) => {
            format.with_comment("", &[]).is_none().then(|| board_csv(points_mm))
        }
        Format::Json => None,
        Format::Rig(_) | Format::ViewsCsv | Format::Vnl => return None,
    };
    Some(FoundBoard { note, csv })
}

/// `written`, the calibration `file` in `format`, with a comment about a board that the calibration
/// corrected, if the format has comments.
fn with_board(written: String, file: Option<&CalibrationFile>, format: CameraFormat) -> String {
    let off_mm = file.and_then(CalibrationFile::board_off_mm);
    let commented =
        off_mm.and_then(|mm| format.with_comment(&written, &[text::board_as_found(mm)]));
    commented.unwrap_or(written)
}

/// Writes the points of a board that the calibration corrected beside the export `out` in a format
/// without comments. Returns the file, if any.
///
/// # Errors
///
/// If the file can't be written.
pub fn save_board(
    out: &Path,
    board: &FoundBoard,
    overwrite: Overwrite,
) -> anyhow::Result<Option<PathBuf>> {
    let Some(csv) = &board.csv else { return Ok(None) };
    let stem = out.file_stem().unwrap_or_default().to_string_lossy();
    let file = out.with_file_name(format!("{stem}-board.csv"));
    save(&file, csv.as_bytes(), overwrite)?;
    Ok(Some(file))
}

/// Converts as [`export`], for a session outside a folder with the calibration file `text`.
///
/// # Errors
///
/// If the format can't hold the lens.
pub fn of_session(
    session: &Session,
    text: &str,
    format: Format,
    name: &str,
    announcer: &Announcer,
) -> anyhow::Result<String> {
    match format {
        Format::Vnl => Ok(corners_of(session)),
        Format::Camera(CameraFormat::Mrcal) => {
            let file = CalibrationFile::read(&serde_json::from_str(text)?)?;
            mrcal_with_views(session, text, &file, name, announcer)
        }
        format => export_text(text, format, Some(name), announcer),
    }
}

/// Calibration in `text`, parsed as `file`, for mrcal, with the corners of the views of `session`:
/// mrcal computes its own uncertainty. Without the corners if the calibration has others.
fn mrcal_with_views(
    session: &Session,
    text: &str,
    file: &CalibrationFile,
    name: &str,
    announcer: &Announcer,
) -> anyhow::Result<String> {
    let taken: BTreeMap<String, &[Corner]> = named_corners(session).collect();
    let solved = file.used().map(|(_, view)| {
        let pose = view.cam_from_board?;
        let [w, x, y, z] = pose.rotation_wxyz;
        let turn = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z));
        let cam_from_board = Isometry3::from_parts(Translation3::from(pose.translation_m), turn);
        Some(SolvedView { name: &view.name, corners: taken.get(&view.name)?, cam_from_board })
    });
    let views: Option<Vec<SolvedView<'_>>> = solved.collect();
    let (exported, _) = camera_of(text, name, announcer)?;
    let board = &session.setup().board;
    let written =
        mrcal_cameramodel_with_views(&exported, board, views.as_deref().unwrap_or_default());
    let written = written.with_context(|| cannot_hold(CameraFormat::Mrcal))?;
    Ok(with_board(written, Some(file), CameraFormat::Mrcal))
}

/// Lens of the result in `input`, read as by [`export`], and true if unusable.
///
/// # Errors
///
/// If the result can't be read.
#[cfg(any(feature = "bags", all(target_os = "linux", feature = "ros2")))]
pub(crate) fn result_of(
    input: &Path,
    announcer: &Announcer,
) -> anyhow::Result<(ExportedCamera<'static>, bool)> {
    let (text, file) = read_any(&result_named_by(input)?, None, announcer)?;
    let untrustworthy = file.known_verdict() == Some(Verdict::Untrustworthy);
    if let Some(off_mm) = file.board_off_mm() {
        announcer.say(&text::board_as_found(off_mm));
    }
    Ok((camera_of(&text, "camera", announcer)?.0, untrustworthy))
}

/// Converts the calibration in `text` into `format`. Calls the camera `name`, or `camera` without a
/// name.
///
/// # Errors
///
/// If the text is no calibration, or if the format can't hold the lens.
pub fn export_text(
    text: &str,
    format: Format,
    name: Option<&str>,
    announcer: &Announcer,
) -> anyhow::Result<String> {
    match format {
        Format::Json => Ok(text.into()),
        Format::ViewsCsv => {
            let file = CalibrationFile::read(&serde_json::from_str(text)?)?;
            if file.views.is_empty() {
                bail!("another program's calibration has no views: name a session folder");
            }
            Ok(views_csv(&file.views))
        }
        Format::Camera(format) => camera(format, text, name.unwrap_or("camera"), announcer),
        Format::Rig(format) => {
            bail!("{} takes several cameras: boresight calibrate --rig", format.label())
        }
        Format::Vnl => bail!("a corner table is written from a session folder"),
    }
}

/// Writes the result of the session in `folder` beside the session, in format `number` of
/// [those offered](offered), under a free name. Returns the file.
///
/// # Errors
///
/// As [`export`], and if the file can't be written.
pub fn beside(folder: &Path, number: usize, announcer: &Announcer) -> anyhow::Result<PathBuf> {
    let formats = offered(RigSessionFile::is_in(folder));
    let format = *formats.get(number).context("there is no such format")?;
    let file = format.file();
    let (stem, ending) = file.split_once('.').unwrap_or((file, ""));
    let out = (2..1000)
        .map(|n| folder.join(format!("{stem}-{n}.{ending}")))
        .fold(folder.join(file), |free, next| if free.exists() { next } else { free });
    let exported = export(folder, format, None, None, announcer)?;
    save(&out, exported.text.as_bytes(), Overwrite::Never)?;
    announcer.say(&format!("Written: {}", out.display()));
    if let Some(board) = &exported.board {
        save_board(&out, board, Overwrite::Never)?;
        announcer.say(&board.note);
    }
    Ok(out)
}

fn camera(
    format: CameraFormat,
    text: &str,
    name: &str,
    announcer: &Announcer,
) -> anyhow::Result<String> {
    let (exported, covariance) = camera_of(text, name, announcer)?;
    let written = match covariance {
        Some(covariance) if format == CameraFormat::Colmap => {
            colmap_cameras_with_sd(&exported, &covariance)
        }
        _ => format.write(&exported).with_context(|| cannot_hold(format))?,
    };
    // Another program's file names no board.
    let file = serde_json::from_str(text).ok().and_then(|tree| CalibrationFile::read(&tree).ok());
    Ok(with_board(written, file.as_ref(), format))
}

fn cannot_hold(format: CameraFormat) -> String {
    format!("{} can't hold this lens", format.label())
}

/// Calibration in `text` of the camera `name`, and the covariance of the parameters, if stated.
fn camera_of<'a>(
    text: &str,
    name: &'a str,
    announcer: &Announcer,
) -> anyhow::Result<(ExportedCamera<'a>, Option<LensMatrix>)> {
    let old = import::read(text).context("could not use the calibration")?;
    if old.focal_varies {
        announcer.say(text::focal_is_a_mean());
    }
    let (camera, image_size) = (old.camera, old.image_size);
    let rms_px = old.rms_px.unwrap_or(0.0);
    Ok((ExportedCamera { name, camera, image_size, rms_px }, old.covariance))
}

/// Corners of the accepted views, from the session's journal.
fn corners(session: &Path, announcer: &Announcer) -> anyhow::Result<String> {
    let saved =
        SavedSession::open(session).context("a corner table is written from a session folder")?;
    saved.announce(announcer);
    Ok(corners_of(&saved.session))
}

/// Corners of the accepted views of `session`.
pub(crate) fn corners_of(session: &Session) -> String {
    let views: Vec<(String, &[Corner])> = named_corners(session).collect();
    corner_table::write(views.iter().map(|(name, corners)| (name.as_str(), Some(*corners))))
}

/// Name and corners of each accepted view, as in the calibration.
fn named_corners(session: &Session) -> impl Iterator<Item = (String, &[Corner])> {
    let taken = session.accepted().iter().zip(session.corners_at_one_instant());
    taken.map(|(taken, corners)| (taken.picture_name(), corners.as_slice()))
}
