//! Corners → lens and poses: closed forms, least squares, lens models.
//!
//! | file | does |
//! |---|---|
//! | `initial_guess` | closed forms from the distorted corners: principal lines, ring, Zhang |
//! | `zhang` | Zhang's method: the closed form and its refinement |
//! | `schur_lm` | Levenberg–Marquardt for shared and per-view parameters, by Schur complement |
//! | `gram` | sums of products of derivatives, the parts of normal equations |
//! | `bundle` | fits lens and poses for one lens model |
//! | `whitened` | corners in units of their own error |
//! | `common_error` | downweights the error common to all corners of a view |
//! | `view_scatter` | covariance from the scatter of the views about the lens |
//! | `reversal` | tries the reversed tilt of every view |
//! | `lens_model` | the families of nested lens models, and priors |
//! | `wide_lens` | test for a wide lens of another family than Brown's, and its initial guess |
//! | `odds` | scale of evidence |
//! | `model_choice` | chooses the lens model by BIC; adds the uncertainty of the choice |
//! | `free_homography`, `free_covariance` | independent check without a common focal length |
//! | `varying` | lens with a separate focal length for every view |

pub(super) mod bundle;
pub mod common_error;
pub(super) mod free_covariance;
pub mod free_homography;
pub mod gram;
pub(super) mod initial_guess;
pub(super) mod lens_model;
pub(super) mod model_choice;
pub(super) mod odds;
pub(super) mod reversal;
pub(super) mod schur_lm;
pub(super) mod varying;
pub(super) mod view_scatter;
pub(super) mod whitened;
pub(super) mod wide_lens;
pub mod zhang;
