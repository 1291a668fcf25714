//! Views → calibration with stated uncertainty.
//!
//! | room | holds |
//! |---|---|
//! | [`solve`] | corners → lens and poses, with covariance, for the lens model that the corners support |
//! | [`check`] | findings and the verdict: checks that don't rely on the residual of the fit |
//! | `params`, `inputs` | what to estimate; the corners and everything derived from them before adjustment |
//! | `calibrate`, `examined`, `summary`, `result` | runs the stages; judges the residuals; turns the minimum into a [`Calibration`] |
//! | `free_fit` | free homographies of the views, straightened under a wide lens |
//! | `repeats` | pictures of one held pose count once |
//! | [`acceptance`](mod@acceptance) | whether the result is good enough for a stated need |
//! | `drift` | new views of an installed camera against its old calibration |
//! | `lens_difference` | two calibrations of one camera, by what they state |
//!
//! [`calibrate`] runs them all. `solve` uses none of the others, `check` uses `solve`, and the top level uses both.
//! Everything is deterministic. Findings and errors are values with numbers; `text` turns them into sentences.

pub mod acceptance;
mod calibrate;
pub mod check;
mod drift;
mod examined;
mod free_fit;
mod inputs;
mod known_lens;
mod lens_change;
mod lens_difference;
mod params;
mod repeats;
mod result;
pub mod solve;
mod summary;

pub use acceptance::{Acceptance, AcceptanceGoal, ErrorBound, NotAGoal};
pub use calibrate::calibrate;
pub use check::{
    finding::{CANDIDATES, Finding, FindingCode, FocusMotion, Severity, Verdict, is_unfinished},
    leave_out,
    limits::Limits,
    noise_findings::noise_finding,
    projection_sd::{GridSd, ProjectionJacobian, ProjectionSd, projection_jacobian},
};
pub use drift::{DRIFT_VIEWS, Drift, DriftVerdict, NoDrift, OldLens, drift};
pub use known_lens::{Combined, KnownLens, NotHeld};
pub use lens_difference::{LensDifference, StatedLens};
pub use params::{BOARD_SCALE_SD, CalibrationParams, NotCalibrated};
pub use result::{Calibration, Focal, PrincipalPointEstimate, PrincipalPoints, ViewResult};
pub use solve::{
    bundle::{Bundle, BundleState, InvalidCorners, Observations, adjust},
    free_homography::{self, FreeHomographies},
    lens_model::{LensFamily, LensFreedom, LensModel, LensPrior},
    model_choice::ModelFit,
    zhang,
};
