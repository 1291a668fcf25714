//! Should this calibration be trusted? Checks that do not believe the fit's own residual.
//!
//! | file | does |
//! |---|---|
//! | `projection_sd` | what the covariance means for pixels, with a turn of the camera set aside |
//! | `noise_inflation` | how much more the corners scatter than their covariances state |
//! | `leave_out` | estimates with views left out |
//! | `held_out` | views that the others do not predict |
//! | `odd_corners` | single corners that are wrong |
//! | `misfit_models`, `misfit_diagnosis` | what a misfit comes from: focus, board, shutter, mixed views |
//! | `trust_checks` | runs the checks: findings and the verdict |
//! | `finding` | what can be found, and how severe it is |

pub(super) mod finding;
pub(super) mod held_out;
pub mod leave_out;
pub(super) mod misfit_diagnosis;
pub(super) mod misfit_models;
pub(super) mod noise_inflation;
pub(super) mod odd_corners;
pub(super) mod projection_sd;
pub(super) mod trust_checks;
