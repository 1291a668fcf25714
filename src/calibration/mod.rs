//! Views → calibration with stated uncertainty.

mod arrow;
mod bundle;
pub mod free_homography;
mod lens_model;
pub mod skip;
mod uncertainty;
pub mod zhang;

pub use bundle::{Bundle, BundleState, InvalidCorners, Observations, adjust};
pub use free_homography::FreeHomographies;
pub use lens_model::{LensFreedom, LensModel, LensPrior};
pub use uncertainty::{
    GRID_COLUMNS, GRID_ROWS, GridSd, ProjectionJacobian, ProjectionSd, projection_jacobian,
};
