//! A simulated person who reads the guidance and moves the board, with a person's delay and error.

use std::collections::VecDeque;

use nalgebra::{
    DMatrix, Isometry3, Matrix3, Matrix6, Point2, Rotation3, Translation3, UnitQuaternion, Vector2,
    Vector3, Vector6,
};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::UnitSphere;

pub use super::technician_params::TechnicianParams;
use super::{rng_stream::RngStream, scene::Scene};
use crate::{frame::CaptureTime, geometry::Camera};

/// A cue for the person.
#[derive(Clone, Debug, PartialEq)]
pub struct Cue {
    /// Capture time of the frame that caused it.
    pub seen_at: CaptureTime,
    /// What it says.
    pub kind: CueKind,
}

/// What a [`Cue`] says.
#[derive(Clone, Debug, PartialEq)]
pub enum CueKind {
    /// Bring the board onto the ghost drawn in the picture.
    Show {
        /// Wanted image positions of all inner corners, in numbering order.
        ghost_px: Vec<Point2<f64>>,
        /// Changes when the wanted pose changes.
        target: u64,
    },
    /// Keep the board where it is.
    HoldStill,
    /// The view has been taken.
    Taken,
    /// Nothing more is wanted.
    Finished,
}

/// The person. See [`Self::pose_at`].
#[derive(Clone, Debug)]
pub struct Technician {
    params: TechnicianParams,
    camera: Camera,
    corners_in_board_m: Vec<Point2<f64>>,
    /// How far down the board must go to be out of view, relative to its distance; and by its size.
    out_of_view: (f64, f64),
    rng: ChaCha8Rng,
    tremor: Tremor,
    now: CaptureTime,
    /// Cues read, with the time at which they are acted on.
    pending: VecDeque<(CaptureTime, CueKind)>,
    /// Number of the target last read, acted on or not.
    target: Option<u64>,
    wanted: Option<Isometry3<f64>>,
    /// Size of the next attempt's error relative to the first's.
    error_scale: f64,
    /// When to correct the pose, unless something happens before.
    correct_at: Option<CaptureTime>,
    still: bool,
    motion: Motion,
}

/// A smooth way from one pose to another.
#[derive(Clone, Copy, Debug)]
struct Motion {
    from: Isometry3<f64>,
    to: Isometry3<f64>,
    start: CaptureTime,
    duration_secs: f64,
}

impl Technician {
    /// A person holding the scene's board up, roughly frontal, somewhere near the middle.
    pub fn new(scene: &Scene) -> Self {
        let params = scene.technician;
        let mut rng = RngStream::Technician.rng(scene.seed);
        let board = &scene.board;
        let width_m = (board.columns() - 1) as f64 * board.square_m();
        let (picture_width_px, picture_height_px) =
            (f64::from(scene.image_size.width_px), f64::from(scene.image_size.height_px));
        let start_px = (params.start_width * picture_width_px).max(1.0);
        let distance_m = scene.camera.f_px.x * width_m / start_px;
        let centre_px = scene.image_size.centre_px()
            + 0.05
                * picture_width_px
                * Vector2::new(rng.random_range(-1.0..1.0), rng.random_range(-0.5..0.5));
        let ray = (centre_px - scene.camera.pp_px).component_div(&scene.camera.f_px);
        let start = Isometry3::from_parts(
            Translation3::new(ray.x * distance_m, ray.y * distance_m, distance_m),
            UnitQuaternion::from_scaled_axis(
                0.1 * Vector3::from_fn(|_, _| rng.random_range(-1.0..1.0_f64)),
            ),
        );
        let size_m = (board.columns() + board.rows() + 4) as f64 * board.square_m();
        Self {
            params,
            camera: scene.camera,
            corners_in_board_m: board.corners_in_board_m(),
            out_of_view: (1.5 * picture_height_px / scene.camera.f_px.y, size_m),
            tremor: Tremor::new(&mut rng, &params),
            rng,
            now: CaptureTime { nanos: 0 },
            pending: VecDeque::new(),
            target: None,
            wanted: None,
            error_scale: 1.0,
            correct_at: None,
            still: false,
            motion: Motion::rest(start, CaptureTime { nanos: 0 }),
        }
    }

