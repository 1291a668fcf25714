//! Poses at which a part of the board lies beyond the picture's edge.
//!
//! A board that must be whole can't reach the picture's edge: it's too large for a corner of the picture, or too small to
//! tell much there. Source: `docs/method.md`, section 3.4.

use nalgebra::{Isometry3, Point2, Point3, Vector2, Vector3};

use super::{
    candidates::{Pair, free_directions_rad},
    information::reflected,
    params::GuidanceParams,
    view::{LensEstimate, View},
    wanted_pose::{WantedPose, placed, rotation},
    worth::pose_of,
};
use boresight_geometry::{Corner, board::Checkerboard};

/// Directions searched over the full turn.
const DIRECTIONS: u32 = 16;
/// Tilts, beside the one that is always asked for: steeper determines the focal length better, flatter reaches farther.
const STEEPER_RAD: f64 = 10.0 * std::f64::consts::PI / 180.0;
const FLAT_RAD: f64 = 20.0 * std::f64::consts::PI / 180.0;
/// Offsets of the board's middle from the picture's, in shares of width and height. The reflected views stand at the
/// other half of the places.
const PLACES: [(f64, f64); 10] = [
    (0.0, 0.0),
    (0.1, 0.1),
    (0.1, -0.1),
    (0.15, 0.0),
    (0.0, 0.15),
    (0.2, 0.2),
    (0.2, -0.2),
    (0.28, 0.28),
    (0.28, -0.28),
    (0.33, 0.0),
];
/// Distances, in multiples of the nearest whole view's: much nearer, the board may be out of focus.
const DISTANCES: [f64; 3] = [0.75, 1.0, 1.3];
/// Share of the corners that must be in the picture, and their least distance from its edge.
const SEEN_SHARE: f64 = 0.6;
const INSET_PX: f64 = 15.0;
/// Largest angle between the board's normal and a ray to any of its points; at 90° its edge would be seen.
const STEEPEST_LOOK_RAD: f64 = 75.0 * std::f64::consts::PI / 180.0;
/// Largest distance from the picture, in its widths: farther out, the lens is a guess.
const FARTHEST_WIDTHS: f64 = 2.0;

/// Poses at which a part of the board lies beyond the picture's edge, also in the reflected view, in directions that
/// are independent of all accepted ones. None without accepted views: a part can be identified only by following the
/// board.
pub(super) fn pairs_beyond_edge(
    accepted: &[View],
    board: &Checkerboard,
    lens_estimate: &LensEstimate,
    params: &GuidanceParams,
) -> Vec<Pair> {
    // Only whole views count here: measured from partial ones, which may lie nearer, the next pair would come nearer
    // still.
    let whole = accepted.iter().filter(|view| view.corners.iter().all(Corner::is_seen));
    let poses = whole.filter_map(|view| pose_of(&view.corners, board, lens_estimate));
    let nearest_m = poses.map(|pose| pose.translation.z).fold(f64::INFINITY, f64::min);
    if !nearest_m.is_finite() || params.stop_corner_sigma_px.is_none() || params.is_far() {
        return Vec::new();
    }
    let points = board.corners_in_board_m();
    let size = lens_estimate.image_size;
    let size_px = Vector2::new(f64::from(size.width_px), f64::from(size.height_px));
    let usual_rad = params.wanted_tilt_rad(lens_estimate.f_to_width());
    let flat_rad = FLAT_RAD.max(1.3 * params.min_tilt_rad).min(usual_rad);
    let steep_rad = (usual_rad + STEEPER_RAD).min(params.max_tilt_rad);
    let mut pairs = Vec::new();
    for tilt_azimuth_rad in free_directions_rad(accepted, DIRECTIONS, params) {
        for tilt_rad in [steep_rad, usual_rad, flat_rad] {
            for (across, down) in PLACES {
                let offset_px = size_px.component_mul(&Vector2::new(across, down));
                let wanted =
                    WantedPose { tilt_azimuth_rad, tilt_rad, offset_px, is_reflected: true };
                let turn = rotation(&wanted, params.board_roll);
                let centre_px = lens_estimate.camera.pp_px + offset_px;
                let poses = DISTANCES.into_iter().filter_map(|share| {
                    placed(&turn, share * nearest_m, &centre_px, &points, lens_estimate)
                });
                let leave = |pose: &Isometry3<f64>| {
                    [*pose, reflected(pose)]
                        .iter()
                        .all(|pose| leaves_picture(pose, &points, lens_estimate))
                };
                pairs.extend(poses.filter(leave).map(|pose| (wanted, pose)));
            }
        }
    }
    pairs
}

/// True if a part of the board lies outside of the picture, but most of the board inside.
fn leaves_picture(
    pose: &Isometry3<f64>,
    points: &[Point2<f64>],
    lens_estimate: &LensEstimate,
) -> bool {
    let size = lens_estimate.image_size;
    let (right, bottom) = (f64::from(size.width_px) - 1.0, f64::from(size.height_px) - 1.0);
    let normal = pose.rotation * Vector3::z();
    let mut inside = 0;
    for point in points {
        let in_cam = pose.transform_point(&Point3::new(point.x, point.y, 0.0)).coords;
        if normal.dot(&in_cam) < STEEPEST_LOOK_RAD.cos() * in_cam.norm() {
            return false;
        }
        let Some(px) = lens_estimate.camera.px_from_board(pose, point) else { return false };
        if (px - size.centre_px()).norm() > FARTHEST_WIDTHS * right {
            return false;
        }
        let is_inside = (INSET_PX..=right - INSET_PX).contains(&px.x)
            && (INSET_PX..=bottom - INSET_PX).contains(&px.y);
        inside += usize::from(is_inside);
    }
    inside < points.len() && inside as f64 >= SEEN_SHARE * points.len() as f64
}
