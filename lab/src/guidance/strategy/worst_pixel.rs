//! The next best pose by the most uncertain pixel.
//!
//! Source: Richardson, Strom & Olson, "AprilCal: Assisted and repeatable camera calibration", IROS
//! 2013: the largest expected reprojection error over the picture; here over its grid of cells. The
//! first three views are chosen to determine the focal length best, as in the source.
//! that fix the focal length best, as in its source.

use nalgebra::{Isometry3, SMatrix};
use rand_chacha::ChaCha8Rng;

use super::information::{FREE_VIEWS, best};
use crate::guidance::situation::Situation;
use boresight_calibrate::projection_jacobian;
use boresight_guide::guidance::information::{LensMatrix, PARAMETERS, square_pixels};

/// Candidate with the smallest remaining error of the worst pixel; at first, of the focal length.
pub(super) fn wish(situation: &Situation<'_>, rng: &mut ChaCha8Rng) -> Option<Isometry3<f64>> {
    if situation.shown.len() < FREE_VIEWS {
        return best(situation, rng, |covariance: &LensMatrix| covariance[(0, 0)]);
    }
    let jacobian =
        projection_jacobian(&situation.lens_estimate.camera, situation.lens_estimate.image_size)?;
    let joined: Vec<_> = jacobian.jac_lens.iter().map(square_pixels).collect();
    best(situation, rng, |covariance: &LensMatrix| {
        let variance = |m: &SMatrix<f64, 2, PARAMETERS>| (m * covariance * m.transpose()).trace();
        joined.iter().map(variance).fold(0.0, f64::max)
    })
}
