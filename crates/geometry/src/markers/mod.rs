//! Markers on a board: which corner is which, however little of the board is seen.
//!
//! A ChArUco board is a checkerboard with a square ArUco marker in the middle of each light square: a black frame one
//! cell wide around black and white cells, which name the marker. Markers are numbered row by row. In OpenCV's layout
//! since 4.6 the square in the top-left corner is dark; in the older one ("legacy") it's light if the number of rows is
//! even. Which of the two a board has shows in its picture, so nobody needs to know.
//!
//! Source: Garrido-Jurado et al., "Automatic generation and detection of highly reliable fiducial markers under
//! occlusion", 2014.
//!
//! An AprilGrid is made of [`Tags`]: they fill their squares, and smaller dark squares touch their corners.

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

/// The markers of a board.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Markers {
    /// What the markers look like.
    pub dictionary: Dictionary,
    /// Side of a marker with its black frame, as a share of a square's side. Tags fill theirs, whatever this is.
    pub side_squares: f64,
    /// How they're laid out as an AprilGrid; `None` in the light squares of a ChArUco board.
    pub tags: Option<Tags>,
    /// Circles instead of squares and markers; `None` on other boards.
    pub circles: Option<CircleRows>,
}

impl Markers {
    /// Side of a marker, in squares, if none is given.
    const USUAL_SIDE_SQUARES: f64 = 0.75;

    /// Markers with this side, or the usual one.
    pub fn sized(dictionary: Dictionary, side_squares: Option<f64>) -> Self {
        let side_squares = side_squares.unwrap_or(Self::USUAL_SIDE_SQUARES);
        Self { dictionary, side_squares, tags: None, circles: None }
    }

    /// Whether they are in the light squares of a ChArUco board.
    pub fn are_in_squares(&self) -> bool {
        self.tags.is_none() && self.circles.is_none()
    }

    /// Width of a marker's black frame, in cells.
    pub fn frame_cells(&self) -> usize {
        if self.tags.is_some() { Tags::FRAME_CELLS } else { 1 }
    }

    /// Cells along a marker's side, with the frame.
    pub fn cells(&self) -> usize {
        self.dictionary.side_cells() + 2 * self.frame_cells()
    }

    /// Side of a marker, as a share of its square's.
    pub fn share(&self) -> f64 {
        if self.tags.is_some() { 1.0 } else { self.side_squares }
    }

    /// Distance of a marker from the edges of its square, as a share of the square's side.
    pub fn inset(&self) -> f64 {
        (1.0 - self.share()) / 2.0
    }

    /// Side of a cell, as a share of the square's.
    pub fn cell_side(&self) -> f64 {
        self.share() / self.cells() as f64
    }

    /// How far from the edges of its square a marker is surrounded by white, as a share of the square's side: inside of
    /// them, or outside if it's negative.
    pub fn white_at(&self) -> f64 {
        self.tags.map_or(0.5 * self.inset(), |tags| -0.5 * tags.spacing)
    }

    /// Sides of squares with a marker in shorter steps between points: 1 where all steps are equal.
    pub fn square_steps(&self) -> f64 {
        self.tags.map_or(1.0, |tags| 1.0 / tags.spacing)
    }

    /// How far from the edges between squares only their colours are seen, in shorter steps between points.
    pub fn gap_steps(&self) -> f64 {
        match self.tags {
            None => self.inset(),
            Some(_) => self.cell_side() * self.frame_cells() as f64 * self.square_steps(),
        }
    }

    /// The ways in which the markers may lie on a board with so many rows of squares, as [`code_at`](Self::code_at) knows
    /// them. The first is the one that's drawn.
    pub fn layouts(&self, rows: usize) -> &'static [Layout] {
        match self.tags {
            Some(_) => &Layout::TAGS,
            // With an odd number of rows, both layouts are one.
            None => &Layout::ALL[..if rows.is_multiple_of(2) { 2 } else { 1 }],
        }
    }

    /// The [code](Dictionary::code) of the marker in a square of a board of `columns` × `rows` squares; `None` where there
    /// is none.
    pub fn code_at(&self, layout: Layout, square: [usize; 2], size: [usize; 2]) -> Option<u64> {
        let number = layout.marker_at(square, size)?;
        let Some(tags) = self.tags else { return self.dictionary.code(number) };
        let code = self.dictionary.code(number + usize::from(tags.first))?;
        Some(if layout.is_half_turned() { self.half_turned(code) } else { code })
    }

    /// Whether one of the markers has this code, whichever way round.
    pub fn knows(&self, code: u64) -> bool {
        let turned = || self.tags.is_some() && self.dictionary.has(self.half_turned(code));
        self.dictionary.has(code) || turned()
    }

    fn half_turned(&self, code: u64) -> u64 {
        let cells = self.dictionary.side_cells().pow(2) as u32;
        code.reverse_bits() >> (u64::BITS - cells)
    }

    /// Whether a cell of the marker with this code is black, as all cells of its frame are. Rows and columns count the
    /// frame.
    pub fn is_black(&self, code: u64, cell: [usize; 2]) -> bool {
        self.dictionary.is_black_in(code, self.frame_cells(), cell)
    }
}
