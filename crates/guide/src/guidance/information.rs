//! Fisher information about the lens from views of the board.

use nalgebra::{Isometry3, Point2, SMatrix, Vector2};

use super::{params::width_scale, view::LensEstimate};
use boresight_geometry::{
    BROWN_PARAMETERS, Camera, LENS_PARAMETERS, RayProjection, board::Checkerboard, cell_centres_px,
    frame::ImageSize,
};

/// Lens parameters of a camera with square pixels: `f, cx, cy, k1, k2, p1, p2, k3`. The worth of a view hardly depends
/// on the further coefficients of wide lenses.
pub const PARAMETERS: usize = BROWN_PARAMETERS - 1;

/// Information or covariance of the lens parameters.
pub type LensMatrix = SMatrix<f64, PARAMETERS, PARAMETERS>;

/// Standard deviation of a corner, assumed for candidates. It comes from the width of a pixel, and is the same in
/// pictures of every size.
pub(super) const CORNER_SIGMA_PX: f64 = 0.1;
/// Standard deviations of the weak priors, in the order of the parameters: `f, cx, cy` in pixels of a picture
/// 1280 pixels wide, then the distortion coefficients.
const PRIOR_SIGMA: [f64; PARAMETERS] = [500.0, 100.0, 100.0, 0.4, 0.6, 0.01, 0.01, 0.6];

/// Distance from the middle, as a share of the picture across and down, beyond which pixels lie in its corners.
const IN_CORNER: f64 = 0.3;

/// Standard deviation, as a share of the weak prior's, of a coefficient that an earlier calibration held fixed.
const FIXED_SHARE: f64 = 1e-3;

/// Fisher information about the lens from views at these poses, each with its corners in the picture and errors of
/// `sigma_px`, and from weak priors: positive definite without any view. A view with a corner behind the camera adds
/// nothing.
pub fn known_information(
    poses: impl IntoIterator<Item = Isometry3<f64>>,
    board: &Checkerboard,
    lens_estimate: &LensEstimate,
    sigma_px: f64,
) -> LensMatrix {
    let prior = prior_information(lens_estimate);
    poses
        .into_iter()
        .filter_map(|pose| information_in_picture(&pose, board, lens_estimate, sigma_px))
        .fold(prior, |sum, view| sum + view)
}

/// Weak priors and, if there is one, an earlier calibration: its covariance, plus an error that no model states.
pub(super) fn prior_information(lens_estimate: &LensEstimate) -> LensMatrix {
    let sigma = prior_sigma(lens_estimate.image_size);
    let weak = LensMatrix::from_diagonal(&sigma.map(|sigma| 1.0 / (sigma * sigma)).into());
    let known = lens_estimate.known_covariance.and_then(|known| {
        // fx and fy share one focal length, and parameters that the earlier model held fixed are known to a thousandth
        // of the prior.
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
    information_of(pose, board, camera, sigma_px, |_, _| true)
}

/// [`view_information`] of the corners that lie in the picture.
pub(super) fn information_in_picture(
    pose: &Isometry3<f64>,
    board: &Checkerboard,
    lens_estimate: &LensEstimate,
    sigma_px: f64,
) -> Option<LensMatrix> {
    let size = lens_estimate.image_size;
    information_of(pose, board, &lens_estimate.camera, sigma_px, |_, px| size.contains(px))
}

/// [`view_information`] from the corners for which `is_seen` (of index and pixel) is true.
pub(super) fn information_of(
    pose: &Isometry3<f64>,
    board: &Checkerboard,
    camera: &Camera,
    sigma_px: f64,
    is_seen: impl Fn(usize, &Point2<f64>) -> bool,
) -> Option<LensMatrix> {
    let mut a = LensMatrix::zeros();
    let mut b = SMatrix::<f64, PARAMETERS, 6>::zeros();
    let mut d = SMatrix::<f64, 6, 6>::zeros();
    for (index, point) in board.corners_in_board_m().into_iter().enumerate() {
        let at = camera.project_board_point(pose, &point)?;
        if !is_seen(index, &at.px) {
            continue;
        }
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
    let grid = ProjectionGrid::new(lens_estimate);
    let a = grid.pixels.iter().fold(LensMatrix::zeros(), |sum, (_, seen)| {
        let jac_lens = square_pixels(&seen.jac_lens);
        sum + jac_lens.transpose() * jac_lens
    });
    let weight = grid.turn_from_lens.map_or(a, |turn| a + grid.lens_by_turn * turn);
    (weight, grid.pixels.len())
}

/// [`projection_weight`] of the grid's pixels in the picture's corners, per pixel; the camera still turns to suit the
/// whole picture best. `None` if the lens has no ray for any of them.
pub(super) fn corner_weight(lens_estimate: &LensEstimate) -> Option<LensMatrix> {
    let grid = ProjectionGrid::new(lens_estimate);
    let size = lens_estimate.image_size;
    let size_px = Vector2::new(f64::from(size.width_px), f64::from(size.height_px));
    let is_in_corner = |px: &Point2<f64>| {
        let off = (px - size.centre_px()).component_div(&size_px);
        off.x.abs() > IN_CORNER && off.y.abs() > IN_CORNER
    };
    let turn = grid.turn_from_lens?;
    let (mut weight, mut count) = (LensMatrix::zeros(), 0.0);
    for (_, seen) in grid.pixels.iter().filter(|(px, _)| is_in_corner(px)) {
        let jac = square_pixels(&seen.jac_lens) + seen.jac_rotation * turn;
        weight += jac.transpose() * jac;
        count += 1.0;
    }
    (count > 0.0).then(|| weight / count)
}

/// Projection at a grid of pixels.
struct ProjectionGrid {
    pixels: Vec<(Point2<f64>, RayProjection)>,
    /// `Σ JₗᵀJᵣ`, of the Jacobians by the lens and by the camera's rotation.
    lens_by_turn: SMatrix<f64, PARAMETERS, 3>,
    /// The camera rotation that compensates best, by the lens parameters; `None` if the pixels don't fix it.
    turn_from_lens: Option<SMatrix<f64, 3, PARAMETERS>>,
}

impl ProjectionGrid {
    fn new(lens_estimate: &LensEstimate) -> Self {
        let camera = &lens_estimate.camera;
        let pixels: Vec<_> = cell_centres_px(lens_estimate.image_size)
            .filter_map(|px| Some((px, camera.project_ray(&camera.ray_from_px(&px)?)?)))
            .collect();
        let mut lens_by_turn = SMatrix::<f64, PARAMETERS, 3>::zeros();
        let mut by_turn = SMatrix::<f64, 3, 3>::zeros();
        for (_, seen) in &pixels {
            lens_by_turn += square_pixels(&seen.jac_lens).transpose() * seen.jac_rotation;
            by_turn += seen.jac_rotation.transpose() * seen.jac_rotation;
        }
        let turn_from_lens =
            by_turn.try_inverse().map(|inverse| -inverse * lens_by_turn.transpose());
        Self { pixels, lens_by_turn, turn_from_lens }
    }
}
