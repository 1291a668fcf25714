//! Layout of the strip. Places are in squares from the board's top-left corner (the outer corner of
//! the outermost square), `x` along a row and `y` down.

use super::CELLS;

/// Near side of the strip, in squares outside of the board's edge. The white before the strip keeps
/// the outer squares unchanged.
pub const NEAR: f64 = 0.42;
/// Far side of the strip, as [`NEAR`].
pub const FAR: f64 = 0.66;

/// Side of the board.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[expect(missing_docs, reason = "the words say it")]
pub enum Edge {
    Top,
    Bottom,
    Left,
    Right,
}

impl Edge {
    /// All edges.
    pub const ALL: [Self; 4] = [Self::Top, Self::Bottom, Self::Left, Self::Right];

    /// Place on an edge of a board with `columns` × `rows` inner corners: `along` the edge, 0 to 1,
    /// and `outside` it, in squares.
    pub fn place(self, (columns, rows): (usize, usize), along: f64, outside: f64) -> (f64, f64) {
        let (width, height) = ((columns + 1) as f64, (rows + 1) as f64);
        match self {
            Self::Top => (along * width, -outside),
            Self::Bottom => (along * width, height + outside),
            Self::Left => (-outside, along * height),
            Self::Right => (width + outside, along * height),
        }
    }
}

/// Place along an edge, 0 to 1, of a point in cell `index`; `within` the cell is 0 to 1.
pub fn place_in_cell(index: usize, within: f64) -> f64 {
    (index as f64 + within) / CELLS as f64
}

/// Black bars of a strip: top-left and bottom-right corner of each.
pub fn bars(edge: Edge, size: (usize, usize), cells: &[bool; CELLS]) -> Vec<[(f64, f64); 2]> {
    let mut bars = Vec::new();
    let mut begin = None;
    for index in 0..=CELLS {
        let black = cells.get(index).is_some_and(|black| *black);
        match (black, begin) {
            (true, None) => begin = Some(index),
            (false, Some(first)) => {
                let place = |index, outside| edge.place(size, place_in_cell(index, 0.0), outside);
                let (a, b) = (place(first, NEAR), place(index, FAR));
                bars.push([(a.0.min(b.0), a.1.min(b.1)), (a.0.max(b.0), a.1.max(b.1))]);
                begin = None;
            }
            _ => {}
        }
    }
    bars
}
