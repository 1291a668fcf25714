use nalgebra::{Isometry3, Matrix3, Matrix6, Point2, Rotation3, SVector, UnitQuaternion, Vector3};

use super::{Camera, Corner, Homography};

/// Where the board is, seen by a known camera.
#[derive(Clone, Debug, PartialEq)]
pub struct PoseFit {
    /// Board to camera.
    pub cam_from_board: Isometry3<f64>,
    /// Root mean square reprojection error.
    pub rms_px: f64,
    /// Covariance of the small step `(ω, τ)`, see [`Camera::moved`], for the corner covariances given.
    pub covariance: Matrix6<f64>,
}

/// Why corners give no pose.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NoPose {
    /// The corners fit no plane, or lie outside of the lens model's field.
    #[error("the corners fit no plane in front of the camera")]
    NoStart,
    /// The fit did not stay in front of the camera.
    #[error("the pose could not be refined")]
    Diverged,
}

/// The pose behind a homography of *undistorted* pixels: `K⁻¹H ∝ (r1 r2 t)`, closest rotation by
/// singular values, sign so that the board is in front. Zhang 2000, section 3.1.
///
/// `None` if the matrix is not finite or puts the board on the camera's plane.
pub fn pose_from_homography(
    image_from_board: &Matrix3<f64>,
    camera: &Camera,
) -> Option<Isometry3<f64>> {
    let (f, pp) = (camera.f_px, camera.pp_px);
    let ideal_from_image =
        Matrix3::new(1.0 / f.x, 0.0, -pp.x / f.x, 0.0, 1.0 / f.y, -pp.y / f.y, 0.0, 0.0, 1.0);
    let m = ideal_from_image * image_from_board;
    let (mut first, mut second, mut shift) =
        (m.column(0).into_owned(), m.column(1).into_owned(), m.column(2).into_owned());
    // Both columns are unit vectors in truth; their geometric mean is the scale least sensitive to noise.
    let mut scale = 1.0 / (first.norm() * second.norm()).sqrt();
    if shift.z < 0.0 {
        scale = -scale;
    }
    first *= scale;
    second *= scale;
    shift *= scale;
    if !(shift.z > 1e-9 && scale.is_finite()) {
        return None;
    }
    let rough = Matrix3::from_columns(&[first, second, first.cross(&second)]);
    let svd = rough.svd(true, true);
    let (u, v_t) = (svd.u?, svd.v_t?);
    let mut rotation = u * v_t;
    if rotation.determinant() < 0.0 {
        rotation = u * Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, -1.0)) * v_t;
    }
    let rotation =
        UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rotation));
    Some(Isometry3::from_parts(shift.into(), rotation))
}

/// The pose that minimises the reprojection error, each corner weighted by its covariance:
/// undistort, homography, then Levenberg–Marquardt with the camera's own derivatives.
///
/// # Errors
///
/// [`NoPose`].
pub fn fit_pose(
    camera: &Camera,
    board_points_m: &[Point2<f64>],
    corners: &[Corner],
) -> Result<PoseFit, NoPose> {
    let undistorted: Option<Vec<Corner>> = corners
        .iter()
        .map(|corner| {
            let px = camera.undistort_px(&corner.px)?;
            Some(Corner { px, covariance_px2: corner.covariance_px2 })
        })
        .collect();
    let undistorted = undistorted.ok_or(NoPose::NoStart)?;
    let homography = Homography::fit(board_points_m, &undistorted).map_err(|_| NoPose::NoStart)?;
    let start =
        pose_from_homography(homography.image_from_board(), camera).ok_or(NoPose::NoStart)?;
    refine(camera, start, board_points_m, corners)
}

struct Linear {
    cost: f64,
    squares_px2: f64,
    gradient: SVector<f64, 6>,
    normal_matrix: Matrix6<f64>,
}

fn linearise(
    camera: &Camera,
    pose: &Isometry3<f64>,
    board_points_m: &[Point2<f64>],
    corners: &[Corner],
) -> Option<Linear> {
    let mut linear = Linear {
        cost: 0.0,
        squares_px2: 0.0,
        gradient: SVector::zeros(),
        normal_matrix: Matrix6::zeros(),
    };
    for (point, corner) in board_points_m.iter().zip(corners) {
        let at = camera.project_board_point(pose, point)?;
        let weight = corner.covariance_px2.try_inverse()?;
        let residual = corner.px - at.px;
        linear.cost += residual.dot(&(weight * residual));
        linear.squares_px2 += residual.norm_squared();
        linear.gradient += at.jac_pose.transpose() * weight * residual;
        linear.normal_matrix += at.jac_pose.transpose() * weight * at.jac_pose;
    }
    linear.cost.is_finite().then_some(linear)
}

fn refine(
    camera: &Camera,
    start: Isometry3<f64>,
    board_points_m: &[Point2<f64>],
    corners: &[Corner],
) -> Result<PoseFit, NoPose> {
    let at = |pose: &Isometry3<f64>| linearise(camera, pose, board_points_m, corners);
    let mut pose = start;
    let mut linear = at(&pose).ok_or(NoPose::Diverged)?;
    let mut damping = 1e-6;
    for _ in 0..50 {
        let mut damped = linear.normal_matrix;
        for i in 0..6 {
            damped[(i, i)] *= 1.0 + damping;
        }
        let step = damped.cholesky().ok_or(NoPose::Diverged)?.solve(&linear.gradient);
        let tried = Camera::moved(
            &pose,
            &step.fixed_rows::<3>(0).into_owned(),
            &step.fixed_rows::<3>(3).into_owned(),
        );
        match at(&tried) {
            Some(better) if better.cost <= linear.cost => {
                let gained = linear.cost - better.cost;
                (pose, linear) = (tried, better);
                damping = (damping * 0.1).max(1e-12);
                if gained <= 1e-14 * linear.cost || step.norm() < 1e-13 {
                    break;
                }
            }
            _ => damping *= 10.0,
        }
        if damping > 1e6 {
            break;
        }
    }
    let covariance = linear.normal_matrix.cholesky().ok_or(NoPose::Diverged)?.inverse();
    let rms_px = (linear.squares_px2 / corners.len().max(1) as f64).sqrt();
    Ok(PoseFit { cam_from_board: pose, rms_px, covariance })
}
