//! Fisher information about the lens from views of the board.

use nalgebra::{Isometry3, Point2, SMatrix, Vector2};

use super::{params::width_scale, view::LensEstimate};
use boresight_calibrate::{
    common_error::{COLUMNS as COMMON, error_by_numbers},
    gram::{Gram, Row, TILE},
};
use boresight_geometry::{
    BROWN_PARAMETERS, Camera, LENS_PARAMETERS, LensParameter, RayProjection, boards::Board,
    cell_centres_px,
};

/// Number of usual parameters.
pub const PARAMETERS: usize = BROWN_PARAMETERS - 1;

/// Lens parameters of a camera with square pixels, the focal length as [`LensParameter::Fx`], each
/// with the standard deviation of the weak prior: in pixels of a picture 1280 pixels wide, or of a
/// distortion coefficient. The gain of a view hardly depends on the further coefficients of wide
/// lenses.
const USUAL: [(LensParameter, f64); PARAMETERS] = [
    (LensParameter::Fx, 500.0),
    (LensParameter::Cx, 100.0),
    (LensParameter::Cy, 100.0),
    (LensParameter::K1, 0.4),
    (LensParameter::K2, 0.1),
    (LensParameter::P1, 1.5e-4),
    (LensParameter::P2, 1.5e-4),
    (LensParameter::K3, 0.05),
];

/// Information or covariance of the lens parameters.
pub type LensMatrix = SMatrix<f64, PARAMETERS, PARAMETERS>;

/// Standard deviation of a corner, assumed for candidates. Follows from the width of a pixel, so
/// equal in pictures of every size.
pub(super) const CORNER_SIGMA_PX: f64 = 0.1;

/// Distance from the middle, as a share of the picture across and down, beyond which pixels lie in
/// the picture's corners.
const IN_CORNER: f64 = 0.3;

/// Standard deviation, as a share of the weak prior's, of a coefficient held fixed by an earlier
/// calibration.
const FIXED_SHARE: f64 = 1e-3;

/// Weak priors and, if given, the covariance of an earlier calibration, plus an error outside its
/// model.
pub fn prior_information(lens_estimate: &LensEstimate) -> LensMatrix {
    let sigma = prior_sigma(lens_estimate);
    let weak = LensMatrix::from_diagonal(&sigma.map(|sigma| 1.0 / (sigma * sigma)).into());
    let known = lens_estimate.known_covariance.and_then(|known| {
        // Parameters held fixed by the earlier model are known to a thousandth of the prior.
        let usual = usual_from_full(lens_estimate)?;
        let mut covariance = usual * known * usual.transpose();
        for (i, sigma) in sigma.iter().enumerate() {
            covariance[(i, i)] += (FIXED_SHARE * sigma).powi(2);
        }
        covariance.cholesky().map(|cholesky| cholesky.inverse())
    });
    known.map_or(weak, |known| weak + known)
}

/// Information of a parameter without effect on any pixel, to a thousandth.
const NEGLIGIBLE: f64 = 1e-6;

/// Changes of the usual parameters nearest, over the picture, to changes of all parameters. The
/// coefficients of rational and fisheye lenses nearly cancel, so some rows of their covariance
/// alone say nothing. `None` if the lens sees too little of the picture.
fn usual_from_full(
    lens_estimate: &LensEstimate,
) -> Option<SMatrix<f64, PARAMETERS, LENS_PARAMETERS>> {
    // Parameters absent from this lens don't change.
    let mut by_usual = LensMatrix::identity() * NEGLIGIBLE;
    let mut by_full = SMatrix::<f64, PARAMETERS, LENS_PARAMETERS>::zeros();
    for (_, seen) in projections(lens_estimate) {
        let usual = square_pixels(&seen.jac_lens);
        by_usual += usual.transpose() * usual;
        by_full += usual.transpose() * seen.jac_lens;
    }
    Some(by_usual.cholesky()?.solve(&by_full))
}

/// Standard deviations of the priors. A coefficient of the lens estimate may be as large as the
/// estimate.
fn prior_sigma(lens_estimate: &LensEstimate) -> [f64; PARAMETERS] {
    let values = lens_estimate.camera.lens_parameters();
    USUAL.map(|(parameter, sigma)| match parameter.is_distortion() {
        true => libm::hypot(sigma, values[parameter.index()]),
        false => sigma * width_scale(lens_estimate.image_size),
    })
}

