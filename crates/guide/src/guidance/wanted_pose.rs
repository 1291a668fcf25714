//! Pose of the board with a given direction, tilt, size and place.

use nalgebra::{Isometry3, Point2, Translation3, Unit, UnitQuaternion, Vector2, Vector3};

use super::{
    params::{BoardRoll, GuidanceParams},
    slots::slots_deg,
    view::{LensEstimate, bounds_px},
};
use boresight_geometry::{boards::Board, frame::ImageSize};

/// Least share of the picture spanned by a requested board.
const LEAST_SPAN_FRACTION: f64 = 0.05;
/// Room for an edge fit around a corner.
const LEAST_MARGIN_PX: f64 = 8.0;

/// Requested appearance of the board in the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct WantedPose {
    /// Direction in the picture in which the board recedes, clockwise from the right.
    pub(super) tilt_azimuth_rad: f64,
    pub(super) tilt_rad: f64,
    /// Requested place of the mean corner, from the principal point.
    pub(super) offset_px: Vector2<f64>,
    /// True if the view's point reflection about the principal point must lie in the picture, too.
    pub(super) is_reflected: bool,
    /// True if a part of the board is to be beyond the picture's edge.
    pub(super) leaves_picture: bool,
}

/// Inner corners in the picture, in numbering order, without those behind the camera.
pub fn seen_px(
    cam_from_board: &Isometry3<f64>,
    board: &Board,
    lens_estimate: &LensEstimate,
) -> Vec<Point2<f64>> {
    board
        .corners_in_board_m()
        .iter()
        .filter_map(|corner| lens_estimate.camera.px_from_board(cam_from_board, corner))
        .collect()
}

/// Pose with the appearance `wanted`: the mean corner in place, and the board as large as
/// [`GuidanceParams::target_span_fraction`] and the picture allow. The inner corners lie inside the
/// picture; the outer squares may leave it. Source: `docs/method.md`, section 3.4.
///
/// `None` if the result spans less than a twentieth.
pub(super) fn place_board(
    wanted: &WantedPose,
    board: &Board,
    lens_estimate: &LensEstimate,
    params: &GuidanceParams,
) -> Option<Isometry3<f64>> {
    let rotation = rotation(wanted, params.board_roll);
    let centre_px = lens_estimate.camera.pp_px + wanted.offset_px;
    let corners = rim_m(board);
    let mut depth_m = board.target().length_m() * lens_estimate.camera.f_px.x
        / (params.target_span_fraction * f64::from(lens_estimate.image_size.width_px));
    let mut best = None;
    // Bisection finds the distance between "too large" and "fits", a fixed-point iteration the
    // place.
    let (mut near_m, mut far_m) = (depth_m * 0.3, depth_m * 6.0);
    for _ in 0..18 {
        depth_m = 0.5 * (near_m + far_m);
        let pose = placed(&rotation, depth_m, &centre_px, &corners, lens_estimate);
        let fits = pose.as_ref().is_some_and(|pose| {
            span_fraction(pose, &corners, lens_estimate)
                .is_some_and(|span| span <= params.target_span_fraction)
                && corners_inside(pose, &corners, wanted, lens_estimate, params)
        });
        if fits {
            far_m = depth_m;
            best = pose;
        } else {
            near_m = depth_m;
        }
    }
    let pose = best?;
    span_fraction(&pose, &corners, lens_estimate)
        .is_some_and(|span| span >= LEAST_SPAN_FRACTION)
        .then_some(pose)
}

/// Pose of a whole board receding towards `tilt_azimuth_rad`, tilted by `tilt_rad`, with the mean
/// corner `offset_px` from the principal point. `None` without room for the board.
pub(crate) fn posed_board(
    (tilt_azimuth_rad, tilt_rad): (f64, f64),
    offset_px: Vector2<f64>,
    board: &Board,
    lens_estimate: &LensEstimate,
    params: &GuidanceParams,
) -> Option<Isometry3<f64>> {
    let is_reflected = false;
    let leaves_picture = false;
    let wanted = WantedPose { tilt_azimuth_rad, tilt_rad, offset_px, is_reflected, leaves_picture };
    place_board(&wanted, board, lens_estimate, params)
}

/// Poses of the plan's first four views.
pub(super) fn planned_poses(
    board: &Board,
    lens_estimate: &LensEstimate,
    params: &GuidanceParams,
) -> impl Iterator<Item = Isometry3<f64>> {
    let tilt_rad = params.wanted_tilt_rad(lens_estimate.f_to_width());
    slots_deg(lens_estimate.image_size).into_iter().take(4).filter_map(move |direction_deg| {
        let wanted = WantedPose {
            tilt_azimuth_rad: direction_deg.to_radians(),
            tilt_rad,
            offset_px: Vector2::zeros(),
            is_reflected: true,
            leaves_picture: false,
        };
        place_board(&wanted, board, lens_estimate, params)
    })
}

