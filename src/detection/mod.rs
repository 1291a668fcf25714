//! Finds the board in a picture: image → [`Detection`] or [`Miss`]. No state between frames but what is
//! handed in as a [`Prediction`].
//!
//! | stage | does | fails when | parameters |
//! |---|---|---|---|
//! | `track` | looks where the board should be by now | sudden moves: then everywhere | every tenth frame everywhere |
//! | `reduce` | halves the picture until corners have the size of the search ring | squares under ~6 px at the search level | 1000 px wide, then half of that, then twice |
//! | `response` | corner response on a ring, its local maxima | edges cross below ~35°, contrast below ~8 levels | `min_response`, `max_candidates` |
//! | `junction` | the two edge directions and the colours between them | a neighbour's edge enters the ring | edges in line within 27°, crossing above 30° |
//! | `grow` | grows grids (`lattice`) of junctions with alternating colours | several neighbouring corners missing | `max_seeds` |
//! | `board_match` | fits a grid to the known board, fills gaps it can verify, numbers the corners | cut, covered or dazzled boards: a reason (`missing`) | a third of the neighbours' contrast |
//! | `refine` | fits the `edge_model` to every corner of the full-size picture: position and covariance; drops what contradicts its neighbours | a corner is covered, or softer than a quarter of a square | `max_residual`, `max_blur_px`, `min_contrast` |
//! | `motion` | how far the board moved while the shutter was open | motion along a diagonal of the squares | – |
//!
//! Missing corners cost a second, wrong ones a calibration: every stage may drop, and what is guessed (one
//! corner in eighteen at most) must be confirmed by its own fit.
//! Work is bounded by counts ([`DetectorParams`]), so that equal pictures give equal results; whoever has no
//! time can end it ([`Search::keep_on`]). Results are the same bits for every vector width (`simd`).

mod board_match;
mod detector;
mod edge_model;
mod edge_pixels;
mod grow;
mod junction;
mod lattice;
mod missing;
mod motion;
mod reduce;
mod refine;
mod response;
mod simd;
mod track;

pub use detector::{Detector, DetectorParams, Search, detect};
pub use track::{Prediction, Track};

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
    /// How far the board moved while the shutter was open, from edges across the motion being softer than
    /// edges along it; 0 if they are equally sharp.
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
    /// Corners are missing where light reflected by the board, or the lamp itself, saturates the picture.
    Glare {
        /// Corners found.
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
