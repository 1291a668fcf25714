//! Kinds of boards, and parsing of names.

use std::{fmt, str::FromStr};

use super::{
    BoardChoice, BoardKind, InvalidChoice, MarkerSide, Pattern, aprilgrid, charuco, checkerboard,
    circles,
};
use crate::markers::CircleRows;

/// Every kind of board, the plain kind first.
pub static BOARD_KINDS: [BoardKind; 5] =
    [checkerboard::KIND, charuco::KIND, aprilgrid::KIND, circles::SYMMETRIC, circles::ASYMMETRIC];

impl Pattern {
    /// Place of the kind in [`BOARD_KINDS`].
    pub fn kind_index(&self) -> usize {
        match self {
            Self::Plain => 0,
            Self::Charuco { .. } => 1,
            Self::AprilGrid(_) => 2,
            Self::Circles(CircleRows::Symmetric) => 3,
            Self::Circles(CircleRows::Asymmetric) => 4,
        }
    }
}

impl BoardChoice {
    /// Kind of the board.
    pub fn kind(&self) -> &'static BoardKind {
        &BOARD_KINDS[self.pattern.kind_index()]
    }

    /// Counts named by people in a row and in a column: inner corners of a plain board, squares of
    /// a ChArUco board, tags of an AprilGrid, circles.
    pub fn counted(&self) -> [u16; 2] {
        [self.columns, self.rows].map(self.kind().counted)
    }
}

impl fmt::Display for BoardChoice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&(self.kind().write)(self))
    }
}

impl FromStr for BoardChoice {
    type Err = InvalidChoice;

    /// Parses the output of [`Display`](fmt::Display), in either case, the marker's side in any
    /// unit of [`length_m`](super::length_m). Its share of a square isn't checked.
    fn from_str(text: &str) -> Result<Self, InvalidChoice> {
        let (kind, rest) = match text.split_once(':') {
            None => (Some(&BOARD_KINDS[0]), text),
            Some((name, rest)) => {
                let named = |kind: &&BoardKind| kind.name.eq_ignore_ascii_case(name);
                (BOARD_KINDS[1..].iter().find(named), rest)
            }
        };
        let choice = (kind.ok_or(InvalidChoice::NoKind)?.read)(rest)?;
        // The counts must be possible for any squares.
        let any_side = match choice.pattern {
            Pattern::Charuco { dictionary, .. } => {
                Pattern::Charuco { dictionary, side: MarkerSide::Usual }
            }
            pattern => pattern,
        };
        BoardChoice { pattern: any_side, ..choice }.board(1.0)?;
        Ok(choice)
    }
}

#[cfg(test)]
mod tests {
    use super::{super::length_m, *};
    use crate::markers::Tags;

    #[test]
    fn boards_and_lengths_are_read_as_people_write_them() {
        let plain = BoardChoice { columns: 9, rows: 6, pattern: Pattern::Plain };
        assert_eq!("9x6".parse(), Ok(plain));
        let dictionary = "DICT_4X4_50".parse().expect("known");
        let sized = |side| BoardChoice::of([7, 10], Pattern::Charuco { dictionary, side });
        assert_eq!("charuco:8x11:DICT_4X4_50:15mm".parse(), Ok(sized(MarkerSide::Metres(0.015))));
        assert_eq!("ChArUco:8x11:4x4_50:1.5cm".parse(), Ok(sized(MarkerSide::Metres(0.015))));
        assert_eq!("charuco:8x11:4x4_50".parse(), Ok(sized(MarkerSide::Usual)));
        assert_eq!((plain.counted(), sized(MarkerSide::Usual).counted()), ([9, 6], [8, 11]));
        let tags = |spacing: f64, first: u16| {
            BoardChoice::of([12, 14], Pattern::AprilGrid(Tags { spacing, first }))
        };
        assert_eq!("aprilgrid:6x7".parse(), Ok(tags(0.3, 0)));
        assert_eq!("AprilGrid:6x7:0.25".parse(), Ok(tags(0.25, 0)));
        assert_eq!("aprilgrid:6x7:0.3:36".parse(), Ok(tags(0.3, 36)));
        assert_eq!(tags(0.3, 36).to_string(), "aprilgrid:6x7:0.3:36");
        assert_eq!(tags(0.25, 0).to_string(), "aprilgrid:6x7:0.25");
        assert_eq!(tags(0.3, 0).counted(), [6, 7]);
        let circles = |rows| BoardChoice { pattern: Pattern::Circles(rows), ..plain };
        assert_eq!("circles:9x6".parse(), Ok(circles(CircleRows::Symmetric)));
        assert_eq!("ACircles:9x6".parse(), Ok(circles(CircleRows::Asymmetric)));
        for wrong in [
            "circles:2x6",
            "circles:9x6:2",
            "acircles:9",
            "aprilgrid:6",
            "aprilgrid:6x6:30%",
            "aprilgrid:6x6:0.05",
            "aprilgrid:6x6:0.3:552",
            "aprilgrid:1x6",
            "aprilgrid:6x6:0.3:0:0",
            "9",
            "9x",
            "x6",
            "9x6x2",
            "ninexsix",
            "-9x6",
            "2x6",
            "charuco:8x11",
            "aruco:8x11:4x4_50",
            "checkerboard:9x6",
            "charuco:8x11:9x9_50",
            "charuco:8x11:4x4_50:15",
            "charuco:8x11:4x4_50:15mm:2",
            "charuco:20x20:4x4_50",
        ] {
            assert!(wrong.parse::<BoardChoice>().is_err(), "{wrong}");
        }
        assert_eq!(length_m("25mm"), Ok(0.025));
        assert_eq!(length_m("2.5 cm"), Ok(0.025));
        assert_eq!(length_m("1in"), Ok(0.0254));
        for wrong in ["25", "mm", "25ft", "", "nanmm x"] {
            assert!(length_m(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn every_kind_reads_what_it_writes() {
        for kind in &BOARD_KINDS {
            let choice: BoardChoice = kind.example.parse().expect("a board");
            assert_eq!(choice.kind().name, kind.name);
            assert_eq!((kind.usual)().kind_index(), choice.pattern.kind_index());
            assert_eq!(choice.to_string(), kind.example);
        }
    }
}
