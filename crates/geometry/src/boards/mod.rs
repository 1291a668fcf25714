//! Calibration targets: the interface to a board of any kind.
//!
//! [`Board`] is a value for any kind of board; [`Board::target`] gives its pattern as a [`Target`].
//! A kind of board is a file here that implements [`Target`], a [`Pattern`], and a line in
//! [`BOARD_KINDS`].
//!
//! The board frame has its origin midway between the outermost points, `x` along a row (towards
//! higher columns), `y` along a column (towards higher rows) and `z = 0` on the paper, in metres.
//! Points are numbered row by row, all rows equally long: `index = row * columns + column`.

mod aprilgrid;
mod board;
mod charuco;
mod checkerboard;
mod choice;
mod circles;
mod kinds;
mod pattern;

#[doc(hidden)]
pub use aprilgrid::AprilGrid;
pub use board::Board;
#[doc(hidden)]
pub use charuco::Charuco;
#[doc(hidden)]
pub use checkerboard::Squares;
pub use choice::{BoardChoice, InvalidBoard, InvalidChoice};
#[doc(hidden)]
pub use choice::{BoardKind, length_m, millimetres};
#[doc(hidden)]
pub use circles::Circles;
#[doc(hidden)]
pub use kinds::BOARD_KINDS;
#[doc(hidden)]
pub use pattern::{MarkerSide, Pattern};

use nalgebra::Point2;

use crate::{
    coverage::BoardOutline,
    markers::{InvalidMarkers, Markers},
};

/// Flat board with points to be found in pictures.
pub trait Target {
    /// Numbers of points in a row and in a column; at least 3 each.
    fn grid(&self) -> [usize; 2];

    /// Distances of neighbouring points of a row or column, in metres: from the first point to the
    /// second, from the third to the fourth and so on; and the ones between. If every second row is
    /// shifted: half of a row's distance, and that of rows.
    fn steps_m(&self) -> [f64; 2];

    /// Mean distance of neighbouring points of a row, in metres.
    fn pitch_m(&self) -> f64 {
        let [one, other] = self.steps_m();
        0.5 * (one + other)
    }

    /// Positions of all points in the board frame, in metres and in numbering order.
    fn points_m(&self) -> Vec<Point2<f64>>;

    /// Width and height of the printed pattern, in metres, including any print outside of the
    /// outermost points. Its centre is the origin.
    fn size_m(&self) -> [f64; 2];

    /// Largest distance of the points from the middle along both axes, in metres.
    fn reach_m(&self) -> [f64; 2] {
        self.points_m().iter().fold([0.0; 2], |[x, y], point| [point.x.max(x), point.y.max(y)])
    }

    /// Reach from the middle along both axes of the part needed in the picture, in metres, to
    /// measure all points.
    fn needed_m(&self) -> [f64; 2] {
        self.reach_m()
    }

    /// True if a half turn leaves the pattern unchanged, so that the numbers of the points are
    /// known only up to [`half_turn`](Self::half_turn). Harmless when calibrating a single camera.
    fn looks_the_same_upside_down(&self) -> bool;

    /// Information in a part of the board about the numbers of the points.
    fn part_tells(&self) -> PartTells;

    /// Markers that name the points beside them.
    fn markers(&self) -> Option<Markers> {
        None
    }

    /// Checks that the board can have its markers.
    ///
    /// # Errors
    ///
    /// [`InvalidMarkers`].
    fn check(&self) -> Result<(), InvalidMarkers> {
        Ok(())
    }

    /// Dark shapes of the print, on white.
    fn dark_shapes(&self) -> DarkShapes;

    /// Number of points.
    fn point_count(&self) -> usize {
        let [columns, rows] = self.grid();
        columns * rows
    }

    /// Column and row of a point in the first of [`steps_m`](Self::steps_m), from the upper left
    /// corner of the points.
    fn place_in_steps(&self, index: usize) -> [f64; 2] {
        let [one, other] = self.steps_m();
        // Whole numbers if all steps are equal.
        self.place(index).map(|at| (at / 2) as f64 * (1.0 + other / one) + (at % 2) as f64)
    }

    /// Longer side, in metres, with a pitch for each point.
    fn length_m(&self) -> f64 {
        let [columns, rows] = self.grid();
        columns.max(rows) as f64 * self.pitch_m()
    }

    /// Column and row of a point.
    fn place(&self, index: usize) -> [usize; 2] {
        let [columns, _] = self.grid();
        [index % columns, index / columns]
    }

    /// Point at the place of `index` after a half turn of the board about the centre. Two half
    /// turns lead back. `None` if the turned points lie elsewhere.
    ///
    /// # Panics
    ///
    /// If there's no such point.
    fn half_turn(&self, index: usize) -> Option<usize> {
        Some(self.point_count() - 1 - index)
    }

