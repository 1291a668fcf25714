//! Hand of the person: the pose reached, and the time needed.

use nalgebra::{Isometry3, Point2, UnitQuaternion, Vector3};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, UnitSphere};

use super::course::{IMAGE_SIZE, TrueLens};
use crate::params::Hand;
use boresight_geometry::{Camera, boards::Board};

/// Time from seeing a request to acting.
const REACTION_SECS: f64 = 0.4;
/// Speed of the board's centre.
const SPEED_M_PER_S: f64 = 0.5;
/// Speed of tilting, and of the slower rotation in the board's plane.
const TILT_RAD_PER_S: f64 = 60.0 * RAD_PER_DEG;
const TURN_RAD_PER_S: f64 = 45.0 * RAD_PER_DEG;
/// Aligning time per doubling of the distance (Fitts), and the distance and angle without aligning.
const ALIGN_SECS: f64 = 0.25;
const ALIGNED_PX: f64 = 20.0;
const ALIGNED_RAD: f64 = 4.0 * RAD_PER_DEG;
/// Factor of stepping back for a hand watching the screen, when a corner is cut.
const STEP_BACK: f64 = 1.05;
const RAD_PER_DEG: f64 = std::f64::consts::PI / 180.0;

/// Requested pose.
#[derive(Clone, Debug)]
pub(super) struct Wish {
    /// Pose of the board in the believed camera.
    pub(super) cam_from_board: Isometry3<f64>,
    /// Corners of the board in the believed camera.
    pub(super) ghost_px: Vec<Point2<f64>>,
}

/// Errors of a pose at the first try.
struct Errors {
    turn_rad: f64,
    lateral_px: f64,
    distance: f64,
}

/// Person with a board.
#[derive(Clone, Debug)]
pub(super) struct Person {
    kind: Hand,
    hold_secs: f64,
    pub(super) at: Isometry3<f64>,
    /// Time since the start.
    pub(super) secs: f64,
    /// Number of movements of the board.
    pub(super) tries: usize,
}

impl Person {
    /// Person holding the board up at 0.8 m, and keeping each pose for `hold_secs`.
    pub(super) fn new(kind: Hand, hold_secs: f64) -> Self {
        Self { kind, hold_secs, at: held_up(), secs: 0.0, tries: 0 }
    }

    /// Goal of the person for `wish`.
    pub(super) fn goal(&self, wish: &Wish, board: &Board, lens: &TrueLens) -> Isometry3<f64> {
        match self.kind {
            Hand::Metric => wish.cam_from_board,
            Hand::Screen | Hand::Clumsy => {
                lens.pose_showing(board, &wish.ghost_px).unwrap_or(wish.cam_from_board)
            }
        }
    }

    /// Moves the goal back after a corner was cut.
    pub(super) fn step_back(&self, goal: &mut Isometry3<f64>) {
        if self.kind != Hand::Metric {
            goal.translation.vector *= STEP_BACK;
        }
    }

    /// Brings the board to `goal` and holds; errors shrink with `care`.
    pub(super) fn bring(
        &mut self,
        goal: &Isometry3<f64>,
        lens: &TrueLens,
        believed: &Camera,
        care: f64,
        rng: &mut ChaCha8Rng,
    ) {
        let errors = self.errors();
        let f_px = match self.kind {
            Hand::Metric => believed.f_px.x,
            Hand::Screen | Hand::Clumsy => lens.camera().f_px.x,
        };
        let axis: [f64; 3] = UnitSphere.sample(rng);
        let mut even = |size: f64| rng.random_range(-1.0..1.0) * size * care;
        let turn = Vector3::from(axis) * even(errors.turn_rad);
        let depth_m = goal.translation.z;
        let lateral_m = errors.lateral_px / f_px * depth_m;
        let shift = Vector3::new(even(lateral_m), even(lateral_m), even(errors.distance * depth_m));
        let reached = Isometry3::from_parts(
            (goal.translation.vector + shift).into(),
            UnitQuaternion::from_scaled_axis(turn) * goal.rotation,
        );
        self.secs += moving_secs(&self.at, &reached, lens.camera().f_px.x) + self.hold_secs;
        self.at = reached;
        self.tries += 1;
    }

    fn errors(&self) -> Errors {
        match self.kind {
            Hand::Screen | Hand::Metric => {
                Errors { turn_rad: 4.0 * RAD_PER_DEG, lateral_px: 20.0, distance: 0.04 }
            }
            Hand::Clumsy => Errors {
                turn_rad: 10.0 * RAD_PER_DEG,
                lateral_px: 0.1 * f64::from(IMAGE_SIZE.width_px),
                distance: 0.15,
            },
        }
    }
}

