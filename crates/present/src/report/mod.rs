//! A calibration as one HTML page: readable offline on any screen, and printed on three sheets. The first is the
//! certificate for the customer, the others are for the engineer.
//!
//! ```text
//! calibration.json ─┐
//! corners ──────────┤
//! small pictures ───┼──▶ Report ──▶ page ──▶ one HTML file, drawings as SVG in it
//! camera, refusals ─┤
//! check ────────────┘
//! ```
//!
//! The numbers are those of the calibration file, so page and file can't differ; each number is in a
//! `<data value="…">` with all its digits. Corners, pictures, refusals and the check are shown where they are
//! known; where they aren't, the page says so. Text from outside, such as a file name, is escaped. Nothing
//! here opens a file.
//!
//! [`history_page`] shows many calibrations of many cameras over time.

mod certificate;
mod drift;
mod estimates;
mod fit;
mod history;
mod lens_curve;
mod line;
mod logo;
mod number;
mod page;
mod picture_maps;
mod projection_map;
mod section;
mod skip;
mod stated;
mod summary;
mod thumbnail;
mod unknown_sd;
mod views;
mod watched;

pub use history::{CameraCurve, CurvePoint, HistoryPage, ModelLine, history_page};
pub use logo::Logo;
pub use page::page;
pub use stated::Certificate;
pub use thumbnail::Thumbnail;
pub use watched::{WatchedCurve, WatchedEvent, WatchedPoint, watched_chart};

use boresight_formats::{CalibrationFile, CheckFile};
use boresight_geometry::Corner;

/// The contents of the page.
#[derive(Clone, Debug)]
pub struct Report {
    /// Name of the session, or of the files that were calibrated.
    pub name: String,
    /// Calibration that the page reports.
    pub calibration: CalibrationFile,
    /// Sentences to read before the numbers.
    pub notes: Vec<String>,
    /// Statements of the first sheet beside the numbers; `None` for a report without one.
    pub certificate: Option<Certificate>,
    /// The camera and what happened to it.
    pub camera: CameraSection,
    /// Corners of each used view, in pixels; empty if unknown.
    pub corners: Vec<Vec<Corner>>,
    /// Picture of each used view, `None` where there is none.
    pub pictures: Vec<Option<Thumbnail>>,
    /// Check against an older calibration of the same camera, if there was one.
    pub check: Option<CheckFile>,
    /// Reasons for refusing frames, the most frequent first.
    pub refused: Vec<Refused>,
    /// Versions, sources, and the command that repeats the result.
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

/// A change of the camera or its controls, or an interruption.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CameraChange {
    /// When, in words.
    pub when: String,
    /// The change, in words.
    pub what: String,
}

/// A reason for refusing frames or pictures.
#[derive(Clone, Debug, PartialEq)]
pub struct Refused {
    /// The reason, or the picture with its reason.
    pub what: String,
    /// Number of frames or pictures.
    pub count: usize,
    /// Time that they lasted, of a video.
    pub secs: Option<f64>,
}

/// Source of a result, and the command that repeats it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Provenance {
    /// Versions and sources: name and value of each row.
    pub rows: Vec<(String, String)>,
    /// The command that repeats the result, quoted for a shell.
    pub command: String,
}
