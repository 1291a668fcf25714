//! Result of the detector: the board's corners, or the reason for their absence.

use boresight_geometry::{
    Corner,
    boards::{Board, BoardChoice, Pattern},
    markers::{CircleRows, Dictionary},
};

/// Board found in a picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Detection {
    /// Every inner corner, row by row in the board's numbering, in pixels with covariance. A
    /// covered or cut-off corner is [unseen](Corner::unseen).
    pub corners: Vec<Corner>,
    /// Sharpness, contrast, glare and motion.
    pub quality: Quality,
}

/// Image quality of the board, measured on the edges.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quality {
    /// Standard deviation in pixels of the Gaussian blur of the edges, median over the corners.
    pub blur_px: f64,
    /// Half the brightness step between dark and light squares in grey levels (0 to 127.5), median
    /// over the corners.
    pub contrast: f64,
    /// Fraction of the corners with saturated light squares, 0 to 1.
    pub glare: f64,
    /// Motion in pixels during the exposure, estimated from the difference in blur between edges
    /// across and along the motion; 0 if both are equally sharp. A lower bound, see the `motion`
    /// stage.
    pub motion_px: f64,
}

/// Side of the picture.
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

/// Another board than the named board.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OtherBoard {
    /// Board without markers.
    Plain {
        /// Inner corners in a row.
        columns: usize,
        /// Inner corners in a column.
        rows: usize,
    },
    /// Board with markers in the light squares.
    Charuco {
        /// Dictionary of the markers; the largest of a family represents all that begin like it.
        dictionary: Dictionary,
        /// True if the markers' side is about the usual share of a square's, so that nobody needs
        /// to measure.
        is_usual_side: bool,
    },
    /// Board without markers larger than the named board, but not seen whole.
    Larger {
        /// Least number of corners in a row.
        columns: usize,
        /// Least number of rows of corners.
        rows: usize,
    },
    /// Tags with small squares between the corners, at the usual distance.
    AprilGrid,
    /// Grid of circles.
    Circles {
        /// Number of circles in a row.
        columns: usize,
        /// Number of rows.
        rows: usize,
        /// Layout of the rows.
        layout: CircleRows,
    },
}

impl OtherBoard {
    /// Choice of the board; `None` if too little of it is known, or if no such board can be chosen.
    ///
    /// ```
    /// # use boresight_detect::OtherBoard;
    /// let seen = OtherBoard::Plain { columns: 7, rows: 5 };
    /// assert_eq!(seen.choice().map(|choice| choice.to_string()).as_deref(), Some("7x5"));
    /// ```
    pub fn choice(self) -> Option<BoardChoice> {
        let (columns, rows, pattern) = match self {
            Self::Plain { columns, rows } => (columns, rows, Pattern::Plain),
            Self::Circles { columns, rows, layout } => (columns, rows, Pattern::Circles(layout)),
            Self::Charuco { .. } | Self::Larger { .. } | Self::AprilGrid => return None,
        };
        let side = |count: usize| u16::try_from(count).ok();
        let (columns, rows) = (side(columns)?, side(rows)?);
        let can_be_chosen = Board::new(columns, rows, 1.0).is_ok();
        can_be_chosen.then_some(BoardChoice { columns, rows, pattern })
    }
}

/// Board on which pictures agree that all miss the named one: the only board named, or without one,
/// the largest full [rectangle](Miss::rectangle) seen in two pictures, if no picture shows more.
pub fn agreed(misses: &[Miss]) -> Option<BoardChoice> {
    let named = misses.iter().filter_map(|miss| match miss {
        Miss::OtherBoard(other) => Some(*other),
        _ => None,
    });
    let rectangles = || misses.iter().filter_map(Miss::rectangle).filter_map(OtherBoard::choice);
    let largest = || {
        let largest = rectangles().max_by_key(|it| it.columns * it.rows)?;
        let is_seen_twice = rectangles().filter(|it| *it == largest).count() > 1;
        is_seen_twice.then_some(largest)
    };
    let choice = match named.clone().next() {
        Some(_) => named.clone().find_map(OtherBoard::choice)?,
        None => largest()?,
    };
    let holds = |columns: usize, rows: usize| {
        columns <= usize::from(choice.columns) && rows <= usize::from(choice.rows)
    };
    let is_held = |other: OtherBoard| match other {
        OtherBoard::Larger { columns, rows } => choice.pattern.is_plain() && holds(columns, rows),
        _ => other.choice() == Some(choice),
    };
    let are_held = rectangles().all(|it| holds(it.columns.into(), it.rows.into()));
    (named.clone().all(is_held) && (are_held || !choice.pattern.is_plain())).then_some(choice)
}