/// Indices of the principal point in a [`LensMatrix`].
pub(super) fn pp_places() -> [usize; 2] {
    LensParameter::PP.map(|pp| USUAL.iter().take_while(|(usual, _)| *usual != pp).count())
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

/// Error of a corner.
#[derive(Clone, Copy, Debug)]
pub(super) struct CornerError {
    /// Variance of the independent error, per axis.
    pub(super) variance_px2: f64,
    /// See [`Corner::common_px`](boresight_geometry::Corner::common_px).
    pub(super) common_px: f64,
}

/// Fisher information of a view about the lens, the pose eliminated, from the corners in the
/// picture, with errors of `variance_px2` per axis. `None` if a corner is behind the camera.
pub fn information_in_picture(
    pose: &Isometry3<f64>,
    points_m: &[Point2<f64>],
    lens_estimate: &LensEstimate,
    variance_px2: f64,
) -> Option<LensMatrix> {
    let error = CornerError { variance_px2, common_px: 0.0 };
    let size = lens_estimate.image_size;
    let in_picture = |_, px: &Point2<f64>| size.contains(px).then_some(error);
    information_of(pose, points_m, &lens_estimate.camera, nowhere, in_picture)
}

/// Fisher information of a view about the lens from all corners, wherever they appear.
pub fn view_information(
    pose: &Isometry3<f64>,
    board: &Board,
    camera: &Camera,
    sigma_px: f64,
) -> Option<LensMatrix> {
    let error = CornerError { variance_px2: sigma_px * sigma_px, common_px: 0.0 };
    information_of(pose, &board.corners_in_board_m(), camera, nowhere, |_, _| Some(error))
}

/// Place on the board of corners without a common error, which doesn't depend on the place.
pub(super) fn nowhere(_: &Point2<f64>) -> Vector2<f64> {
    Vector2::zeros()
}

/// Fisher information of a view about the lens, the pose eliminated: `A − B D⁻¹ Bᵀ` with `A =
/// ΣJₗᵀJₗ/σ²`, `B = ΣJₗᵀJₚ/σ²`, `D = ΣJₚᵀJₚ/σ²`. The pose includes the error common to the corners.
/// `error_of` gives the error of a corner by its index and pixel, `None` if unseen.
///
/// `None` if a corner is behind the camera or the pose is not determined.
pub(super) fn information_of(
    pose: &Isometry3<f64>,
    points_m: &[Point2<f64>],
    camera: &Camera,
    on_board: impl Fn(&Point2<f64>) -> Vector2<f64>,
    error_of: impl Fn(usize, &Point2<f64>) -> Option<CornerError>,
) -> Option<LensMatrix> {
    const OF_VIEW: usize = 6 + COMMON;
    const TILES: usize = (PARAMETERS + OF_VIEW).div_ceil(TILE);
    let mut rows: Vec<Row<TILES>> = Vec::with_capacity(2 * points_m.len());
    for (index, point) in points_m.iter().enumerate() {
        let at = camera.project_board_point(pose, point)?;
        let Some(CornerError { variance_px2, common_px }) = error_of(index, &at.px) else {
            continue;
        };
        let weight = variance_px2.sqrt().recip();
        let by_lens = square_pixels(&at.jac_lens) * weight;
        let by_pose = at.jac_pose * weight;
        let by_common = error_by_numbers(common_px, &on_board(&at.px)) * weight;
        for axis in 0..2 {
            let mut row = Row::zeros();
            (0..PARAMETERS).for_each(|i| row.set(i, by_lens[(axis, i)]));
            (0..6).for_each(|i| row.set(PARAMETERS + i, by_pose[(axis, i)]));
            (0..COMMON).for_each(|i| row.set(PARAMETERS + 6 + i, by_common[(axis, i)]));
            rows.push(row);
        }
    }
    let gram = Gram::of(&rows);
    let a = LensMatrix::from_fn(|i, j| gram.at(i, j));
    let b = SMatrix::<f64, PARAMETERS, OF_VIEW>::from_fn(|i, j| gram.at(i, PARAMETERS + j));
    // The parameters of the common error have unit standard deviation.
    let d = SMatrix::<f64, OF_VIEW, OF_VIEW>::from_fn(|i, j| {
        gram.at(PARAMETERS + i, PARAMETERS + j) + if i == j && i >= 6 { 1.0 } else { 0.0 }
    });
    Some(a - b * d.cholesky()?.inverse() * b.transpose())
}

/// Jacobian by the lens parameters of a camera with square pixels: the columns of `fx` and `fy`
/// summed to a column of `f`.
pub fn square_pixels(jac_lens: &SMatrix<f64, 2, LENS_PARAMETERS>) -> SMatrix<f64, 2, PARAMETERS> {
    SMatrix::from_fn(|row, column| {
        let parameter = USUAL[column].0;
        let along_y = if parameter == LensParameter::Fx {
            jac_lens[(row, LensParameter::Fy.index())]
        } else {
            0.0
        };
        jac_lens[(row, parameter.index())] + along_y
    })
}

/// `MᵀM` per pixel, where `M` is the Jacobian of the projection by the lens parameters, after the
/// best compensating camera rotation over the whole picture.
pub(super) struct ProjectionWeights {
    /// Over a grid of pixels.
    pub(super) everywhere: LensMatrix,
    /// Over the pixels of the grid in the picture's corners; `None` if the lens has no ray for any.
    pub(super) corners: Option<LensMatrix>,
}

impl ProjectionWeights {
    pub(super) fn new(lens_estimate: &LensEstimate) -> Self {
        let grid = ProjectionGrid::new(lens_estimate);
        let size = lens_estimate.image_size;
        let size_px = Vector2::new(f64::from(size.width_px), f64::from(size.height_px));
        let turn = grid.turn_from_lens.unwrap_or_else(SMatrix::zeros);
        let mean = |is_counted: &dyn Fn(&Point2<f64>) -> bool| {
            let (mut weight, mut count) = (LensMatrix::zeros(), 0.0);
            for (_, seen) in grid.pixels.iter().filter(|(px, _)| is_counted(px)) {
                let jac = square_pixels(&seen.jac_lens) + seen.jac_rotation * turn;
                weight += jac.transpose() * jac;
                count += 1.0;
            }
            (count > 0.0).then(|| weight / count)
        };
        let is_in_corner = |px: &Point2<f64>| {
            let off = (px - size.centre_px()).component_div(&size_px);
            off.x.abs() > IN_CORNER && off.y.abs() > IN_CORNER
        };
        Self {
            everywhere: mean(&|_| true).unwrap_or_else(LensMatrix::zeros),
            corners: mean(&is_in_corner),
        }
    }
}

/// A grid of pixels over the picture, with the projection of their rays; without pixels lacking a
/// ray.
fn projections(lens_estimate: &LensEstimate) -> impl Iterator<Item = (Point2<f64>, RayProjection)> {
    let camera = &lens_estimate.camera;
    cell_centres_px(lens_estimate.image_size)
        .filter_map(|px| Some((px, camera.project_ray(&camera.ray_from_px(&px)?)?)))
}

/// Projection at a grid of pixels.
struct ProjectionGrid {
    pixels: Vec<(Point2<f64>, RayProjection)>,
    /// The best compensating camera rotation, by the lens parameters; `None` if the pixels don't
    /// fix the rotation.
    turn_from_lens: Option<SMatrix<f64, 3, PARAMETERS>>,
}

impl ProjectionGrid {
    fn new(lens_estimate: &LensEstimate) -> Self {
        let pixels: Vec<_> = projections(lens_estimate).collect();
        let mut lens_by_turn = SMatrix::<f64, PARAMETERS, 3>::zeros();
        let mut by_turn = SMatrix::<f64, 3, 3>::zeros();
        for (_, seen) in &pixels {
            lens_by_turn += square_pixels(&seen.jac_lens).transpose() * seen.jac_rotation;
            by_turn += seen.jac_rotation.transpose() * seen.jac_rotation;
        }
        let turn_from_lens =
            by_turn.try_inverse().map(|inverse| -inverse * lens_by_turn.transpose());
        Self { pixels, turn_from_lens }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use boresight_geometry::{LensMatrix as FullMatrix, LensParts, frame::ImageSize};

    /// A rational lens with k1 and k4 hardly known individually: their effects on the picture
    /// nearly cancel.
    #[test]
    fn coefficients_that_cancel_leave_an_earlier_lens_known() {
        let image_size = ImageSize { width_px: 1280, height_px: 720 };
        let mut lens_estimate = LensEstimate::guess(image_size);
        lens_estimate.camera.distortion.k4 = 0.01;
        let mut known = FullMatrix::zeros();
        for parameter in
            [LensParameter::Fx, LensParameter::Fy, LensParameter::Cx, LensParameter::Cy]
        {
            known[(parameter.index(), parameter.index())] = 0.01;
        }
        let (k1, k4) = (LensParameter::K1, LensParameter::K4);
        let together = SMatrix::<f64, 2, 2>::new(9.0, 9.0, 9.0, 9.0) + SMatrix::identity() * 1e-6;
        known.set_block([k1, k4], [k1, k4], &together);
        lens_estimate.known_covariance = Some(known);
        let information = prior_information(&lens_estimate);
        let covariance = information.cholesky().expect("definite").inverse();
        let weight = ProjectionWeights::new(&lens_estimate).everywhere;
        let sd_px = (0.5 * (weight * covariance).trace()).sqrt();
        assert!(sd_px < 2.0, "{sd_px} px");
    }
}
