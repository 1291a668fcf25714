//! Poses open to a request, and the reflected pair with the most gain. Source: `docs/method.md`,
//! section 3.4.
//!
//! Poses are judged *in reflected pairs*: this keeps the precision of a greedy choice, and a too
//! simple lens model pulls the principal point two to three times less.

use nalgebra::{Isometry3, Point2, Point3, Vector2, Vector3};

use super::{
    gain::Knowledge,
    information::reflected,
    params::GuidanceParams,
    slots::{direction_difference_rad, slots_deg},
    view::{LensEstimate, View},
    wanted_pose::{WantedPose, place_board, placed, rotation},
};
use boresight_geometry::boards::Board;

/// A pose, with its intended appearance.
pub(super) type Pose = (WantedPose, Isometry3<f64>);

/// Offsets of directions from the slots: the eight slots first, then twice the directions in
/// between.
const BETWEEN_DEG: [f64; 4] = [0.0, 22.5, 11.25, 33.75];
/// Tilts, beside the requested tilt: steeper ones give more of the focal length, flatter ones reach
/// farther.
const MORE_TILT_DEG: [f64; 3] = [0.0, 10.0, -15.0];
/// Places of the board's middle, from the picture's, in shares of width and height. The reflected
/// views take the other half of the places.
const PLACES: [(f64, f64); 7] = [
    (0.0, 0.0),
    (0.16, 0.0),
    (0.0, 0.16),
    (0.14, 0.14),
    (0.14, -0.14),
    (0.27, 0.27),
    (0.27, -0.27),
];
/// Distances of boards beyond the picture's edge, in multiples of the distance of a just fitting
/// board in the middle.
const DISTANCES: [f64; 2] = [0.85, 1.15];
/// Factor of gain for a later pose to replace an earlier pose: the slots are easiest to show.
const CLEARLY_MORE: f64 = 1.1;
/// Time for a person to show a board beyond the picture's edge, relative to inside.
const EFFORT_BEYOND_EDGE: f64 = 2.0;
/// Least angle of requested directions from accepted lines. A person misses a direction by some
/// degrees, and the view must still count.
const CLEAR_RAD: f64 = 15.0 * std::f64::consts::PI / 180.0;
/// Least angle if no such direction is left.
const LEAST_CLEAR_RAD: f64 = 7.5 * std::f64::consts::PI / 180.0;
/// Angle within which a direction counts as tried.
const TRIED_RAD: f64 = 40.0 * std::f64::consts::PI / 180.0;
/// Share of the corners required in the picture, at this distance from the edge.
const SEEN_SHARE: f64 = 0.6;
const INSET_PX: f64 = 15.0;
/// Steepest angle of looking at any part of the board, from the normal; at 90° its edge would be
/// seen.
const STEEPEST_LOOK_RAD: f64 = 75.0 * std::f64::consts::PI / 180.0;
/// Distance from the picture, in widths, beyond which the lens is a guess.
const FARTHEST_WIDTHS: f64 = 2.0;

/// The pose with the most gain for its effort together with its reflected partner, in a direction
/// clear of all accepted ones and not `tried` in vain. `None` if no such direction is left, or if
/// nothing fits into the picture.
pub(super) fn best_pair(
    accepted: &[View],
    tried_rad: &[f64],
    board: &Board,
    knowledge: &Knowledge,
    lens_estimate: &LensEstimate,
    params: &GuidanceParams,
) -> Option<Pose> {
    let usual = knowledge.usual(None);
    let mut best: Option<(f64, Pose)> = None;
    for direction_rad in clear_directions_rad(accepted, tried_rad, lens_estimate) {
        for (wanted, pose) in poses(direction_rad, board, lens_estimate, params) {
            let pair = knowledge.at(&pose, usual) + knowledge.at(&reflected(&pose), usual);
            let gain = knowledge.gain(&pair);
            let gain = if wanted.leaves_picture { gain / EFFORT_BEYOND_EDGE } else { gain };
            if best.as_ref().is_none_or(|(most, _)| gain > CLEARLY_MORE * most) {
                best = Some((gain, (wanted, pose)));
            }
        }
    }
    best.map(|(_, pose)| pose)
}