    /// Points next to `index` in row, column and diagonals: eight, or fewer at the rim.
    fn neighbours(&self, index: usize) -> Vec<usize> {
        let [columns, rows] = self.grid();
        let [column, row] = self.place(index);
        let around = |at: usize, count: usize| at.saturating_sub(1)..(at + 2).min(count);
        around(row, rows)
            .flat_map(|row| around(column, columns).map(move |column| row * columns + column))
            .filter(|other| *other != index)
            .collect()
    }

    /// Calls `see` with three consecutive points in a row or column, and the position of the middle
    /// point as a share of the way from the first to the last. Each two neighbours of a row or
    /// column are in at least one triple.
    fn each_three_in_line(&self, see: &mut dyn FnMut([usize; 3], f64)) {
        let [columns, rows] = self.grid();
        let steps_m = self.steps_m();
        let share = |place: usize| steps_m[place % 2] / (steps_m[0] + steps_m[1]);
        for index in 0..self.point_count() {
            let [column, row] = self.place(index);
            if column + 2 < columns {
                see([index, index + 1, index + 2], share(column));
            }
            if row + 2 < rows {
                see([index, index + columns, index + 2 * columns], share(row));
            }
        }
    }

    /// The four outermost points, in order around the board from the first point.
    fn rim(&self) -> [usize; 4] {
        let [columns, rows] = self.grid();
        let last = columns * rows - 1;
        [0, columns - 1, last, last + 1 - columns]
    }

    /// Outline of the seen part of a board with points at `points_px`, in numbering order;
    /// `is_seen` is true for the indices of seen points.
    ///
    /// `None` with another number of points, if fewer than two are seen, or if the outermost seen
    /// ones aren't finite.
    fn outline(
        &self,
        points_px: &[Point2<f64>],
        is_seen: &dyn Fn(usize) -> bool,
    ) -> Option<BoardOutline> {
        let of_this = points_px.len() == self.point_count();
        let place = |index: usize| self.place_in_steps(index);
        let outline = || BoardOutline::of_seen(points_px, &place, is_seen);
        of_this.then(outline).flatten()
    }
}

/// Information in a part of a board about the numbers of the points.
#[doc(hidden)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PartTells {
    /// Every point, named by the print beside it.
    EachPoint,
    /// Every point, if the rest of the board is located: a part counts if followed from a whole
    /// board, or if a code is seen in the margin beside it.
    WhenFollowed,
    /// Nothing: a board counts only if the missing part is so small that it has only one possible
    /// place.
    Nothing,
}

/// Print of a board, on white. Shapes may overlap.
#[doc(hidden)]
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DarkShapes {
    /// Shapes visible from afar that make up the pattern, row by row.
    pub large: Vec<Shape>,
    /// Shapes visible from near, such as cells of markers.
    pub fine: Vec<Shape>,
}