/// Pose of the board before any request.
fn held_up() -> Isometry3<f64> {
    Isometry3::translation(0.0, 0.0, 0.8)
}

/// Minimum time in seconds for a hand that never misses to show `poses`, each held for `hold_secs`.
/// Tries all orders: for up to eight poses.
pub(super) fn least_secs(poses: &[Isometry3<f64>], hold_secs: f64, f_px: f64) -> f64 {
    fn rest(at: &Isometry3<f64>, left: &mut Vec<Isometry3<f64>>, f_px: f64) -> f64 {
        let mut least: Option<f64> = None;
        for index in 0..left.len() {
            let next = left.swap_remove(index);
            let secs = moving_secs(at, &next, f_px) + rest(&next, left, f_px);
            least = Some(least.map_or(secs, |least| least.min(secs)));
            left.push(next);
            let last = left.len() - 1;
            left.swap(index, last);
        }
        least.unwrap_or(0.0)
    }
    let held_secs = hold_secs * poses.len() as f64;
    held_secs + rest(&held_up(), &mut poses.to_vec(), f_px)
}

/// Seconds from a request to the arrival of the board:
///
/// ```text
/// 0.4 + max(L, A) + ½ min(L, A) + ¼ log₂(1 + d / 20 px) + ¼ log₂(1 + (τ + ρ) / 4°)
/// L = way / (0.5 m/s)      A = τ / (60°/s) + ρ / (45°/s)
/// ```
///
/// with `τ` the change of the board's normal, `ρ` the rotation in the board's plane, and `d` the
/// distance in the picture: moving and turning overlap by half, and aligning takes longer the
/// farther the board was off.
fn moving_secs(from: &Isometry3<f64>, to: &Isometry3<f64>, f_px: f64) -> f64 {
    let way_m = (to.translation.vector - from.translation.vector).norm();
    // A board looks the same from both ends, so half a turn in its plane is never needed.
    let relative = from.rotation.inverse() * to.rotation;
    let half_turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), std::f64::consts::PI);
    let relative = [relative, half_turn * relative]
        .into_iter()
        .min_by(|a, b| a.angle().total_cmp(&b.angle()))
        .unwrap_or(relative);
    let matrix = relative.to_rotation_matrix();
    let tilt_rad = matrix[(2, 2)].clamp(-1.0, 1.0).acos();
    let turn_rad = (matrix[(1, 0)] - matrix[(0, 1)]).atan2(matrix[(0, 0)] + matrix[(1, 1)]).abs();
    let (lift, turn) =
        (way_m / SPEED_M_PER_S, tilt_rad / TILT_RAD_PER_S + turn_rad / TURN_RAD_PER_S);
    let way_px = way_m / to.translation.z.max(1e-3) * f_px;
    REACTION_SECS
        + lift.max(turn)
        + 0.5 * lift.min(turn)
        + ALIGN_SECS * (1.0 + way_px / ALIGNED_PX).log2()
        + ALIGN_SECS * (1.0 + (tilt_rad + turn_rad) / ALIGNED_RAD).log2()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn aligning_and_turning_in_the_plane_cost_time() {
        let at = Isometry3::translation(0.0, 0.0, 0.5);
        let turned = |axis: Vector3<f64>| Isometry3::new(at.translation.vector, axis);
        let secs = |to: &Isometry3<f64>| moving_secs(&at, to, 1400.0);
        assert!((secs(&at) - REACTION_SECS).abs() < 1e-12);
        let angle = 45.0 * RAD_PER_DEG;
        let aligned = 0.25 * (1.0 + 45.0_f64 / 4.0).log2();
        assert!((secs(&turned(Vector3::x() * angle)) - (0.4 + 0.75 + aligned)).abs() < 1e-9);
        assert!((secs(&turned(Vector3::z() * angle)) - (0.4 + 1.0 + aligned)).abs() < 1e-9);
        // Upside down is the same view.
        let over = turned(Vector3::z() * std::f64::consts::PI);
        assert!((secs(&over) - REACTION_SECS).abs() < 1e-6);
        // The nearer pose comes first, in either order.
        let poses = [turned(Vector3::x() * angle), at];
        let both = moving_secs(&held_up(), &at, 1400.0) + secs(&poses[0]) + 2.0;
        assert!((least_secs(&poses, 1.0, 1400.0) - both).abs() < 1e-9);
        let aside = Isometry3::translation(0.1, 0.0, 0.5);
        let align = 0.25 * (1.0 + 0.1 / 0.5 * 1400.0 / 20.0_f64).log2();
        assert!((secs(&aside) - (0.4 + 0.2 + align)).abs() < 1e-9);
    }
}
