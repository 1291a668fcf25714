//! Poses to choose from.

use nalgebra::{Isometry3, Point2, Translation3, UnitQuaternion, Vector3};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::situation::Situation;
use crate::{
    geometry::Camera,
    guidance::{view::bounds_px, wanted_pose::tilted},
};

/// A pose in a person's terms.
#[derive(Clone, Copy, Debug)]
pub(super) struct Wanted {
    /// Direction in which the board recedes.
    pub(super) slot_rad: f64,
    pub(super) tilt_rad: f64,
    /// Turn of the board in its own plane.
    pub(super) roll_rad: f64,
    /// Where its centre is seen, as a share of the picture's width and height.
    pub(super) centre: [f64; 2],
    /// Share of the picture's width or height that the corners span.
    pub(super) fill: f64,
}

/// The pose; the board comes no nearer than the picture allows. `None` if it cannot be seen whole.
pub(super) fn pose(situation: &Situation<'_>, wanted: &Wanted) -> Option<Isometry3<f64>> {
    let camera = &situation.lens_estimate.camera;
    let size = situation.lens_estimate.image_size;
    let (width, height) = (f64::from(size.width_px), f64::from(size.height_px));
    let rotation = tilted(wanted.slot_rad, wanted.tilt_rad)
        * UnitQuaternion::from_axis_angle(&Vector3::z_axis(), wanted.roll_rad);
    let centre = Point2::new(wanted.centre[0] * width, wanted.centre[1] * height);
    let ray = camera.normalized_from_px(&centre)?;
    let board = situation.board;
    let span_m = board.columns().max(board.rows()) as f64 * board.square_m();
    let mut depth_m = span_m * camera.f_px.x / (wanted.fill * width);
    for _ in 0..12 {
        let at = Vector3::new(ray.x * depth_m, ray.y * depth_m, depth_m);
        let pose = Isometry3::from_parts(Translation3::from(at), rotation);
        match spans(situation, camera, &pose) {
            Some((inside, fill)) if inside && fill <= 1.02 * wanted.fill => return Some(pose),
            _ => depth_m *= 1.08,
        }
    }
    None
}

/// Whether all corners lie in the picture with room for a hand's errors, and the larger share they span.
fn spans(situation: &Situation<'_>, camera: &Camera, pose: &Isometry3<f64>) -> Option<(bool, f64)> {
    let size = situation.lens_estimate.image_size;
    let (width, height) = (f64::from(size.width_px), f64::from(size.height_px));
    let corners_m = situation.board.corners_in_board_m();
    let seen_px: Option<Vec<Point2<f64>>> =
        corners_m.iter().map(|m| camera.px_from_board(pose, m)).collect();
    let (low, high) = bounds_px(seen_px?.into_iter());
    let margin = 12.0;
    let inside =
        low.x >= margin && low.y >= margin && high.x <= width - margin && high.y <= height - margin;
    Some((inside, ((high.x - low.x) / width).max((high.y - low.y) / height)))
}

/// Random poses within these limits, all visible.
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
