//! Board of any kind, as a value.

use nalgebra::Point2;

use super::{
    AprilGrid, BoardChoice, Charuco, Circles, InvalidBoard, InvalidChoice, MarkerSide, Pattern,
    Squares, Target,
};
use crate::markers::{InvalidMarkers, Markers};

/// Board of any kind, in the frame of [`target`](super). Also known as
/// [`Board`](crate::boards::Board).
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Board {
    /// A plain checkerboard.
    Plain(Squares),
    /// A checkerboard with markers in the light squares.
    Charuco(Charuco),
    /// Rows of tags with dark squares at the tags' corners.
    AprilGrid(AprilGrid),
    /// Rows of circles.
    Circles(Circles),
}

impl Board {
    /// Plain board of `columns` × `rows` *inner* corners with squares of `square_m` metres.
    ///
    /// # Errors
    ///
    /// [`InvalidBoard`] if a count is outside 3..=99 or the length is not in (0, 10) m.
    ///
    /// ```
    /// # use boresight_geometry::boards::Board;
    /// let board = Board::new(9, 6, 0.025)?;
    /// assert_eq!(board.corner_count(), 54);
    /// // The origin is the middle of the corners.
    /// assert_eq!(board.corners_in_board_m()[0], nalgebra::Point2::new(-0.1, -0.0625));
    /// assert!(Board::new(1, 6, 0.025).is_err());
    /// # Ok::<(), boresight_geometry::boards::InvalidBoard>(())
    /// ```
    pub fn new(columns: u16, rows: u16, square_m: f64) -> Result<Self, InvalidBoard> {
        if !(3..=99).contains(&columns) || !(3..=99).contains(&rows) {
            return Err(InvalidBoard::Count { columns, rows });
        }
        if !(square_m > 0.0 && square_m < 10.0) {
            return Err(InvalidBoard::Square { square_m });
        }
        Ok(Self::Plain(Squares { columns, rows, square_m }))
    }

    /// Board with as many points and as large squares, printed with `pattern`. The tags of an
    /// AprilGrid are as large as the squares; circles are as far apart as the squares are wide.
    ///
    /// # Errors
    ///
    /// [`InvalidMarkers`] if the markers' side is outside 0.3..=0.95 squares, or the spacing of
    /// tags outside 0.1..=0.6, or if the dictionary has too few.
    pub fn with(self, pattern: Pattern) -> Result<Self, InvalidMarkers> {
        let board = self.drawn_with(pattern);
        board.target().check().map(|()| board)
    }

    /// Board with an unchecked pattern, only to draw a pending choice: markers missing from the
    /// dictionary are left out.
    #[must_use]
    pub fn drawn_with(self, pattern: Pattern) -> Self {
        let ([columns, rows], square_m) = (self.target().grid(), self.measured_m());
        let (columns, rows) = (columns as u16, rows as u16);
        let squares = Squares { columns, rows, square_m };
        match pattern {
            Pattern::Plain => Self::Plain(squares),
            Pattern::Charuco { dictionary, side } => {
                let side_squares = side.in_squares_of(square_m);
                Self::Charuco(Charuco { squares, dictionary, side_squares })
            }
            Pattern::AprilGrid(tags) => {
                Self::AprilGrid(AprilGrid { columns, rows, tag_m: square_m, tags })
            }
            Pattern::Circles(layout) => Self::Circles(Circles { squares, layout }),
        }
    }

    /// Print of the board.
    pub fn pattern(&self) -> Pattern {
        match *self {
            Self::Plain(_) => Pattern::Plain,
            Self::Charuco(Charuco { dictionary, side_squares, .. }) => {
                Pattern::Charuco { dictionary, side: MarkerSide::Squares(side_squares) }
            }
            Self::AprilGrid(AprilGrid { tags, .. }) => Pattern::AprilGrid(tags),
            Self::Circles(Circles { layout, .. }) => Pattern::Circles(layout),
        }
    }

    /// Common interface of all kinds.
    pub fn target(&self) -> &dyn Target {
        match self {
            Self::Plain(squares) => squares,
            Self::Charuco(charuco) => charuco,
            Self::AprilGrid(grid) => grid,
            Self::Circles(circles) => circles,
        }
    }

    /// Markers in the light squares, or tags; `None` on a plain board and on circles.
    pub fn markers(&self) -> Option<Markers> {
        self.target().markers()
    }

