//! Checks the trustworthiness of a calibration, without relying on the residual of the fit: an
//! overfitted lens has small residuals, too.
//!
//! | file | does |
//! |---|---|
//! | `projection_sd` | projects the covariance to pixels, compensated for rotation of the camera |
//! | `noise_inflation` | inflates corner covariances to what the residuals show |
//! | `noise_correlation` | widens the covariance if errors of neighbouring corners correlate |
//! | `print_errors` | widens the covariance if corners are misplaced on the board |
//! | `next_radial` | doubt from radial terms beyond the models |
//! | `disagreement` | compares bundle and free homographies |
//! | `noise_findings` | compares the noise of the fit with that of a board held still |
//! | `leave_out` | repeats the estimate with views left out |
//! | `held_out` | predicts views from the lens of the others |
//! | `odd_corners` | finds corners in the wrong order, and single corners far off |
//! | `trust_checks` | turns all evidence into findings |
//! | `limits` | limits of a Good calibration |
//! | `finding` | the possible findings, their severity, and the verdict |

pub(super) mod disagreement;
pub(super) mod finding;
pub(super) mod heavy_tails;
pub(super) mod held_out;
pub mod leave_out;
pub(super) mod limits;
pub(super) mod next_radial;
pub(super) mod noise_correlation;
pub(super) mod noise_findings;
pub(super) mod noise_inflation;
pub(super) mod odd_corners;
pub(super) mod print_errors;
pub(super) mod projection_sd;
pub(super) mod trust_checks;
