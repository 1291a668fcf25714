//! Estimates from corners, principal lines and principal points, by each method.

use nalgebra::{Matrix3, Point2};

use boresight_calibrate::{Bundle, BundleState, LensModel, Observations, adjust, zhang};
use boresight_geometry::{
    Camera, Corner, Homography, PrincipalLine, boards::Board, frame::ImageSize,
    intersect_unweighted, mean_px, pose_from_homography,
};

/// View as used by every estimate.
#[derive(Clone, Debug)]
pub(super) struct View {
    pub(super) corners: Vec<Corner>,
    pub(super) image_from_board: Matrix3<f64>,
    pub(super) line: Option<PrincipalLine>,
}

/// Homography and principal line of a view, from the corners as seen; lines count from `origin_px`.
/// `sigma_px` is the assumed error of a corner coordinate.
///
/// `None` if the corners have no homography.
pub(super) fn view(
    board: &Board,
    corners_px: &[Point2<f64>],
    origin_px: Point2<f64>,
    sigma_px: f64,
) -> Option<View> {
    let corners: Vec<Corner> =
        corners_px.iter().map(|px| Corner::isotropic(*px, sigma_px)).collect();
    let homography = Homography::fit(&board.corners_in_board_m(), &corners).ok()?;
    let line = PrincipalLine::of(&homography, origin_px, mean_px(&corners)).ok();
    Some(View { corners, image_from_board: *homography.image_from_board(), line })
}

/// Unweighted intersection of the principal lines of `views`, as in the paper.
pub(super) fn by_principal_lines(views: &[&View]) -> Option<Point2<f64>> {
    let lines: Option<Vec<PrincipalLine>> = views.iter().map(|view| view.line.clone()).collect();
    intersect_unweighted(&lines?).ok().map(|point| point.px)
}

/// Zhang's principal point of `views`: closed form, then refined with `model`.
pub(super) fn by_zhang(
    board: &Board,
    views: &[&View],
    image_size: ImageSize,
    model: LensModel,
) -> Option<Point2<f64>> {
    let homographies: Vec<Matrix3<f64>> = views.iter().map(|view| view.image_from_board).collect();
    // If the closed form fails, start at a usual focal length.
    let usual = || Camera::pinhole(1.2 * f64::from(image_size.width_px), image_size.centre_px());
    let start = zhang::closed_form(&homographies, image_size).unwrap_or_else(usual);
    let poses: Option<Vec<_>> =
        homographies.iter().map(|h| pose_from_homography(h, &start)).collect();
    let corners: Vec<&[Corner]> = views.iter().map(|view| view.corners.as_slice()).collect();
    let observations = Observations::new(&board.corners_in_board_m(), &corners).ok()?;
    let bundle = zhang::refined(&observations, model, start, poses?)?;
    Some(bundle.state.camera.pp_px)
}

/// Bundle adjustment of `views` with `model`, from `camera`: started at the truth, it finds the
/// minimum.
pub(super) fn adjusted(
    board: &Board,
    views: &[View],
    camera: &Camera,
    model: LensModel,
) -> Option<Bundle> {
    let corners: Vec<&[Corner]> = views.iter().map(|view| view.corners.as_slice()).collect();
    let observations = Observations::new(&board.corners_in_board_m(), &corners).ok()?;
    let poses: Option<Vec<_>> =
        views.iter().map(|view| pose_from_homography(&view.image_from_board, camera)).collect();
    let start = BundleState { camera: *camera, cam_from_board: poses? };
    adjust(&observations, &model.freedom(true), None, start)
}
