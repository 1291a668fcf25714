//! The plain checkerboard.

use nalgebra::Point2;

use super::{
    BoardChoice, BoardKind, DarkShapes, InvalidChoice, PartTells, Pattern, Shape, Target, choice,
};

/// Name and text form of a checkerboard.
pub(super) const KIND: BoardKind = BoardKind {
    name: "checkerboard",
    example: "9x6",
    counted: |points| points,
    points: |corners| corners,
    counts: [3, 99],
    usual: || Pattern::Plain,
    read: |text| {
        let [columns, rows] = choice::counts(text).ok_or(InvalidChoice::NotCounts)?;
        Ok(BoardChoice { columns, rows, pattern: Pattern::Plain })
    },
    write: |named| format!("{}x{}", named.columns, named.rows),
};

/// Dark and light squares, described by the inner corners, which are the points. The outermost
/// squares are whole.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Squares {
    pub(super) columns: u16,
    pub(super) rows: u16,
    pub(super) square_m: f64,
}

impl Squares {
    /// Numbers of squares in a row and in a column.
    pub(super) fn count(&self) -> [usize; 2] {
        self.grid().map(|corners| corners + 1)
    }

    /// Rectangle between two places, in squares from the upper left corner of the pattern.
    pub(super) fn rectangle(&self, low: [f64; 2], high: [f64; 2]) -> Shape {
        let size_m = self.size_m();
        let in_board_m = |place: [f64; 2]| {
            std::array::from_fn(|axis| place[axis] * self.square_m - 0.5 * size_m[axis])
        };
        Shape::Rectangle { low_m: in_board_m(low), high_m: in_board_m(high) }
    }
}

impl Target for Squares {
    fn grid(&self) -> [usize; 2] {
        [self.columns, self.rows].map(usize::from)
    }

    fn steps_m(&self) -> [f64; 2] {
        [self.square_m; 2]
    }

    fn points_m(&self) -> Vec<Point2<f64>> {
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

    fn size_m(&self) -> [f64; 2] {
        self.count().map(|squares| squares as f64 * self.square_m)
    }

    /// True if both counts are odd or both even.
    fn looks_the_same_upside_down(&self) -> bool {
        self.columns % 2 == self.rows % 2
    }

    fn part_tells(&self) -> PartTells {
        PartTells::WhenFollowed
    }

    /// Dark squares, including the upper left corner's.
    fn dark_shapes(&self) -> DarkShapes {
        let [across, down] = self.count();
        let dark = (0..down).flat_map(|row| (row % 2..across).step_by(2).map(move |at| [at, row]));
        let square = |place: [usize; 2]| {
            self.rectangle(place.map(|at| at as f64), place.map(|at| (at + 1) as f64))
        };
        DarkShapes { large: dark.map(square).collect(), fine: Vec::new() }
    }
}
