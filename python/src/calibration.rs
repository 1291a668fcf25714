//! Corners to lenses, and calibration files.

use std::path::{Path, PathBuf};

use anyhow::Context;
use boresight::{
    app::{
        Announcer,
        calibration_views::from_pictures,
        comparison,
        export::{FORMATS, export as export_result},
    },
    calibration::{
        OldLens, calibrate, drift,
        files::{CalibrationFile, ViewName},
        import::OldCalibration,
    },
    config::Config,
    frame::ImageSize,
    geometry::{Corner, LensParameter, LensValues},
    markers::MarkerChoice,
    text,
};
use pyo3::prelude::*;
use serde_json::json;

use crate::{
    error::{raised, warn, wrong},
    picture::{Named, View, board, corners, markers},
};

/// Board and settings of a calibration. Warns of settings that aren't used any more.
pub(crate) fn config(py: Python<'_>, named: &Named, settings: &[String]) -> PyResult<Config> {
    let markers = markers(named)?;
    let (config, notes) = checked(named, markers, settings).map_err(|err| raised(&err))?;
    warn(py, &notes)?;
    Ok(config)
}

fn checked(
    (columns, rows, square_mm, ..): &Named,
    markers: Option<MarkerChoice>,
    settings: &[String],
) -> anyhow::Result<(Config, Vec<String>)> {
    let (mut config, notes) = Config::load_with_notes(None, settings)?;
    config.board = config.board.chosen([*columns, *rows], markers);
    config.board.square_mm = *square_mm;
    config.check()?;
    Ok((config, notes))
}

fn file_text(file: &CalibrationFile) -> anyhow::Result<String> {
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
    let config = config(py, &board, &settings)?;
    let work = || {
        let board = config.board()?;
        let views = from_pictures(&files, &board, false, &Announcer::silent(), || ())?;
        let result = calibrate(&views.corners, &board, views.image_size, &config.calibration());
        let result = result.as_ref();
        let words = text::FINDING_WORDS;
        file_text(&CalibrationFile::of(result, views.image_size, &board, &views.names, words))
    };
    py.detach(work).map_err(|err| raised(&err))
}

fn views_of(views: &[View<'_>]) -> PyResult<Vec<Vec<Corner>>> {
    views.iter().map(corners).collect()
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
    views: Vec<View<'_>>,
    names: Vec<String>,
    board: Named,
    image_size: (u32, u32),
    settings: Vec<String>,
) -> PyResult<String> {
    let config = config(py, &board, &settings)?;
    let image_size = size(image_size)?;
    let corners = views_of(&views)?;
    let work = || {
        let board = config.board()?;
        anyhow::ensure!(
            corners.iter().all(|view| view.len() == board.corner_count()),
            "each view needs the board's {} corners, row by row",
            board.corner_count()
        );
        let names: Vec<ViewName> =
            names.into_iter().map(|name| ViewName { name, reason: None }).collect();
        let result = calibrate(&corners, &board, image_size, &config.calibration());
        let words = text::FINDING_WORDS;
        file_text(&CalibrationFile::of(result.as_ref(), image_size, &board, &names, words))
    };
    py.detach(work).map_err(|err| raised(&err))
}

/// Compares corners with the calibration in a file. Returns `boresight.check/1`.
#[pyfunction]
pub(crate) fn check_corners(
    py: Python<'_>,
    views: Vec<View<'_>>,
    against: PathBuf,
    named: Named,
    image_size: (u32, u32),
) -> PyResult<String> {
    let image_size = size(image_size)?;
    let board = board(&named)?;
    let corners = views_of(&views)?;
    let work = || {
        let old = comparison::read(&against)?;
        let found = if old.focal_varies {
            Err(comparison::NoVerdict::FocalVaries)
        } else {
            let lens = OldLens {
                camera: old.camera,
                covariance: old.covariance,
                outlines: &old.outlines,
                image_size: old.image_size,
            };
            drift(&corners, &board, image_size, &lens).map_err(comparison::NoVerdict::NoDrift)
        };
        let (_, action) = comparison::words(&found);
        let file = comparison::check_file(&against, "", &old, &found, action);
        anyhow::Ok(file.to_json()?.to_string())
    };
    py.detach(work).map_err(|err| raised(&err))
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

/// The result of a session folder or calibration file in another program's format.
#[pyfunction]
pub(crate) fn export(
    py: Python<'_>,
    input: PathBuf,
    format: &str,
    name: Option<&str>,
) -> PyResult<String> {
    let work = || {
        let known = FORMATS.into_iter().find(|known| known.code() == format);
        let known = known.with_context(|| format!("there is no format {format:?}"))?;
        let exported = export_result(Path::new(&input), known, name, &Announcer::silent())?;
        Ok::<_, anyhow::Error>(exported.text)
    };
    py.detach(work).map_err(|err| raised(&err))
}

/// Names of the formats.
#[pyfunction]
pub(crate) fn formats() -> Vec<&'static str> {
    FORMATS.iter().map(|format| format.code()).collect()
}
