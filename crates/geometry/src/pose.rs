use nalgebra::{
    Isometry3, Matrix3, Matrix6, Point2, Rotation3, SMatrix, SVector, UnitQuaternion, Vector3,
};

use super::{
    Camera, Corner, Homography,
    corner::seen,
    least_squares::{Limits, Linearised, Problem, minimise},
};

/// Pose of a board in a known camera.
#[derive(Clone, Debug, PartialEq)]
pub struct PoseFit {
    /// Rigid motion from board to camera, in metres.
    pub cam_from_board: Isometry3<f64>,
    /// Root mean square distance between corners and projected board points, in pixels.
    pub rms_px: f64,
    /// Covariance of the small step `(ω, τ)`, radians and metres, see [`Camera::moved`]; for the
    /// stated corner covariances.
    pub covariance: Matrix6<f64>,
}

/// Reason why corners give no pose.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NoPose {
    /// The corners fit no homography, or lie outside the field of the lens model.
    #[error("the corners fit no plane in front of the camera")]
    NoStart,
    /// The fit did not stay in front of the camera, or the corners don't determine it.
    #[error("the pose could not be refined")]
    Diverged,
}

/// Decomposes a homography of *undistorted* pixels: `K⁻¹H ∝ (r1 r2 t)`, the closest rotation by
/// singular values, and the sign for which the board is in front. Zhang 2000, section 3.1.
///
/// Board points are in metres, and so is the translation. `None` if the matrix isn't finite or puts
/// the board's origin on the camera's plane.
pub fn pose_from_homography(
    image_from_board: &Matrix3<f64>,
    camera: &Camera,
) -> Option<Isometry3<f64>> {
    let (f, pp) = (camera.f_px, camera.pp_px);
    let normalized_from_image =
        Matrix3::new(1.0 / f.x, 0.0, -pp.x / f.x, 0.0, 1.0 / f.y, -pp.y / f.y, 0.0, 0.0, 1.0);
    rigid_from_columns(&(normalized_from_image * image_from_board))
}

/// Pose of a board from the `rays` to the board's points (metres), directions in camera
/// coordinates, at any angle to the optical axis: `ray × (r1 r2 t) X = 0`, solved by its singular
/// vector.
///
/// `None` with fewer than four points, if the equations don't determine the matrix, or if most of
/// the board lies against the direction of its rays.
pub fn pose_from_rays(
    board_points_m: &[Point2<f64>],
    rays: &[Vector3<f64>],
) -> Option<Isometry3<f64>> {
    let scale_m = board_points_m.iter().map(|point| point.coords.amax()).fold(0.0, f64::max);
    if board_points_m.len() < 4 || board_points_m.len() != rays.len() || !(scale_m > 0.0) {
        return None;
    }
    let mut normal = SMatrix::<f64, 9, 9>::zeros();
    for (point, ray) in board_points_m.iter().zip(rays) {
        let cross = ray.normalize().cross_matrix();
        let on_board = [point.x / scale_m, point.y / scale_m, 1.0];
        let row = SMatrix::<f64, 3, 9>::from_fn(|i, j| cross[(i, j % 3)] * on_board[j / 3]);
        normal += row.transpose() * row;
    }
    let eigen = normal.symmetric_eigen();
    let smallest = eigen.eigenvalues.imin();
    let vector = eigen.eigenvectors.column(smallest);
    let mut m = Matrix3::from_column_slice(vector.clone_owned().as_slice());
    let agreement: f64 = board_points_m
        .iter()
        .zip(rays)
        .map(|(point, ray)| {
            ray.dot(&(m * Vector3::new(point.x / scale_m, point.y / scale_m, 1.0))).signum()
        })
        .sum();
    if agreement < 0.0 {
        m = -m;
    }
    m.column_mut(0).scale_mut(1.0 / scale_m);
    m.column_mut(1).scale_mut(1.0 / scale_m);
    closest_rigid(&m)
}

/// [`closest_rigid`] with the sign that puts the board's origin in front of the camera.
fn rigid_from_columns(m: &Matrix3<f64>) -> Option<Isometry3<f64>> {
    let m = if m[(2, 2)] < 0.0 { -m } else { *m };
    closest_rigid(&m).filter(|pose| pose.translation.z > 1e-9)
}

