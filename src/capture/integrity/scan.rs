//! Steps over every code of a baseline JPEG's scan without decoding a picture.
//!
//! A whole scan holds exactly the blocks that the picture's size asks for, each with at most 64
//! coefficients and a mean that a picture can have, and after the last one only the fill to the byte.
//! Data that was cut, joined or changed loses step with the codes: it ends early or late, meets a code
//! that is none, or runs out of a block. Method: ITU-T T.81, annex F.2.

use super::{Flaw, huffman::Table};

/// A component's part in each unit of the scan.
#[derive(Clone, Copy, Debug)]
pub(super) struct Part<'a> {
    pub(super) dc: &'a Table,
    pub(super) ac: &'a Table,
    /// Blocks in each unit.
    pub(super) blocks: u32,
    /// Step of the first coefficient.
    pub(super) dc_step: i32,
}

/// What a scan must hold.
#[derive(Clone, Debug)]
pub(super) struct Expected<'a> {
    pub(super) parts: Vec<Part<'a>>,
    pub(super) units: u32,
    /// Units between restart markers; 0 for none.
    pub(super) restart_every: u32,
    /// Whether no picture gives a long run of zero bytes: so with the usual tables.
    pub(super) zeros_are_foreign: bool,
}

/// How a scan ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct End {
    /// Where the end-of-image marker stands.
    pub(super) marker_at: usize,
    /// Bytes between the last block and that marker.
    pub(super) surplus: usize,
}

/// Largest first coefficient, in its step-free unit: 8 times half the range of a sample, and rounding.
const LARGEST_MEAN: i32 = 1024 + 64;

/// Walks the scan that begins at `start` of `bytes`. `clean` is scratch memory.
pub(super) fn walk(
    bytes: &[u8],
    start: usize,
    expected: &Expected<'_>,
    clean: &mut Vec<u8>,
) -> Result<End, Flaw> {
    let mut at = start;
    let mut left = expected.units;
    let mut restart = 0;
    loop {
        let marker = segment(bytes, &mut at, clean).ok_or(Flaw::NoEnd)?;
        let units = match expected.restart_every {
            0 => left,
            every => every.min(left),
        };
        if expected.zeros_are_foreign && has_zeros(clean) {
            return Err(Flaw::BrokenScan);
        }
        let surplus = blocks(clean, expected, units)?;
        left -= units;
        if left == 0 {
            return match marker {
                0xD9 => Ok(End { marker_at: at, surplus }),
                // A restart marker after the last unit is allowed.
                0xD0..=0xD7 if bytes.get(at + 2..at + 4) == Some(&[0xFF, 0xD9]) => {
                    Ok(End { marker_at: at + 2, surplus })
                }
                _ => Err(Flaw::SurplusScan),
            };
        }
        if marker != 0xD0 + restart || surplus > 0 {
            return Err(Flaw::BrokenScan);
        }
        restart = (restart + 1) % 8;
        at += 2;
    }
}

/// Whether there is a run of zero bytes as a lost packet leaves it. Zeros are codes, too, and would pass for
/// a picture; but one whose every coefficient is -1.
fn has_zeros(data: &[u8]) -> bool {
    const RUN: usize = 16;
    // Every run of that length covers one of these pieces.
    let pieces = data.chunks_exact(RUN / 2).enumerate();
    let mut zero = pieces.filter(|(_, piece)| piece.iter().all(|byte| *byte == 0));
    zero.any(|(at, _)| {
        let (before, behind) = data.split_at(at * RUN / 2);
        let zeros = |byte: &&u8| **byte == 0;
        let run = before.iter().rev().take_while(zeros).count()
            + behind.iter().take(RUN).take_while(zeros).count();
        run >= RUN
    })
}

/// Copies the data from `at` up to the next marker without its stuffed bytes; leaves `at` at the marker
/// and returns it. `None` if there is none.
fn segment(bytes: &[u8], at: &mut usize, clean: &mut Vec<u8>) -> Option<u8> {
    clean.clear();
    loop {
        let rest = bytes.get(*at..)?;
        let length = rest.iter().position(|byte| *byte == 0xFF)?;
        clean.extend_from_slice(&rest[..length]);
        *at += length;
        match *bytes.get(*at + 1)? {
            0x00 => {
                clean.push(0xFF);
                *at += 2;
            }
            // A fill byte before a marker.
            0xFF => *at += 1,
            marker => {
                // Lets the bit reader take whole words up to the end.
                return Some(marker);
            }
        }
    }
}

