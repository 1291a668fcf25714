//! A calibration as one page: to read on any screen without a network, and to print on two sheets.
//!
//! ```text
//! calibration.json ─┐
//! corners ──────────┤
//! small pictures ───┼──▶ Report ──▶ page ──▶ one HTML file, drawings as SVG in it
//! camera, refusals ─┤
//! drift ────────────┘
//! ```
//!
//! The numbers are those of the calibration's JSON, so that page and file cannot differ; each stands in a
//! `<data value="…">` with all its digits. Corners, pictures, refusals and drift are shown where they are
//! known, and where they are not, the page says so. Whatever comes from outside, such as the name of a
//! file, is escaped. Nothing here touches a file.

mod drift;
mod estimates;
mod lens_curve;
mod line;
mod number;
mod page;
mod picture_maps;
mod projection_map;
mod section;
mod skip;
mod summary;
mod thumbnail;
mod views;

pub use page::page;
pub use thumbnail::Thumbnail;

use crate::{
    calibration::files::{CalibrationFile, CheckFile},
    geometry::Corner,
};

/// Everything that the page is made of.
#[derive(Clone, Debug)]
pub struct Report {
    /// What was calibrated: the session's name, or the files'.
    pub name: String,
    /// The calibration.
    pub calibration: CalibrationFile,
    /// What is to be known before the numbers, in sentences.
    pub notes: Vec<String>,
    /// The camera.
    pub camera: CameraSection,
    /// Corners of each used view; empty if they are not known.
    pub corners: Vec<Vec<Corner>>,
    /// Picture of each used view, as far as there are any.
    pub pictures: Vec<Option<Thumbnail>>,
    /// What a check against an older calibration of the same camera found.
    pub check: Option<CheckFile>,
    /// What was refused, with how often.
    pub refused: Vec<Refused>,
    /// Where it all comes from.
    pub provenance: Provenance,
}

/// What is known about the camera.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct CameraSection {
    /// Identity, mode, controls: what it is and how it stands.
    pub rows: Vec<(String, String)>,
    /// What changed while the views were taken, oldest first.
    pub changes: Vec<CameraChange>,
}

/// A change of the camera or its controls, or an interruption.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CameraChange {
    /// When, in words.
    pub when: String,
    /// What.
    pub what: String,
}

/// A reason for refusing frames or pictures.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Refused {
    /// The reason, or the picture with its reason.
    pub what: String,
    /// How many.
    pub count: usize,
}

/// Where a result comes from and how it is had again.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Provenance {
    /// Versions, and what else names the sources.
    pub rows: Vec<(String, String)>,
    /// The command that gives the same result again, as a shell reads it.
    pub command: String,
}
