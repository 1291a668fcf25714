//! The calibration board.

use nalgebra::Point2;

use crate::markers::{InvalidMarkers, Markers};

/// A checkerboard, described by its inner corners: a plain one, or one with [markers](Markers) in its light squares.
///
/// The board frame has its origin at the centre of the grid of inner corners, `x` along a row
/// (towards higher columns), `y` along a column (towards higher rows) and `z = 0` on the paper,
/// in metres. Corners are numbered row by row: `index = row * columns + column`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Checkerboard {
    columns: u16,
    rows: u16,
    square_m: f64,
    markers: Option<Markers>,
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

impl Checkerboard {
    /// Creates a board of `columns` × `rows` *inner* corners with squares of `square_m` metres.
    ///
    /// # Errors
    ///
    /// [`InvalidBoard`] if a count is outside 3..=99 or the length is not in (0, 10) m.
    pub fn new(columns: u16, rows: u16, square_m: f64) -> Result<Self, InvalidBoard> {
        if !(3..=99).contains(&columns) || !(3..=99).contains(&rows) {
            return Err(InvalidBoard::Count { columns, rows });
        }
        if !(square_m > 0.0 && square_m < 10.0) {
            return Err(InvalidBoard::Square { square_m });
        }
        Ok(Self { columns, rows, square_m, markers: None })
    }

    /// The board with `markers` in its light squares.
    ///
    /// # Errors
    ///
    /// [`InvalidMarkers`] if their side is outside 0.3..=0.95 squares, or if the dictionary has too few.
    pub fn with_markers(self, markers: Markers) -> Result<Self, InvalidMarkers> {
        markers.check([self.columns, self.rows])?;
        Ok(Self { markers: Some(markers), ..self })
    }

    /// The markers in the light squares; `None` on a plain board.
    pub fn markers(&self) -> Option<Markers> {
        self.markers
    }

    /// Squares in a row and in a column.
    pub fn squares(&self) -> [usize; 2] {
        [self.columns() + 1, self.rows() + 1]
    }

    /// Inner corners in a row.
    pub fn columns(&self) -> usize {
        usize::from(self.columns)
    }

    /// Inner corners in a column.
    pub fn rows(&self) -> usize {
        usize::from(self.rows)
    }

    /// Side of a square, in metres.
    pub fn square_m(&self) -> f64 {
        self.square_m
    }

    /// Number of inner corners.
    pub fn corner_count(&self) -> usize {
        self.columns() * self.rows()
    }

    /// Whether a half turn maps the pattern to itself, so that corner numbers are known only up to that turn: both counts
    /// odd or both even, and no markers. Harmless when calibrating a single camera.
    pub fn looks_the_same_upside_down(&self) -> bool {
        self.markers.is_none() && self.columns % 2 == self.rows % 2
    }

    /// Positions of all inner corners in the board frame, in metres and in numbering order.
    pub fn corners_in_board_m(&self) -> Vec<Point2<f64>> {
        let (half_width, half_height) =
            (f64::from(self.columns - 1) / 2.0, f64::from(self.rows - 1) / 2.0);
        (0..self.rows)
            .flat_map(|row| (0..self.columns).map(move |column| (column, row)))
            .map(|(column, row)| {
                Point2::new(
                    (f64::from(column) - half_width) * self.square_m,
                    (f64::from(row) - half_height) * self.square_m,
                )
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_are_centred_and_row_major() {
        let board = Checkerboard::new(9, 6, 0.025).expect("valid");
        let corners = board.corners_in_board_m();
        assert_eq!(corners.len(), board.corner_count());
        assert_eq!(corners[0], Point2::new(-4.0 * 0.025, -2.5 * 0.025));
        assert!((corners[1] - corners[0]).norm() - 0.025 < 1e-15);
        assert!((corners[9] - corners[0]).y - 0.025 < 1e-15);
        let sum = corners.iter().fold(nalgebra::Vector2::zeros(), |sum, c| sum + c.coords);
        assert!(sum.norm() < 1e-12);
    }

    #[test]
    fn nonsense_is_refused() {
        assert!(matches!(Checkerboard::new(2, 6, 0.025), Err(InvalidBoard::Count { .. })));
        for square_m in [0.0, -1.0, f64::NAN, f64::INFINITY, 10.0] {
            assert!(matches!(Checkerboard::new(9, 6, square_m), Err(InvalidBoard::Square { .. })));
        }
    }

    #[test]
    fn markers_must_fit_and_suffice() {
        let board = Checkerboard::new(7, 10, 0.02).expect("valid");
        let with = |name: &str, side_squares| {
            let dictionary = name.parse().expect("a dictionary");
            board.with_markers(Markers { dictionary, side_squares })
        };
        assert!(with("DICT_4X4_50", 0.75).is_ok_and(|board| board.squares() == [8, 11]));
        assert!(matches!(with("DICT_4X4_50", 1.0), Err(InvalidMarkers::Side { .. })));
        let few = with("DICT_APRILTAG_16h5", 0.75);
        assert!(matches!(few, Err(InvalidMarkers::Count { needed: 44, count: 30, .. })));
    }

    #[test]
    fn mixed_parity_tells_up_from_down() {
        let same = |columns, rows| {
            Checkerboard::new(columns, rows, 0.02).expect("valid").looks_the_same_upside_down()
        };
        assert!(!same(9, 6) && !same(6, 7) && same(8, 6) && same(9, 7));
    }
}
