//! A board of any kind in the files of calibrations.

use serde::{Deserialize, Serialize};

use boresight_geometry::{
    boards::{Board, MarkerSide, Pattern},
    markers::{CircleRows, Tags},
};

/// The board in front of the camera. Of an AprilGrid, the corners of its tags are the inner
/// corners, and a square is a tag; of circles, their centres are, and a square is as wide as rows
/// are apart.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
pub struct BoardEntry {
    /// Inner corners in a row.
    pub columns: u32,
    /// Inner corners in a column.
    pub rows: u32,
    /// Side of a square in millimetres.
    pub square_mm: f64,
    /// The markers in its light squares, or the tags of an AprilGrid; none on a plain board.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub markers: Option<MarkersEntry>,
    /// `symmetric` or `asymmetric` for a grid of circles, as OpenCV calls them; none on other boards.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub circles: Option<String>,
    /// The inner corners as the views show them, row by row, from the middle, in millimetres; left
    /// out if the board is flat and its squares are square.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub points_mm: Option<Vec<[f64; 3]>>,
}

/// Markers of a ChArUco board, or tags of an AprilGrid.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
pub struct MarkersEntry {
    /// Name of their dictionary, such as `DICT_4X4_50`.
    pub dictionary: String,
    /// Side of a marker, with its black frame, in millimetres.
    pub side_mm: f64,
    /// White between the tags of an AprilGrid, as a share of a tag's side; none on a ChArUco board.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tag_spacing: Option<f64>,
    /// Number of the first tag of an AprilGrid; 0 if it isn't there.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub first_tag: Option<u16>,
}

impl MarkersEntry {
    /// Layout of the tags of an AprilGrid.
    pub fn tags(&self) -> Option<Tags> {
        let first = self.first_tag.unwrap_or(0);
        self.tag_spacing.map(|spacing| Tags { spacing, first })
    }
}

impl BoardEntry {
    /// The entry of a board as named.
    pub(super) fn of(board: &Board) -> Self {
        let (tags, circles) = (board.pattern().tags(), board.pattern().circles());
        Self {
            columns: board.columns() as u32,
            rows: board.rows() as u32,
            square_mm: 1000.0 * board.measured_m(),
            markers: board.markers().map(|markers| MarkersEntry {
                dictionary: markers.dictionary.to_string(),
                side_mm: 1000.0 * board.measured_m() * markers.side_squares,
                tag_spacing: tags.map(|tags| tags.spacing),
                first_tag: tags.map(|tags| tags.first).filter(|first| *first != 0),
            }),
            circles: circles.map(|rows| rows.name().into()),
            points_mm: None,
        }
    }

    /// The board; `None` if impossible. Plain if the markers are unknown here or don't fit.
    pub fn board(&self) -> Option<Board> {
        let Self { columns, rows, square_mm, markers, circles, points_mm: _ } = self;
        let count = |count: &u32| u16::try_from(*count).ok();
        let plain = Board::new(count(columns)?, count(rows)?, square_mm / 1000.0).ok()?;
        if let Some(rows) = circles.as_deref().and_then(CircleRows::named) {
            return plain.with(Pattern::Circles(rows)).ok();
        }
        let marked = markers.as_ref().and_then(|entry| {
            let dictionary = entry.dictionary.parse().ok()?;
            let side = MarkerSide::Squares(entry.side_mm / square_mm);
            let markers = Pattern::Charuco { dictionary, side };
            plain.with(entry.tags().map_or(markers, Pattern::AprilGrid)).ok()
        });
        Some(marked.unwrap_or(plain))
    }
}
