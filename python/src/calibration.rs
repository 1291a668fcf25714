//! Corners to lenses, and calibration files.

use std::path::{Path, PathBuf};

use boresight::{
    app::{
        Announcer, RESULT_FILE, SavedSession,
        commands::{
            calibration_views::{
                CalibrationViews, GivenView, SessionViews, from_pictures, from_session,
            },
            judgement::{Fresh, judgement},
        },
        session::{
            comparison,
            export::{Format, export as export_result, export_text, found_board, read_any},
        },
    },
    calibration::{
        CalibrationParams, NotAGoal, OldLens, drift,
        files::CalibrationFile,
        import::{self, OldCalibration},
    },
    config::Config,
    files::{Overwrite, save},
    frame::ImageSize,
    geometry::{LensParameter, LensValues, boards::BoardChoice},
};
use pyo3::prelude::*;
use serde_json::json;

use crate::{
    error::{raised, wrong},
    picture::{Named, View, board, choice, corners},
};

/// Board and settings of a calibration.
pub(crate) fn config(named: &Named, settings: &[String]) -> PyResult<Config> {
    // The same error for a wrong board wherever it's named.
    board(named)?;
    checked(choice(named)?, named.2, settings).map_err(|err| raised(&err))
}

fn checked(board: BoardChoice, square_mm: f64, settings: &[String]) -> anyhow::Result<Config> {
    let mut config = Config::load(None, settings)?;
    config.board = config.board.chosen(board);
    config.board.square_mm = square_mm;
    config.check()?;
    Ok(config)
}

fn calibrated(
    mut views: CalibrationViews,
    config: &Config,
    noise_floor_px: Option<f64>,
    session: Option<&SavedSession>,
) -> anyhow::Result<String> {
    let board = config.board()?;
    let params = CalibrationParams { noise_floor_px, ..config.calibration() };
    let (_, file) = views.calibrated_with_file(&board, &params, session, &Announcer::silent());
    Ok(file.to_json()?.to_string())
}

/// Calibrates from picture files, as `boresight calibrate`. Returns `boresight.calibration/1`.
#[pyfunction]
pub(crate) fn calibrate_files(
    py: Python<'_>,
    files: Vec<PathBuf>,
    board: Named,
    settings: Vec<String>,
) -> PyResult<String> {
    let config = config(&board, &settings)?;
    let work = || {
        let board = config.board()?;
        let pictures = (files.as_slice(), config.camera.upright());
        let views = from_pictures(pictures, &board, false, &Announcer::silent(), || ())?;
        calibrated(views, &config, None, None)
    };
    py.detach(work).map_err(|err| raised(&err))
}

/// Calibrates from the corners in a session's journal, as `boresight calibrate SESSION`.
#[pyfunction]
pub(crate) fn calibrate_session(
    py: Python<'_>,
    session: PathBuf,
    settings: Vec<String>,
) -> PyResult<String> {
    let work = || {
        let SessionViews { views, noise_floor_px, saved } =
            from_session(&session, &Announcer::silent())?;
        let config = saved.header.config.with(&settings)?;
        calibrated(views, &config, noise_floor_px, Some(&saved))
    };
    py.detach(work).map_err(|err| raised(&err))
}

/// A view by its name: corners in the order of the board, or why there are none.
type Given<'py> = (String, Option<View<'py>>, String);

/// Views of a board in pictures of one size.
type OfBoard<'py> = (Vec<Given<'py>>, Named, (u32, u32));

fn views_of(views: Vec<Given<'_>>) -> PyResult<Vec<GivenView>> {
    let read = |(name, view, reason): Given<'_>| {
        Ok((name, view.map(|view| corners(&view)).transpose()?.ok_or(reason)))
    };
    views.into_iter().map(read).collect()
}

fn size((width_px, height_px): (u32, u32)) -> PyResult<ImageSize> {
    if width_px == 0 || height_px == 0 {
        return Err(wrong("image_size needs a width and a height in pixels"));
    }
    Ok(ImageSize { width_px, height_px })
}

/// Calibrates from corners in the order of the board. Returns `boresight.calibration/1`.
#[pyfunction]
pub(crate) fn calibrate_corners(
    py: Python<'_>,
    views: Vec<Given<'_>>,
    board: Named,
    image_size: (u32, u32),
    settings: Vec<String>,
) -> PyResult<String> {
    let config = config(&board, &settings)?;
    let image_size = size(image_size)?;
    let views = views_of(views)?;
    let work = || {
        let board = config.board()?;
        let views = CalibrationViews::of(views, image_size, &board);
        calibrated(views, &config, None, None)
    };
    py.detach(work).map_err(|err| raised(&err))
}

/// Compares views of a board with the calibration `old`, the text of a file named `against`.
/// Returns `boresight.check/1`.
#[pyfunction]
pub(crate) fn check_corners(
    py: Python<'_>,
    views: OfBoard<'_>,
    against: PathBuf,
    old: Option<&str>,
    limit_px: Option<f64>,
) -> PyResult<String> {
    let (views, named, image_size) = views;
    let image_size = size(image_size)?;
    let board = board(&named)?;
    let given = views_of(views)?;
    let work = || {
        let old = older(&against, old)?;
        let corners = CalibrationViews::of(given, image_size, &board).corners;
        let found = if old.focal_varies {
            Err(comparison::NoVerdict::FocalVaries)
        } else {
            let lens = OldLens {
                camera: old.camera,
                covariance: old.covariance,
                outlines: &old.outlines,
                image_size: old.image_size,
            };
            drift(&corners, &board, image_size, &lens, limit_px)
                .map_err(comparison::NoVerdict::NoDrift)
        };
        let (_, action) = comparison::words(&found);
        let file = comparison::check_file(&against, "", &old, &found, &action);
        anyhow::Ok(file.to_json()?.to_string())
    };
    py.detach(work).map_err(|err| raised(&err))
}

