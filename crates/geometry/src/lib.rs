//! Geometry of a camera and a flat board: homography, principal line and point, lens, pose.
//!
//! Two tilted views determine the principal point, because the principal line of each passes
//! through it:
//!
//! ```
//! use boresight_geometry::{
//!     Camera, Corner, Homography, PrincipalLine, boards::Board, intersect_weighted, mean_px,
//! };
//! use nalgebra::{Isometry3, Point2, Vector3};
//!
//! let camera = Camera::pinhole(900.0, Point2::new(650.0, 350.0));
//! let board_m = Board::new(9, 6, 0.025)?.corners_in_board_m();
//! let mut lines = Vec::new();
//! for axis in [Vector3::x(), Vector3::y()] {
//!     let tilt = axis * 40_f64.to_radians();
//!     let cam_from_board = Isometry3::new(Vector3::new(0.02, 0.01, 0.4), tilt);
//!     let corners: Vec<Corner> = board_m
//!         .iter()
//!         .filter_map(|point_m| camera.px_from_board(&cam_from_board, point_m))
//!         .map(|px| Corner::isotropic(px, 0.1))
//!         .collect();
//!     let homography = Homography::fit(&board_m, &corners)?;
//!     let image_centre_px = Point2::new(639.5, 359.5);
//!     lines.push(PrincipalLine::of(&homography, image_centre_px, mean_px(&corners))?);
//! }
//!
//! assert!(lines.iter().all(|line| line.distance_px(&camera.pp_px).abs() < 1e-6));
//! assert!((intersect_weighted(&lines)?.px - camera.pp_px).norm() < 1e-6);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Conventions
//!
//! - Pixels: `x` right, `y` down, `(0, 0)` at the centre of the top-left pixel. Camera: `z`
//!   forward.
//! - Board: metres on the plane `z = 0`, origin at the centre of the grid of inner corners.
//! - Transforms read right to left: `corner_in_image = image_from_board * corner_in_board`.
//! - Angles are radians; a name carries `_deg` only where a person reads or writes it.
//! - Directions of lines are modulo π, tilt azimuths (the direction in which a board recedes)
//!   modulo 2π.
//!
//! # Modules
//!
//! | module | holds |
//! |---|---|
//! | `camera`, `distortion`, `corner` | lens model; measured corner with covariance |
//! | `lens_parameter` | lens parameters by name, and their parts of a covariance |
//! | `homography`, `pose` | board plane → picture, and its rigid motion; by [`least_squares`] |
//! | `principal_line` | line through the principal point, determined by a view |
//! | `principal_point`, `ring`, `outlier` | intersection of several lines, and outliers |
//! | `rig` | cameras with fixed mutual places: triangulation, rows, rectification |
//! | `coverage` | coverage of the picture by boards |
//! | `target` | kinds of boards and their common interface |

#[doc(hidden)]
pub mod board_code;
pub mod boards;
mod camera;
mod coded;
mod corner;
mod coverage;
#[doc(hidden)]
pub mod device;
mod distortion;
pub mod frame;
mod homography;
#[doc(hidden)]
pub mod least_squares;
mod lens_parameter;
#[doc(hidden)]
pub mod markers;
mod outlier;
#[doc(hidden)]
pub mod panic_message;
#[doc(hidden)]
pub mod parallel;
mod pose;
mod principal_line;
mod principal_point;
mod rig;
mod ring;
#[cfg(feature = "simd")]
#[doc(hidden)]
pub mod simd;

#[doc(hidden)]
pub use camera::RayProjection;
pub use camera::{Camera, Projection};
pub use corner::{Corner, mean_px, seen_count};
#[doc(hidden)]
pub use coverage::{
    BoardOutline, GRID_COLUMNS, GRID_ROWS, cell_centres_px, corner_coverage, coverage, open_corners,
};
pub use distortion::{BROWN_PARAMETERS, Distortion, LENS_PARAMETERS, LensKind};
pub use homography::{Homography, NoHomography, expect_unseen};
pub use lens_parameter::{DISTORTION_PARAMETERS, LensMatrix, LensParameter};
#[doc(hidden)]
pub use lens_parameter::{LensParts, LensValues};
#[doc(hidden)]
pub use outlier::{
    ConsistentLines, LINES_TO_TELL_OUTLIERS, OutlierLine, OutliersUnknown, consistent_lines,
};
pub use pose::{NoPose, PoseFit, fit_pose, pose_from_homography, pose_from_rays};
pub use principal_line::{FocalLength, NoFocalLength, NoPrincipalLine, PrincipalLine};
pub use principal_point::{
    NoPrincipalPoint, PrincipalPoint, intersect_unweighted, intersect_weighted,
};
#[doc(hidden)]
pub use rig::{Rectified, Rig};
#[doc(hidden)]
pub use ring::{NoRing, RingEstimate, principal_line_and_ring};

/// Compiles and runs the example of the README.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
