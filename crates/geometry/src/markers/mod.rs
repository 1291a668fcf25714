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

mod circles;
mod dictionary;
mod invalid;
mod layout;
mod tags;

pub use circles::CircleRows;
pub use dictionary::{Dictionary, NoDictionary};
pub use invalid::InvalidMarkers;
pub use layout::{Layout, marker_count};
pub use tags::Tags;

/// Markers in squares of a board, as they are read: a ChArUco board's, or an AprilGrid's tags.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Markers {
    /// Dictionary of the markers.
    pub dictionary: Dictionary,
    /// Side of a marker with the black frame, as a share of a square's side.
    pub side_squares: f64,
    /// Width of a marker's black frame, in cells.
    pub frame_cells: usize,
    /// Number of the first marker.
    pub first: u16,
    /// Distance from the edges of a marker's square at which the marker is surrounded by white, as
    /// a share of the square's side: inside the edges, or outside if negative.
    pub white_at: f64,
    /// Sides of squares with a marker in shorter steps between points: 1 where all steps are equal.
    pub square_steps: f64,
    /// Distance from the edges between squares with only the squares' colours, in shorter steps
    /// between points.
    pub gap_steps: f64,
    /// Possible layouts, for [`code_at`](Self::code_at). The first is the drawn one.
    pub layouts: &'static [Layout],
}

impl Markers {
    /// Number of cells along a marker's side, with the frame.
    pub fn cells(&self) -> usize {
        self.dictionary.side_cells() + 2 * self.frame_cells
    }

    /// Distance of a marker from the edges of the square, as a share of the square's side.
    pub fn inset(&self) -> f64 {
        (1.0 - self.side_squares) / 2.0
    }

    /// Side of a cell, as a share of the square's.
    pub fn cell_side(&self) -> f64 {
        self.side_squares / self.cells() as f64
    }

    /// [Code](Dictionary::code) of the marker in a square of a board of `columns` × `rows` squares;
    /// `None` in a square without a marker.
    pub fn code_at(&self, layout: Layout, square: [usize; 2], size: [usize; 2]) -> Option<u64> {
        let number = layout.marker_at(square, size)?;
        let code = self.dictionary.code(number + usize::from(self.first))?;
        Some(if layout.is_half_turned() { self.half_turned(code) } else { code })
    }

    /// True if a marker has this code, either way round.
    pub fn knows(&self, code: u64) -> bool {
        let turned = || {
            let may_be_turned = self.layouts.iter().any(|layout| layout.is_half_turned());
            may_be_turned && self.dictionary.has(self.half_turned(code))
        };
        self.dictionary.has(code) || turned()
    }

    fn half_turned(&self, code: u64) -> u64 {
        let cells = self.dictionary.side_cells().pow(2) as u32;
        code.reverse_bits() >> (u64::BITS - cells)
    }

    /// True if a cell of the marker with this code is black, like all cells of the frame. Rows and
    /// columns count the frame.
    pub fn is_black(&self, code: u64, cell: [usize; 2]) -> bool {
        self.dictionary.is_black_in(code, self.frame_cells, cell)
    }
}
