//! Candidate poses.

use nalgebra::{Isometry3, Point2, Translation3, UnitQuaternion, Vector3};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use crate::guidance::{course::planned_margin_px, situation::Situation};
use boresight_geometry::{Camera, boards::Board, frame::ImageSize};
use boresight_guide::guidance::{view::bounds_px, wanted_pose::tilted};

/// Pose in a person's terms.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::guidance) struct Wanted {
    /// Direction in which the board recedes.
    pub(in crate::guidance) slot_rad: f64,
    pub(in crate::guidance) tilt_rad: f64,
    /// Rotation of the board in the board plane.
    pub(in crate::guidance) roll_rad: f64,
    /// Image of the board's centre, as a share of the picture's width and height.
    pub(in crate::guidance) centre: [f64; 2],
    /// Share of the picture's width or height spanned by the corners.
    pub(in crate::guidance) fill: f64,
}

/// Steps of the bisection for the distance, to half a per cent.
const STEPS: usize = 9;

/// Wanted pose, at least far enough away to keep all corners `margin_px` inside the picture. `None`
/// if the board isn't wholly visible at three times the requested distance.
pub(in crate::guidance) fn place(
    (camera, size): (&Camera, ImageSize),
    board: &Board,
    wanted: &Wanted,
    margin_px: f64,
) -> Option<Isometry3<f64>> {
    let (width, height) = (f64::from(size.width_px), f64::from(size.height_px));
    let rotation = tilted(wanted.slot_rad, wanted.tilt_rad)
        * UnitQuaternion::from_axis_angle(&Vector3::z_axis(), wanted.roll_rad);
    let centre = Point2::new(wanted.centre[0] * width, wanted.centre[1] * height);
    let ray = camera.normalized_from_px(&centre)?;
    let corners_m = board.corners_in_board_m();
    let at = |depth_m: f64| {
        let shift = Vector3::new(ray.x * depth_m, ray.y * depth_m, depth_m);
        Isometry3::from_parts(Translation3::from(shift), rotation)
    };
    let fits = |pose: &Isometry3<f64>| {
        let seen: Option<Vec<Point2<f64>>> =
            corners_m.iter().map(|m| camera.px_from_board(pose, m)).collect();
        seen.is_some_and(|seen| {
            let (low, high) = bounds_px(seen.into_iter());
            let least = low.x.min(low.y).min(width - 1.0 - high.x).min(height - 1.0 - high.y);
            let fill = ((high.x - low.x) / width).max((high.y - low.y) / height);
            least >= margin_px && fill <= wanted.fill
        })
    };
    let frontal_m = board.target().length_m() * camera.f_px.x / (wanted.fill * width);
    let (mut near_m, mut far_m) = (0.5 * frontal_m, 3.0 * frontal_m);
    if !fits(&at(far_m)) {
        return None;
    }
    for _ in 0..STEPS {
        let middle_m = 0.5 * (near_m + far_m);
        if fits(&at(middle_m)) {
            far_m = middle_m;
        } else {
            near_m = middle_m;
        }
    }
    Some(at(far_m))
}

/// [`place`] in the believed camera, with the margin of all strategies for a hand's errors.
pub(super) fn pose(situation: &Situation<'_>, wanted: &Wanted) -> Option<Isometry3<f64>> {
    let lens = situation.lens_estimate;
    place((&lens.camera, lens.image_size), situation.board, wanted, planned_margin_px())
}

/// Random visible poses within limits.
pub(super) fn random(
    situation: &Situation<'_>,
    (tilt_rad, fill): ([f64; 2], [f64; 2]),
    count: usize,
    rng: &mut ChaCha8Rng,
) -> Vec<Isometry3<f64>> {
    let mut poses = Vec::with_capacity(count);
    for _ in 0..20 * count {
        if poses.len() == count {
            break;
        }
        let wanted = Wanted {
            slot_rad: rng.random_range(0.0..std::f64::consts::TAU),
            tilt_rad: rng.random_range(tilt_rad[0]..tilt_rad[1]),
            roll_rad: rng.random_range(-0.3..0.3),
            centre: [rng.random_range(0.2..0.8), rng.random_range(0.2..0.8)],
            fill: rng.random_range(fill[0]..fill[1]),
        };
        poses.extend(pose(situation, &wanted));
    }
    poses
}
