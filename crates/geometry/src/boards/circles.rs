//! Grids of circles, as in OpenCV's `findCirclesGrid`.

use nalgebra::{Point2, Vector2};

use super::{
    BoardChoice, BoardKind, DarkShapes, InvalidChoice, PartTells, Pattern, Shape, Squares, Target,
    checkerboard, choice,
};
use crate::markers::CircleRows;

/// Name and text form of a grid with rows below each other.
pub(super) const SYMMETRIC: BoardKind = BoardKind {
    name: "circles",
    example: "circles:7x5",
    read: |text| read(text, CircleRows::Symmetric),
    write: |named| format!("circles:{}x{}", named.columns, named.rows),
    usual: || Pattern::Circles(CircleRows::Symmetric),
    ..checkerboard::KIND
};

/// Name and text form of a grid with every second row shifted.
pub(super) const ASYMMETRIC: BoardKind = BoardKind {
    name: "acircles",
    example: "acircles:4x11",
    read: |text| read(text, CircleRows::Asymmetric),
    write: |named| format!("acircles:{}x{}", named.columns, named.rows),
    usual: || Pattern::Circles(CircleRows::Asymmetric),
    ..checkerboard::KIND
};

fn read(text: &str, layout: CircleRows) -> Result<BoardChoice, InvalidChoice> {
    let [columns, rows] = choice::counts(text).ok_or(InvalidChoice::NotCircles)?;
    Ok(BoardChoice { columns, rows, pattern: Pattern::Circles(layout) })
}

/// Dark circles on white; the centres are the points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Circles {
    /// Squares, one for each circle; their side is the distance of rows.
    pub(super) squares: Squares,
    pub(super) layout: CircleRows,
}

impl Circles {
    /// Diameter of printed circles, in distances of rows. Others are found, too.
    pub const DIAMETER: f64 = 0.5;

    /// Reach of the necessary ground around the outermost centres, in distances of rows.
    pub const GROUND: f64 = 0.85;

    /// Layout of the rows.
    pub fn layout(&self) -> CircleRows {
        self.layout
    }

    /// Distance between adjacent circles of a row, in distances of rows.
    pub fn step(&self) -> usize {
        match self.layout {
            CircleRows::Symmetric => 1,
            CircleRows::Asymmetric => 2,
        }
    }

    /// Place of a circle in distances of rows, from the upper left corner.
    pub fn at(&self, index: usize) -> [usize; 2] {
        let [column, row] = self.place(index);
        [self.step() * column + row % self.step(), row]
    }

    /// Distances of rows from the first column to the last, and from the first row to the last.
    pub fn reach(&self) -> [usize; 2] {
        let [columns, rows] = self.grid();
        [self.step() * columns - 1, rows - 1]
    }
}

impl Target for Circles {
    fn grid(&self) -> [usize; 2] {
        self.squares.grid()
    }

    fn steps_m(&self) -> [f64; 2] {
        self.squares.steps_m()
    }

    fn points_m(&self) -> Vec<Point2<f64>> {
        let middle = self.reach().map(|reach| reach as f64 / 2.0);
        let along =
            |at: [usize; 2], axis: usize| (at[axis] as f64 - middle[axis]) * self.squares.square_m;
        let at = |index: usize| self.at(index);
        (0..self.point_count()).map(at).map(|at| Point2::new(along(at, 0), along(at, 1))).collect()
    }

    fn size_m(&self) -> [f64; 2] {
        self.reach().map(|reach| (reach as f64 + Self::DIAMETER) * self.squares.square_m)
    }

    /// Reach including the surrounding ground, which shows the end of the grid.
    fn needed_m(&self) -> [f64; 2] {
        self.reach().map(|reach| (0.5 * reach as f64 + Self::GROUND) * self.squares.square_m)
    }

    fn place_in_steps(&self, index: usize) -> [f64; 2] {
        self.at(index).map(|at| at as f64)
    }

    fn length_m(&self) -> f64 {
        let [across, down] = self.reach();
        across.max(down) as f64 * self.squares.square_m
    }

    /// True for unshifted rows, or an even number of rows: of an odd number, the shifted ones tell
    /// up from down.
    fn looks_the_same_upside_down(&self) -> bool {
        self.step() == 1 || self.grid()[1].is_multiple_of(2)
    }

    fn half_turn(&self, index: usize) -> Option<usize> {
        self.looks_the_same_upside_down().then(|| self.point_count() - 1 - index)
    }

    /// Nothing, as all circles look alike.
    fn part_tells(&self) -> PartTells {
        PartTells::Nothing
    }

    fn dark_shapes(&self) -> DarkShapes {
        let radius_m = 0.5 * Self::DIAMETER * self.squares.square_m;
        let disc = |point: Point2<f64>| Shape::Disc { centre_m: point.into(), radius_m };
        DarkShapes { large: self.points_m().into_iter().map(disc).collect(), fine: Vec::new() }
    }

    /// Nearest points, and the adjacent points of the row.
    fn neighbours(&self, index: usize) -> Vec<usize> {
        let place = |index: usize| Vector2::from(self.place_in_steps(index));
        let here = place(index);
        let is_near = |other: &usize| *other != index && (place(*other) - here).norm() < 1.5;
        (0..self.point_count()).filter(is_near).collect()
    }

    fn each_three_in_line(&self, see: &mut dyn FnMut([usize; 3], f64)) {
        let [columns, rows] = self.grid();
        // Every second row of a shifted grid is in line.
        let down = self.step() * columns;
        for index in 0..self.point_count() {
            let [column, row] = self.place(index);
            if column + 2 < columns {
                see([index, index + 1, index + 2], 0.5);
            }
            if row + 2 * self.step() < rows {
                see([index, index + down, index + 2 * down], 0.5);
            }
        }
    }

    fn rim(&self) -> [usize; 4] {
        let [across, down] = self.reach();
        [[0, 0], [across, 0], [across, down], [0, down]].map(|corner| {
            let apart = |index: &usize| {
                let at = self.at(*index);
                let [x, y] = [0, 1].map(|axis: usize| at[axis].abs_diff(corner[axis]));
                (x + y, x.max(y))
            };
            (0..self.point_count()).min_by_key(apart).unwrap_or_default()
        })
    }
}
