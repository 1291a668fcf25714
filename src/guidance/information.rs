//! Which reflected pair of poses is most informative about the camera? Source: `docs/method.md`, section 3.4.
//!
//! Candidates are judged *in reflected pairs*: that keeps the precision of a greedy choice, and a lens model
//! that is too simple pulls the principal point two to three times less.

use nalgebra::{Isometry3, SMatrix};

use super::{
    params::{GuidanceParams, width_scale},
    view::{LensEstimate, View},
    wanted_pose::{WantedPose, place_board, seen_px},
};
use crate::{
    board::Checkerboard,
    frame::ImageSize,
    geometry::{
        BoardOutline, Camera, LENS_PARAMETERS, RayProjection, cell_centres_px, coverage, fit_pose,
    },
};

/// Lens parameters of a camera with square pixels: `f, cx, cy, k1, k2, p1, p2, k3`.
pub const PARAMETERS: usize = LENS_PARAMETERS - 1;

/// Information or covariance of the lens parameters.
pub type LensMatrix = SMatrix<f64, PARAMETERS, PARAMETERS>;

/// Standard deviation of a corner, assumed for candidates. It comes from the width of a pixel, so that it is
/// the same in pictures of every size.
const CORNER_SIGMA_PX: f64 = 0.1;
/// Standard deviations of the weak priors, in the order of the parameters: `f, cx, cy` in pixels of a picture
/// 1280 pixels wide, then the distortion coefficients.
const PRIOR_SIGMA: [f64; PARAMETERS] = [500.0, 100.0, 100.0, 0.4, 0.6, 0.01, 0.01, 0.6];

/// The feasible pose that, with its reflected partner, minimises the expected variance of projection
/// over the picture, `tr(M C Mᵀ)`, among directions that are independent of all accepted ones. `None` if no
/// direction is left or no candidate fits into the picture.
pub(super) fn most_informative_pair(
    accepted: &[View],
    board: &Checkerboard,
    lens_estimate: &LensEstimate,
    params: &GuidanceParams,
) -> Option<(WantedPose, Isometry3<f64>)> {
    let points = board.corners_in_board_m();
    let poses = accepted.iter().filter_map(|view| {
        Some(fit_pose(&lens_estimate.camera, &points, &view.corners).ok()?.cam_from_board)
    });
    let known = known_information(poses, board, lens_estimate, CORNER_SIGMA_PX);
    let weight = projection_weight(lens_estimate);
    let mut best: Option<(f64, WantedPose, Isometry3<f64>)> = None;
    for wanted in candidates(accepted, lens_estimate, params) {
        let Some(pose) = place_board(&wanted, board, lens_estimate, params) else { continue };
        let Some(pair) = pair_information(&pose, board, &lens_estimate.camera) else { continue };
        let Some(covariance) = (known + pair).cholesky().map(|c| c.inverse()) else { continue };
        let variance = (weight * covariance).trace();
        if best.as_ref().is_none_or(|(least, ..)| variance < *least) {
            best = Some((variance, wanted, pose));
        }
    }
    best.map(|(_, wanted, pose)| (wanted, pose))
}

/// The feasible pose that, with its reflected partner, covers most of the picture's cells that no view has
/// covered, because the lens is extrapolated where no corner was seen. `None` if no pose covers more.
pub(super) fn most_covering_pair(
    accepted: &[View],
    board: &Checkerboard,
    lens_estimate: &LensEstimate,
    params: &GuidanceParams,
) -> Option<(WantedPose, Isometry3<f64>)> {
    let mut outlines: Vec<BoardOutline> = accepted
        .iter()
        .filter_map(|view| {
            let corners: Vec<_> = view.corners.iter().map(|corner| corner.px).collect();
            BoardOutline::of(&corners, board.columns())
        })
        .collect();
    let taken = outlines.len();
    let mut most = coverage(&outlines, lens_estimate.image_size);
    let mut best = None;
    for wanted in candidates(accepted, lens_estimate, params) {
        let Some(pose) = place_board(&wanted, board, lens_estimate, params) else { continue };
        let pair = [pose, reflected(&pose)];
        outlines.truncate(taken);
        outlines.extend(pair.iter().filter_map(|pose| {
            BoardOutline::of(&seen_px(pose, board, lens_estimate), board.columns())
        }));
        let share = coverage(&outlines, lens_estimate.image_size);
        if share > most {
            most = share;
            best = Some((wanted, pose));
        }
    }
    best
}

