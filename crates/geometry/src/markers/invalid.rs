//! Which markers a board can have.

use super::{Markers, marker_count};

/// Why a board can't have these markers.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum InvalidMarkers {
    /// The markers are too small or too large for the squares.
    #[error("markers with a side of {side_squares} squares: 0.3 to 0.95 are possible")]
    Side {
        /// Side of a marker, as a share of a square's.
        side_squares: f64,
    },
    /// The dictionary has too few markers.
    #[error(
        "a board of {columns}x{rows} inner corners has {needed} markers; {dictionary} has only {count}"
    )]
    Count {
        /// Inner corners in a row.
        columns: u16,
        /// Inner corners in a column.
        rows: u16,
        /// Markers on the board.
        needed: usize,
        /// The dictionary's name.
        dictionary: &'static str,
        /// Its markers.
        count: usize,
    },
}

impl InvalidMarkers {
    /// Least and largest side of a marker, as a share of a square's.
    pub const SIDES_SQUARES: [f64; 2] = [0.3, 0.95];
}

impl Markers {
    /// Whether a board of `columns` × `rows` inner corners can have these markers.
    ///
    /// # Errors
    ///
    /// [`InvalidMarkers`] if their side is outside 0.3..=0.95 squares, or if the dictionary has too few.
    pub fn check(&self, [columns, rows]: [u16; 2]) -> Result<(), InvalidMarkers> {
        let Self { dictionary, side_squares } = *self;
        let [least, most] = InvalidMarkers::SIDES_SQUARES;
        if !(least..=most).contains(&side_squares) {
            return Err(InvalidMarkers::Side { side_squares });
        }
        let squares = [columns, rows].map(|corners| usize::from(corners) + 1);
        let (needed, count) = (marker_count(squares), dictionary.count());
        if needed > count {
            let dictionary = dictionary.name();
            return Err(InvalidMarkers::Count { columns, rows, needed, dictionary, count });
        }
        Ok(())
    }
}
