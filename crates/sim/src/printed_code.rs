//! The code in a printed board's margin.

use boresight_geometry::{
    board_code::{BoardCode, BoardId, CELLS, Edge, FAR, NEAR},
    boards::Board,
};

/// Strips of a code along the longer sides of a board, as printed by `boresight target` on a sheet
/// with enough room.
#[derive(Clone, Debug)]
pub(super) struct PrintedCode {
    size: (usize, usize),
    edges: [Edge; 2],
    cells: [bool; CELLS],
}

impl PrintedCode {
    /// Printed code; `None` if no code has the board's square size, or the board has markers or
    /// circles.
    pub(super) fn new(board: &Board, id: BoardId) -> Option<Self> {
        if !board.pattern().is_plain() {
            return None;
        }
        let size = (board.columns(), board.rows());
        let upright = [Edge::Top, Edge::Bottom];
        let edges = if size.0 >= size.1 { upright } else { [Edge::Left, Edge::Right] };
        Some(Self { size, edges, cells: BoardCode::new(board, id)?.cells() })
    }

    /// True if a point of the margin, in squares from the board's upper left corner, is on a black
    /// bar.
    pub(super) fn is_black(&self, u: f32, v: f32) -> bool {
        self.edges.into_iter().any(|edge| {
            let [along, outside] = self.along_and_outside(edge, u, v);
            let cell = (along * CELLS as f32).floor();
            let is_on_strip = outside > NEAR as f32 && outside < FAR as f32 && cell >= 0.0;
            is_on_strip && self.cells.get(cell as usize).copied().unwrap_or_default()
        })
    }

    /// True if a strip may lie within `du`, `dv` of a point.
    pub(super) fn may_reach(&self, u: f32, v: f32, du: f32, dv: f32) -> bool {
        self.edges.into_iter().any(|edge| {
            let [along, outside] = self.along_and_outside(edge, u, v);
            let (width, height) = self.sides();
            let (reach, reach_out) = match edge {
                Edge::Top | Edge::Bottom => (du / width, dv),
                Edge::Left | Edge::Right => (dv / height, du),
            };
            along > -reach
                && along < 1.0 + reach
                && outside > NEAR as f32 - reach_out
                && outside < FAR as f32 + reach_out
        })
    }

    /// Arguments of [`Edge::place`] for the point.
    fn along_and_outside(&self, edge: Edge, u: f32, v: f32) -> [f32; 2] {
        let (width, height) = self.sides();
        match edge {
            Edge::Top => [u / width, -v],
            Edge::Bottom => [u / width, v - height],
            Edge::Left => [v / height, -u],
            Edge::Right => [v / height, u - width],
        }
    }

    fn sides(&self) -> (f32, f32) {
        ((self.size.0 + 1) as f32, (self.size.1 + 1) as f32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use boresight_geometry::board_code::bars;

    #[test]
    fn what_is_printed_are_the_bars_of_the_sheet() {
        for (columns, rows) in [(9, 6), (5, 8)] {
            let board = Board::new(columns, rows, 0.02).expect("a board");
            let id = "ZX5N".parse().expect("an ID");
            let printed = PrintedCode::new(&board, id).expect("fits");
            let size = (board.columns(), board.rows());
            let bars: Vec<_> = printed
                .edges
                .into_iter()
                .flat_map(|edge| bars(edge, size, &printed.cells))
                .collect();
            let (mut black, mut beside) = (0, 0);
            for step in 0..60_000 {
                // All over the sheet, by two numbers without a common period.
                let share = [0.618_034, 0.754_878].map(|by| (f64::from(step) * by).fract());
                let (width, height) = (f64::from(columns) + 2.6, f64::from(rows) + 2.6);
                let (u, v) = (share[0] * width - 0.8, share[1] * height - 0.8);
                let on = |[from, to]: &[(f64, f64); 2]| {
                    (from.0..to.0).contains(&u) && (from.1..to.1).contains(&v)
                };
                let is_black = bars.iter().any(on);
                let (u, v) = (u as f32, v as f32);
                assert_eq!(printed.is_black(u, v), is_black, "{columns}x{rows}: {u} {v}");
                assert!(!is_black || printed.may_reach(u, v, 0.01, 0.01));
                black += usize::from(is_black);
                beside += usize::from(!printed.may_reach(u, v, 0.05, 0.05));
            }
            assert!(black > 500 && beside > 30_000, "{black} {beside}");
        }
    }
}
