//! Views → calibration with stated uncertainty.
//!
//! | stage | does |
//! |---|---|
//! | `start` | closed forms of the corners as seen: principal lines, ring, Zhang |
//! | `bundle` | lens and poses by least squares, for one lens model |
//! | `model_choice` | nested lens models, chosen by BIC; doubt about the choice enters the covariance |
//! | `free_homography` | the independent check: no common focal length, distortion centre free |
//! | `uncertainty` | what the covariance means for pixels, a turn of the camera set aside |
//! | `skip` | estimates with views left out |
//! | `causes`, `extended` | what a misfit comes from: focus, board, shutter, mixed views; its doubt widens the covariance |
//! | `varying` | the result when every view has its own focal length |
//! | `corners`, `held_out` | single corners that are wrong; views that the others do not predict |
//! | `honesty` | findings and the verdict |
//! | `drift` | new views of an installed camera against its old calibration |
//!
//! [`calibrate`] runs them all. Everything is deterministic; nothing here speaks to a person.

mod arrow;
mod assemble;
mod bundle;
mod calibrate;
mod causes;
mod corners;
mod drift;
mod excess;
pub mod export;
mod extended;
mod finding;
mod free_covariance;
pub mod free_homography;
mod held_out;
mod honesty;
pub mod import;
mod lens_model;
mod model_choice;
mod result;
pub mod skip;
mod start;
mod uncertainty;
mod varying;
pub mod zhang;

pub use bundle::{Bundle, BundleState, InvalidCorners, Observations, adjust};
pub use calibrate::calibrate;
pub use drift::{DRIFT_VIEWS, Drift, DriftVerdict, NoDrift, OldLens, drift};
pub use finding::{Finding, FindingCode, Severity, Verdict};
pub use free_homography::FreeHomographies;
pub use lens_model::{LensFreedom, LensModel, LensPrior};
pub use model_choice::ModelFit;
pub use result::{
    Calibration, CalibrationParams, Focal, NotCalibrated, PrincipalPointEstimate, PrincipalPoints,
    ViewResult,
};
pub use uncertainty::{GridSd, ProjectionJacobian, ProjectionSd, projection_jacobian};
