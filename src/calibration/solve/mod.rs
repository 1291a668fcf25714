//! Corners → lens and poses: closed forms, least squares, lens models.
//!
//! | file | does |
//! |---|---|
//! | `initial_guess` | closed forms from the corners as seen: principal lines, ring, Zhang |
//! | `zhang` | Zhang's method, the closed form and its refinement |
//! | `schur_lm` | Levenberg-Marquardt on shared and per-view parameters, by Schur complement |
//! | `bundle` | lens and poses by least squares, for one lens model |
//! | `lens_model` | the nested lens models and their priors |
//! | `model_choice` | the lens model chosen by BIC; doubt about the choice enters the covariance |
//! | `free_homography`, `free_covariance` | the independent check: no common focal length, distortion centre free |
//! | `varying` | the result when every view has its own focal length |

pub(super) mod bundle;
pub(super) mod free_covariance;
pub mod free_homography;
pub(super) mod initial_guess;
pub(super) mod lens_model;
pub(super) mod model_choice;
pub(super) mod schur_lm;
pub(super) mod varying;
pub mod zhang;