/// Judges the calibration `old`, the text of a file named `file`, by the views of a board, else by
/// those of a session, else by the file's own corners. Returns `boresight.judgement/1`.
#[pyfunction]
pub(crate) fn judge(
    py: Python<'_>,
    file: PathBuf,
    old: Option<&str>,
    views: Option<OfBoard<'_>>,
    session: Option<PathBuf>,
    accept: Option<&str>,
) -> PyResult<String> {
    let read =
        |(views, named, of)| Ok::<_, PyErr>((views_of(views)?, config(&named, &[])?, size(of)?));
    let given = views.map(read).transpose()?;
    let goal = accept.map(str::parse).transpose();
    let goal = goal.map_err(|err: NotAGoal| wrong(err.to_string()))?;
    let work = || {
        let (old, silent) = (older(&file, old)?, Announcer::silent());
        let fresh = match (given, session) {
            (Some((views, config, size)), _) => {
                let board = config.board()?;
                let views = CalibrationViews::of(views, size, &board);
                Some(Fresh::of(views, board, &config.calibration(), &silent))
            }
            (None, Some(session)) => {
                let saved = SavedSession::open(&session)?;
                Some(Fresh::of_session(&saved.session, &saved.header.config, &silent)?)
            }
            (None, None) => {
                Fresh::of_own_corners(&old, &Config::load(None, &[])?.calibration(), &silent)
            }
        };
        let (_, file) = judgement(&file, &old, fresh.as_ref(), goal);
        anyhow::Ok(file.to_json()?.to_string())
    };
    py.detach(work).map_err(|err| raised(&err))
}

/// An older calibration: its text, or the file that holds it.
pub(crate) fn older(file: &Path, text: Option<&str>) -> anyhow::Result<OldCalibration> {
    match text {
        Some(text) => Ok(import::read(text)?),
        None => comparison::read(file),
    }
}

/// A calibration of this or another program, as `boresight.calibration/1`.
#[pyfunction]
#[pyo3(signature = (file, image_size = None))]
pub(crate) fn load(
    py: Python<'_>,
    file: PathBuf,
    image_size: Option<(u32, u32)>,
) -> PyResult<String> {
    let image_size = image_size.map(size).transpose()?;
    let path = if file.is_dir() { file.join(RESULT_FILE) } else { file };
    let work = || Ok(read_any(&path, image_size, &Announcer::silent())?.0);
    py.detach(work).map_err(|err: anyhow::Error| raised(&err))
}

/// Writes a text as a whole, or not at all.
#[pyfunction]
pub(crate) fn save_text(
    py: Python<'_>,
    file: PathBuf,
    text: &str,
    overwrite: bool,
) -> PyResult<()> {
    let overwrite = if overwrite { Overwrite::Allowed } else { Overwrite::Never };
    let work = || save(&file, text.as_bytes(), overwrite);
    py.detach(work).map_err(|err| raised(&err.into()))
}

/// Reads a calibration of this or another program.
#[pyfunction]
pub(crate) fn read_calibration(py: Python<'_>, file: PathBuf) -> PyResult<String> {
    let work = || {
        let old = comparison::read(&file)?;
        Ok::<_, anyhow::Error>(imported(&old).to_string())
    };
    py.detach(work).map_err(|err| raised(&err))
}

fn imported(old: &OldCalibration) -> serde_json::Value {
    let lens = old.camera.lens_parameters();
    let [fx, fy, cx, cy] = lens.of(LensParameter::F_THEN_PP);
    let coefficients = lens.of(LensParameter::DISTORTION);
    let fisheye = old.camera.distortion.kind.is_fisheye();
    let covariance = old.covariance.map(|matrix| {
        let rows = matrix.row_iter().map(|row| row.iter().copied().collect::<Vec<f64>>());
        rows.collect::<Vec<_>>()
    });
    json!({
        "image_size": [old.image_size.width_px, old.image_size.height_px],
        "f_px": [fx, fy],
        "pp_px": [cx, cy],
        "distortion": coefficients,
        "fisheye": fisheye,
        "covariance": covariance,
        "rms_px": old.rms_px,
        "source": old.source,
        "focal_varies": old.focal_varies,
    })
}

/// A result in another program's format: of a session folder or a calibration file, or of `text`, a
/// calibration. Beside it a note about the board, if the calibration corrected it.
#[pyfunction]
pub(crate) fn export(
    py: Python<'_>,
    input: PathBuf,
    text: Option<&str>,
    format: &str,
    name: Option<&str>,
) -> PyResult<(String, Option<String>)> {
    let Some(known) = Format::by_code(format) else {
        return Err(wrong(format!("there is no format {format:?}")));
    };
    let work = || match text {
        Some(text) => {
            let written = export_text(text, known, name, &Announcer::silent())?;
            let file = serde_json::from_str(text).ok();
            let file = file.and_then(|tree| CalibrationFile::read(&tree).ok());
            let board = file.and_then(|file| found_board(&file, known));
            Ok((written, board.map(|board| board.note)))
        }
        None => {
            let exported = export_result(&input, known, name, None, &Announcer::silent())?;
            Ok((exported.text, exported.board.map(|board| board.note)))
        }
    };
    py.detach(work).map_err(|err| raised(&err))
}

/// Names of the formats of one camera.
#[pyfunction]
pub(crate) fn formats() -> Vec<&'static str> {
    let of_one = |format: &Format| !matches!(format, Format::Rig(_));
    Format::all().filter(of_one).map(Format::code).collect()
}
