//! Names of the kinds of boards, and text form of a board.

use super::Pattern;
use crate::markers::{InvalidMarkers, NoDictionary};

/// Name and text form of a kind of board.
#[derive(Clone, Copy, Debug)]
pub struct BoardKind {
    /// Name before the first colon of the argument, left out for the plain kind; also the start of
    /// file names.
    pub name: &'static str,
    /// Example argument for this kind.
    pub example: &'static str,
    /// Number counted by people along a side with the given points: inner corners, squares or tags.
    pub counted: fn(u16) -> u16,
    /// Number of points along a side with the given count.
    pub points: fn(u16) -> u16,
    /// Least and largest count.
    pub counts: [u16; 2],
    /// Usual print.
    pub usual: fn() -> Pattern,
    /// Parses the argument, without the name and the colon.
    pub(super) read: fn(&str) -> Result<BoardChoice, InvalidChoice>,
    /// Writes the argument.
    pub(super) write: fn(&BoardChoice) -> String,
}

/// Board chosen before the side of the squares is settled: `9x6`, or
/// `charuco:8x11:DICT_4X4_50:15mm`, or `aprilgrid:6x6`, or `circles:7x5`, or `acircles:4x11`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoardChoice {
    /// Number of points in a row.
    pub columns: u16,
    /// Number of points in a column.
    pub rows: u16,
    /// Print at the points.
    pub pattern: Pattern,
}

impl BoardKind {
    /// Possible number of points along a side near the given number.
    pub fn nearest(&self, points: u16) -> u16 {
        let [least, most] = self.counts;
        (self.points)((self.counted)(points).clamp(least, most))
    }
}

impl BoardChoice {
    /// Board with these numbers of points in a row and in a column.
    pub fn of([columns, rows]: [u16; 2], pattern: Pattern) -> Self {
        Self { columns, rows, pattern }
    }
}

/// Reason why a text doesn't name a board.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum InvalidChoice {
    /// The text isn't two numbers.
    #[error("expected inner corners, columns x rows, for example 9x6")]
    NotCounts,
    /// There is a name before a colon, but no ChArUco board.
    #[error(
        "expected squares, dictionary and marker size, for example charuco:8x11:DICT_4X4_50:15mm; the size can be left out if it's 0.75 of a square"
    )]
    NotCharuco,
    /// The tags aren't named as an AprilGrid's.
    #[error(
        "expected tags, columns x rows, for example aprilgrid:6x6; if they aren't 0.3 of their side apart or the first isn't 0, then also that share and that number: aprilgrid:6x6:0.25:100"
    )]
    NotAprilGrid,
    /// The circles aren't counted.
    #[error(
        "expected circles in a row and rows, for example circles:7x5, or acircles:4x11 if every second row is shifted"
    )]
    NotCircles,
    /// The name before the colon is of no kind of board.
    #[error(
        "expected inner corners (9x6), charuco:8x11:DICT_4X4_50:15mm, aprilgrid:6x6, circles:7x5 or acircles:4x11"
    )]
    NoKind,
    /// The marker's size isn't a length.
    #[error("expected a length with its unit, for example 25mm")]
    NotALength,
    /// The dictionary is unknown.
    #[error(transparent)]
    Dictionary(#[from] NoDictionary),
    /// No board has these counts.
    #[error(transparent)]
    Board(#[from] InvalidBoard),
    /// No board of this size can have the markers.
    #[error(transparent)]
    Markers(#[from] InvalidMarkers),
}

/// Reason why numbers do not describe a usable board.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum InvalidBoard {
    /// Fewer than 3 or more than 99 inner corners on a side.
    #[error("a board of {columns}x{rows} inner corners: each side needs 3 to 99")]
    Count {
        /// Number of inner corners in a row.
        columns: u16,
        /// Number of inner corners in a column.
        rows: u16,
    },
    /// The side of a square isn't a positive length below 10 m.
    #[error("a square of {square_m} m: needs a positive length below 10 m")]
    Square {
        /// Given length.
        square_m: f64,
    },
}

/// Parses `8x11` as two numbers.
pub(super) fn counts(text: &str) -> Option<[u16; 2]> {
    let (columns, rows) = text.split_once(['x', 'X', '×'])?;
    Some([columns.trim().parse().ok()?, rows.trim().parse().ok()?])
}

/// Length in millimetres, to a nanometre, so that the rounding of metres doesn't show.
pub fn millimetres(length_m: f64) -> f64 {
    (length_m * 1e9).round() / 1e6
}

/// Parses a length with a unit (mm, cm, m or in), in metres.
///
/// # Errors
///
/// [`InvalidChoice::NotALength`] without a number or a unit.
pub fn length_m(text: &str) -> Result<f64, InvalidChoice> {
    let text = text.trim();
    let split = text.find(|c: char| c.is_ascii_alphabetic()).unwrap_or(text.len());
    let (number, unit) = text.split_at(split);
    let metres = match unit {
        "mm" => 1e-3,
        "cm" => 1e-2,
        "m" => 1.0,
        "in" => 0.0254,
        _ => return Err(InvalidChoice::NotALength),
    };
    let value: f64 = number.trim().parse().map_err(|_| InvalidChoice::NotALength)?;
    Ok(value * metres)
}
