//! Where the board must stand to show a wanted direction, tilt, size and place.

use nalgebra::{Isometry3, Point2, Point3, Translation3, Unit, UnitQuaternion, Vector3};

use super::{
    params::{BoardRoll, GuidanceParams},
    view::{LensEstimate, bounds_px},
};
use crate::{board::Checkerboard, frame::ImageSize};

/// How the board should appear in the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct WantedPose {
    /// Direction in the picture in which the board recedes, clockwise from the right.
    pub(super) tilt_azimuth_rad: f64,
    pub(super) tilt_rad: f64,
    /// Larger of the shares of the picture's width and height that the corners should span.
    pub(super) span_fraction: f64,
    /// Shift of the board's centre from the principal point along that direction.
    pub(super) along_px: f64,
}

/// Where the inner corners appear in the picture, in numbering order, without those behind the camera.
pub fn seen_px(
    cam_from_board: &Isometry3<f64>,
    board: &Checkerboard,
    lens_estimate: &LensEstimate,
) -> Vec<Point2<f64>> {
    board
        .corners_in_board_m()
        .iter()
        .filter_map(|corner| lens_estimate.camera.px_from_board(cam_from_board, corner))
        .collect()
}

/// The pose that shows `wanted`: the mean corner at its place, and the board with its outer squares, and its
/// reflected partner, inside the picture; as large as wanted or, if that doesn't fit, as large as fits.
///
/// `None` if what fits spans less than half of the wanted share or less than `min_span_fraction`.
pub(super) fn place_board(
    wanted: &WantedPose,
    board: &Checkerboard,
    lens_estimate: &LensEstimate,
    params: &GuidanceParams,
) -> Option<Isometry3<f64>> {
    let rotation = rotation(wanted, params.board_roll);
    let (sin, cos) = wanted.tilt_azimuth_rad.sin_cos();
    let centre_px = lens_estimate.camera.pp_px + nalgebra::Vector2::new(cos, sin) * wanted.along_px;
    let corners = board.corners_in_board_m();
    let mut depth_m = f64::from(board.columns().max(board.rows()) as u32)
        * board.square_m()
        * lens_estimate.camera.f_px.x
        / (wanted.span_fraction * f64::from(lens_estimate.image_size.width_px));
    let mut best = None;
    // Bisection finds the distance between "too large" and "fits", a fixed-point iteration the place.
    let (mut near_m, mut far_m) = (depth_m * 0.3, depth_m * 4.0);
    for _ in 0..18 {
        depth_m = 0.5 * (near_m + far_m);
        let pose = placed(&rotation, depth_m, &centre_px, &corners, lens_estimate);
        let fits = pose.as_ref().is_some_and(|pose| {
            span_fraction(pose, &corners, lens_estimate)
                .is_some_and(|span| span <= wanted.span_fraction)
                && outline_inside(pose, board, lens_estimate, params)
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
        .is_some_and(|span| span >= params.min_span_fraction.max(0.5 * wanted.span_fraction))
        .then_some(pose)
}

/// Rotation of a board that faced the camera and was tilted by `tilt_rad` so that it recedes towards
/// `tilt_azimuth_rad`.
pub fn tilted(tilt_azimuth_rad: f64, tilt_rad: f64) -> UnitQuaternion<f64> {
    let (sin, cos) = tilt_azimuth_rad.sin_cos();
    let axis = Unit::new_normalize(Vector3::new(sin, -cos, 0.0));
    UnitQuaternion::from_axis_angle(&axis, tilt_rad)
}

fn rotation(wanted: &WantedPose, roll: BoardRoll) -> UnitQuaternion<f64> {
    let tilted = tilted(wanted.tilt_azimuth_rad, wanted.tilt_rad);
    match roll {
        BoardRoll::Upright => tilted,
        BoardRoll::Turn => {
            tilted * UnitQuaternion::from_axis_angle(&Vector3::z_axis(), wanted.tilt_azimuth_rad)
        }
    }
}

/// Shifts the board at `depth_m` until its mean corner appears at `centre_px`. `None` if a corner gets behind
/// the camera.
fn placed(
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

/// Whether the board with its outer squares, and its reflected partner, lie in the picture.
fn outline_inside(
    pose: &Isometry3<f64>,
    board: &Checkerboard,
    lens_estimate: &LensEstimate,
    params: &GuidanceParams,
) -> bool {
    let half_width = (board.columns() as f64 + 1.0) / 2.0 * board.square_m();
    let half_height = (board.rows() as f64 + 1.0) / 2.0 * board.square_m();
    let outline = [
        (-1.0, -1.0),
        (0.0, -1.0),
        (1.0, -1.0),
        (1.0, 0.0),
        (1.0, 1.0),
        (0.0, 1.0),
        (-1.0, 1.0),
        (-1.0, 0.0),
    ];
    let (width, height) = (
        f64::from(lens_estimate.image_size.width_px),
        f64::from(lens_estimate.image_size.height_px),
    );
    let inside = |p: &Point2<f64>| {
        let margin = params.margin_px;
        p.x >= margin
            && p.y >= margin
            && p.x <= width - 1.0 - margin
            && p.y <= height - 1.0 - margin
    };
    outline.iter().all(|(x, y)| {
        let in_cam = pose * Point3::new(x * half_width, y * half_height, 0.0);
        lens_estimate.camera.project(&in_cam).is_some_and(|px| {
            let reflected = Point2::from(lens_estimate.camera.pp_px.coords * 2.0 - px.coords);
            inside(&px) && inside(&reflected)
        })
    })
}