/// Reason for a missing [`Detection`]. An ordinary result, not an error of the program.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Miss {
    /// No checkerboard-like pattern.
    NoBoard,
    /// Part of the board is visible: too little, or an unidentified part.
    PartialBoard {
        /// Number of inner corners found.
        found: usize,
        /// Number of corners of the whole board. All of them are found if white, or circles'
        /// ground, is missing around the board.
        wanted: usize,
        /// Corners of a plain grid between the outermost ones found, along the longer and the
        /// shorter side; zeros if the grid doesn't count.
        size: [usize; 2],
        /// Side of the picture at which the board is cut off, if any.
        cut_off_by: Option<Side>,
    },
    /// Corners are missing where a reflection or a lamp saturates the picture.
    Glare {
        /// Number of inner corners found.
        found: usize,
        /// Number of corners of the whole board.
        wanted: usize,
    },
    /// Another board, of another size or kind.
    OtherBoard(OtherBoard),
    /// Board with markers like the named board's, seen in a mirror.
    Mirrored,
    /// Board without the named board's markers in the light squares.
    OtherMarkers {
        /// Number of markers seen, from any dictionary.
        markers: usize,
    },
    /// Board with the named board's markers in other places: it has another number of columns or
    /// rows.
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
    /// True if the picture may show a board of another kind.
    pub fn leaves_open(&self) -> bool {
        matches!(
            self,
            Self::NoBoard
                | Self::PartialBoard { .. }
                | Self::Glare { .. }
                | Self::Blurred { .. }
                | Self::OtherMarkers { .. }
                // Some corners of a board with markers can look like this.
                | Self::OtherBoard(OtherBoard::Plain { .. } | OtherBoard::Larger { .. })
        )
    }

    /// Board without markers as large as the grid found, if that's a full rectangle inside the
    /// picture: a smaller board, or an uncovered part of the named one.
    pub fn rectangle(&self) -> Option<OtherBoard> {
        match *self {
            Self::PartialBoard { found, size: [columns, rows], cut_off_by: None, .. }
                if found == columns * rows =>
            {
                Some(OtherBoard::Plain { columns, rows }).filter(|it| it.choice().is_some())
            }
            _ => None,
        }
    }

    /// Number of corners of a part.
    pub(super) fn found(&self) -> usize {
        if let Self::PartialBoard { found, .. } = *self { found } else { 0 }
    }

    /// True if more informative than `other`.
    pub(super) fn is_closer_than(&self, other: Self) -> bool {
        self.closeness() > other.closeness()
    }

    /// Rank of a miss by information.
    fn closeness(&self) -> usize {
        match *self {
            Self::NoBoard | Self::OutOfTime => 0,
            // Many pictures without a board contain a few corners.
            Self::PartialBoard { found, wanted, .. } if 4 * found < wanted || found < 9 => 0,
            Self::PartialBoard { found, .. } | Self::Glare { found, .. } => found,
            // A part of another board is less clear than the whole.
            Self::OtherBoard(OtherBoard::Larger { columns, rows }) => columns * rows,
            Self::OtherBoard(
                OtherBoard::Plain { columns, rows } | OtherBoard::Circles { columns, rows, .. },
            ) => 2 * columns * rows,
            // Recognised if no other reason is clear.
            Self::OtherBoard(OtherBoard::Charuco { .. } | OtherBoard::AprilGrid) => 0,
            Self::OtherMarkers { markers } => 10 + markers,
            Self::Mirrored
            | Self::OtherSquares { .. }
            | Self::TooSmall { .. }
            | Self::Blurred { .. }
            | Self::LowContrast { .. } => 100_000,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn part(found: usize, size: [usize; 2]) -> Miss {
        Miss::PartialBoard { found, wanted: 88, size, cut_off_by: None }
    }

    #[test]
    fn one_whole_board_or_two_equal_parts_name_the_board_of_a_folder() {
        let plain = |columns, rows| Miss::OtherBoard(OtherBoard::Plain { columns, rows });
        let named = |misses: &[Miss]| agreed(misses).map(|it| it.to_string());
        assert_eq!(named(&[plain(10, 7), Miss::NoBoard]).as_deref(), Some("10x7"));
        assert_eq!(named(&[plain(10, 7), plain(9, 7)]), None);
        let larger = |columns, rows| Miss::OtherBoard(OtherBoard::Larger { columns, rows });
        assert_eq!(named(&[larger(9, 7), plain(10, 7)]).as_deref(), Some("10x7"));
        assert_eq!(named(&[larger(11, 7), plain(10, 7)]), None);
        assert_eq!(named(&[part(63, [9, 7])]), None);
        assert_eq!(
            named(&[part(63, [9, 7]), part(54, [9, 6]), part(63, [9, 7])]).as_deref(),
            Some("9x7")
        );
        assert_eq!(named(&[part(62, [9, 7]), part(62, [9, 7])]), None, "a corner is covered");
        assert_eq!(named(&[part(63, [9, 7]), plain(8, 7)]), None);
    }
}
