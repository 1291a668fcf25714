//! The detector's answer: the board's corners, or the reason why not.

use boresight_geometry::Corner;

/// A board, found in a picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Detection {
    /// Every inner corner, row by row in the board's numbering, in pixels with covariance. A covered or cut-off corner
    /// is [unseen](Corner::unseen).
    pub corners: Vec<Corner>,
    /// Sharpness, contrast, glare and motion.
    pub quality: Quality,
}

/// Image quality of the board, measured on its edges.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quality {
    /// Standard deviation in pixels of the Gaussian that blurs the edges, median over the corners.
    pub blur_px: f64,
    /// Half the brightness step between dark and light squares in grey levels (0 to 127.5), median over the corners.
    pub contrast: f64,
    /// Fraction of the corners whose light squares are saturated, 0 to 1.
    pub glare: f64,
    /// Motion in pixels during the exposure, estimated from the difference in blur between edges across and along
    /// the motion; 0 if both are equally sharp. A lower bound, see the `motion` stage.
    pub motion_px: f64,
}

/// A side of the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// Left edge of the picture.
    Left,
    /// Right edge of the picture.
    Right,
    /// Top edge of the picture.
    Top,
    /// Bottom edge of the picture.
    Bottom,
}

/// Why there is no [`Detection`]. An ordinary result, not an error of the program.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Miss {
    /// Nothing that looks like a checkerboard.
    NoBoard,
    /// Only part of the board is visible: too little, or an unidentified part.
    PartialBoard {
        /// Number of inner corners found.
        found: usize,
        /// Corners of the whole board.
        wanted: usize,
        /// Side of the picture at which the board is cut off, if any.
        cut_off_by: Option<Side>,
    },
    /// Corners are missing where a reflection or a lamp saturates the picture.
    Glare {
        /// Number of inner corners found.
        found: usize,
        /// Corners of the whole board.
        wanted: usize,
    },
    /// A complete board of another size.
    OtherBoard {
        /// Inner corners in a row.
        columns: usize,
        /// Inner corners in a column.
        rows: usize,
    },
    /// A board whose light squares don't have the markers of the named one.
    OtherMarkers {
        /// Number of markers seen, from any dictionary.
        markers: usize,
    },
    /// A board with markers of the named one, but not in the same places: it has another number of columns or rows.
    OtherSquares {
        /// Number of markers seen.
        markers: usize,
    },
    /// Squares too small to measure.
    TooSmall {
        /// Shortest side of a square, in pixels.
        square_px: f64,
        /// Least side that can be measured, in pixels.
        needed_px: f64,
    },
    /// Edges too blurred to measure.
    Blurred {
        /// Blur, as [`Quality::blur_px`].
        blur_px: f64,
        /// Widest blur that can be measured.
        limit_px: f64,
    },
    /// Contrast too low to measure.
    LowContrast {
        /// Contrast, as [`Quality::contrast`].
        contrast: f64,
        /// Least contrast that can be measured.
        needed: f64,
    },
    /// [`Search::keep_on`](super::Search::keep_on) ended the search.
    OutOfTime,
}

impl Miss {
    /// The more informative of two misses; the first of equals.
    #[must_use]
    pub(super) fn or_closer(self, other: Self) -> Self {
        if other.closeness() > self.closeness() { other } else { self }
    }

    /// Rank of a miss by how much it tells.
    fn closeness(&self) -> usize {
        match *self {
            Self::NoBoard | Self::OutOfTime => 0,
            // Many pictures without a board contain a few corners.
            Self::PartialBoard { found, wanted, .. } if 4 * found < wanted || found < 9 => 0,
            Self::PartialBoard { found, .. } | Self::Glare { found, .. } => found,
            Self::OtherBoard { columns, rows } => columns * rows,
            Self::OtherMarkers { markers } => 10 + markers,
            Self::OtherSquares { .. }
            | Self::TooSmall { .. }
            | Self::Blurred { .. }
            | Self::LowContrast { .. } => 100_000,
        }
    }
}