    /// Tells the person something. Repeating what the person knows changes nothing.
    pub fn read(&mut self, cue: Cue) {
        if let CueKind::Show { target, .. } = &cue.kind {
            if self.target == Some(*target) {
                return;
            }
            self.target = Some(*target);
        }
        let due = after(cue.seen_at, self.params.reaction_secs);
        self.pending.push_back((due, cue.kind));
    }

    /// Where the board is at `time`, which must not go back; an earlier time counts as the latest.
    pub fn pose_at(&mut self, time: CaptureTime) -> Isometry3<f64> {
        let time = time.max(self.now);
        loop {
            let cue_due = self.pending.front().map(|(due, _)| (*due).max(self.now));
            let due = match (cue_due, self.correct_at) {
                (Some(cue), Some(correction)) => cue.min(correction),
                (Some(due), None) | (None, Some(due)) => due,
                (None, None) => break,
            };
            if due > time {
                break;
            }
            self.now = due;
            if cue_due == Some(due) {
                if let Some((_, cue)) = self.pending.pop_front() {
                    self.act_on(&cue);
                }
            } else {
                self.error_scale *= self.params.correction;
                self.attempt();
            }
        }
        self.now = time;
        self.tremor.applied(&self.motion.pose_at(time), time)
    }

    fn act_on(&mut self, cue: &CueKind) {
        match cue {
            CueKind::Show { ghost_px, .. } => {
                let wanted = pose_onto(&self.camera, &self.corners_in_board_m, ghost_px);
                if let Some(wanted) = wanted {
                    self.wanted = Some(wanted);
                    self.error_scale = 1.0;
                    self.attempt();
                }
            }
            CueKind::HoldStill => {
                if !self.still {
                    self.motion = Motion::rest(self.motion.pose_at(self.now), self.now);
                    self.correct_at =
                        self.wanted.map(|_| after(self.now, self.params.patience_secs));
                    self.still = true;
                }
            }
            CueKind::Taken => self.correct_at = None,
            CueKind::Finished => {
                let from = self.motion.pose_at(self.now);
                let (by_distance, by_size) = self.out_of_view;
                let down_m = by_distance * from.translation.z + by_size;
                let lowered = Translation3::new(0.0, down_m, 0.0) * from;
                self.move_to(lowered);
                (self.wanted, self.correct_at) = (None, None);
            }
        }
    }

    /// Moves to the wanted pose, missing it by as much as the person misses it this time.
    fn attempt(&mut self) {
        let Some(wanted) = self.wanted else {
            self.correct_at = None;
            return;
        };
        let params = self.params;
        let size = |rng: &mut ChaCha8Rng| rng.random_range(0.3..1.0_f64);
        let axis = Vector3::from(self.rng.sample::<[f64; 3], _>(UnitSphere));
        let turn_rad = self.error_scale * params.rotation_error_rad * size(&mut self.rng);
        let direction_rad = self.rng.random_range(0.0..std::f64::consts::TAU);
        let lateral_px = self.error_scale * params.lateral_error_px * size(&mut self.rng);
        let farther =
            self.error_scale * params.distance_error * self.rng.random_range(-1.0..1.0_f64);
        let at = wanted.translation.vector;
        let lateral = Vector2::new(direction_rad.cos(), direction_rad.sin()) * lateral_px * at.z;
        let lateral_m = lateral.component_div(&self.camera.f_px);
        let missed = Isometry3::from_parts(
            ((at + Vector3::new(lateral_m.x, lateral_m.y, 0.0)) * (1.0 + farther)).into(),
            UnitQuaternion::from_scaled_axis(axis * turn_rad) * wanted.rotation,
        );
        let arrival = self.move_to(missed);
        self.correct_at = Some(after(arrival, params.patience_secs));
    }

