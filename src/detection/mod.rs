//! Finds the board in a picture: image → [`Detection`] or [`Miss`]. No state between frames.
//!
//! | stage | does | fails when |
//! |---|---|---|
//! | `reduce` | halves the picture until corners have the size of the search ring | squares under ~10 px at the search level |
//! | `response` | corner response on a ring, its local maxima | edges cross below ~40°, contrast below ~8 levels |
//! | `junction` | sub-pixel place, the two edge directions, the colours between them | a neighbour's edge enters the ring |
//! | `lattice` | grows grids of junctions with alternating colours | several neighbouring corners missing |
//! | `board_match` | fits a grid to the known board, fills gaps it can verify, numbers the corners | cut or covered boards: a reason |
//! | `edge_model` | fits blurred edges to the full-size picture: position and covariance | windows cut by the picture's edge |
//!
//! Missing corners cost a second, wrong ones a calibration: every stage may drop, none may guess.
//! Work is bounded by counts ([`DetectorParams`]), not by a clock, so that equal pictures give equal results.

mod board_match;
mod detector;
mod edge_model;
mod junction;
mod lattice;
mod reduce;
mod response;

pub use detector::{Detector, DetectorParams, detect};

use crate::geometry::Corner;

/// A complete board.
#[derive(Clone, Debug, PartialEq)]
pub struct Detection {
    /// Every inner corner, in the board's numbering order.
    pub corners: Vec<Corner>,
    /// How well the board is seen.
    pub quality: Quality,
}

/// How well the board is seen, measured on its own edges.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quality {
    /// Standard deviation of the Gaussian that blurs the edges, median over the corners.
    pub blur_px: f64,
    /// Half the brightness step between dark and light squares in grey levels, median over the corners.
    pub contrast: f64,
    /// Share of the corners whose light squares are clipped, 0 to 1.
    pub glare: f64,
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

/// Why there is no [`Detection`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Miss {
    /// Nothing that looks like a checkerboard.
    NoBoard,
    /// A part of the board, or a board with some corners hidden.
    PartialBoard {
        /// Corners found.
        found: usize,
        /// Corners of the whole board.
        wanted: usize,
        /// The side of the picture that cuts it off, if one does.
        cut_off_by: Option<Side>,
    },
    /// A complete board of another size.
    OtherBoard {
        /// Inner corners in a row.
        columns: usize,
        /// Inner corners in a column.
        rows: usize,
    },
    /// Squares too small to measure.
    TooSmall {
        /// Shortest side of a square.
        square_px: f64,
        /// Least side that is measured.
        needed_px: f64,
    },
    /// Edges too soft to measure.
    Blurred {
        /// Width of the blur, as [`Quality::blur_px`].
        blur_px: f64,
        /// Widest that is measured.
        limit_px: f64,
    },
    /// Dark and light squares hardly differ.
    LowContrast {
        /// As [`Quality::contrast`].
        contrast: f64,
        /// Least that is measured.
        needed: f64,
    },
    /// The search was stopped at its time budget.
    OutOfTime,
}
