//! Lens estimated from the views of a run, with errors.

use nalgebra::{Matrix3, SMatrix, Vector2, Vector3};
use serde::{Deserialize, Serialize};

use super::course::{Course, IMAGE_SIZE, TrueLens};
use boresight_calibrate::{
    Bundle, BundleState, CalibrationParams, LensPrior, Observations, adjust, calibrate,
    projection_jacobian,
};
use boresight_geometry::{Camera, Corner, LensParts, cell_centres_px, fit_pose};
use boresight_guide::{
    guidance::{LensEstimate, Precision},
    session::precision_of,
};

/// True and stated errors of a lens.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Errors {
    /// Distance of the principal point from the truth.
    pub pp_error_px: f64,
    /// Error of the focal length.
    pub f_error_px: f64,
    /// Mean error of projection over the picture, after removing a turn of the camera.
    pub projection_error_px: f64,
    /// Stated standard deviation of the principal point along the worst axis.
    pub pp_sd_px: f64,
    /// Stated mean standard deviation of projection.
    pub projection_sd_px: f64,
}

/// Lens with the model of the course, from all views so far.
///
/// `before` is the minimum of the views without the newest one: the start of the search. `None` if
/// no lens fits the corners.
pub(super) fn fitted(
    course: &Course,
    shown: &[Vec<Corner>],
    before: Option<&BundleState>,
) -> Option<(Bundle, Errors)> {
    let board_m = course.board.corners_in_board_m();
    let guess = LensEstimate::guess(IMAGE_SIZE).camera;
    let camera = before.map_or(guess, |state| state.camera);
    let mut cam_from_board = before.map_or_else(Vec::new, |state| state.cam_from_board.clone());
    for corners in &shown[cam_from_board.len()..] {
        cam_from_board.push(fit_pose(&camera, &board_m, corners).ok()?.cam_from_board);
    }
    let corners: Vec<&[Corner]> = shown.iter().map(Vec::as_slice).collect();
    let observations = Observations::new(&board_m, &corners).ok()?;
    let prior = prior();
    let start = BundleState { camera, cam_from_board };
    let bundle = adjust(&observations, &course.model.freedom(true), Some(&prior), start)?;
    // The corners' noise is known; use it without rescaling by the misfit.
    let covariance = bundle.covariance(1.0)?;
    let camera = &bundle.state.camera;
    let pp = covariance.pp().symmetric_eigenvalues().max().max(0.0);
    let errors = Errors {
        pp_sd_px: pp.sqrt(),
        projection_sd_px: projection_jacobian(camera, IMAGE_SIZE)?.sd(&covariance).mean_px,
        ..errors_of(camera, &course.lens)?
    };
    Some((bundle, errors))
}

/// Prior before any view: a usual focal length ± half of it, the principal point at the centre ±
/// 100 px, and weak priors on the distortion.
pub(super) fn prior() -> LensPrior {
    let f_px = LensEstimate::guess(IMAGE_SIZE).camera.f_px.x;
    LensPrior::weak(IMAGE_SIZE).with_focal_length(f_px, 0.5 * f_px)
}

/// Lens as calibrated by the program: model chosen by BIC, with the model doubt in the stated
/// deviations.
///
/// `None` if the views determine no lens.
pub(super) fn calibrated(course: &Course, shown: &[Vec<Corner>]) -> Option<(Errors, Precision)> {
    let calibration =
        calibrate(shown, &course.board, IMAGE_SIZE, &CalibrationParams::default()).ok()?;
    let precision = precision_of(&calibration, IMAGE_SIZE);
    let errors = Errors {
        pp_sd_px: precision.pp_sigma_px,
        projection_sd_px: precision.projection_sigma_px,
        ..errors_of(&calibration.camera, &course.lens)?
    };
    Some((errors, precision))
}

/// Errors of `estimate`; the stated deviations are left at zero.
fn errors_of(estimate: &Camera, truth: &TrueLens) -> Option<Errors> {
    let camera = truth.camera();
    Some(Errors {
        pp_error_px: (estimate.pp_px - camera.pp_px).norm(),
        f_error_px: (estimate.f_px.x - camera.f_px.x).abs(),
        projection_error_px: projection_error_px(estimate, truth)?,
        ..Errors::default()
    })
}

/// Mean distance over the picture between the images of the same rays in two cameras, after the
/// rotation of best agreement.
fn projection_error_px(estimate: &Camera, truth: &TrueLens) -> Option<f64> {
    let mut off: Vec<(Vector2<f64>, SMatrix<f64, 2, 3>)> = Vec::new();
    for px in cell_centres_px(IMAGE_SIZE) {
        let Some(ray) = truth.normalized_from_px(&px) else { continue };
        let at = estimate.project_ray(&Vector3::new(ray.x, ray.y, 1.0))?;
        off.push((at.px - px, at.jac_rotation));
    }
    let mut normal = Matrix3::zeros();
    let mut gradient = Vector3::zeros();
    for (off, jac_rotation) in &off {
        normal += jac_rotation.transpose() * jac_rotation;
        gradient += jac_rotation.transpose() * off;
    }
    let turn = normal.try_inverse()? * gradient;
    let sum: f64 = off.iter().map(|(off, jac_rotation)| (off - jac_rotation * turn).norm()).sum();
    (!off.is_empty()).then(|| sum / off.len() as f64)
}
