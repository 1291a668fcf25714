//! Finds a checkerboard, a ChArUco board, an AprilGrid or a grid of circles in a picture: every
//! inner corner or centre with covariance, or the reason for its absence.
//!
//! ```
//! use boresight_detect::{DetectorParams, detect};
//! use boresight_geometry::boards::Board;
//! use image::{GrayImage, Luma, imageops};
//! use nalgebra::Point2;
//!
//! // 10 by 7 squares of 40 pixels on a light page, as sharp as a good lens shows them.
//! let drawn = GrayImage::from_fn(640, 480, |x, y| {
//!     let (column, row) = (x.wrapping_sub(120) / 40, y.wrapping_sub(100) / 40);
//!     let is_dark = column < 10 && row < 7 && (column + row) % 2 == 0;
//!     Luma([if is_dark { 40 } else { 210 }])
//! });
//! let page = imageops::blur(&drawn, 0.8);
//!
//! // A board is named by its inner corners; the side of a square in metres doesn't matter here.
//! let board = Board::new(9, 6, 0.025)?;
//! let found = detect(&page, &board, DetectorParams::default()).expect("the whole board is seen");
//! assert_eq!(found.corners.len(), 54);
//! for (index, corner) in found.corners.iter().enumerate() {
//!     let (column, row) = ((index % 9 + 1) as f64, (index / 9 + 1) as f64);
//!     // (0, 0) is the centre of the first pixel, so squares meet between pixels.
//!     let truth_px = Point2::new(119.5 + 40.0 * column, 99.5 + 40.0 * row);
//!     assert!((corner.px - truth_px).norm() < 0.02);
//! }
//! # Ok::<(), boresight_geometry::boards::InvalidBoard>(())
//! ```
//!
//! [`detect`] takes one picture. For a stream, a [`Detector`] keeps its buffers and searches near a
//! [`Prediction`]. That is the only state between frames, and the caller keeps it.
//!
//! # Stages
//!
//! A picture becomes a [`Detection`] or a [`Miss`]:
//!
//! | stage | does |
//! |---|---|
//! | `track` | searches near the predicted corners |
//! | `reduce` | halves the picture until corners match the size of the search ring |
//! | `response` | computes a corner response on a ring and its local maxima |
//! | `junction` | reads the two edge directions and the colours between them |
//! | `grow` | grows grids (`lattice`) of junctions with alternating colours |
//! | `colours` | refuses a grid of discs or of several smaller squares, by its edges |
//! | `board_match` | matches a grid to the board, fills gaps (`saddle`), numbers the corners |
//! | `placement` | places a part of the board by its track or its printed code |
//! | `marked_board` | places a grid by markers or tags (`marker_cells`, `marker_votes`) instead |
//! | `refine` | fits the `edge_model` to every corner; drops corners that contradict others |
//! | `bent_edges` | moves the corners onto edges bent by the lens |
//! | `circle_blobs`, `circle_grid` | finds ellipses, and grows and places a grid of them instead |
//! | `disc_pixels`, `disc_model`, `circles` | fits ellipses, and derives the circles' centres |
//! | `picture_quality` | recognises a dark or blurred picture, if no board is found |
//! | `printed_code` | reads the code in the margin, for a part of a board or on request |
//! | `explain` | lists the weighed grids, on request |
//! | `motion` | estimates the motion of the board during the exposure |
//!
//! | stage | fails when | parameters |
//! |---|---|---|
//! | `track` | the board moves suddenly: then everywhere | everywhere on every tenth frame |
//! | `reduce` | squares are under ~6 px at the search level | 1000 px wide, then half, then twice |
//! | `response` | edges cross below ~35° | `max_candidates` |
//! | `response` | contrast is below ~8 levels | `min_response` |
//! | `junction` | an edge of another corner enters the ring | in line to 27°, crossing above 30° |
//! | `grow` | several neighbouring corners are missing | `max_seeds` |
//! | `colours` | blur leaves no edges in the middle of a square's side | – |
//! | `board_match` | the board is cut off, covered or overexposed | a third of the contrast |
//! | `placement` | under twelve corners are seen, or neither track nor code decides | – |
//! | `marked_board` | under two markers of 4x4 cells are seen, or one of 6x6 | a seventh of cells |
//! | `refine` | a corner is covered | `max_residual` |
//! | `refine` | blur exceeds a quarter of a square | `max_blur_px`, `min_contrast` |
//! | `bent_edges` | the board has fewer than three corners in a row | – |
//! | `circle_grid` | part of the board is missing, or more of it may follow | – |
//! | `circles` | circles are under ~3 px wide | `max_residual`, `max_blur_px`, `min_contrast` |
//! | `picture_quality` | another object is light and sharp | – |
//! | `printed_code` | there is none | – |
//! | `motion` | motion is along a diagonal of the squares | – |
//!
//! A missed board costs a second, a wrong corner a calibration. So every stage may drop candidates,
//! and each interpolated corner (at most one in eighteen) must be confirmed by its own fit. Work is
//! bounded by counts ([`DetectorParams`]), so that equal pictures give equal results; a caller
//! short of time can stop the search ([`Search::keep_on`]). Results are identical for every vector
//! width (`simd`).
//!
//! # Features
//!
//! None of its own.
//!
//! # Requirements
//!
//! A picture in memory: no files, clocks, chance, threads or unsafe code. The crate compiles for
//! `wasm32-unknown-unknown`.
//!
//! # Limitations
//!
//! - One board in a picture of 8-bit brightness, with known columns and rows; [`Detector::count`]
//!   reads them from a picture.
//! - Some boards are missed: see the column "fails when".
//! - A covariance is that of the fit to the picture. A print that isn't flat or true to size isn't
//!   part of it.
//! - Another version may find other boards, and corners elsewhere within their covariance.
//!   `docs/versioning.md` lists the stable parts.

#![forbid(unsafe_code)]

mod bent_edges;
mod board_match;
mod circle_blobs;
mod circle_grid;
mod circles;
mod colours;
mod complete;
mod detector;
mod disc_model;
mod disc_pixels;
mod edge_model;
mod edge_pixels;
mod erf;
mod explain;
mod grid_search;
mod grow;
mod junction;
mod lattice;
mod marked_board;
mod marker_cells;
mod marker_votes;
mod missing;
mod motion;
mod nearby;
mod neighbours;
mod outcome;
mod params;
mod patch;
mod picture_quality;
mod placement;
mod plane;
mod printed_code;
mod recognise;
mod reduce;
mod refine;
mod response;
mod saddle;
mod simd;
mod stated_noise;
mod track;

#[doc(hidden)]
pub use detector::Search;
pub use detector::{Detector, detect};
#[doc(hidden)]
pub use explain::{
    GridOutcome, Searched, VotedPlace, WeighedEnd, WeighedGrid, WeighedMarkers, WeighedPlace,
};
#[doc(hidden)]
pub use outcome::agreed;
pub use outcome::{Detection, Miss, OtherBoard, Quality, Side};
pub use params::DetectorParams;
#[doc(hidden)]
pub use printed_code::read_code;
#[doc(hidden)]
pub use track::{Prediction, Track};

/// Compiles and runs the example of the README.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