/// Steps over `units` units; the bytes left after them.
fn blocks(data: &[u8], expected: &Expected<'_>, units: u32) -> Result<usize, Flaw> {
    let mut bits = Bits { data, at: 0, word: 0, held: 0, past_end: 0 };
    let mut means = [0_i32; 4];
    for _ in 0..units {
        for (part, mean) in expected.parts.iter().zip(&mut means) {
            for _ in 0..part.blocks {
                block(&mut bits, part, mean)?;
            }
        }
        if bits.past_end > 0 && bits.overrun() {
            return Err(Flaw::BrokenScan);
        }
    }
    bits.left()
}

#[inline]
fn block(bits: &mut Bits<'_>, part: &Part<'_>, mean: &mut i32) -> Result<(), Flaw> {
    bits.refill();
    let (length, size) = part.dc.look_up(bits.next16()).ok_or(Flaw::BrokenScan)?;
    let size = u32::from(size);
    if size > 11 {
        return Err(Flaw::BrokenScan);
    }
    bits.skip(length);
    *mean += bits.signed(size);
    bits.skip(size);
    if (*mean * part.dc_step).abs() > LARGEST_MEAN + part.dc_step {
        return Err(Flaw::BrokenScan);
    }
    let mut k = 1;
    while k < 64 {
        bits.refill();
        let (length, value) = part.ac.look_up(bits.next16()).ok_or(Flaw::BrokenScan)?;
        let (run, size) = (u32::from(value >> 4), u32::from(value & 15));
        if size == 0 {
            bits.skip(length);
            match run {
                0 => return Ok(()),
                15 => k += 16,
                _ => return Err(Flaw::BrokenScan),
            }
            // A run of zeros is followed by a value.
            if k > 63 {
                return Err(Flaw::BrokenScan);
            }
            continue;
        }
        k += run + 1;
        if k > 64 || size > 10 {
            return Err(Flaw::BrokenScan);
        }
        bits.skip(length + size);
    }
    Ok(())
}

/// Bits of the data, most significant first; zeros after the end, counted.
struct Bits<'a> {
    data: &'a [u8],
    at: usize,
    /// The next bits, left-aligned.
    word: u64,
    held: u32,
    /// Bits held that are not in the data.
    past_end: u32,
}

impl Bits<'_> {
    /// Makes at least 32 bits available.
    #[inline]
    fn refill(&mut self) {
        if self.held >= 32 {
            return;
        }
        if let Some(four) = self.data.get(self.at..self.at + 4) {
            let four = u32::from_be_bytes([four[0], four[1], four[2], four[3]]);
            self.word |= u64::from(four) << (32 - self.held);
            self.at += 4;
            self.held += 32;
            return;
        }
        while self.held <= 56 {
            match self.data.get(self.at) {
                Some(byte) => {
                    self.word |= u64::from(*byte) << (56 - self.held);
                    self.at += 1;
                }
                None => self.past_end += 8,
            }
            self.held += 8;
        }
    }

    #[inline]
    fn next16(&self) -> u32 {
        (self.word >> 48) as u32
    }

    #[inline]
    fn skip(&mut self, count: u32) {
        self.word <<= count;
        self.held -= count;
    }

    /// The next `size` bits as the signed number that they code.
    #[inline]
    fn signed(&self, size: u32) -> i32 {
        if size == 0 {
            return 0;
        }
        let value = (self.word >> (64 - size)) as i32;
        if value < 1 << (size - 1) { value - (1 << size) + 1 } else { value }
    }

    /// Whether bits were taken that are not in the data.
    fn overrun(&self) -> bool {
        self.held < self.past_end
    }

    /// Whole bytes that were not taken; the fill of the last byte must be ones.
    fn left(&self) -> Result<usize, Flaw> {
        if self.overrun() {
            return Err(Flaw::BrokenScan);
        }
        let held = self.held - self.past_end;
        let fill = held % 8;
        if fill > 0 && self.word >> (64 - fill) != (1 << fill) - 1 {
            return Err(Flaw::BrokenScan);
        }
        Ok(self.data.len() - self.at + (held / 8) as usize)
    }
}
