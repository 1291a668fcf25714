//! The tags of a printed AprilGrid, and the dark squares at the tags' corners.

use super::printed_markers::{Cells, Crossing};
use boresight_geometry::{
    boards::Board,
    markers::{Markers, Tags},
};

/// Printed AprilGrid, in sides of a tag from the upper left corner of the pattern.
#[derive(Clone, Debug)]
pub(super) struct PrintedTags {
    markers: Markers,
    /// White between two tags.
    white: f32,
    /// Side of a cell.
    cell: f32,
    /// Tags in a row.
    across: usize,
    /// Cells of the tags, row by row.
    codes: Vec<u64>,
}

/// Position along an axis.
#[derive(Clone, Copy)]
enum Place {
    /// In a tag's column or row: index of the tag, and of the cell.
    Tag(usize, usize),
    /// In a narrow column or row.
    White,
}

impl PrintedTags {
    /// Printed tags; `None` for other boards.
    pub(super) fn new(board: &Board) -> Option<Self> {
        let markers = board.markers()?;
        let Tags { spacing, .. } = board.pattern().tags()?;
        let size = board.squares();
        let layout = markers.layouts[0];
        let [across, down] = size.map(|squares| squares / 2);
        let code = |tag: usize| {
            let square = [2 * (tag % across) + 1, 2 * (tag / across) + 1];
            markers.code_at(layout, square, size).unwrap_or_default()
        };
        Some(Self {
            markers,
            white: spacing as f32,
            cell: markers.cell_side() as f32,
            across,
            codes: (0..across * down).map(code).collect(),
        })
    }

    /// True if a point of the pattern is black.
    pub(super) fn is_black(&self, u: f32, v: f32) -> bool {
        match (self.place(u), self.place(v)) {
            (Place::White, Place::White) => true,
            (Place::Tag(column, across), Place::Tag(row, down)) => {
                let code = self.codes.get(row * self.across + column).copied().unwrap_or_default();
                self.markers.is_black(code, [across, down])
            }
            _ => false,
        }
    }

    /// Contents within `du`, `dv` of a point.
    pub(super) fn around(&self, u: f32, v: f32, du: f32, dv: f32) -> Cells {
        let ([line_u, next_u], [line_v, next_v]) = (self.lines(u, du), self.lines(v, dv));
        if line_u.is_none() && line_v.is_none() {
            return Cells::One;
        }
        if next_u.is_some() || next_v.is_some() {
            return Cells::More;
        }
        // Beside a missing line, both sides are the same.
        let sides = |at: f32, line: Option<f32>, reach: f32| match line {
            Some(line) => [0.5 * (at - reach + line), 0.5 * (at + reach + line)],
            None => [at, at],
        };
        let ([left, right], [top, bottom]) = (sides(u, line_u, du), sides(v, line_v, dv));
        let dark = [(left, top), (right, top), (left, bottom), (right, bottom)]
            .map(|(u, v)| self.is_black(u, v));
        Cells::Four(Crossing { at: [line_u.unwrap_or(u), line_v.unwrap_or(v)], dark })
    }

    fn place(&self, at: f32) -> Place {
        let from_first = at - self.white;
        if from_first < 0.0 {
            return Place::White;
        }
        let tag = (from_first / (1.0 + self.white)) as usize;
        let within = from_first - tag as f32 * (1.0 + self.white);
        if within >= 1.0 {
            return Place::White;
        }
        Place::Tag(tag, ((within / self.cell) as usize).min(self.markers.cells() - 1))
    }

    /// First two lines between columns or rows of squares and cells within `reach` of a position.
    fn lines(&self, at: f32, reach: f32) -> [Option<f32>; 2] {
        let period = 1.0 + self.white;
        let cells = self.markers.cells();
        let mut found = [None; 2];
        let first = ((at - reach - self.white) / period).floor();
        // Lines of a tag, and the first line of the next tag.
        for tag in [first, first + 1.0, first + 2.0] {
            let start = self.white + tag * period;
            let from = ((at - reach - start) / self.cell).ceil().max(0.0);
            if from > cells as f32 {
                continue;
            }
            for line in from as usize..=cells {
                let line = start + line as f32 * self.cell;
                if line > at + reach {
                    break;
                }
                match &mut found {
                    [first @ None, _] => *first = Some(line),
                    [_, second] => {
                        *second = Some(line);
                        return found;
                    }
                }
            }
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use boresight_geometry::boards::{DarkShapes, Pattern, Shape};

    /// The rendered sheet equals the printed sheet.
    #[test]
    fn the_sheet_is_black_where_the_board_is() {
        let tags = Pattern::AprilGrid(Tags { spacing: 0.3, first: 7 });
        let board = Board::new(6, 4, 0.02).map(|board| board.with(tags));
        let board = board.expect("a board").expect("tags fit");
        let printed = PrintedTags::new(&board).expect("tags");
        let DarkShapes { large, fine } = board.target().dark_shapes();
        let size_m = board.target().size_m();
        let (mut one, mut four) = (0, 0);
        for step in 0..20_000 {
            // All over the pattern, by two numbers without a common period.
            let share = [0.618_033_9, 0.754_877_7].map(|k| (step as f32 * k).fract());
            let [u, v] = [0, 1].map(|k| share[k] * size_m[k] as f32 / 0.02);
            let at_m = [u, v].map(|at| f64::from(at) * 0.02);
            let is_black = large.iter().chain(&fine).any(|shape| {
                let Shape::Rectangle { low_m, high_m } = shape else { return false };
                (0..2).all(|k| {
                    let at_m = at_m[k] - 0.5 * size_m[k];
                    low_m[k] <= at_m && at_m < high_m[k]
                })
            });
            let reach = 0.002 + 0.03 * (step as f32 * 0.414_213_5).fract();
            let seen = printed.around(u, v, reach, reach);
            let near_line = printed.lines(u, 1e-4)[0].or(printed.lines(v, 1e-4)[0]).is_some();
            assert!(near_line || printed.is_black(u, v) == is_black, "{u} {v}");
            for (x, y) in [(-0.9, -0.9), (0.9, -0.9), (-0.9, 0.9), (0.9, 0.9), (0.0, 0.3)] {
                let at = [u + x * reach, v + y * reach];
                let inside = (0..2).all(|k| (0.0..size_m[k] as f32 / 0.02).contains(&at[k]));
                let black = printed.is_black(at[0], at[1]);
                match seen {
                    Cells::One if inside => assert_eq!(black, printed.is_black(u, v), "{at:?}"),
                    Cells::Four(crossing) if inside => {
                        let quarter = usize::from(at[0] >= crossing.at[0])
                            + 2 * usize::from(at[1] >= crossing.at[1]);
                        let from_line =
                            (at[0] - crossing.at[0]).abs().min((at[1] - crossing.at[1]).abs());
                        assert!(
                            from_line < 1e-4 || black == crossing.dark[quarter],
                            "{at:?} {crossing:?}"
                        );
                    }
                    _ => {}
                }
            }
            one += usize::from(seen == Cells::One);
            four += usize::from(matches!(seen, Cells::Four(_)));
        }
        assert!(one > 1_000 && four > 1_000, "{one} {four}");
    }
}
