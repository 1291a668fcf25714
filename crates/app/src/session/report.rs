//! The report of a calibration file.

use std::path::{Component, Path};

use anyhow::Context;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::session::certificate::{Circumstances, certificate};
use boresight_capture::read_picture;
use boresight_files::{Links, read_text};
use boresight_formats::{CALIBRATION_SCHEMA, CalibrationFile, import::MAX_BYTES};
use boresight_geometry::frame::ImageSize;
use boresight_present::{
    report::{CameraSection, Provenance, Report, Thumbnail},
    text::{is_simulated, report as words},
};
use boresight_run::config::CertificateConfig;

/// Report of a calibration file without the session. `command` is the command line to repeat it;
/// `stated` has the certificate's statements.
///
/// # Errors
///
/// If the file can't be read or isn't a whole `boresight.calibration/1`.
pub fn of_file(path: &Path, command: String, stated: &CertificateConfig) -> anyhow::Result<Report> {
    let text = read_text(path, MAX_BYTES as u64, Links::Followed)?;
    of_text(&text, path, command, stated)
}

/// Report of the calibration in `text`, the present or future contents of `path`; otherwise as
/// [`of_file`].
///
/// # Errors
///
/// As there.
pub fn of_text(
    text: &str,
    path: &Path,
    command: String,
    stated: &CertificateConfig,
) -> anyhow::Result<Report> {
    let value: Value = serde_json::from_str(text)
        .with_context(|| format!("not a calibration that boresight wrote: {path:?}. To convert another program's: boresight convert IN NEW.json --format json"))?;
    let calibration = CalibrationFile::read(&value)
        .with_context(|| format!("not a whole calibration: {path:?}"))?;
    let [width_px, height_px] = calibration.image_size;
    let folder = path.parent().unwrap_or(Path::new("."));
    let size = ImageSize { width_px, height_px };
    let pictures =
        calibration.used().map(|(_, view)| picture_beside(folder, &view.name, size)).collect();
    let simulated = calibration.source.as_deref().is_some_and(is_simulated);
    let camera = CameraSection { simulated, ..CameraSection::default() };
    let mut rows = versions(&[]);
    rows.push((words::name::FILE.into(), path.display().to_string()));
    let mut notes = Vec::new();
    let known = Circumstances { file: Some((path, text.as_bytes())), ..Circumstances::default() };
    let certificate = Some(certificate(stated, known, &mut notes));
    Ok(Report {
        name: path.file_name().unwrap_or_default().to_string_lossy().into_owned(),
        calibration,
        notes,
        certificate,
        camera,
        corners: Vec::new(),
        pictures,
        cause: None,
        check: None,
        refused: Vec::new(),
        provenance: Provenance { rows, command },
    })
}

/// What `report --json` prints.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
pub struct ReportFile {
    /// [`REPORT_SCHEMA`].
    #[cfg_attr(feature = "schemas", schemars(extend("const" = "boresight.report/1")))]
    pub schema: String,
    /// Path of the page.
    pub page: String,
    /// The calibration's verdict: `good`, `care` or `untrustworthy`.
    #[cfg_attr(feature = "schemas", schemars(extend("enum" = ["good", "care", "untrustworthy"])))]
    pub verdict: String,
}

/// Name and version of [`ReportFile`].
pub const REPORT_SCHEMA: &str = "boresight.report/1";

/// Picture `name` below `folder`, if present and of `size`. Names leading out of the folder give
/// none.
pub fn picture_beside(folder: &Path, name: &str, size: ImageSize) -> Option<Thumbnail> {
    let inside = Path::new(name).components().all(|part| matches!(part, Component::Normal(_)));
    let path = folder.join(name);
    if name.is_empty() || !inside || !path.is_file() {
        return None;
    }
    let thumbnail = Thumbnail::of(&read_picture(&path).ok()?)?;
    (thumbnail.full_size() == size).then_some(thumbnail)
}

/// Versions of the program and the schemas: the calibration's and `more`.
pub fn versions(more: &[&str]) -> Vec<(String, String)> {
    let schemas = [&[CALIBRATION_SCHEMA], more].concat().join(", ");
    vec![
        (words::name::PROGRAM.into(), format!("boresight {}", env!("CARGO_PKG_VERSION"))),
        (words::name::SCHEMAS.into(), schemas),
    ]
}
