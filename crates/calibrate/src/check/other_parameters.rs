//! Carries the doubt about a lens over to the parameters of another lens family.

use nalgebra::{Point2, SVector, Vector2};

use super::projection_sd::{ProjectionJacobian, projection_jacobian};
use crate::solve::{
    lens_model::{LensFreedom, tie_focal_lengths},
    schur_lm::inverse,
};
use boresight_geometry::{Camera, LENS_PARAMETERS, LensMatrix, frame::ImageSize};

type LensVector = SVector<f64, LENS_PARAMETERS>;

/// Carries `doubt`, a covariance of the parameters of the lens `from`, over to the parameters of
/// `to`, a lens of another family with the given freedom, by its effect on the picture. Zero if the
/// picture doesn't determine it.
pub(crate) fn carried(
    doubt: &LensMatrix,
    from: &Camera,
    (to, freedom): (&Camera, &LensFreedom),
    image_size: ImageSize,
) -> LensMatrix {
    if from.distortion.kind == to.distortion.kind {
        return *doubt;
    }
    let Some(jacobian) = projection_jacobian(to, image_size) else { return LensMatrix::zeros() };
    let moved = |px: &Point2<f64>| Some(from.project_ray(&to.ray_from_px(px)?)?.jac_lens);
    let by_lens: Vec<_> = jacobian.px.iter().map(moved).collect();
    let scale = doubt.diagonal().map(|variance| variance.max(f64::MIN_POSITIVE).sqrt());
    let unit = LensMatrix::from_fn(|i, j| doubt[(i, j)] / (scale[i] * scale[j]));
    let eigen = unit.symmetric_eigen();
    let along =
        eigen.eigenvectors.column_iter().zip(&eigen.eigenvalues).filter_map(|(way, size)| {
            let step = way.component_mul(&scale) * size.max(0.0).sqrt();
            let off_px = by_lens.iter().map(|by_lens| Some(by_lens.as_ref()? * step));
            let off = fitted(freedom, &jacobian, off_px)?;
            Some(off * off.transpose())
        });
    along.sum()
}

/// Least-squares change of the lens parameters for the shifts `off_px` of the grid points of
/// `jacobian`; points without a shift are skipped. `None` if the points don't determine the change.
fn fitted(
    freedom: &LensFreedom,
    jacobian: &ProjectionJacobian,
    off_px: impl IntoIterator<Item = Option<Vector2<f64>>>,
) -> Option<LensVector> {
    let (mut squares, mut pull) = (LensMatrix::zeros(), LensVector::zeros());
    for (jac_lens, off_px) in jacobian.jac_lens.iter().zip(off_px) {
        let Some(off_px) = off_px else { continue };
        let mut by = *jac_lens;
        freedom.restrict(&mut by);
        squares += by.transpose() * by;
        pull += by.transpose() * off_px;
    }
    for fixed in (0..LENS_PARAMETERS).filter(|i| !freedom.free[*i]) {
        squares[(fixed, fixed)] = 1.0;
    }
    let mut off = inverse(&squares)? * pull;
    if freedom.square_pixels {
        tie_focal_lengths(off.as_mut_slice());
    }
    off.iter().all(|x| x.is_finite()).then_some(off)
}
