//! Code in a printed board's margin, which identifies the board without typing.
//!
//! A strip of black and white cells runs along a whole side of the board, outside of it:
//!
//! ```text
//!  ██ ▌▐█ ▌▌██▐ …   guard 110, 86 bits, guard 101
//! ┌──────────────
//! │████    ████     the board's outer squares
//! ```
//!
//! The bits are columns and rows (7 each), the side of a square in micrometres (20), the board's ID
//! (20), and a CRC-32 over them. The reader locates the strip from the corners found, and columns
//! and rows must match the observed board, so that a chance strip passes about once in 2⁴⁰
//! attempts.

mod board_id;
mod layout;

pub use board_id::{BoardId, NotAnId};
pub use layout::{Edge, FAR, NEAR, bars, place_in_cell};

use crate::boards::Board;

const START: [bool; 3] = [true, true, false];
const END: [bool; 3] = [true, false, true];
const COUNT_BITS: u32 = 7;
const SQUARE_BITS: u32 = 20;
const SUM_BITS: u32 = 32;
/// Number of cells in a strip.
pub const CELLS: usize = 3 + (2 * COUNT_BITS + SQUARE_BITS + BoardId::BITS + SUM_BITS) as usize + 3;
/// Layout version, part of the checksum, so that strips of a different layout are rejected.
const LAYOUT: &[u8] = b"boresight/1";

/// Contents of the strip.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BoardCode {
    columns: u16,
    rows: u16,
    square_um: u32,
    id: BoardId,
}

impl BoardCode {
    /// Code of a board. `None` if its squares are a metre or larger, or smaller than a micrometre.
    pub fn new(board: &Board, id: BoardId) -> Option<Self> {
        let square_um = (board.square_m() * 1e6).round();
        let fits = (1.0..f64::from(1_u32 << SQUARE_BITS)).contains(&square_um);
        fits.then_some(Self {
            // At most 99 each.
            columns: board.columns() as u16,
            rows: board.rows() as u16,
            square_um: square_um as u32,
            id,
        })
    }

    /// Board with the printed squares.
    pub fn board(&self) -> Option<Board> {
        Board::new(self.columns, self.rows, f64::from(self.square_um) * 1e-6).ok()
    }

    /// Identity of the print.
    pub fn id(&self) -> BoardId {
        self.id
    }

    /// Cells of the strip, true if black.
    pub fn cells(&self) -> [bool; CELLS] {
        let mut bits = START.to_vec();
        for (value, count) in self.fields() {
            bits.extend((0..count).rev().map(|bit| value >> bit & 1 == 1));
        }
        bits.extend(END);
        std::array::from_fn(|i| bits[i])
    }

    /// Decodes cells; `None` if the cells aren't a whole strip.
    pub fn read(cells: &[bool; CELLS]) -> Option<Self> {
        if cells[..START.len()] != START || cells[CELLS - END.len()..] != END {
            return None;
        }
        let mut at = START.len();
        let mut take = |count: u32| {
            let bits = &cells[at..at + count as usize];
            at += bits.len();
            bits.iter().fold(0_u32, |value, bit| value << 1 | u32::from(*bit))
        };
        let code = Self {
            columns: take(COUNT_BITS) as u16,
            rows: take(COUNT_BITS) as u16,
            square_um: take(SQUARE_BITS),
            id: BoardId::from_number(take(BoardId::BITS)),
        };
        let sum = take(SUM_BITS);
        (sum == code.sum() && code.board().is_some()).then_some(code)
    }

    /// Values with numbers of bits, in the strip's order.
    fn fields(&self) -> [(u32, u32); 5] {
        [
            (self.columns.into(), COUNT_BITS),
            (self.rows.into(), COUNT_BITS),
            (self.square_um, SQUARE_BITS),
            (self.id.number(), BoardId::BITS),
            (self.sum(), SUM_BITS),
        ]
    }

    fn sum(&self) -> u32 {
        let mut sum = crc32fast::Hasher::new();
        sum.update(LAYOUT);
        for value in [self.columns.into(), self.rows.into(), self.square_um, self.id.number()] {
            let value: u32 = value;
            sum.update(&value.to_be_bytes());
        }
        sum.finalize()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn code() -> BoardCode {
        let board = Board::new(9, 6, 0.025).expect("a board");
        BoardCode::new(&board, "K7Q2".parse().expect("an ID")).expect("fits")
    }

    #[test]
    fn a_strip_says_what_was_put_in() {
        for (columns, rows, square_m) in [(9, 6, 0.025), (3, 99, 0.000_5), (11, 8, 0.025_124)] {
            let board = Board::new(columns, rows, square_m).expect("a board");
            let code = BoardCode::new(&board, "0Z9A".parse().expect("an ID")).expect("fits");
            let read = BoardCode::read(&code.cells()).expect("read");
            assert_eq!(read, code);
            let again = read.board().expect("a board");
            assert_eq!((again.columns(), again.rows()), (board.columns(), board.rows()));
            assert!((again.square_m() - square_m).abs() < 1e-12);
        }
        let large = Board::new(9, 6, 2.0).expect("a board");
        assert_eq!(BoardCode::new(&large, code().id()), None);
    }

    #[test]
    fn up_to_three_wrong_cells_and_the_other_way_round_say_nothing() {
        let whole = code().cells();
        let mut backwards = whole;
        backwards.reverse();
        assert_eq!(BoardCode::read(&backwards), None);
        let flipped = |at: &[usize]| {
            let mut cells = whole;
            for at in at {
                cells[*at] ^= true;
            }
            BoardCode::read(&cells)
        };
        for i in 0..CELLS {
            assert_eq!(flipped(&[i]), None);
            for j in 0..i {
                assert_eq!(flipped(&[i, j]), None, "{i} {j}");
                for k in 0..j {
                    assert_eq!(flipped(&[i, j, k]), None, "{i} {j} {k}");
                }
            }
        }
    }
}
