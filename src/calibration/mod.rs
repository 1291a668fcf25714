//! Views → calibration with stated uncertainty.
//!
//! | room | holds |
//! |---|---|
//! | [`solve`] | corners → lens and poses, with covariance, for the lens model that the corners support |
//! | [`check`] | findings and the verdict: checks that do not believe the fit's own residual |
//! | [`files`] | calibrations as files: the formats of other programs, read and written |
//! | `calibrate`, `summary`, `result` | the order of the stages; the minimum turned into a [`Calibration`] |
//! | `drift` | new views of an installed camera against its old calibration |
//!
//! [`calibrate`] runs them all. Everything is deterministic; nothing here speaks to a person.

mod calibrate;
pub mod check;
mod drift;
pub mod files;
mod inputs;
mod params;
mod result;
pub mod solve;
mod summary;

pub use calibrate::calibrate;
pub use check::{
    finding::{Finding, FindingCode, Severity, Verdict},
    leave_out,
    projection_sd::{GridSd, ProjectionJacobian, ProjectionSd, projection_jacobian},
};
pub use drift::{DRIFT_VIEWS, Drift, DriftVerdict, NoDrift, OldLens, drift};
pub use files::{export, import};
pub use params::{CalibrationParams, NotCalibrated};
pub use result::{Calibration, Focal, PrincipalPointEstimate, PrincipalPoints, ViewResult};
pub use solve::{
    bundle::{Bundle, BundleState, InvalidCorners, Observations, adjust},
    free_homography::{self, FreeHomographies},
    lens_model::{LensFreedom, LensModel, LensPrior},
    model_choice::ModelFit,
    zhang,
};
