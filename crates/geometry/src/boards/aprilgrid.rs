//! Kalibr's AprilGrid: rows of tags, with dark squares touching their corners.

use std::str::FromStr;

use nalgebra::Point2;

use super::{
    BoardChoice, BoardKind, DarkShapes, InvalidChoice, PartTells, Pattern, Shape, Target,
    charuco::runs, choice,
};
use crate::markers::{InvalidMarkers, Layout, Markers, Tags};

/// Name and text form of an AprilGrid.
pub(super) const KIND: BoardKind = BoardKind {
    name: "aprilgrid",
    example: "aprilgrid:6x6",
    counted: |points| points / 2,
    points: |tags| 2 * tags,
    counts: [2, 49],
    usual: || Pattern::AprilGrid(Tags::default()),
    read: |text| {
        let mut parts = text.split(':');
        let (Some(tags), spacing, first, None) =
            (parts.next(), parts.next(), parts.next(), parts.next())
        else {
            return Err(InvalidChoice::NotAprilGrid);
        };
        let usual = Tags::default();
        let tags_in = choice::counts(tags).ok_or(InvalidChoice::NotAprilGrid)?;
        let [columns, rows] = tags_in.map(|count| count.saturating_mul(2));
        let tags =
            Tags { spacing: number(spacing, usual.spacing)?, first: number(first, usual.first)? };
        Ok(BoardChoice { columns, rows, pattern: Pattern::AprilGrid(tags) })
    },
    write: |named| {
        let [across, down] = [named.columns, named.rows].map(|points| points / 2);
        let counts = format!("aprilgrid:{across}x{down}");
        let usual = Tags::default();
        match named.pattern.tags().unwrap_or(usual) {
            tags if tags == usual => counts,
            Tags { spacing, first } if first == usual.first => format!("{counts}:{spacing}"),
            Tags { spacing, first } => format!("{counts}:{spacing}:{first}"),
        }
    },
};

/// Number in a part of the argument, or the usual number without the part.
fn number<T: FromStr>(text: Option<&str>, usual: T) -> Result<T, InvalidChoice> {
    let read = |text: &str| text.trim().parse().map_err(|_| InvalidChoice::NotAprilGrid);
    text.map_or(Ok(usual), read)
}

/// Tags with white between them, and dark squares at the tags' corners, which are the points. The
/// grid is a checkerboard whose columns and rows are by turns as wide as a tag and as the white
/// between tags; the tags are its larger dark squares.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AprilGrid {
    /// Number of points in a row, two for each tag.
    pub(super) columns: u16,
    /// Number of points in a column.
    pub(super) rows: u16,
    /// Side of a tag, in metres.
    pub(super) tag_m: f64,
    pub(super) tags: Tags,
}

impl AprilGrid {
    /// Tags as markers that fill their squares.
    fn as_markers(&self) -> Markers {
        let Tags { spacing, first } = self.tags;
        let markers = Markers {
            dictionary: Tags::dictionary(),
            side_squares: 1.0,
            frame_cells: Tags::FRAME_CELLS,
            first,
            white_at: -0.5 * spacing,
            square_steps: 1.0 / spacing,
            gap_steps: 0.0,
            layouts: &Layout::TAGS,
        };
        let frame = markers.cell_side() * Tags::FRAME_CELLS as f64;
        Markers { gap_steps: frame * markers.square_steps, ..markers }
    }

    /// Position of the line between two columns or rows of squares, from the middle of the board;
    /// −1 is the pattern's edge, and 0 the first point's line.
    fn line_m(&self, points: u16, line: i32) -> f64 {
        let [tag_m, white_m] = self.steps_m();
        let half_m = (f64::from(points / 2) * (tag_m + white_m) - white_m) / 2.0;
        let before = f64::from(line.div_euclid(2)) * (tag_m + white_m);
        before + f64::from(line.rem_euclid(2)) * tag_m - half_m
    }

    /// Rectangle between these shares of the square in a column and row of squares.
    fn within(&self, square: [i32; 2], from: [f64; 2], to: [f64; 2]) -> Shape {
        let points = [self.columns, self.rows];
        let place = |axis: usize, share: f64| {
            let [low_m, high_m] =
                [-1, 0].map(|after| self.line_m(points[axis], square[axis] + after));
            low_m + share * (high_m - low_m)
        };
        Shape::Rectangle {
            low_m: std::array::from_fn(|axis| place(axis, from[axis])),
            high_m: std::array::from_fn(|axis| place(axis, to[axis])),
        }
    }

    /// Squares with even (0) or odd (1) columns and rows.
    fn squares(&self, odd: i32) -> impl Iterator<Item = [i32; 2]> + use<> {
        let [across, down] = self.grid().map(|points| points as i32);
        let step = move |end: i32| (odd..=end).step_by(2);
        step(down).flat_map(move |row| step(across).map(move |column| [column, row]))
    }
}

