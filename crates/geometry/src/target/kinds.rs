//! The kinds of boards, and how a person names one.

use std::{fmt, str::FromStr};

use super::{Board, BoardChoice, BoardKind, InvalidChoice, charuco, checkerboard};
use crate::markers::{MarkerChoice, Markers};

/// Every kind of board, the plain one first.
pub static BOARD_KINDS: [BoardKind; 2] = [checkerboard::KIND, charuco::KIND];

impl BoardChoice {
    /// The kind of board.
    pub fn kind(&self) -> &'static BoardKind {
        let [plain, charuco] = &BOARD_KINDS;
        if self.markers.is_some() { charuco } else { plain }
    }

    /// What a person counts in a row and in a column: inner corners of a plain board, squares of a ChArUco board.
    pub fn counted(&self) -> [u16; 2] {
        [self.columns, self.rows].map(|points| points + self.kind().more)
    }
}

impl fmt::Display for BoardChoice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&(self.kind().write)(self))
    }
}

impl FromStr for BoardChoice {
    type Err = InvalidChoice;

    /// Reads what [`Display`](fmt::Display) writes, in either case, the marker's side in any unit of [`length_m`](super::length_m).
    /// Its share of a square isn't checked.
    fn from_str(text: &str) -> Result<Self, InvalidChoice> {
        let (kind, rest) = match text.split_once(':') {
            None => (Some(&BOARD_KINDS[0]), text),
            Some((name, rest)) => {
                let named = |kind: &&BoardKind| kind.name.eq_ignore_ascii_case(name);
                (BOARD_KINDS[1..].iter().find(named), rest)
            }
        };
        let choice = (kind.ok_or(InvalidChoice::NotCharuco)?.read)(rest)?;
        // The counts must be possible whatever the squares are.
        let board = Board::new(choice.columns, choice.rows, 1.0)?;
        if let Some(MarkerChoice { dictionary, .. }) = choice.markers {
            board.with_markers(Markers::sized(dictionary, None))?;
        }
        Ok(choice)
    }
}

#[cfg(test)]
mod tests {
    use super::{super::length_m, *};

    #[test]
    fn boards_and_lengths_are_read_as_people_write_them() {
        let plain = BoardChoice { columns: 9, rows: 6, markers: None };
        assert_eq!("9x6".parse(), Ok(plain));
        let dictionary = "DICT_4X4_50".parse().expect("known");
        let sized = |side_m| {
            let markers = Some(MarkerChoice { dictionary, side_m });
            BoardChoice { columns: 7, rows: 10, markers }
        };
        assert_eq!("charuco:8x11:DICT_4X4_50:15mm".parse(), Ok(sized(Some(0.015))));
        assert_eq!("ChArUco:8x11:4x4_50:1.5cm".parse(), Ok(sized(Some(0.015))));
        assert_eq!("charuco:8x11:4x4_50".parse(), Ok(sized(None)));
        assert_eq!((plain.counted(), sized(None).counted()), ([9, 6], [8, 11]));
        for wrong in [
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
            assert_eq!(choice.to_string(), kind.example);
        }
    }
}