/// True if the direction is near a direction tried in vain.
pub(super) fn is_tried(direction_rad: f64, tried_rad: &[f64]) -> bool {
    let off_rad = |tried: &f64| direction_difference_rad(*tried, direction_rad).abs();
    tried_rad.iter().any(|tried| off_rad(tried) < TRIED_RAD)
}

/// Directions all round, the plan's slots first, clear of the taken directions; closer ones if none
/// is.
fn clear_directions_rad(
    accepted: &[View],
    tried_rad: &[f64],
    lens_estimate: &LensEstimate,
) -> Vec<f64> {
    let slots = slots_deg(lens_estimate.image_size);
    let all = BETWEEN_DEG.into_iter().flat_map(|more| slots.map(|slot| (slot + more).to_radians()));
    let off_rad = |one: f64, other: f64| libm::asin(libm::sin(one - other).abs());
    let all: Vec<f64> = all.filter(|direction| !is_tried(*direction, tried_rad)).collect();
    let clear_by = |least_rad: f64| -> Vec<f64> {
        let is_clear = |direction: &&f64| {
            accepted.iter().all(|view| off_rad(view.tilt_azimuth_rad(), **direction) >= least_rad)
        };
        all.iter().filter(is_clear).copied().collect()
    };
    let clear = clear_by(CLEAR_RAD);
    if clear.is_empty() { clear_by(LEAST_CLEAR_RAD) } else { clear }
}

/// Poses in a direction: as near as fits in several places and, if parts of a board can be
/// identified, beyond the picture's edge.
fn poses(
    tilt_azimuth_rad: f64,
    board: &Board,
    lens_estimate: &LensEstimate,
    params: &GuidanceParams,
) -> Vec<Pose> {
    let size = lens_estimate.image_size;
    let size_px = Vector2::new(f64::from(size.width_px), f64::from(size.height_px));
    let usual_rad = params.wanted_tilt_rad(lens_estimate.f_to_width());
    let points = board.corners_in_board_m();
    let mut poses = Vec::new();
    for more_deg in MORE_TILT_DEG {
        let tilt_rad = usual_rad + more_deg.to_radians();
        let mut fits_m = None;
        for (across, down) in PLACES {
            let wanted = WantedPose {
                tilt_azimuth_rad,
                tilt_rad,
                offset_px: size_px.component_mul(&Vector2::new(across, down)),
                is_reflected: true,
                leaves_picture: false,
            };
            let whole = place_board(&wanted, board, lens_estimate, params);
            fits_m = fits_m.or(whole.map(|pose| pose.translation.z));
            poses.extend(whole.map(|pose| (wanted, pose)));
            let Some(fits_m) = fits_m.filter(|_| params.leaves_picture()) else { continue };
            let turn = rotation(&wanted, params.board_roll);
            let centre_px = lens_estimate.camera.pp_px + wanted.offset_px;
            let beyond = DISTANCES.into_iter().filter_map(|share| {
                placed(&turn, share * fits_m, &centre_px, &points, lens_estimate)
            });
            let leaves = |pose: &Isometry3<f64>| {
                leaves_picture(pose, &points, lens_estimate)
                    && leaves_picture(&reflected(pose), &points, lens_estimate)
            };
            let wanted = WantedPose { leaves_picture: true, ..wanted };
            poses.extend(beyond.filter(leaves).map(|pose| (wanted, pose)));
        }
    }
    poses
}

/// True if a part of the board lies outside of the picture, but most of it inside.
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
        if normal.dot(&in_cam) < libm::cos(STEEPEST_LOOK_RAD) * in_cam.norm() {
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
