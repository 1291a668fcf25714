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
//! | `torn_views` | finds views put together from two pictures |
//! | `hypotheses` | table of causes of a misfit: focus, board, shutter, mixed or torn views |
//! | `view_split`, `first_steps`, `picture_effect`, `extended_bundle` | fits the causes |
//! | `misfit_models`, `misfit_diagnosis` | compares their odds |
//! | `correction`, `other_parameters` | corrects causes, and carries the remaining doubt over |
//! | `trust_checks` | turns all evidence into findings |
//! | `limits` | limits of a GOOD calibration |
//! | `finding` | the possible findings, their severity, and the verdict |

mod cause_findings;
pub(super) mod correction;
pub(super) mod disagreement;
mod extended_bundle;
pub(super) mod finding;
mod first_steps;
pub(super) mod heavy_tails;
pub(super) mod held_out;
mod hypotheses;
pub mod leave_out;
pub(super) mod limits;
pub(super) mod misfit_diagnosis;
mod misfit_models;
pub(super) mod next_radial;
pub(super) mod noise_correlation;
pub mod noise_findings;
pub(super) mod noise_inflation;
pub(super) mod odd_corners;
mod other_parameters;
mod picture_effect;
pub(super) mod print_errors;
pub(super) mod projection_sd;
mod torn_views;
pub(super) mod trust_checks;
mod view_split;
