//! Reasons against the markers of a board.

/// Reason why a board can't have the given markers.
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
        /// Number of inner corners in a row.
        columns: u16,
        /// Number of inner corners in a column.
        rows: u16,
        /// Number of markers on the board.
        needed: usize,
        /// Name of the dictionary.
        dictionary: &'static str,
        /// Number of markers in the dictionary.
        count: usize,
    },
    /// Tags have four corners each, so rows and columns must have an even number of points.
    #[error("{columns}x{rows} points aren't the corners of tags: both must be even, 4 or more")]
    Tags {
        /// Number of points in a row.
        columns: u16,
        /// Number of points in a column.
        rows: u16,
    },
    /// The tags are too close, or too far apart.
    #[error("tags {spacing} of their side apart: 0.1 to 0.6 are possible")]
    Spacing {
        /// White between tags, as a share of a tag's side.
        spacing: f64,
    },
    /// The family has too few tags.
    #[error("tags {first} to {last} are needed; {dictionary} has 0 to {highest}")]
    Numbers {
        /// First tag.
        first: u16,
        /// Last tag on the board.
        last: usize,
        /// Name of the family.
        dictionary: &'static str,
        /// Last tag of the family.
        highest: usize,
    },
}

impl InvalidMarkers {
    /// Least and largest side of a marker, as a share of a square's.
    pub const SIDES_SQUARES: [f64; 2] = [0.3, 0.95];
    /// Least and largest space between tags, as a share of a tag's side: nearly equal steps can't
    /// be told apart when tilted.
    pub const SPACINGS: [f64; 2] = [0.1, 0.6];
}
