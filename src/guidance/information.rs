//! Fisher information about the lens from views of the board.

use nalgebra::{Isometry3, SMatrix};

use super::{params::width_scale, view::LensEstimate};
use crate::{
    board::Checkerboard,
    frame::ImageSize,
    geometry::{BROWN_PARAMETERS, Camera, LENS_PARAMETERS, RayProjection, cell_centres_px},
};

/// Lens parameters of a camera with square pixels: `f, cx, cy, k1, k2, p1, p2, k3`. What a view is worth hardly depends on
/// the further coefficients of wide lenses.
pub const PARAMETERS: usize = BROWN_PARAMETERS - 1;

/// Information or covariance of the lens parameters.
pub type LensMatrix = SMatrix<f64, PARAMETERS, PARAMETERS>;

/// Standard deviation of a corner, assumed for candidates. It comes from the width of a pixel, so that it is
/// the same in pictures of every size.
pub(super) const CORNER_SIGMA_PX: f64 = 0.1;
/// Standard deviations of the weak priors, in the order of the parameters: `f, cx, cy` in pixels of a picture
/// 1280 pixels wide, then the distortion coefficients.
const PRIOR_SIGMA: [f64; PARAMETERS] = [500.0, 100.0, 100.0, 0.4, 0.6, 0.01, 0.01, 0.6];

/// Standard deviation, as a share of the weak prior's, of a coefficient that an earlier calibration held fixed.
const FIXED_SHARE: f64 = 1e-3;

/// Fisher information about the lens from views at these poses, with corner errors of `sigma_px`, and from
/// weak priors: positive definite without any view. A view with a corner behind the camera adds nothing.
pub fn known_information(
    poses: impl IntoIterator<Item = Isometry3<f64>>,
    board: &Checkerboard,
    lens_estimate: &LensEstimate,
    sigma_px: f64,
) -> LensMatrix {
    let prior = prior_information(lens_estimate);
    poses
        .into_iter()
        .filter_map(|pose| view_information(&pose, board, &lens_estimate.camera, sigma_px))
        .fold(prior, |sum, view| sum + view)
}

/// Weak priors and, if there is one, an earlier calibration: its covariance, with the error that no model states.
fn prior_information(lens_estimate: &LensEstimate) -> LensMatrix {
    let sigma = prior_sigma(lens_estimate.image_size);
    let weak = LensMatrix::from_diagonal(&sigma.map(|sigma| 1.0 / (sigma * sigma)).into());
    let known = lens_estimate.known_covariance.and_then(|known| {
        // One focal length for fx and fy, and what the earlier model held fixed is unknown to a thousandth of the prior.
        let known = known.fixed_view::<BROWN_PARAMETERS, BROWN_PARAMETERS>(0, 0).into_owned();
        let mut covariance: LensMatrix = known.remove_row(1).remove_column(1);
        for (i, sigma) in sigma.iter().enumerate() {
            covariance[(i, i)] += (FIXED_SHARE * sigma).powi(2);
        }
        covariance.cholesky().map(|cholesky| cholesky.inverse())
    });
    known.map_or(weak, |known| weak + known)
}

fn prior_sigma(image_size: ImageSize) -> [f64; PARAMETERS] {
    let mut sigma = PRIOR_SIGMA;
    for sigma_px in &mut sigma[..3] {
        *sigma_px *= width_scale(image_size);
    }
    sigma
}

pub(super) fn pair_information(
    pose: &Isometry3<f64>,
    board: &Checkerboard,
    camera: &Camera,
) -> Option<LensMatrix> {
    Some(
        view_information(pose, board, camera, CORNER_SIGMA_PX)?
            + view_information(&reflected(pose), board, camera, CORNER_SIGMA_PX)?,
    )
}

/// Point reflection about the principal point: `R' = ZRZ`, `t' = Zt`, `Z = diag(−1, −1, 1)`.
pub(super) fn reflected(cam_from_board: &Isometry3<f64>) -> Isometry3<f64> {
    let half_turn = nalgebra::UnitQuaternion::from_axis_angle(
        &nalgebra::Vector3::z_axis(),
        std::f64::consts::PI,
    );
    Isometry3::from_parts(
        (half_turn * cam_from_board.translation.vector).into(),
        half_turn * cam_from_board.rotation * half_turn,
    )
}

/// Fisher information of one view about the lens, its pose eliminated:
/// `A − B D⁻¹ Bᵀ` with `A = ΣJₗᵀJₗ/σ²`, `B = ΣJₗᵀJₚ/σ²`, `D = ΣJₚᵀJₚ/σ²`.
///
/// `None` if a corner is behind the camera or the pose is not determined.
pub fn view_information(
    pose: &Isometry3<f64>,
    board: &Checkerboard,
    camera: &Camera,
    sigma_px: f64,
) -> Option<LensMatrix> {
    let mut a = LensMatrix::zeros();
    let mut b = SMatrix::<f64, PARAMETERS, 6>::zeros();
    let mut d = SMatrix::<f64, 6, 6>::zeros();
    for point in board.corners_in_board_m() {
        let at = camera.project_board_point(pose, &point)?;
        let jac_lens = square_pixels(&at.jac_lens);
        a += jac_lens.transpose() * jac_lens;
        b += jac_lens.transpose() * at.jac_pose;
        d += at.jac_pose.transpose() * at.jac_pose;
    }
    let eliminated = b * d.cholesky()?.inverse() * b.transpose();
    Some((a - eliminated) / (sigma_px * sigma_px))
}

/// Jacobian by the lens parameters of a camera with square pixels: the columns of `fx` and `fy` added up to
/// one of `f`.
pub fn square_pixels(jac_lens: &SMatrix<f64, 2, LENS_PARAMETERS>) -> SMatrix<f64, 2, PARAMETERS> {
    let mut joined = SMatrix::<f64, 2, PARAMETERS>::zeros();
    joined.set_column(0, &(jac_lens.column(0) + jac_lens.column(1)));
    joined.fixed_columns_mut::<{ PARAMETERS - 1 }>(1).copy_from(&jac_lens.fixed_columns::<7>(2));
    joined
}

/// `MᵀM`, where `M` is the Jacobian of the projection over a grid of pixels by the lens parameters, after the
/// camera rotation that compensates best, and the number of pixels.
pub(super) fn projection_weight(lens_estimate: &LensEstimate) -> (LensMatrix, usize) {
    let mut a = LensMatrix::zeros();
    let mut b = SMatrix::<f64, PARAMETERS, 3>::zeros();
    let mut d = SMatrix::<f64, 3, 3>::zeros();
    let mut count = 0;
    for px in cell_centres_px(lens_estimate.image_size) {
        let camera = &lens_estimate.camera;
        let Some(seen) = camera.ray_from_px(&px).and_then(|ray| camera.project_ray(&ray)) else {
            continue;
        };
        let RayProjection { jac_lens, jac_rotation, .. } = seen;
        let jac_lens = square_pixels(&jac_lens);
        count += 1;
        a += jac_lens.transpose() * jac_lens;
        b += jac_lens.transpose() * jac_rotation;
        d += jac_rotation.transpose() * jac_rotation;
    }
    let weight = match d.try_inverse() {
        Some(inverse) => a - b * inverse * b.transpose(),
        None => a,
    };
    (weight, count)
}
