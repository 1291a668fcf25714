//! The ChArUco board: a checkerboard with markers in the light squares.

use nalgebra::Point2;

use super::{
    BoardChoice, BoardKind, DarkShapes, InvalidChoice, PartTells, Shape, Squares, Target, choice,
};
use crate::markers::{Layout, MarkerChoice, Markers};

/// Name and text form of a ChArUco board.
pub(super) const KIND: BoardKind = BoardKind {
    name: "charuco",
    example: "charuco:8x11:DICT_4X4_50:15mm",
    counted: |points| points + 1,
    read: |text| {
        let mut parts = text.split(':');
        let (Some(squares), Some(dictionary), side, None) =
            (parts.next(), parts.next(), parts.next(), parts.next())
        else {
            return Err(InvalidChoice::NotCharuco);
        };
        let squares = choice::counts(squares).ok_or(InvalidChoice::NotCharuco)?;
        let [columns, rows] = squares.map(|count| count.saturating_sub(1));
        let dictionary = dictionary.parse()?;
        let side_m = side.map(choice::length_m).transpose()?;
        let markers = Some(MarkerChoice::in_squares(dictionary, side_m));
        Ok(BoardChoice { columns, rows, markers })
    },
    write: |named| {
        let squares = format!("charuco:{}x{}", named.columns + 1, named.rows + 1);
        let Some(markers) = named.markers else { return squares };
        let side = markers.side_m.map(|side_m| format!(":{}mm", choice::millimetres(side_m)));
        let side = side.unwrap_or_default();
        format!("{squares}:{}{side}", markers.dictionary)
    },
};

/// Checkerboard with a marker in each light square.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Charuco {
    pub(super) squares: Squares,
    pub(super) markers: Markers,
}

impl Charuco {
    /// Black cells of the markers, in rows and in columns: each is covered twice, so that no seam
    /// shows between them.
    fn black_cells(&self) -> Vec<Shape> {
        let Markers { dictionary, side_squares, .. } = self.markers;
        let (size, side) = (self.squares.count(), dictionary.side_cells() + 2);
        let (cell, gap) = (side_squares / side as f64, self.markers.inset());
        let squares = (0..size[1]).flat_map(|row| (0..size[0]).map(move |column| [column, row]));
        let mut cells = Vec::new();
        for square in squares {
            let Some(number) = Layout::Present.marker_at(square, size) else { continue };
            let is_black = |at: [usize; 2]| dictionary.is_black(number, at) == Some(true);
            let mut push = |from: [usize; 2], to: [usize; 2]| {
                let place = |cells: [usize; 2]| {
                    std::array::from_fn(|k| square[k] as f64 + gap + cell * cells[k] as f64)
                };
                cells.push(self.squares.rectangle(place(from), place(to)));
            };
            for line in 0..side {
                for [from, to] in runs(side, |at| is_black([at, line])) {
                    push([from, line], [to, line + 1]);
                }
                for [from, to] in runs(side, |at| is_black([line, at])) {
                    push([line, from], [line + 1, to]);
                }
            }
        }
        cells
    }
}

impl Target for Charuco {
    fn grid(&self) -> [usize; 2] {
        self.squares.grid()
    }

    fn steps_m(&self) -> [f64; 2] {
        self.squares.steps_m()
    }

    fn points_m(&self) -> Vec<Point2<f64>> {
        self.squares.points_m()
    }

    fn size_m(&self) -> [f64; 2] {
        self.squares.size_m()
    }

    fn looks_the_same_upside_down(&self) -> bool {
        false
    }

    fn part_tells(&self) -> PartTells {
        PartTells::EachPoint
    }

    fn dark_shapes(&self) -> DarkShapes {
        DarkShapes { fine: self.black_cells(), ..self.squares.dark_shapes() }
    }
}

/// Runs of `black` places below `count`, each with begin and end.
pub(super) fn runs(count: usize, black: impl Fn(usize) -> bool) -> Vec<[usize; 2]> {
    let mut runs: Vec<[usize; 2]> = Vec::new();
    for place in (0..count).filter(|place| black(*place)) {
        match runs.last_mut() {
            Some([_, end]) if *end == place => *end += 1,
            _ => runs.push([place, place + 1]),
        }
    }
    runs
}
