//! Doubt about the lens from another family of lens models that explains the corners nearly as well.
//!
//! Rational and fisheye models can agree where boards were and diverge elsewhere. Their difference, projected onto the
//! chosen lens's parameters, is added to the covariance.

use nalgebra::{Matrix3, Point2, SVector, UnitQuaternion, Vector2, Vector3};

use super::projection_sd::{ProjectionJacobian, projection_jacobian};
use crate::solve::{
    lens_model::{LensFreedom, tie_focal_lengths},
    schur_lm::inverse,
    wide_lens::Rival,
};
use boresight_geometry::{Camera, LENS_PARAMETERS, LensMatrix, frame::ImageSize};

type LensVector = SVector<f64, LENS_PARAMETERS>;

/// Rounds in which the turn between two lenses settles.
const ROUNDS: usize = 8;

/// Covariance from `rivals`, each weighed by its probability, of a lens with the given freedom.
pub(crate) fn rival_doubt(
    camera: &Camera,
    freedom: &LensFreedom,
    rivals: &[Rival],
    image_size: ImageSize,
) -> LensMatrix {
    let total: f64 = 1.0 + rivals.iter().map(|rival| rival.odds).sum::<f64>();
    rivals
        .iter()
        .filter_map(|rival| {
            let off = as_parameters(camera, freedom, &rival.camera, image_size)?;
            Some(off * off.transpose() * (rival.odds / total))
        })
        .fold(LensMatrix::zeros(), |sum, doubt| sum + doubt)
}

/// `doubt` about the lens `from`, a covariance of its parameters, as one of the parameters of `to`, a lens of another family
/// with the given freedom: by how far it moves the picture. Zero if the picture doesn't determine it.
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

/// The change of the lens parameters that comes closest to `rival`, over the picture and after the best turn. `None` if the
/// picture doesn't determine one.
fn as_parameters(
    camera: &Camera,
    freedom: &LensFreedom,
    rival: &Camera,
    image_size: ImageSize,
) -> Option<LensVector> {
    let jacobian = projection_jacobian(camera, image_size)?;
    let rays: Vec<Vector3<f64>> =
        jacobian.px.iter().map(|px| camera.ray_from_px(px)).collect::<Option<_>>()?;
    let off_px = after_best_turn(rival, &rays, &jacobian.px);
    fitted(freedom, &jacobian, off_px)
}

/// The change of the lens parameters that moves the grid points of `jacobian` the most alike to `off_px`; those without a
/// shift carry no information. `None` if they don't determine one.
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

/// Pixels at which `rival` sees `rays`, less `px`, after the turn that brings them closest together.
fn after_best_turn(
    rival: &Camera,
    rays: &[Vector3<f64>],
    px: &[Point2<f64>],
) -> Vec<Option<Vector2<f64>>> {
    let mut turn = UnitQuaternion::identity();
    for _ in 0..ROUNDS {
        let (mut normal, mut pull) = (Matrix3::zeros(), Vector3::zeros());
        for (ray, px) in rays.iter().zip(px) {
            let Some(seen) = rival.project_ray(&(turn * ray)) else { continue };
            normal += seen.jac_rotation.transpose() * seen.jac_rotation;
            pull += seen.jac_rotation.transpose() * (px - seen.px);
        }
        let Some(inverse) = normal.try_inverse() else { break };
        turn = UnitQuaternion::from_scaled_axis(inverse * pull) * turn;
    }
    let off_px =
        |(ray, px): (&Vector3<f64>, &Point2<f64>)| Some(rival.project_ray(&(turn * ray))?.px - px);
    rays.iter().zip(px).map(off_px).collect()
}
