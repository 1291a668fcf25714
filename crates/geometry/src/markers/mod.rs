//! Markers on a board, which identify the corners in any part of it.
//!
//! A ChArUco board is a checkerboard with a square ArUco marker in the middle of each light square:
//! a black frame one cell wide around black and white cells, which name the marker. Markers are
//! numbered row by row. In OpenCV's layout since 4.6, the square in the top-left corner is dark; in
//! the older layout ("legacy"), it's light if the number of rows is even. The picture shows the
//! layout of a board, so it needn't be stated.
//!
//! Source: Garrido-Jurado et al., "Automatic generation and detection of highly reliable fiducial
//! markers under occlusion", 2014.
//!
//! An AprilGrid is made of [`Tags`]: they fill their squares, and smaller dark squares touch their
//! corners.

mod choice;
mod circles;
mod dictionary;
mod invalid;
mod layout;
mod tags;

pub use choice::MarkerChoice;
pub use circles::CircleRows;
pub use dictionary::{Dictionary, NoDictionary};
pub use invalid::InvalidMarkers;
pub use layout::{Layout, marker_count};
pub use tags::Tags;

/// Markers of a board.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Markers {
    /// Dictionary of the markers.
    pub dictionary: Dictionary,
    /// Side of a marker with the black frame, as a share of a square's side. Ignored for tags,
    /// which fill their squares.
    pub side_squares: f64,
    /// Layout of an AprilGrid; `None` for the light squares of a ChArUco board.
    pub tags: Option<Tags>,
    /// Layout of circles instead of squares and markers; `None` on other boards.
    pub circles: Option<CircleRows>,
}

impl Markers {
    /// Default side of a marker, in squares.
    const USUAL_SIDE_SQUARES: f64 = 0.75;

    /// Markers with the given or the usual side.
    pub fn sized(dictionary: Dictionary, side_squares: Option<f64>) -> Self {
        let side_squares = side_squares.unwrap_or(Self::USUAL_SIDE_SQUARES);
        Self { dictionary, side_squares, tags: None, circles: None }
    }

    /// True if the markers are in the light squares of a ChArUco board.
    pub fn are_in_squares(&self) -> bool {
        self.tags.is_none() && self.circles.is_none()
    }

    /// Width of a marker's black frame, in cells.
    pub fn frame_cells(&self) -> usize {
        if self.tags.is_some() { Tags::FRAME_CELLS } else { 1 }
    }

    /// Number of cells along a marker's side, with the frame.
    pub fn cells(&self) -> usize {
        self.dictionary.side_cells() + 2 * self.frame_cells()
    }

    /// Side of a marker, as a share of the square's.
    pub fn share(&self) -> f64 {
        if self.tags.is_some() { 1.0 } else { self.side_squares }
    }

    /// Distance of a marker from the edges of the square, as a share of the square's side.
    pub fn inset(&self) -> f64 {
        (1.0 - self.share()) / 2.0
    }

    /// Side of a cell, as a share of the square's.
    pub fn cell_side(&self) -> f64 {
        self.share() / self.cells() as f64
    }

    /// Distance from the edges of a marker's square at which the marker is surrounded by white, as
    /// a share of the square's side: inside the edges, or outside if negative.
    pub fn white_at(&self) -> f64 {
        self.tags.map_or(0.5 * self.inset(), |tags| -0.5 * tags.spacing)
    }

    /// Sides of squares with a marker in shorter steps between points: 1 where all steps are equal.
    pub fn square_steps(&self) -> f64 {
        self.tags.map_or(1.0, |tags| 1.0 / tags.spacing)
    }

    /// Distance from the edges between squares with only the squares' colours, in shorter steps
    /// between points.
    pub fn gap_steps(&self) -> f64 {
        match self.tags {
            None => self.inset(),
            Some(_) => self.cell_side() * self.frame_cells() as f64 * self.square_steps(),
        }
    }

    /// Possible layouts of the markers on a board with `rows` rows of squares, for
    /// [`code_at`](Self::code_at). The first is the drawn one.
    pub fn layouts(&self, rows: usize) -> &'static [Layout] {
        match self.tags {
            Some(_) => &Layout::TAGS,
            // With an odd number of rows, both layouts are the same.
            None => &Layout::ALL[..if rows.is_multiple_of(2) { 2 } else { 1 }],
        }
    }

    /// [Code](Dictionary::code) of the marker in a square of a board of `columns` × `rows` squares;
    /// `None` in a square without a marker.
    pub fn code_at(&self, layout: Layout, square: [usize; 2], size: [usize; 2]) -> Option<u64> {
        let number = layout.marker_at(square, size)?;
        let Some(tags) = self.tags else { return self.dictionary.code(number) };
        let code = self.dictionary.code(number + usize::from(tags.first))?;
        Some(if layout.is_half_turned() { self.half_turned(code) } else { code })
    }

    /// True if a marker has this code, either way round.
    pub fn knows(&self, code: u64) -> bool {
        let turned = || self.tags.is_some() && self.dictionary.has(self.half_turned(code));
        self.dictionary.has(code) || turned()
    }

    fn half_turned(&self, code: u64) -> u64 {
        let cells = self.dictionary.side_cells().pow(2) as u32;
        code.reverse_bits() >> (u64::BITS - cells)
    }

    /// True if a cell of the marker with this code is black, like all cells of the frame. Rows and
    /// columns count the frame.
    pub fn is_black(&self, code: u64, cell: [usize; 2]) -> bool {
        self.dictionary.is_black_in(code, self.frame_cells(), cell)
    }
}
