//! Steps over every code of a baseline JPEG's scan without decoding a picture.
//!
//! A whole scan holds exactly the blocks of the picture's size, each with at most 64 coefficients
//! and a possible mean, and after the last one only the fill to the byte. Cut, joined or changed
//! data loses step with the codes: it ends early or late, meets an invalid code, or runs out of a
//! block. Method: ITU-T T.81, annex F.2. Data back in step by chance has mostly lost the means, see
//! [`super::seam`].

use super::{
    Flaw,
    bits::Bits,
    huffman::{MeanTable, StepTable},
    seam::{Edges, seam},
};

/// A component's part in each unit of the scan.
#[derive(Clone, Copy, Debug)]
pub(super) struct Part<'a> {
    pub(super) means: &'a MeanTable,
    pub(super) steps: &'a StepTable,
    /// Blocks in each row of a unit, and rows.
    pub(super) across: u32,
    pub(super) down: u32,
    pub(super) mean_step: i32,
    /// Largest mean, in steps.
    pub(super) largest_mean: i32,
}

/// Expected contents of a scan.
#[derive(Clone, Debug)]
pub(super) struct Expected<'a> {
    pub(super) parts: Vec<Part<'a>>,
    /// Units in each row, and rows.
    pub(super) columns: u32,
    pub(super) rows: u32,
    /// Units between restart markers; 0 for none.
    pub(super) restart_every: u32,
    /// True if no picture gives a long run of zero bytes: so with the usual tables.
    pub(super) zeros_are_foreign: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct End {
    /// Index of the end-of-image marker, in bytes.
    pub(super) marker_at: usize,
    /// Number of bytes between the last block and the marker.
    pub(super) surplus: usize,
}

/// Largest mean, in eighths of a grey level: half the range of a sample, and rounding.
pub(super) const LARGEST_MEAN: i32 = 1024 + 64;

/// Least certainty of a jump, 0 to 1, at which the gate refuses a picture. Brightness of real
/// pictures comes to 0.36, of edges drawn to resemble a jump to 0.41; colour, with mostly equal
/// neighbours, to 0.61.
const SURE_OF_BRIGHTNESS: f64 = 0.5;
const SURE_OF_COLOUR: f64 = 0.85;

/// Memory reused for every frame.
#[derive(Clone, Debug, Default)]
pub(super) struct Scratch {
    clean: Vec<u8>,
    edges: [Vec<Edges>; 4],
}

/// Walks the scan at `start` of `bytes`.
pub(super) fn walk(
    bytes: &[u8],
    start: usize,
    expected: &Expected<'_>,
    Scratch { clean, edges }: &mut Scratch,
) -> Result<End, Flaw> {
    let mut at = start;
    let mut left = expected.columns * expected.rows;
    edges.iter_mut().for_each(Vec::clear);
    let mut restart = 0;
    loop {
        let marker = segment(bytes, &mut at, clean)?;
        let units = match expected.restart_every {
            0 => left,
            every => every.min(left),
        };
        if expected.zeros_are_foreign && has_zeros(clean) {
            return Err(Flaw::BrokenScan);
        }
        let surplus = blocks(clean, expected, units, edges).ok_or(Flaw::BrokenScan)?;
        left -= units;
        if left == 0 {
            if jumps(expected, edges) {
                return Err(Flaw::BrokenScan);
            }
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

/// True if a component jumps in the middle of a row and stays there. Restart markers reset the
/// means in every row or so, and leave no such sign.
fn jumps(expected: &Expected<'_>, edges: &[Vec<Edges>]) -> bool {
    let surely = |(part, edges): (&Part<'_>, &Vec<Edges>)| {
        let per_level = f64::from(8 * part.across) / f64::from(part.mean_step);
        seam(edges, expected.columns as usize, per_level)
    };
    let mut sure = expected.parts.iter().zip(edges).map(surely);
    expected.restart_every == 0
        && (sure.next().is_some_and(|first| first > SURE_OF_BRIGHTNESS)
            || sure.any(|other| other > SURE_OF_COLOUR))
}

/// True if there is a run of zero bytes, as after a lost packet. Zeros are codes, too, and would
/// pass for a picture, with every coefficient -1. Real pictures have up to 46 zero bits in a row.
fn has_zeros(data: &[u8]) -> bool {
    const RUN: usize = 10;
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

/// Copies the data from `at` up to the next marker without stuffed bytes; leaves `at` at the marker
/// and returns the marker.
fn segment(bytes: &[u8], at: &mut usize, clean: &mut Vec<u8>) -> Result<u8, Flaw> {
    clean.clear();
    loop {
        let rest = bytes.get(*at..).ok_or(Flaw::NoEnd)?;
        let length = next_ff(rest).ok_or(Flaw::NoEnd)?;
        clean.extend_from_slice(&rest[..length]);
        *at += length;
        let fill = rest[length + 1..].iter().take_while(|byte| **byte == 0xFF).count();
        *at += fill;
        match (fill, *bytes.get(*at + 1).ok_or(Flaw::NoEnd)?) {
            (0, 0x00) => {
                clean.push(0xFF);
                *at += 2;
            }
            // Only markers have fill bytes before them.
            (_, 0x00) => return Err(Flaw::BrokenScan),
            (_, marker) => return Ok(marker),
        }
    }
}

/// Index of the next byte of all ones.
fn next_ff(bytes: &[u8]) -> Option<usize> {
    // Whole pieces at once: the largest of a piece is found in one step.
    let without = |piece: &&[u8]| piece.iter().fold(0, |largest, byte| *byte.max(&largest)) < 0xFF;
    let passed = 32 * bytes.chunks_exact(32).take_while(without).count();
    let found = bytes[passed..].iter().position(|byte| *byte == 0xFF)?;
    Some(passed + found)
}

/// Steps over `units` units, and returns the number of bytes left. `None` for data no encoder
/// writes.
fn blocks(
    data: &[u8],
    expected: &Expected<'_>,
    units: u32,
    edges: &mut [Vec<Edges>],
) -> Option<usize> {
    let mut bits = Bits::new(data);
    let mut means = [0_i32; 4];
    for _ in 0..units {
        for ((part, mean), edges) in expected.parts.iter().zip(&mut means).zip(&mut *edges) {
            let mut edge = Edges::default();
            for row in 1..=part.down {
                for _ in 0..part.across {
                    block(&mut bits, part, mean)?;
                    if row == 1 {
                        edge.top += *mean as i16;
                    }
                    if row == part.down {
                        edge.bottom += *mean as i16;
                    }
                }
            }
            edges.push(edge);
        }
        if bits.overrun() {
            return None;
        }
    }
    bits.left()
}

#[inline(always)]
fn block(bits: &mut Bits<'_>, part: &Part<'_>, mean: &mut i32) -> Option<()> {
    bits.refill();
    *mean += part.means.take(bits)?;
    if mean.abs() > part.largest_mean {
        return None;
    }
    let mut coefficients = 1;
    if part.steps.take(bits, &mut coefficients)? {
        return Some(());
    }
    loop {
        bits.refill();
        // One refill is enough for two.
        if part.steps.take(bits, &mut coefficients)? || part.steps.take(bits, &mut coefficients)? {
            return Some(());
        }
    }
}
