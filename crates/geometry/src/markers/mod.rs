//! Markers in the light squares of a board: which corner is which, however little of the board is seen.
//!
//! A ChArUco board is a checkerboard with a square ArUco marker in the middle of each light square: a black frame one
//! cell wide around black and white cells, which name the marker. Markers are numbered row by row. In OpenCV's layout
//! since 4.6 the square in the top-left corner is dark; in the older one ("legacy") it's light if the number of rows is
//! even. Which of the two a board has shows in its picture, so nobody needs to know.
//!
//! Source: Garrido-Jurado et al., "Automatic generation and detection of highly reliable fiducial markers under
//! occlusion", 2014.

mod choice;
mod dictionary;
mod invalid;

pub use choice::MarkerChoice;
pub use dictionary::{Dictionary, NoDictionary};
pub use invalid::InvalidMarkers;

/// The markers of a board.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Markers {
    /// What the markers look like.
    pub dictionary: Dictionary,
    /// Side of a marker with its black frame, as a share of a square's side.
    pub side_squares: f64,
}

impl Markers {
    /// Side of a marker, in squares, if none is given.
    const USUAL_SIDE_SQUARES: f64 = 0.75;

    /// Markers with this side, or the usual one.
    pub fn sized(dictionary: Dictionary, side_squares: Option<f64>) -> Self {
        let side_squares = side_squares.unwrap_or(Self::USUAL_SIDE_SQUARES);
        Self { dictionary, side_squares }
    }

    /// Distance of a marker from the edges of its square, in squares.
    pub fn gap_squares(&self) -> f64 {
        (1.0 - self.side_squares) / 2.0
    }
}

/// Where the light squares are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Layout {
    /// The square in the top-left corner is dark.
    Present,
    /// Up to OpenCV 4.5: the square in the top-left corner is light if the number of rows is even.
    Legacy,
}

impl Layout {
    /// Both, the present one first.
    pub const ALL: [Self; 2] = [Self::Present, Self::Legacy];

    /// The number of the marker in a square of a board of `columns` × `rows` *squares*; `None` in a dark square and
    /// outside of the board.
    pub fn marker_at(
        self,
        [column, row]: [usize; 2],
        [columns, rows]: [usize; 2],
    ) -> Option<usize> {
        if column >= columns || row >= rows || !self.is_light([column as i32, row as i32], rows) {
            return None;
        }
        // Light squares in the first columns of a row: one more if the row begins with a light one.
        let first_is_light = usize::from(self.is_light([0, 0], rows));
        let before = |row: usize, columns: usize| (columns + (row + first_is_light) % 2) / 2;
        let above = row / 2 * columns + if row % 2 == 1 { before(0, columns) } else { 0 };
        Some(above + before(row, column))
    }

    /// Whether a square is light on a board with `rows` rows of squares. The pattern continues outside of the board.
    pub fn is_light(self, [column, row]: [i32; 2], rows: usize) -> bool {
        let first_is_light = self == Self::Legacy && rows.is_multiple_of(2);
        (column + row).rem_euclid(2) == i32::from(!first_is_light)
    }
}

/// Markers on a board of `columns` × `rows` squares in the present layout, which has the fewer.
pub fn marker_count([columns, rows]: [usize; 2]) -> usize {
    columns * rows / 2
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn markers_are_numbered_row_by_row() {
        for layout in Layout::ALL {
            for size in [[8, 11], [7, 5], [5, 8], [4, 4], [11, 8]] {
                let [columns, rows] = size;
                let mut next = 0;
                for row in 0..rows {
                    for column in 0..columns {
                        let first_is_light = layout == Layout::Legacy && rows % 2 == 0;
                        let light = ((column + row) % 2 == 1) != first_is_light;
                        let number = layout.marker_at([column, row], size);
                        assert_eq!(
                            number,
                            light.then_some(next),
                            "{layout:?} {size:?} {column} {row}"
                        );
                        next += usize::from(light);
                    }
                }
                assert!(next >= marker_count(size) && next <= marker_count(size) + 1);
                assert_eq!(layout.marker_at([columns, 0], size), None);
            }
        }
    }
}