/// Places on the board's rim, evenly around its middle, in metres: the extremes of the board in the
/// picture.
fn rim_m(board: &Board) -> Vec<Point2<f64>> {
    let [x, y] = board.target().needed_m();
    let shares = [-1.0, 0.0, 1.0];
    let places = shares.into_iter().flat_map(|down| shares.map(|across| (across, down)));
    let rim = places.filter(|place| *place != (0.0, 0.0));
    rim.map(|(across, down)| Point2::new(across * x, down * y)).collect()
}

/// Rotation of a board facing the camera by `tilt_rad`, to recede towards `tilt_azimuth_rad`.
pub fn tilted(tilt_azimuth_rad: f64, tilt_rad: f64) -> UnitQuaternion<f64> {
    let (sin, cos) = libm::sincos(tilt_azimuth_rad);
    let axis = Unit::new_normalize(Vector3::new(sin, -cos, 0.0));
    UnitQuaternion::from_axis_angle(&axis, tilt_rad)
}

pub(super) fn rotation(wanted: &WantedPose, roll: BoardRoll) -> UnitQuaternion<f64> {
    let tilted = tilted(wanted.tilt_azimuth_rad, wanted.tilt_rad);
    match roll {
        BoardRoll::Upright => tilted,
        BoardRoll::Turn => {
            tilted * UnitQuaternion::from_axis_angle(&Vector3::z_axis(), wanted.tilt_azimuth_rad)
        }
    }
}

/// Shifts the board at `depth_m` until the mean corner appears at `centre_px`. `None` if a corner
/// gets behind the camera.
pub(super) fn placed(
    rotation: &UnitQuaternion<f64>,
    depth_m: f64,
    centre_px: &Point2<f64>,
    corners: &[Point2<f64>],
    lens_estimate: &LensEstimate,
) -> Option<Isometry3<f64>> {
    let mut shift_m = Vector3::new(0.0, 0.0, depth_m);
    for _ in 0..6 {
        let pose = Isometry3::from_parts(Translation3::from(shift_m), *rotation);
        let mut mean = nalgebra::Vector2::zeros();
        for corner in corners {
            mean += lens_estimate.camera.px_from_board(&pose, corner)?.coords;
        }
        let off_px = centre_px.coords - mean / corners.len() as f64;
        shift_m.x += off_px.x * depth_m / lens_estimate.camera.f_px.x;
        shift_m.y += off_px.y * depth_m / lens_estimate.camera.f_px.y;
    }
    Some(Isometry3::from_parts(Translation3::from(shift_m), *rotation))
}

fn span_fraction(
    pose: &Isometry3<f64>,
    corners: &[Point2<f64>],
    lens_estimate: &LensEstimate,
) -> Option<f64> {
    let seen: Option<Vec<_>> =
        corners.iter().map(|corner| lens_estimate.camera.px_from_board(pose, corner)).collect();
    let (low, high) = bounds_px(seen?.into_iter());
    let ImageSize { width_px, height_px } = lens_estimate.image_size;
    Some(((high.x - low.x) / f64::from(width_px)).max((high.y - low.y) / f64::from(height_px)))
}

/// True if the inner corners and, if required, their reflections lie in the picture with the
/// requested margin.
fn corners_inside(
    pose: &Isometry3<f64>,
    corners: &[Point2<f64>],
    wanted: &WantedPose,
    lens_estimate: &LensEstimate,
    params: &GuidanceParams,
) -> bool {
    let ImageSize { width_px, height_px } = lens_estimate.image_size;
    let (width_px, height_px) = (f64::from(width_px), f64::from(height_px));
    let margin_px = (params.target_margin_fraction * width_px.min(height_px)).max(LEAST_MARGIN_PX);
    let inside = |p: &Point2<f64>| {
        p.x >= margin_px
            && p.y >= margin_px
            && p.x <= width_px - 1.0 - margin_px
            && p.y <= height_px - 1.0 - margin_px
    };
    corners.iter().all(|corner| {
        lens_estimate.camera.px_from_board(pose, corner).is_some_and(|px| {
            let reflected = Point2::from(lens_estimate.camera.pp_px.coords * 2.0 - px.coords);
            inside(&px) && (!wanted.is_reflected || inside(&reflected))
        })
    })
}
