//! Geometry of one camera looking at one flat board. Pure functions of numbers.
//!
//! # Conventions
//!
//! - Pixels: `x` right, `y` down, `(0, 0)` at the centre of the top-left pixel. Camera: `z` forward.
//! - Board: metres on the plane `z = 0`, origin at the centre of the grid of inner corners.
//! - Transforms read right to left: `corner_in_image = image_from_board * corner_in_board`.
//! - Angles are radians; a name carries `_deg` only where a person reads or writes it.
//! - Directions of lines are modulo π, tilt azimuths (the direction in which a board recedes) modulo 2π.
//!
//! | file | holds |
//! |---|---|
//! | `camera`, `distortion`, `corner` | the lens model; a measured corner with covariance |
//! | `lens_parameter` | the lens model's parameters by name, and their parts of a covariance |
//! | `homography`, `pose` | board plane → picture, and the rigid motion behind it; both by `least_squares` |
//! | `principal_line` | the line through the principal point that one view determines |
//! | `principal_point`, `ring`, `outlier` | what several lines determine, and lines that don't fit |
//! | `coverage` | which parts of the picture the boards have covered |
//! | `target` | what a board looks like, whatever its kind; the kinds |

pub mod board;
pub mod board_code;
mod camera;
mod corner;
mod coverage;
pub mod device;
mod distortion;
pub mod frame;
mod homography;
pub mod least_squares;
mod lens_parameter;
pub mod markers;
mod outlier;
pub mod panic_message;
pub mod parallel;
mod pose;
mod principal_line;
mod principal_point;
mod ring;
pub mod target;

pub use camera::{Camera, Projection, RayProjection};
pub use corner::{Corner, mean_px, seen_count};
pub use coverage::{
    BoardOutline, GRID_COLUMNS, GRID_ROWS, cell_centre_px, cell_centres_px, corner_coverage,
    coverage, open_corners,
};
pub use distortion::{BROWN_PARAMETERS, Distortion, LENS_PARAMETERS, LensKind};
pub use homography::{Homography, NoHomography, expect_unseen};
pub use lens_parameter::{LensMatrix, LensParameter, LensParts};
pub use outlier::{
    ConsistentLines, LINES_TO_TELL_OUTLIERS, OutlierLine, OutliersUnknown, consistent_lines,
};
pub use pose::{NoPose, PoseFit, fit_pose, pose_from_homography, pose_from_rays};
pub use principal_line::{FocalLength, NoFocalLength, NoPrincipalLine, PrincipalLine};
pub use principal_point::{
    NoPrincipalPoint, PrincipalPoint, intersect_unweighted, intersect_weighted,
};
pub use ring::{NoRing, RingEstimate, principal_line_and_ring};