    /// Starts moving now. Returns the time of arrival.
    fn move_to(&mut self, to: Isometry3<f64>) -> CaptureTime {
        self.still = false;
        self.motion = Motion::new(self.motion.pose_at(self.now), to, self.now, &self.params);
        after(self.now, self.motion.duration_secs)
    }
}

impl Motion {
    fn rest(pose: Isometry3<f64>, start: CaptureTime) -> Self {
        Self { from: pose, to: pose, start, duration_secs: 0.0 }
    }

    fn new(
        from: Isometry3<f64>,
        to: Isometry3<f64>,
        start: CaptureTime,
        params: &TechnicianParams,
    ) -> Self {
        // Top speed of a minimum-jerk movement relative to its mean speed.
        let top = 15.0 / 8.0;
        let way_m = (to.translation.vector - from.translation.vector).norm();
        let turn_rad = from.rotation.angle_to(&to.rotation);
        let duration_secs = (top * way_m / params.max_speed_m_per_s)
            .max(top * turn_rad / params.max_turn_rad_per_s)
            .max(0.1);
        Self { from, to, start, duration_secs }
    }

    /// Minimum jerk, `s³ (10 - 15 s + 6 s²)`, as hands move (Flash and Hogan, 1985).
    fn pose_at(&self, time: CaptureTime) -> Isometry3<f64> {
        let elapsed_secs = time.secs_since(self.start);
        if elapsed_secs >= self.duration_secs {
            return self.to;
        }
        let s = (elapsed_secs / self.duration_secs).clamp(0.0, 1.0);
        let share = s.powi(3) * (10.0 + s * (6.0 * s - 15.0));
        let turn = (self.to.rotation * self.from.rotation.inverse()).scaled_axis();
        Isometry3::from_parts(
            self.from.translation.vector.lerp(&self.to.translation.vector, share).into(),
            UnitQuaternion::from_scaled_axis(share * turn) * self.from.rotation,
        )
    }
}

/// Slow shaking in all six degrees of freedom: two incommensurate sines each.
#[derive(Clone, Copy, Debug)]
struct Tremor {
    amplitude: Vector6<f64>,
    rad_per_s: [Vector6<f64>; 2],
    phase_rad: [Vector6<f64>; 2],
}

impl Tremor {
    fn new(rng: &mut ChaCha8Rng, params: &TechnicianParams) -> Self {
        let mut draw = |low: f64, high: f64| {
            Vector6::from_fn(|_, _| std::f64::consts::TAU * rng.random_range(low..high))
        };
        let (m, rad) = (params.tremor_m, params.tremor_rad);
        Self {
            amplitude: Vector6::new(rad, rad, rad, m, m, m),
            rad_per_s: [draw(0.3, 0.9), draw(1.2, 3.0)],
            phase_rad: [draw(0.0, 1.0), draw(0.0, 1.0)],
        }
    }

    fn applied(&self, pose: &Isometry3<f64>, time: CaptureTime) -> Isometry3<f64> {
        let secs = time.nanos as f64 * 1e-9;
        let shake = Vector6::from_fn(|i, _| {
            let swing =
                |part: usize| (self.rad_per_s[part][i] * secs + self.phase_rad[part][i]).sin();
            self.amplitude[i] * (0.7 * swing(0) + 0.3 * swing(1))
        });
        Camera::moved(
            pose,
            &shake.fixed_rows::<3>(0).into_owned(),
            &shake.fixed_rows::<3>(3).into_owned(),
        )
    }
}

/// The pose that brings the board's corners onto `ghost_px`, in the least-squares sense.
///
/// Starts from the homography of the undistorted ghost and refines in pixels through the lens.
/// `None` if fewer than four corners have a ray or they do not look like a board.
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
    // Board coordinates of the size of image coordinates keep the system well conditioned.
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

fn after(time: CaptureTime, secs: f64) -> CaptureTime {
    CaptureTime { nanos: time.nanos.saturating_add((secs.max(0.0) * 1e9).round() as u64) }
}
