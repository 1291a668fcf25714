//! A calibration as one HTML page: readable offline on any screen, and printed on four sheets. The
//! first two are the certificate for the customer, the others are for the engineer.
//!
//! ```text
//! calibration.json ─┐
//! corners ──────────┤
//! small pictures ───┼──▶ Report ──▶ page ──▶ one HTML file, drawings as SVG in it
//! camera, refusals ─┤
//! check ────────────┘
//! ```
//!
//! The numbers come from the calibration file, so page and file can't differ; each number is in a
//! `<data value="…">` with all its digits. Missing corners, pictures, refusals or checks are stated
//! as missing. Text from outside, such as a file name, is escaped. Nothing here opens a file.
//!

mod certificate;
mod drift;
mod estimates;
mod fit;
mod front;
mod judgement;
mod lens_curve;
mod line;
mod logo;
mod number;
mod numbers_pdf;
mod page;
mod pdf_text;
mod picture_maps;
mod projection_map;
mod rig;
mod row_pictures;
mod section;
mod sheet_pdf;
mod skip;
mod stated;
mod summary;
mod thumbnail;
mod unknown_sd;
mod views;
mod warnings;

pub use judgement::judgement_page;
pub use logo::Logo;
pub use page::page;
pub use rig::rig_page;
pub use row_pictures::RowPictures;
pub use sheet_pdf::{NoPdf, certificate_pdf};
pub use stated::Certificate;
pub use thumbnail::Thumbnail;

use crate::cause_picture::CausePicture;
use boresight_formats::{CalibrationFile, CheckFile};
use boresight_geometry::Corner;

/// Contents of the page.
#[derive(Clone, Debug)]
pub struct Report {
    /// Name of the session, or of the calibrated files.
    pub name: String,
    /// Reported calibration.
    pub calibration: CalibrationFile,
    /// Sentences to read before the numbers.
    pub notes: Vec<String>,
    /// Statements of the first sheet beside the numbers; `None` for a report without a certificate.
    pub certificate: Option<Certificate>,
    /// Camera and changes of the camera.
    pub camera: CameraSection,
    /// Corners of each used view, in pixels; empty if unknown.
    pub corners: Vec<Vec<Corner>>,
    /// Picture of each used view, or `None`.
    pub pictures: Vec<Option<Thumbnail>>,
    /// The cause of an untrustworthy result as a picture, if any.
    pub cause: Option<CausePicture>,
    /// Check against an older calibration of the same camera, if any.
    pub check: Option<CheckFile>,
    /// Reasons for refusing frames, the most frequent first.
    pub refused: Vec<Refused>,
    /// Versions, sources, and the command to repeat the result.
    pub provenance: Provenance,
}

/// Facts about the camera.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct CameraSection {
    /// Identity, mode and controls: name and value of each row.
    pub rows: Vec<(String, String)>,
    /// True if the camera was simulated.
    pub simulated: bool,
    /// Changes while the views were taken, oldest first.
    pub changes: Vec<CameraChange>,
}

/// Change of the camera or a control, or an interruption.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CameraChange {
    /// Time in words.
    pub when: String,
    /// Change in words.
    pub what: String,
}

/// Reason for refusing frames or pictures.
#[derive(Clone, Debug, PartialEq)]
pub struct Refused {
    /// Reason, or picture with its reason.
    pub what: String,
    /// Number of frames or pictures.
    pub count: usize,
    /// Total duration of refused frames, for a video.
    pub secs: Option<f64>,
}

/// Source of a result, and the command to repeat it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Provenance {
    /// Versions and sources: name and value of each row.
    pub rows: Vec<(String, String)>,
    /// Command to repeat the result, quoted for a shell.
    pub command: String,
}