/// Dark shape in the board frame.
#[doc(hidden)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shape {
    /// Rectangle with sides along `x` and `y`.
    Rectangle {
        /// Corner with the lowest `x` and `y`, in metres.
        low_m: [f64; 2],
        /// Opposite corner, in metres.
        high_m: [f64; 2],
    },
    /// Disc.
    Disc {
        /// Centre, in metres.
        centre_m: [f64; 2],
        /// Radius, in metres.
        radius_m: f64,
    },
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector2;
    use proptest::prelude::*;

    use super::*;
    use crate::markers::{CircleRows, Dictionary};

    /// Boards of every kind with this many points.
    fn boards(columns: u16, rows: u16, square_m: f64) -> Vec<Board> {
        let board = |kind: &BoardKind| {
            let [columns, rows] = [columns, rows].map(|points| kind.nearest(points));
            let (usual, side) = ((kind.usual)(), MarkerSide::Usual);
            let large = |it: Dictionary| Pattern::Charuco { dictionary: it.family(), side };
            let pattern = usual.dictionary().map_or(usual, large);
            BoardChoice::of([columns, rows], pattern).board(square_m).expect("markers fit")
        };
        BOARD_KINDS.iter().map(board).collect()
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        #[test]
        fn a_target_is_what_its_parts_say(
            columns in 3_u16..20,
            rows in 3_u16..20,
            square_m in 0.001_f64..1.0,
        ) {
            for board in boards(columns, rows, square_m) {
                let target = board.target();
                let points_m = target.points_m();
                prop_assert_eq!(points_m.len(), target.point_count());
                let [low, high] = [f64::min, f64::max].map(|further: fn(f64, f64) -> f64| {
                    let coords = points_m.iter().map(|point| point.coords);
                    coords.reduce(|a, b| a.zip_map(&b, further)).expect("points")
                });
                prop_assert!((low + high).norm() < 1e-9);
                if target.half_turn(0).is_some() {
                    let sum = points_m.iter().map(|point| point.coords).sum::<Vector2<f64>>();
                    prop_assert!(sum.norm() < 1e-9);
                }

                let [width_m, height_m] = target.size_m();
                for (index, point) in points_m.iter().enumerate() {
                    prop_assert!(2.0 * point.x.abs() < width_m && 2.0 * point.y.abs() < height_m);
                    if let Some(turned) = target.half_turn(index) {
                        prop_assert_eq!(target.half_turn(turned), Some(index));
                        prop_assert!((points_m[turned] + point.coords).coords.norm() < 1e-12);
                    }
                    for other in target.neighbours(index) {
                        prop_assert!(other != index && target.neighbours(other).contains(&index));
                        let apart_m = (points_m[other] - point).norm();
                        prop_assert!(apart_m < 1.5 * target.steps_m()[0]);
                    }
                }
                let mut in_lines = vec![false; points_m.len()];
                let mut most_off_m = 0.0_f64;
                target.each_three_in_line(&mut |line, share| {
                    let [a, b, c] = line.map(|index| points_m[index].coords);
                    most_off_m = most_off_m.max((a.lerp(&c, share) - b).norm());
                    for index in line {
                        in_lines[index] = true;
                    }
                });
                prop_assert!(most_off_m < 1e-12);
                prop_assert!(in_lines.into_iter().all(|is_in| is_in));
                prop_assert!(target.length_m() < width_m.max(height_m));
            }
        }

        #[test]
        fn the_outline_of_a_whole_board_is_its_rim_and_holds_every_point(
            columns in 3_u16..20,
            rows in 3_u16..20,
        ) {
            for board in boards(columns, rows, 0.025) {
                let target = board.target();
                let px = target.points_m();
                let outline = target.outline(&px, &|_| true).expect("seen");
                prop_assert_eq!(*outline.corners_px(), target.rim().map(|index| px[index]));
                // Shifted rows leave a quadrilateral by less than their distance.
                let are_shifted = board.pattern() == Pattern::Circles(CircleRows::Asymmetric);
                let beyond_px = if are_shifted { 0.025 } else { 1e-9 };
                prop_assert!(px.iter().all(|point| outline.reaches(point, beyond_px)));
                prop_assert_eq!(target.outline(&px[1..], &|_| true), None);
                prop_assert_eq!(target.outline(&px, &|index| index == 1), None);
            }
        }

        /// The seen points nearest to the rim's are extreme in four directions of the grid.
        #[test]
        fn the_outline_of_a_part_is_convex(
            columns in 3_u16..9,
            rows in 3_u16..9,
            seen in proptest::collection::vec(any::<bool>(), 64),
        ) {
            for board in boards(columns, rows, 0.025) {
                let points_m = board.target().points_m();
                let tipped =
                    |m: &Point2<f64>| Point2::new(m.x, m.y) * (500.0 / (1.0 + 2.0 * m.x + m.y));
                let px: Vec<Point2<f64>> = points_m.iter().map(tipped).collect();
                let Some(outline) = board.target().outline(&px, &|index| seen[index]) else {
                    continue;
                };
                let at = outline.corners_px();
                for i in 0..4 {
                    let (here, next) = (at[(i + 1) % 4] - at[i], at[(i + 2) % 4] - at[(i + 1) % 4]);
                    prop_assert!(here.perp(&next) >= -1e-9);
                }
            }
        }

        #[test]
        fn what_is_printed_lies_in_the_pattern_and_turns_with_it(
            columns in 3_u16..9,
            rows in 3_u16..9,
        ) {
            for board in boards(columns, rows, 0.025) {
                let target = board.target();
                let half_m = target.size_m().map(|side_m| 0.5 * side_m + 1e-12);
                let DarkShapes { large, fine } = target.dark_shapes();
                let all: Vec<Shape> = large.into_iter().chain(fine).collect();
                for shape in &all {
                    let [low_m, high_m] = match *shape {
                        Shape::Rectangle { low_m, high_m } => [low_m, high_m],
                        Shape::Disc { centre_m, radius_m } => {
                            [-radius_m, radius_m].map(|way_m| centre_m.map(|at_m| at_m + way_m))
                        }
                    };
                    prop_assert!((0..2).all(|axis| -half_m[axis] <= low_m[axis]
                        && low_m[axis] < high_m[axis]
                        && high_m[axis] <= half_m[axis]));
                }
                let is_dark = |at: Vector2<f64>| all.iter().any(|shape| match *shape {
                    Shape::Rectangle { low_m, high_m } => {
                        (0..2).all(|axis| (low_m[axis]..high_m[axis]).contains(&at[axis]))
                    }
                    Shape::Disc { centre_m, radius_m } => {
                        (at - Vector2::from(centre_m)).norm() < radius_m
                    }
                });
                let steps = || (0..200).map(|step| (f64::from(step) + 0.5) / 100.0 - 1.0);
                // Two numbers without a common period reach all over the pattern.
                let same = steps().zip(steps().map(|s| (s * 61.8034).fract())).all(|(x, y)| {
                    let at = Vector2::new(x * half_m[0], y * half_m[1]);
                    is_dark(at) == is_dark(-at)
                });
                prop_assert_eq!(same, target.looks_the_same_upside_down());
            }
        }
    }
}
