//! The ChArUco board: a checkerboard with markers in the light squares.

use nalgebra::Point2;

use super::{
    BoardChoice, BoardKind, DarkShapes, InvalidChoice, MarkerSide, PartTells, Pattern, Shape,
    Squares, Target, choice,
};
use crate::markers::{Dictionary, InvalidMarkers, Layout, Markers, marker_count};

/// Name and text form of a ChArUco board.
pub(super) const KIND: BoardKind = BoardKind {
    name: "charuco",
    example: "charuco:8x11:DICT_4X4_50:15mm",
    counted: |points| points + 1,
    points: |squares| squares - 1,
    counts: [4, 100],
    usual: || Pattern::Charuco { dictionary: Dictionary::default(), side: MarkerSide::Usual },
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
        let side = side_m.map_or(MarkerSide::Usual, MarkerSide::Metres);
        Ok(BoardChoice { columns, rows, pattern: Pattern::Charuco { dictionary, side } })
    },
    write: |named| {
        let squares = format!("charuco:{}x{}", named.columns + 1, named.rows + 1);
        let Some(dictionary) = named.pattern.dictionary() else { return squares };
        let side = named.pattern.side_m();
        let side = side.map(|side_m| format!(":{}mm", choice::millimetres(side_m)));
        format!("{squares}:{dictionary}{}", side.unwrap_or_default())
    },
};

/// Checkerboard with a marker in each light square.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Charuco {
    pub(super) squares: Squares,
    pub(super) dictionary: Dictionary,
    /// Side of a marker with the black frame.
    pub(super) side_squares: f64,
}

impl Charuco {
    /// Black cells of the markers, in rows and in columns: each is covered twice, so that no seam
    /// shows between them.
    fn black_cells(&self) -> Vec<Shape> {
        let Self { squares, dictionary, side_squares } = *self;
        let (size, side) = (squares.count(), dictionary.side_cells() + 2);
        let (cell, gap) = (side_squares / side as f64, (1.0 - side_squares) / 2.0);
        let places = (0..size[1]).flat_map(|row| (0..size[0]).map(move |column| [column, row]));
        let mut cells = Vec::new();
        for square in places {
            let Some(number) = Layout::Present.marker_at(square, size) else { continue };
            let is_black = |at: [usize; 2]| dictionary.is_black(number, at) == Some(true);
            let mut push = |from: [usize; 2], to: [usize; 2]| {
                let place = |cells: [usize; 2]| {
                    std::array::from_fn(|k| square[k] as f64 + gap + cell * cells[k] as f64)
                };
                cells.push(squares.rectangle(place(from), place(to)));
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

    fn markers(&self) -> Option<Markers> {
        let inset = (1.0 - self.side_squares) / 2.0;
        // With an odd number of rows, both layouts are the same.
        let has_two = self.squares.count()[1].is_multiple_of(2);
        Some(Markers {
            dictionary: self.dictionary,
            side_squares: self.side_squares,
            frame_cells: 1,
            first: 0,
            white_at: 0.5 * inset,
            square_steps: 1.0,
            gap_steps: inset,
            layouts: if has_two { &Layout::ALL } else { &Layout::ALL[..1] },
        })
    }

    fn check(&self) -> Result<(), InvalidMarkers> {
        let Self { squares, dictionary, side_squares } = *self;
        let [least, most] = InvalidMarkers::SIDES_SQUARES;
        if !(least..=most).contains(&side_squares) {
            return Err(InvalidMarkers::Side { side_squares });
        }
        let (needed, count) = (marker_count(squares.count()), dictionary.count());
        if needed > count {
            let (Squares { columns, rows, .. }, dictionary) = (squares, dictionary.name());
            return Err(InvalidMarkers::Count { columns, rows, needed, dictionary, count });
        }
        Ok(())
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