impl Target for AprilGrid {
    fn grid(&self) -> [usize; 2] {
        [self.columns, self.rows].map(usize::from)
    }

    fn steps_m(&self) -> [f64; 2] {
        [self.tag_m, self.tags.spacing * self.tag_m]
    }

    fn points_m(&self) -> Vec<Point2<f64>> {
        let [columns, rows] = [self.columns, self.rows].map(i32::from);
        (0..rows)
            .flat_map(|row| (0..columns).map(move |column| (column, row)))
            .map(|(column, row)| {
                Point2::new(self.line_m(self.columns, column), self.line_m(self.rows, row))
            })
            .collect()
    }

    fn size_m(&self) -> [f64; 2] {
        [self.columns, self.rows].map(|points| 2.0 * self.line_m(points, i32::from(points)))
    }

    fn looks_the_same_upside_down(&self) -> bool {
        false
    }

    fn part_tells(&self) -> PartTells {
        PartTells::EachPoint
    }

    fn markers(&self) -> Option<Markers> {
        Some(self.as_markers())
    }

    fn check(&self) -> Result<(), InvalidMarkers> {
        let Self { columns, rows, tags: Tags { spacing, first }, .. } = *self;
        if [columns, rows].iter().any(|points| *points < 4 || !points.is_multiple_of(2)) {
            return Err(InvalidMarkers::Tags { columns, rows });
        }
        let [least, most] = InvalidMarkers::SPACINGS;
        if !(least..=most).contains(&spacing) {
            return Err(InvalidMarkers::Spacing { spacing });
        }
        let last = usize::from(first) + usize::from(columns / 2) * usize::from(rows / 2) - 1;
        let dictionary = Tags::dictionary();
        let highest = dictionary.count() - 1;
        if last > highest {
            let dictionary = dictionary.name();
            return Err(InvalidMarkers::Numbers { first, last, dictionary, highest });
        }
        Ok(())
    }

    /// Shapes of the board. The squares at the corners and the tags' frames are visible from afar.
    fn dark_shapes(&self) -> DarkShapes {
        let mut large: Vec<Shape> =
            self.squares(0).map(|square| self.within(square, [0.0; 2], [1.0; 2])).collect();
        let mut fine = Vec::new();
        let markers = self.as_markers();
        let (side, cell) = (markers.cells(), markers.cell_side());
        let frame = markers.frame_cells as f64 * cell;
        let size = self.grid().map(|points| points + 1);
        for square in self.squares(1) {
            for (from, to) in [
                ([0.0, 0.0], [1.0, frame]),
                ([0.0, 1.0 - frame], [1.0, 1.0]),
                ([0.0, 0.0], [frame, 1.0]),
                ([1.0 - frame, 0.0], [1.0, 1.0]),
            ] {
                large.push(self.within(square, from, to));
            }
            let code =
                markers.code_at(markers.layouts[0], square.map(|place| place as usize), size);
            let Some(code) = code else { continue };
            let is_black = |at: [usize; 2]| markers.is_black(code, at);
            let mut push = |from: [usize; 2], to: [usize; 2]| {
                let share = |cells: [usize; 2]| cells.map(|cells| cells as f64 * cell);
                fine.push(self.within(square, share(from), share(to)));
            };
            // Cells next to the frame continue beneath it, so that no seam shows.
            for line in markers.frame_cells..side - markers.frame_cells {
                for [from, to] in runs(side, |at| is_black([at, line])) {
                    push([from, line], [to, line + 1]);
                }
                for [from, to] in runs(side, |at| is_black([line, at])) {
                    push([line, from], [line + 1, to]);
                }
            }
        }
        DarkShapes { large, fine }
    }
}

#[cfg(test)]
mod tests {
    use super::{super::Board, *};

    /// Points by Kalibr's `GridCalibrationTargetAprilgrid`, whose `y` points up and whose origin is
    /// the corner at the lower left.
    #[test]
    fn points_lie_where_kalibr_has_them() {
        let tags = Pattern::AprilGrid(Tags { spacing: 0.25, first: 0 });
        let board = Board::new(4, 6, 0.08).expect("a board").with(tags).expect("fit");
        let points_m = board.corners_in_board_m();
        for row in 0..6_usize {
            for column in 0..4_usize {
                let along = |k: usize| (k / 2) as f64 * 1.25 * 0.08 + (k % 2) as f64 * 0.08;
                let kalibr = Point2::new(along(column), along(row));
                let here = points_m[(5 - row) * 4 + column] - points_m[5 * 4];
                assert!((here.x - kalibr.x).abs() < 1e-12 && (here.y + kalibr.y).abs() < 1e-12);
            }
        }
    }
}
