//! Check of frames for completeness, before a picture may count: decoders fill in missing parts.
//!
//! | stage | question |
//! |---|---|
//! | [`raw`] | has an uncompressed frame as many bytes as its mode needs? |
//! | `jpeg` | start, headers, size, end? Missing Huffman tables are inserted |
//! | `scan` | does the data hold every block of the picture, and nothing else? |
//! | `seam` | do the blocks after some point jump in brightness? |
//!
//! Limits: JPEG has no checksum. A changed bit within a coefficient's value, with every code's
//! length unchanged, gives another picture of the same structure: some wrong blocks, without any
//! sign in the frame. So does the join of two frames at the same block. The effect on corners is
//! caught in the choice of a view, see `moved_rigidly` of `guidance::motion`; not for a forced
//! view, or a photograph.

mod bits;
mod huffman;
mod jpeg;
mod scan;
mod seam;

pub use jpeg::{Checked, JpegGate};

/// Reason for rejecting a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Flaw {
    /// The driver flagged the frame.
    Flagged,
    /// A frame without bytes.
    Empty,
    /// More bytes than the buffer holds.
    Overlong,
    /// Fewer bytes than the mode needs.
    Short,
    /// No start-of-image marker of a JPEG.
    NoStart,
    /// No end-of-image marker of a JPEG.
    NoEnd,
    /// Headers not of a camera's JPEG.
    BadHeader,
    /// Another picture size than the mode's.
    OtherSize,
    /// Compressed data with a too early end, or not from any encoder.
    BrokenScan,
    /// Compressed data after the end of the picture.
    SurplusScan,
    /// The decoder refused the frame.
    Undecodable,
}

/// Checks that `used` bytes suffice for an uncompressed frame of `rows` rows, `bytes_per_row`
/// apart.
///
/// # Errors
///
/// [`Flaw::Empty`] or [`Flaw::Short`] if `used` is less.
pub fn raw(used: usize, rows: usize, bytes_per_row: usize) -> Result<(), Flaw> {
    match used {
        0 => Err(Flaw::Empty),
        _ if rows.checked_mul(bytes_per_row).is_none_or(|needed| used < needed) => Err(Flaw::Short),
        _ => Ok(()),
    }
}