    /// Numbers of squares in a row and in a column.
    pub fn squares(&self) -> [usize; 2] {
        self.target().grid().map(|corners| corners + 1)
    }

    /// Number of points in a row.
    pub fn columns(&self) -> usize {
        self.target().grid()[0]
    }

    /// Number of points in a column.
    pub fn rows(&self) -> usize {
        self.target().grid()[1]
    }

    /// Side of a square, in metres. For an AprilGrid, the mean distance of neighbouring points.
    pub fn square_m(&self) -> f64 {
        self.target().pitch_m()
    }

    /// Length to measure with a ruler, in metres: side of a square, or of a tag; for circles, the
    /// distance of rows.
    pub fn measured_m(&self) -> f64 {
        self.target().steps_m()[0]
    }

    /// Largest distance of the points from the middle along both axes, in metres.
    pub fn reach_m(&self) -> [f64; 2] {
        self.target().reach_m()
    }

    /// Number of points.
    pub fn corner_count(&self) -> usize {
        self.target().point_count()
    }

    /// True if a half turn leaves the pattern unchanged.
    ///
    /// ```
    /// # use boresight_geometry::boards::Board;
    /// assert!(!Board::new(9, 6, 0.025)?.looks_the_same_upside_down());
    /// assert!(Board::new(9, 7, 0.025)?.looks_the_same_upside_down());
    /// # Ok::<(), boresight_geometry::boards::InvalidBoard>(())
    /// ```
    pub fn looks_the_same_upside_down(&self) -> bool {
        self.target().looks_the_same_upside_down()
    }

    /// Positions of all points in the board frame, in metres and in numbering order.
    pub fn corners_in_board_m(&self) -> Vec<Point2<f64>> {
        self.target().points_m()
    }
}

impl BoardChoice {
    /// Board with squares of `square_m` metres.
    ///
    /// # Errors
    ///
    /// [`InvalidChoice::Board`] or [`InvalidChoice::Markers`].
    ///
    /// ```
    /// # use boresight_geometry::boards::BoardChoice;
    /// let kinds = [("9x6", 54), ("charuco:8x11:DICT_4X4_50", 70), ("circles:4x11", 44)];
    /// for (name, points) in kinds {
    ///     let board = name.parse::<BoardChoice>()?.board(0.02)?;
    ///     assert_eq!(board.corner_count(), points, "{name}");
    /// }
    /// # Ok::<(), boresight_geometry::boards::InvalidChoice>(())
    /// ```
    pub fn board(&self, square_m: f64) -> Result<Board, InvalidChoice> {
        Ok(Board::new(self.columns, self.rows, square_m)?.with(self.pattern)?)
    }

    /// Board with an [unchecked pattern](Board::drawn_with); `None` with invalid counts.
    pub fn drawn(&self, square_m: f64) -> Option<Board> {
        Some(Board::new(self.columns, self.rows, square_m).ok()?.drawn_with(self.pattern))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_are_centred_and_row_major() {
        let board = Board::new(9, 6, 0.025).expect("valid");
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
        assert!(matches!(Board::new(2, 6, 0.025), Err(InvalidBoard::Count { .. })));
        for square_m in [0.0, -1.0, f64::NAN, f64::INFINITY, 10.0] {
            assert!(matches!(Board::new(9, 6, square_m), Err(InvalidBoard::Square { .. })));
        }
    }

    #[test]
    fn markers_must_fit_and_suffice() {
        let board = Board::new(7, 10, 0.02).expect("valid");
        let with = |name: &str, side_squares| {
            let dictionary = name.parse().expect("a dictionary");
            board.with(Pattern::Charuco { dictionary, side: MarkerSide::Squares(side_squares) })
        };
        assert!(with("DICT_4X4_50", 0.75).is_ok_and(|board| board.squares() == [8, 11]));
        assert!(matches!(with("DICT_4X4_50", 1.0), Err(InvalidMarkers::Side { .. })));
        let few = with("DICT_APRILTAG_16h5", 0.75);
        assert!(matches!(few, Err(InvalidMarkers::Count { needed: 44, count: 30, .. })));
    }

    #[test]
    fn mixed_parity_tells_up_from_down() {
        let same = |columns, rows| {
            Board::new(columns, rows, 0.02).expect("valid").looks_the_same_upside_down()
        };
        assert!(!same(9, 6) && !same(6, 7) && same(8, 6) && same(9, 7));
    }
}
