//! What a session folder says of one calibration.

use std::path::Path;

use nalgebra::{Matrix3, Vector3};
use serde::Deserialize;

use boresight_app::RESULT_FILE;
use boresight_calibrate::StatedLens;
use boresight_files::{FileError, Links, read_text};
use boresight_formats::NamedCovariance;

const HEADER: &str = "session.toml";
const HEADER_LIMIT: u64 = 1 << 20;
const RESULT_LIMIT: u64 = 16 << 20;

/// A calibration of a camera.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// The session's folder, an absolute path.
    pub session: String,
    /// The camera: the session's source, which names a live camera by vendor, product and serial number.
    pub camera: String,
    /// The camera's own name; empty for sources that have none.
    pub model: String,
    /// When the session began, UTC.
    pub created: String,
    /// Width and height of the picture.
    pub image_size: [u32; 2],
    /// `good`, `care` or `untrustworthy`.
    pub verdict: String,
    /// The lens, if there is one for all views with its covariance.
    pub lens: Option<StatedLens>,
}

/// Why a folder has no entry.
#[derive(Debug, thiserror::Error)]
pub enum NotAnEntry {
    /// A file can't be read.
    #[error(transparent)]
    File(#[from] FileError),
    /// A file isn't what it should be.
    #[error("not a calibrated session ({reason}): {path:?}")]
    Form {
        /// What is wrong.
        reason: String,
        /// The folder.
        path: std::path::PathBuf,
    },
}

#[derive(Deserialize)]
struct Header {
    created: String,
    source: String,
    #[serde(default)]
    camera: Option<Camera>,
}

#[derive(Deserialize)]
struct Camera {
    name: String,
}

#[derive(Deserialize)]
struct Result_ {
    image_size: [u32; 2],
    verdict: String,
    result: Option<Lens>,
}

#[derive(Deserialize)]
struct Lens {
    f_px: [f64; 2],
    pp_px: [f64; 2],
    covariance: Option<NamedCovariance>,
    covariance_all: Option<NamedCovariance>,
    focal: Option<Focal>,
}

#[derive(Deserialize)]
struct Focal {
    varies: bool,
}

impl Entry {
    /// The calibration that the session in `folder` ended with.
    ///
    /// # Errors
    ///
    /// [`NotAnEntry`], for example if the session has no result yet.
    pub fn read(folder: &Path) -> Result<Self, NotAnEntry> {
        let wrong = |reason: String| NotAnEntry::Form { reason, path: folder.to_path_buf() };
        let session = folder.to_str().ok_or_else(|| wrong("its name isn't UTF-8".into()))?;
        let header = read_text(&folder.join(HEADER), HEADER_LIMIT, Links::Refused)?;
        let header: Header =
            toml::from_str(&header).map_err(|err| wrong(err.message().to_owned()))?;
        let result = read_text(&folder.join(RESULT_FILE), RESULT_LIMIT, Links::Refused)?;
        let result: Result_ =
            serde_json::from_str(&result).map_err(|err| wrong(err.to_string()))?;
        Ok(Self {
            session: session.to_owned(),
            camera: header.source,
            model: header.camera.map_or(String::new(), |camera| camera.name),
            created: header.created,
            image_size: result.image_size,
            verdict: result.verdict,
            lens: result.result.as_ref().and_then(stated),
        })
    }

    /// Whether the calibration counts in a trend.
    pub fn is_usable(&self) -> bool {
        self.lens.is_some() && self.verdict != "untrustworthy"
    }
}

/// Focal length and principal point with their covariance, doubt about what the model holds at zero included.
fn stated(lens: &Lens) -> Option<StatedLens> {
    if lens.focal.as_ref().is_some_and(|focal| focal.varies) {
        return None;
    }
    let covariance = lens.covariance_all.as_ref().or(lens.covariance.as_ref())?;
    let place =
        |names: &[&str]| covariance.order.iter().position(|name| names.contains(&name.as_str()));
    let rows = [place(&["f", "fx"])?, place(&["cx"])?, place(&["cy"])?];
    let mut covariance_px2 = Matrix3::zeros();
    for (i, row) in rows.into_iter().enumerate() {
        for (j, column) in rows.into_iter().enumerate() {
            covariance_px2[(i, j)] = (*covariance.matrix.get(row)?.get(column)?)?;
        }
    }
    let f_pp_px = Vector3::new(lens.f_px[0], lens.pp_px[0], lens.pp_px[1]);
    Some(StatedLens { f_pp_px, covariance_px2 })
}
