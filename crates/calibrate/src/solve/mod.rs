//! Corners → lens and poses: closed forms, least squares, lens models.
//!
//! | file | does |
//! |---|---|
//! | `initial_guess` | closed forms from the distorted corners: principal lines, ring, Zhang |
//! | `zhang` | Zhang's method: the closed form and its refinement |
//! | `schur_lm` | Levenberg–Marquardt for shared and per-view parameters, by Schur complement |
//! | `gram` | what normal equations are made of: sums of products of derivatives |
//! | `bundle` | fits lens and poses for one lens model |
//! | `whitened` | corners in units of their own error |
//! | `common_error` | weighs down what all corners of a view err by in common |
//! | `view_scatter` | the covariance that follows from how far the views pull the lens apart |
//! | `reversal` | tries the reversed tilt of every view |
//! | `lens_model` | the families of nested lens models, and priors |
//! | `wide_lens` | whether a wide lens needs another family than Brown's, and its initial guess |
//! | `odds` | what evidence is worth |
//! | `model_choice` | chooses the lens model by BIC; uncertainty of the choice enters the covariance |
//! | `free_homography`, `free_covariance` | the independent check: no common focal length, free distortion centre |
//! | `varying` | the lens when every view has its own focal length |

pub(super) mod bundle;
pub mod common_error;
pub(super) mod free_covariance;
pub mod free_homography;
pub(super) mod gram;
pub(super) mod initial_guess;
pub(super) mod lens_model;
pub(super) mod model_choice;
pub(super) mod odds;
mod reversal;
pub(super) mod schur_lm;
pub(super) mod varying;
pub(super) mod view_scatter;
pub(super) mod whitened;
pub(super) mod wide_lens;
pub mod zhang;
