//! Marker cells of a printed sheet, spread out for fast lookup.

use boresight_geometry::{
    boards::Board,
    markers::{Layout, Markers},
};

/// Black cells of every square.
#[derive(Clone, Debug)]
pub(super) struct PrintedMarkers {
    /// White between a marker and the square's edge, in squares.
    gap: f32,
    /// Side of a cell, in squares.
    cell: f32,
    /// Number of cells along a side, with the frame.
    side: i32,
    /// Squares in a row.
    across: usize,
    /// A bit per cell, row by row from the lowest; 0 for a square without a marker.
    black_cells: Vec<u128>,
}

/// Cells of a light square visible around a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Cells {
    /// A single cell, or only white around the marker.
    One,
    /// Up to four cells, around the crossing.
    Four(Crossing),
    /// Five or more cells.
    More,
}

/// Meeting point of four squares, or of four cells of a marker.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Crossing {
    /// Position of the crossing, in squares.
    pub(super) at: [f32; 2],
    /// True for each dark square or cell: top left, top right, bottom left, bottom right.
    pub(super) dark: [bool; 4],
}

impl PrintedMarkers {
    pub(super) fn new(board: &Board, markers: &Markers) -> Self {
        let side = markers.dictionary.side_cells() + 2;
        let [across, down] = board.squares();
        let cells_of = |square: usize| {
            let place = [square % across, square / across];
            let number = Layout::Present.marker_at(place, [across, down]);
            (0..side * side).fold(0, |cells, cell| {
                let at = [cell % side, cell / side];
                let black = number.and_then(|number| markers.dictionary.is_black(number, at));
                cells | u128::from(black == Some(true)) << cell
            })
        };
        Self {
            gap: markers.inset() as f32,
            cell: markers.side_squares as f32 / side as f32,
            side: side as i32,
            across,
            black_cells: (0..across * down).map(cells_of).collect(),
        }
    }

    /// True if a point of the pattern is on a black cell.
    #[inline]
    pub(super) fn is_black(&self, u: f32, v: f32) -> bool {
        self.is_cell_black(self.cells_at(u, v), self.cell_at(u), self.cell_at(v))
    }

    /// The cells within `du`, `dv` of a point, all in a single light square.
    #[inline]
    pub(super) fn around(&self, u: f32, v: f32, du: f32, dv: f32) -> Cells {
        let [left, right] = [self.cell_at(u - du), self.cell_at(u + du)];
        let [top, bottom] = [self.cell_at(v - dv), self.cell_at(v + dv)];
        let beside = right < 0 || left >= self.side || bottom < 0 || top >= self.side;
        if beside || (left == right && top == bottom) {
            return Cells::One;
        }
        if right - left > 1 || bottom - top > 1 {
            return Cells::More;
        }
        let cells = self.cells_at(u, v);
        let dark =
            [(right - 1, bottom - 1), (right, bottom - 1), (right - 1, bottom), (right, bottom)]
                .map(|(column, row)| self.is_cell_black(cells, column, row));
        let line = |at: f32, cell: i32| (at as i32) as f32 + self.gap + cell as f32 * self.cell;
        Cells::Four(Crossing { at: [line(u, right), line(v, bottom)], dark })
    }

    /// True if a marker may lie within `du`, `dv` of a point at the given distances from the lines
    /// between squares.
    #[inline]
    pub(super) fn may_reach(&self, from_line_u: f32, from_line_v: f32, du: f32, dv: f32) -> bool {
        from_line_u > self.gap - du && from_line_v > self.gap - dv
    }

    /// Column or row of the cell; -1 before the first, [`side`](Self::side) after the last.
    #[inline]
    fn cell_at(&self, at: f32) -> i32 {
        let from_marker = at - (at as i32) as f32 - self.gap;
        if from_marker < 0.0 { -1 } else { ((from_marker / self.cell) as i32).min(self.side) }
    }

    #[inline]
    fn cells_at(&self, u: f32, v: f32) -> u128 {
        let square = v as usize * self.across + u as usize;
        self.black_cells.get(square).copied().unwrap_or_default()
    }

    #[inline]
    fn is_cell_black(&self, cells: u128, column: i32, row: i32) -> bool {
        let on_marker = 0..self.side;
        on_marker.contains(&column)
            && on_marker.contains(&row)
            && cells >> (row * self.side + column) & 1 == 1
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use boresight_geometry::boards::{MarkerSide, Pattern};

    #[test]
    fn the_cells_around_a_point_are_those_that_points_around_it_show() {
        let dictionary = "DICT_5X5_100".parse().expect("known");
        let pattern = Pattern::Charuco { dictionary, side: MarkerSide::Squares(0.7) };
        let board = Board::new(4, 6, 0.03).map(|board| board.with(pattern));
        let board = board.expect("a board").expect("markers fit");
        let markers = board.markers().expect("markers");
        let printed = PrintedMarkers::new(&board, &markers);
        let (mut one, mut four) = (0, 0);
        for step in 0..40_000 {
            // All over the 5 x 7 squares, by two numbers without a common period.
            let (u, v) =
                ((step as f32 * 0.6180339).fract() * 5.0, (step as f32 * 0.7548777).fract() * 7.0);
            let reach = 0.01 + 0.04 * (step as f32 * 0.4142135).fract();
            let is_light = (u as i32 + v as i32) % 2 == 1;
            let in_square = |at: f32| at.fract() > reach && at.fract() < 1.0 - reach;
            if !is_light || !in_square(u) || !in_square(v) {
                continue;
            }
            let seen = printed.around(u, v, reach, reach);
            for (x, y) in [(-0.9, -0.9), (0.9, -0.9), (-0.9, 0.9), (0.9, 0.9), (0.0, 0.3)] {
                let at = [u + x * reach, v + y * reach];
                let black = printed.is_black(at[0], at[1]);
                match seen {
                    Cells::One => assert_eq!(black, printed.is_black(u, v), "{at:?}"),
                    Cells::Four(crossing) => {
                        let quarter = usize::from(at[0] >= crossing.at[0])
                            + 2 * usize::from(at[1] >= crossing.at[1]);
                        let from_line =
                            (at[0] - crossing.at[0]).abs().min((at[1] - crossing.at[1]).abs());
                        assert!(
                            from_line < 1e-5 || black == crossing.dark[quarter],
                            "{at:?} {crossing:?}"
                        );
                    }
                    Cells::More => {}
                }
            }
            one += usize::from(seen == Cells::One);
            four += usize::from(matches!(seen, Cells::Four(_)));
        }
        assert!(one > 1_000 && four > 1_000, "{one} {four}");
    }
}
