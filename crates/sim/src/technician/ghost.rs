//! Pose of the board that matches the ghost on the screen.

use nalgebra::{
    DMatrix, Isometry3, Matrix3, Matrix6, Point2, Rotation3, UnitQuaternion, Vector3, Vector6,
};

use boresight_geometry::{Camera, frame::ImageSize};

/// Pose with the board's corners on the part of the ghost within the picture, or on the whole ghost
/// if less than a third is within. See [`pose_onto`].
pub(crate) fn matching_pose(
    camera: &Camera,
    image_size: ImageSize,
    corners_in_board_m: &[Point2<f64>],
    ghost_px: &[Point2<f64>],
) -> Option<Isometry3<f64>> {
    let (right, bottom) = (f64::from(image_size.width_px), f64::from(image_size.height_px));
    let within = |px: &Point2<f64>| (0.0..right).contains(&px.x) && (0.0..bottom).contains(&px.y);
    let (seen_m, seen_px): (Vec<_>, Vec<_>) = corners_in_board_m
        .iter()
        .zip(ghost_px)
        .filter(|(_, px)| within(px))
        .map(|(m, px)| (*m, *px))
        .unzip();
    let seen = (3 * seen_px.len() >= ghost_px.len())
        .then(|| pose_onto(camera, &seen_m, &seen_px))
        .flatten();
    seen.or_else(|| pose_onto(camera, corners_in_board_m, ghost_px))
}

/// Least-squares pose with the board's corners on `ghost_px`.
///
/// Starts from the homography of the undistorted ghost and refines in pixels through the lens.
/// `None` if fewer than four corners have a ray or they don't look like a board.
fn pose_onto(
    camera: &Camera,
    corners_in_board_m: &[Point2<f64>],
    ghost_px: &[Point2<f64>],
) -> Option<Isometry3<f64>> {
    let pairs: Vec<(Point2<f64>, Point2<f64>)> = corners_in_board_m
        .iter()
        .zip(ghost_px)
        .filter(|(_, px)| px.coords.norm().is_finite())
        .filter_map(|(corner_m, px)| Some((*corner_m, camera.normalized_from_px(px)?)))
        .collect();
    let mut pose = pose_of_homography(&homography(&pairs)?)?;
    let error_at = |pose: &Isometry3<f64>| {
        let (mut hessian, mut slope, mut cost) = (Matrix6::zeros(), Vector6::zeros(), 0.0);
        for (corner_m, px) in corners_in_board_m.iter().zip(ghost_px) {
            let seen = camera.project_board_point(pose, corner_m)?;
            let missed = px - seen.px;
            hessian += seen.jac_pose.transpose() * seen.jac_pose;
            slope += seen.jac_pose.transpose() * missed;
            cost += missed.norm_squared();
        }
        Some((hessian, slope, cost))
    };
    let (mut hessian, mut slope, mut cost) = error_at(&pose)?;
    let mut damping = 1e-4;
    for _ in 0..50 {
        let damped = hessian + Matrix6::from_diagonal(&(hessian.diagonal() * damping));
        let step = damped.cholesky()?.solve(&slope);
        let next = Camera::moved(
            &pose,
            &step.fixed_rows::<3>(0).into_owned(),
            &step.fixed_rows::<3>(3).into_owned(),
        );
        match error_at(&next) {
            Some((next_hessian, next_slope, next_cost)) if next_cost <= cost => {
                (pose, hessian, slope, cost) = (next, next_hessian, next_slope, next_cost);
                damping = (0.1 * damping).max(1e-12);
            }
            _ => damping *= 10.0,
        }
        if step.norm() < 1e-10 || damping > 1e8 {
            break;
        }
    }
    Some(pose)
}

/// `ideal ∝ H (x, y, 1)` by the direct linear transform, scaled so that the board is in front.
fn homography(board_and_ideal: &[(Point2<f64>, Point2<f64>)]) -> Option<Matrix3<f64>> {
    if board_and_ideal.len() < 4 {
        return None;
    }
    // Scaling board coordinates to the size of image coordinates keeps the system well conditioned.
    let size_m = board_and_ideal.iter().map(|(m, _)| m.coords.norm()).fold(1e-9, f64::max);
    let mut system = DMatrix::<f64>::zeros((2 * board_and_ideal.len()).max(9), 9);
    for (i, (corner_m, ideal)) in board_and_ideal.iter().enumerate() {
        let (x, y) = (corner_m.x / size_m, corner_m.y / size_m);
        for (row, along, at) in [(2 * i, 0, ideal.x), (2 * i + 1, 3, ideal.y)] {
            for (column, value) in [x, y, 1.0].into_iter().enumerate() {
                system[(row, along + column)] = value;
                system[(row, 6 + column)] = -at * value;
            }
        }
    }
    let h = system.svd(false, true).v_t?.row(8).into_owned();
    let sign = if h[8] < 0.0 { -1.0 } else { 1.0 };
    let matrix = sign * Matrix3::new(h[0], h[1], h[2], h[3], h[4], h[5], h[6], h[7], h[8]);
    Some(matrix * Matrix3::from_diagonal(&Vector3::new(1.0 / size_m, 1.0 / size_m, 1.0)))
}

fn pose_of_homography(ideal_from_board: &Matrix3<f64>) -> Option<Isometry3<f64>> {
    let scale = 0.5 * (ideal_from_board.column(0).norm() + ideal_from_board.column(1).norm());
    let [right, down, at] = [0, 1, 2].map(|i| Vector3::from(ideal_from_board.column(i)) / scale);
    if !(scale > 0.0 && at.z > 0.0) {
        return None;
    }
    let axes = Matrix3::from_columns(&[right, down, right.cross(&down)]);
    let turn = Rotation3::from_matrix(&axes);
    Some(Isometry3::from_parts(at.into(), UnitQuaternion::from_rotation_matrix(&turn)))
}