/// Directions every 11.25°, three tilts, two sizes, centred and shifted along the principal
/// line as far as the picture may allow.
fn candidates(
    accepted: &[View],
    lens_estimate: &LensEstimate,
    params: &GuidanceParams,
) -> Vec<WantedPose> {
    let reach_px = 0.2 * f64::from(lens_estimate.image_size.width_px);
    // A person misses the direction by some degrees; leave room so that the view still counts.
    let spare_rad = 0.1 * params.independent_rad;
    let mut wanted = Vec::new();
    for step in 0..32 {
        let tilt_azimuth_rad = f64::from(step) * std::f64::consts::PI / 16.0;
        let free = accepted.iter().all(|view| {
            let off = (view.tilt_azimuth_rad() - tilt_azimuth_rad).sin().abs().asin();
            off >= params.independent_rad + spare_rad
        });
        if !free {
            continue;
        }
        for tilt_rad in [0.9, 1.0, 1.1].map(|share| share * params.target_tilt_rad) {
            for span_fraction in [0.9, 1.15].map(|share| share * params.target_span_fraction) {
                for along_px in [-reach_px, -0.5 * reach_px, 0.0, 0.5 * reach_px, reach_px] {
                    wanted.push(WantedPose { tilt_azimuth_rad, tilt_rad, span_fraction, along_px });
                }
            }
        }
    }
    wanted
}

/// Fisher information about the lens from views at these poses, with corner errors of `sigma_px`, and from
/// weak priors: positive definite without any view. A view with a corner behind the camera adds nothing.
pub fn known_information(
    poses: impl IntoIterator<Item = Isometry3<f64>>,
    board: &Checkerboard,
    lens_estimate: &LensEstimate,
    sigma_px: f64,
) -> LensMatrix {
    let prior = prior_sigma(lens_estimate.image_size).map(|sigma| 1.0 / (sigma * sigma));
    poses
        .into_iter()
        .filter_map(|pose| view_information(&pose, board, &lens_estimate.camera, sigma_px))
        .fold(LensMatrix::from_diagonal(&prior.into()), |sum, view| sum + view)
}

fn prior_sigma(image_size: ImageSize) -> [f64; PARAMETERS] {
    let mut sigma = PRIOR_SIGMA;
    for sigma_px in &mut sigma[..3] {
        *sigma_px *= width_scale(image_size);
    }
    sigma
}

fn pair_information(
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
fn reflected(cam_from_board: &Isometry3<f64>) -> Isometry3<f64> {
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
/// camera rotation that compensates best.
fn projection_weight(lens_estimate: &LensEstimate) -> LensMatrix {
    let mut a = LensMatrix::zeros();
    let mut b = SMatrix::<f64, PARAMETERS, 3>::zeros();
    let mut d = SMatrix::<f64, 3, 3>::zeros();
    for px in cell_centres_px(lens_estimate.image_size) {
        let Some(ideal) = lens_estimate.camera.normalized_from_px(&px) else { continue };
        let RayProjection { jac_lens, jac_rotation, .. } = lens_estimate.camera.project_ray(&ideal);
        let jac_lens = square_pixels(&jac_lens);
        a += jac_lens.transpose() * jac_lens;
        b += jac_lens.transpose() * jac_rotation;
        d += jac_rotation.transpose() * jac_rotation;
    }
    match d.try_inverse() {
        Some(inverse) => a - b * inverse * b.transpose(),
        None => a,
    }
}
