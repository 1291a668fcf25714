//! The next best pose by the most uncertain pixel.
//!
//! Source: Richardson, Strom & Olson, "AprilCal: Assisted and repeatable camera calibration", IROS 2013: the
//! largest expected reprojection error over the picture; here over its grid of cells.

use nalgebra::{Isometry3, SMatrix};
use rand_chacha::ChaCha8Rng;

use super::{information::best, situation::Situation};
use crate::{
    calibration::projection_jacobian,
    guidance::information::{LensMatrix, PARAMETERS, square_pixels},
};

/// Of the candidates the one after which the worst pixel is best.
pub(super) fn wish(situation: &Situation<'_>, rng: &mut ChaCha8Rng) -> Option<Isometry3<f64>> {
    let jacobian =
        projection_jacobian(&situation.lens_estimate.camera, situation.lens_estimate.image_size)?;
    let joined: Vec<_> = jacobian.jac_lens.iter().map(square_pixels).collect();
    best(situation, rng, |covariance: &LensMatrix| {
        let variance = |m: &SMatrix<f64, 2, PARAMETERS>| (m * covariance * m.transpose()).trace();
        joined.iter().map(variance).fold(0.0, f64::max)
    })
}