/// Pose closest to a positive multiple of `(r1 r2 t)`.
fn closest_rigid(m: &Matrix3<f64>) -> Option<Isometry3<f64>> {
    let (mut first, mut second, mut shift) =
        (m.column(0).into_owned(), m.column(1).into_owned(), m.column(2).into_owned());
    // Both columns should be unit vectors; the geometric mean of their lengths is the scale least
    // sensitive to noise.
    let scale = 1.0 / (first.norm() * second.norm()).sqrt();
    if !scale.is_finite() {
        return None;
    }
    first *= scale;
    second *= scale;
    shift *= scale;
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

/// Fits the pose by the least reprojection error, each corner weighted by the inverse covariance.
///
/// `board_points_m[i]` is the board point, in metres, of `corners[i]` (distorted pixels); unseen
/// corners are left out. Undistorts the corners, fits and decomposes a homography (of rays, if the
/// lens is a fisheye), then refines by Levenberg–Marquardt on the distorted pixels.
///
/// # Errors
///
/// [`NoPose::NoStart`] if the corners fit no homography or lie outside the field of the lens model,
/// [`NoPose::Diverged`] if the refinement leaves the front of the camera.
///
/// ```
/// # use boresight_geometry::{Camera, Corner, boards::Board, fit_pose};
/// # use nalgebra::{Isometry3, Point2, Vector3};
/// let camera = Camera::pinhole(900.0, Point2::new(640.0, 360.0));
/// let board_m = Board::new(9, 6, 0.025)?.corners_in_board_m();
/// let truth = Isometry3::new(Vector3::new(0.02, 0.0, 0.5), Vector3::new(0.6, 0.0, 0.1));
/// let corners: Vec<Corner> = board_m
///     .iter()
///     .filter_map(|point_m| camera.px_from_board(&truth, point_m))
///     .map(|px| Corner::isotropic(px, 0.05))
///     .collect();
/// let found = fit_pose(&camera, &board_m, &corners)?;
/// assert!((found.cam_from_board.translation.vector - truth.translation.vector).norm() < 1e-6);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn fit_pose(
    camera: &Camera,
    board_points_m: &[Point2<f64>],
    corners: &[Corner],
) -> Result<PoseFit, NoPose> {
    let (points, seen_corners) = seen(board_points_m, corners);
    let (board_points_m, corners) = (points.as_ref(), seen_corners.as_ref());
    let start = if camera.distortion.kind.keeps_lines() {
        pose_through_pinhole(camera, board_points_m, corners)
    } else {
        let rays: Option<Vec<_>> =
            corners.iter().map(|corner| camera.ray_from_px(&corner.px)).collect();
        rays.and_then(|rays| pose_from_rays(board_points_m, &rays))
    }
    .ok_or(NoPose::NoStart)?;
    let problem = Reprojection { camera, board_points_m, corners };
    let minimum = minimise(&problem, start, Limits::EXACT).ok_or(NoPose::Diverged)?;
    let information = minimum.at.normal_matrix.cholesky().ok_or(NoPose::Diverged)?;
    Ok(PoseFit {
        cam_from_board: minimum.state,
        rms_px: (minimum.at.extra / corners.len().max(1) as f64).sqrt(),
        covariance: information.inverse(),
    })
}

/// Pose by a homography of the undistorted corners.
fn pose_through_pinhole(
    camera: &Camera,
    board_points_m: &[Point2<f64>],
    corners: &[Corner],
) -> Option<Isometry3<f64>> {
    let undistorted: Vec<Corner> =
        corners.iter().map(|corner| camera.undistort_corner(corner)).collect::<Option<_>>()?;
    let homography = Homography::fit(board_points_m, &undistorted).ok()?;
    pose_from_homography(homography.image_from_board(), camera)
}

/// Corners of a view under a known camera.
struct Reprojection<'a> {
    camera: &'a Camera,
    board_points_m: &'a [Point2<f64>],
    corners: &'a [Corner],
}

impl Problem<6> for Reprojection<'_> {
    /// Pose from board to camera.
    type State = Isometry3<f64>;
    /// Sum of squared pixel distances.
    type Extra = f64;

    fn linearise(&self, cam_from_board: &Isometry3<f64>) -> Option<Linearised<6, f64>> {
        let mut linear = Linearised {
            cost: 0.0,
            gradient: SVector::zeros(),
            normal_matrix: Matrix6::zeros(),
            extra: 0.0,
        };
        for (point, corner) in self.board_points_m.iter().zip(self.corners) {
            let at = self.camera.project_board_point(cam_from_board, point)?;
            let weight = corner.covariance_px2.try_inverse()?;
            let residual = corner.px - at.px;
            linear.cost += residual.dot(&(weight * residual));
            linear.extra += residual.norm_squared();
            linear.gradient += at.jac_pose.transpose() * weight * residual;
            linear.normal_matrix += at.jac_pose.transpose() * weight * at.jac_pose;
        }
        linear.cost.is_finite().then_some(linear)
    }

    fn moved(&self, cam_from_board: &Isometry3<f64>, step: &SVector<f64, 6>) -> Isometry3<f64> {
        Camera::moved(
            cam_from_board,
            &step.fixed_rows::<3>(0).into_owned(),
            &step.fixed_rows::<3>(3).into_owned(),
        )
    }
}
