//! What a kind of board is called, and a board as a person names it.

use crate::markers::{InvalidMarkers, MarkerChoice, NoDictionary};

/// What a kind of board is called, and how it is written as one argument.
#[derive(Clone, Copy, Debug)]
pub struct BoardKind {
    /// Stands before the first colon of the argument, which the plain kind goes without, and begins names of files.
    pub name: &'static str,
    /// An argument that names a board of this kind.
    pub example: &'static str,
    /// What people count along a side with so many points: inner corners, squares or tags.
    pub counted: fn(u16) -> u16,
    /// Reads the argument, without the name and its colon.
    pub(super) read: fn(&str) -> Result<BoardChoice, InvalidChoice>,
    /// Writes the argument.
    pub(super) write: fn(&BoardChoice) -> String,
}

/// A board as it's chosen before the side of its squares is settled: `9x6`, or `charuco:8x11:DICT_4X4_50:15mm`, or
/// `aprilgrid:6x6`, or `circles:7x5`, or `acircles:4x11`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoardChoice {
    /// Points in a row.
    pub columns: u16,
    /// Points in a column.
    pub rows: u16,
    /// The markers of a ChArUco board, the tags of an AprilGrid, or circles.
    pub markers: Option<MarkerChoice>,
}

/// Why words don't name a board.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum InvalidChoice {
    /// Not two numbers.
    #[error("expected inner corners, columns x rows, for example 9x6")]
    NotCounts,
    /// Something before a colon, but no ChArUco board.
    #[error(
        "expected squares, dictionary and marker size, for example charuco:8x11:DICT_4X4_50:15mm; the size can be left out if it's 0.75 of a square"
    )]
    NotCharuco,
    /// Tags that aren't named as an AprilGrid's.
    #[error(
        "expected tags, columns x rows, for example aprilgrid:6x6; if they aren't 0.3 of their side apart or the first isn't 0, then also that share and that number: aprilgrid:6x6:0.25:100"
    )]
    NotAprilGrid,
    /// Circles that aren't counted.
    #[error(
        "expected circles in a row and rows, for example circles:7x5, or acircles:4x11 if every second row is shifted"
    )]
    NotCircles,
    /// A name before the colon that no kind of board has.
    #[error(
        "expected inner corners (9x6), charuco:8x11:DICT_4X4_50:15mm, aprilgrid:6x6, circles:7x5 or acircles:4x11"
    )]
    NoKind,
    /// The marker's size.
    #[error("expected a length with its unit, for example 25mm")]
    NotALength,
    /// A dictionary that nobody knows.
    #[error(transparent)]
    Dictionary(#[from] NoDictionary),
    /// Counts that no board has.
    #[error(transparent)]
    Board(#[from] InvalidBoard),
    /// Markers that no board of this size can have.
    #[error(transparent)]
    Markers(#[from] InvalidMarkers),
}

/// Why numbers do not describe a usable board.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum InvalidBoard {
    /// Fewer than 3 or more than 99 inner corners on a side.
    #[error("a board of {columns}x{rows} inner corners: each side needs 3 to 99")]
    Count {
        /// Inner corners in a row.
        columns: u16,
        /// Inner corners in a column.
        rows: u16,
    },
    /// The side of a square isn't a positive length below 10 m.
    #[error("a square of {square_m} m: needs a positive length below 10 m")]
    Square {
        /// The length given.
        square_m: f64,
    },
}

/// `8x11` as two numbers.
pub(super) fn counts(text: &str) -> Option<[u16; 2]> {
    let (columns, rows) = text.split_once(['x', 'X', '×'])?;
    Some([columns.trim().parse().ok()?, rows.trim().parse().ok()?])
}

/// A length in millimetres, to a nanometre, so that the rounding of metres doesn't show.
pub fn millimetres(length_m: f64) -> f64 {
    (length_m * 1e9).round() / 1e6
}

/// A length with its unit (mm, cm, m or in), in metres.
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
