//! Check that a frame is whole. It comes before a picture may count, because decoders fill in what is missing.
//!
//! | stage | question |
//! |---|---|
//! | [`raw`] | has an uncompressed frame as many bytes as its mode needs? |
//! | `jpeg` | start, headers, picture size, end within the frame's bytes? Missing Huffman tables are put in |
//! | `scan` | does the compressed data hold every block of the picture, and nothing else? |
//! | `seam` | does the picture go on as it began, or do the blocks after some point jump in brightness? |
//!
//! Limits: JPEG has no checksum. A changed bit within a coefficient's value that keeps every code's length
//! gives another picture of the same structure: some blocks that are wrong, and nothing in the frame tells. So
//! does the join of two frames at the same block. What that does to the corners is caught where a view is
//! chosen, see `moved_rigidly` of `guidance::motion`; not for a view that a person forces, or a
//! photograph.

mod bits;
mod huffman;
mod jpeg;
mod scan;
mod seam;

pub use jpeg::{Checked, JpegGate};

/// Why a frame is not used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Flaw {
    /// The driver flagged it.
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
    /// Headers that no camera's JPEG has.
    BadHeader,
    /// Another picture size than the mode's.
    OtherSize,
    /// Compressed data that ends before the picture does, or that no encoder writes.
    BrokenScan,
    /// Compressed data after the end of the picture.
    SurplusScan,
    /// The decoder refused it.
    Undecodable,
}

/// Least number of bytes of an uncompressed frame of `rows` rows, `bytes_per_row` apart.
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
