//! Finds a checkerboard, a ChArUco board, an AprilGrid or a grid of circles in a picture: every inner corner or centre with
//! covariance, or the reason why not.
//!
//! ```
//! use boresight_detect::{DetectorParams, detect};
//! use boresight_geometry::board::Checkerboard;
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
//! let board = Checkerboard::new(9, 6, 0.025)?;
//! let found = detect(&page, &board, DetectorParams::default()).expect("the whole board is seen");
//! assert_eq!(found.corners.len(), 54);
//! for (index, corner) in found.corners.iter().enumerate() {
//!     let (column, row) = ((index % 9 + 1) as f64, (index / 9 + 1) as f64);
//!     // (0, 0) is the centre of the first pixel, so squares meet between pixels.
//!     let truth_px = Point2::new(119.5 + 40.0 * column, 99.5 + 40.0 * row);
//!     assert!((corner.px - truth_px).norm() < 0.02);
//! }
//! # Ok::<(), boresight_geometry::board::InvalidBoard>(())
//! ```
//!
//! [`detect`] takes one picture. For a stream, a [`Detector`] keeps its buffers and searches near a [`Prediction`]. That
//! is the only state between frames, and the caller keeps it.
//!
//! # Stages
//!
//! A picture becomes a [`Detection`] or a [`Miss`]:
//!
//! | stage | does | fails when | parameters |
//! |---|---|---|---|
//! | `track` | searches near the predicted corners | the board moves suddenly: then everywhere | everywhere on every tenth frame |
//! | `reduce` | halves the picture until corners match the size of the search ring | squares are under ~6 px at the search level | 1000 px wide, then half of that, then twice |
//! | `response` | computes a corner response on a ring and its local maxima | edges cross below ~35°, contrast is below ~8 levels | `min_response`, `max_candidates` |
//! | `junction` | reads the two edge directions and the colours between them | an edge of a neighbouring corner enters the ring | edges in line within 27°, crossing above 30° |
//! | `grow` | grows grids (`lattice`) of junctions with alternating colours | several neighbouring corners are missing | `max_seeds` |
//! | `colours` | refuses a grid whose cells aren't squares, by the edges between its corners: discs, or several smaller squares | blur leaves no edges in the middle of a square's side | – |
//! | `board_match` | matches a grid to the known board, fills gaps it can verify (`saddle`), refuses a part of a larger pattern, numbers the corners | the board is cut off, covered or overexposed; `missing` says which | a third of the neighbours' contrast |
//! | `placement` | says where on the board a part of it lies, by its track or its printed code | fewer than twelve corners are seen, or neither tells | – |
//! | `marked_board` | instead of `board_match`: says where a grid lies on a board with markers or tags (`marker_cells`, `marker_votes`) | fewer than two markers of 4x4 cells are seen, or one of 6x6 | a seventh of a marker's cells |
//! | `refine` | fits the `edge_model` to every corner of the full-size picture: position and covariance; drops corners that contradict their neighbours | a corner is covered, or blurred by more than a quarter of a square | `max_residual`, `max_blur_px`, `min_contrast` |
//! | `bent_edges` | moves the corners onto edges that the lens bends | the board has fewer than three corners in a row | – |
//! | `circle_blobs`, `circle_grid` | instead of all these, for circles: finds ellipses, grows a grid of them, and says where on the board it lies | part of the board is missing, or more of it may follow | – |
//! | `disc_model`, `circles` | fits an ellipse to every circle of the full-size picture, and tells the picture of the circle's centre from the ellipse's | circles are under ~3 px wide | `max_residual`, `max_blur_px`, `min_contrast` |
//! | `picture_quality` | says whether the picture is too dark or blurred, if no board is found | something else in it is light and sharp | – |
//! | `printed_code` | reads the code in the margin of a printed board, for a part or if the caller asks | there is none | – |
//! | `explain` | lists what was weighed, if somebody asks why a picture was refused | – | – |
//! | `motion` | estimates how far the board moved during the exposure | motion is along a diagonal of the squares | – |
//!
//! A missed board costs a second, a wrong corner a calibration. So every stage may drop candidates, and each
//! interpolated corner (at most one in eighteen) must be confirmed by its own fit.
//! Work is bounded by counts ([`DetectorParams`]), so that equal pictures give equal results; a caller short of time
//! can stop the search ([`Search::keep_on`]). Results are identical for every vector width (`simd`).
//!
//! # Features
//!
//! None of its own.
//!
//! # What it needs
//!
//! A picture in memory: no files, clocks, chance, threads or unsafe code. It compiles for `wasm32-unknown-unknown`.
//!
//! # What isn't promised
//!
//! - One board in a picture of 8-bit brightness, with columns and rows that the caller knows; [`Detector::count`] reads
//!   them from a picture.
//! - Some boards are missed: the column "fails when" says which.
//! - A covariance is that of the fit to the picture. A print that isn't flat or true to size isn't part of it.
//! - Another version may find other boards, and corners elsewhere within their covariance. `docs/versioning.md` says
//!   what stays.

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

pub use detector::{Detector, Search, detect};
pub use explain::{
    GridOutcome, ReadMarker, Searched, VotedPlace, WeighedEnd, WeighedGrid, WeighedMarkers,
    WeighedPlace,
};
pub use outcome::{Detection, Miss, OtherBoard, Others, Quality, Side};
pub use params::DetectorParams;
pub use printed_code::read_code;
pub use track::{Prediction, Track};

/// Compiles and runs the example of the README.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
