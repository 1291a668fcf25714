//! A simulated person and camera without pictures: corners are projected, truth is known.
//!
//! The person brings the board to the ghost with errors of 4° and 20 px, holds it, and tries again
//! if the view is not taken. Corners beyond the picture's edge aren't seen; the others are, while
//! the board is tracked from frame to frame.

use boresight_calibrate::CalibrationParams;
use boresight_detect::{Detection, Miss, Quality, Side};
use boresight_geometry::{
    Camera, Corner, Distortion,
    boards::Board,
    fit_pose,
    frame::{CaptureTime, FrameId, FrameKind, ImageSize},
};
use boresight_guide::{
    guidance::{GuidanceParams, Progress, Target},
    session::{Decision, Input, Observation, Outcome, Session, SessionSetup},
};
use nalgebra::{Isometry3, Point2, Point3, UnitQuaternion, Vector2, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal, UnitSphere};

/// Size of every picture.
pub const SIZE: ImageSize = ImageSize { width_px: 1280, height_px: 720 };
const NOISE_PX: f64 = 0.05;

/// A camera, a board, and a person with unsteady hands.
pub struct World {
    /// True camera.
    pub camera: Camera,
    /// The held board.
    pub board: Board,
    /// Standard deviation of a corner, per coordinate.
    pub noise_px: f64,
    /// Height of the board's middle above the left and right end.
    pub bent_by_m: f64,
    /// Relative standard deviation of the focal length, drawn for each pose.
    pub focus_sd: f64,
    /// Time from picture to picture.
    pub step_nanos: u64,
    /// Mean of the focal length.
    still_f_px: Vector2<f64>,
    rng: ChaCha8Rng,
    time_nanos: u64,
    frame: u64,
    is_followed: bool,
}

/// Frame interval beyond tracking: the board moves too far.
const NOT_FOLLOWED_NANOS: u64 = 120_000_000;
/// Minimum share of the board's corners to detect a part.
const LEAST_SEEN: f64 = 0.4;

impl World {
    /// World number `seed`: another camera for each, the same board.
    pub fn new(seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let k1 = rng.random_range(-0.35..0.1);
        let k2 = if k1 < 0.0 { -0.4 * k1 } else { 0.0 };
        let f_px = rng.random_range(900.0..1400.0);
        let (angle, radius): (f64, f64) =
            (rng.random_range(0.0..std::f64::consts::TAU), rng.random_range(0.0..60.0));
        let camera = Camera {
            f_px: Vector2::new(f_px, f_px),
            pp_px: SIZE.centre_px() + Vector2::new(angle.cos(), angle.sin()) * radius,
            distortion: Distortion { k1, k2, ..Distortion::default() },
        };
        let board = Board::new(9, 6, 0.025).expect("valid");
        Self {
            still_f_px: camera.f_px,
            camera,
            board,
            noise_px: NOISE_PX,
            bent_by_m: 0.0,
            focus_sd: 0.0,
            step_nanos: 33_000_000,
            rng,
            time_nanos: 0,
            frame: 0,
            is_followed: false,
        }
    }

    fn normal(&mut self, sigma: f64) -> f64 {
        Normal::new(0.0, sigma).expect("valid").sample(&mut self.rng)
    }

    /// Brings the board to the ghost, with the errors of a hand; `care` shrinks them.
    pub fn pose_for(&mut self, ghost_px: &[Point2<f64>], care: f64) -> Option<Isometry3<f64>> {
        if self.focus_sd > 0.0 {
            self.camera.f_px = self.still_f_px * (1.0 + self.normal(self.focus_sd));
        }
        let corners: Vec<Corner> = ghost_px.iter().map(|px| Corner::isotropic(*px, 1.0)).collect();
        let pose =
            fit_pose(&self.camera, &self.board.corners_in_board_m(), &corners).ok()?.cam_from_board;
        let axis: [f64; 3] = UnitSphere.sample(&mut self.rng);
        let turn = Vector3::from(axis) * self.normal(4_f64.to_radians() * care);
        let depth = pose.translation.z;
        let lateral = 20.0 * care / self.camera.f_px.x * depth;
        let shift = Vector3::new(
            self.normal(lateral),
            self.normal(lateral),
            self.normal(0.03 * depth * care),
        );
        Some(Isometry3::from_parts(
            (pose.translation.vector + shift).into(),
            UnitQuaternion::from_scaled_axis(turn) * pose.rotation,
        ))
    }

    /// The whole board, if a part is wanted next and not tracked: the start of a person.
    pub fn whole_first(&mut self, target: &Target) -> Option<Observation> {
        let depth_m = 16.0 * self.board.square_m() * self.camera.f_px.x / f64::from(SIZE.width_px);
        let whole = Isometry3::translation(0.0, 0.0, depth_m);
        (target.leaves_picture && !self.is_followed).then(|| self.observe(&whole))
    }

    /// Next frame, with the board at `pose`.
    pub fn observe(&mut self, pose: &Isometry3<f64>) -> Observation {
        self.frame += 1;
        self.time_nanos += self.step_nanos;
        let half_m = 0.5 * (self.board.columns() - 1) as f64 * self.board.square_m();
        let corners: Vec<Corner> = self
            .board
            .corners_in_board_m()
            .iter()
            .map(|point| {
                let height_m = self.bent_by_m * (1.0 - (point.x / half_m).powi(2));
                let point = pose.transform_point(&Point3::new(point.x, point.y, height_m));
                let Some(px) = self.camera.project(&point) else {
                    return Corner::unseen(Point2::new(f64::NAN, f64::NAN));
                };
                let noise = Vector2::new(self.normal(self.noise_px), self.normal(self.noise_px));
                let px = px + noise;
                let inside = px.x > 4.0 && px.y > 4.0 && px.x < 1275.0 && px.y < 715.0;
                if inside { Corner::isotropic(px, self.noise_px) } else { Corner::unseen(px) }
            })
            .collect();
        let (wanted, found) = (corners.len(), corners.iter().filter(|c| c.is_seen()).count());
        let is_told =
            found == wanted || (self.is_followed && found as f64 >= LEAST_SEEN * wanted as f64);
        self.is_followed = is_told && self.step_nanos < NOT_FOLLOWED_NANOS;
        let quality = Quality { blur_px: 0.8, contrast: 80.0, glare: 0.0, motion_px: 0.0 };
        Observation {
            frame_id: FrameId(self.frame),
            captured_at: CaptureTime { nanos: self.time_nanos },
            kind: FrameKind::Video,
            name: String::new(),
            image_size: SIZE,
            seen: if is_told {
                Ok(Detection { corners, quality })
            } else if found > 0 {
                Err(Miss::PartialBoard {
                    found,
                    wanted,
                    size: [0; 2],
                    cut_off_by: Some(Side::Left),
                })
            } else {
                Err(Miss::NoBoard)
            },
        }
    }
}

/// The usual settings of a session with `board`.
pub fn setup(board: Board) -> SessionSetup {
    SessionSetup {
        board,
        image_size: SIZE,
        guidance: GuidanceParams::default(),
        calibration: CalibrationParams::default(),
    }
}

/// Runs a session to the end and passes every input to `seen`. Also returns the number of attempts
/// at a pose.
pub fn guided(seed: u64, seen: impl FnMut(&Input, &Decision)) -> (World, Session, usize) {
    guided_with(seed, CalibrationParams::default(), seen)
}

/// Runs a session with other settings of the solver.
pub fn guided_with(
    seed: u64,
    calibration: CalibrationParams,
    seen: impl FnMut(&Input, &Decision),
) -> (World, Session, usize) {
    guided_in(World::new(seed), calibration, seen)
}

/// Runs a session in the given world.
pub fn guided_in(
    world: World,
    calibration: CalibrationParams,
    seen: impl FnMut(&Input, &Decision),
) -> (World, Session, usize) {
    let session = Session::new(SessionSetup { calibration, ..setup(world.board) });
    guided_from(world, session, seen)
}

/// Continues the given session.
pub fn guided_from(
    mut world: World,
    mut session: Session,
    mut seen: impl FnMut(&Input, &Decision),
) -> (World, Session, usize) {
    let mut attempts = 0;
    while session.progress() == Progress::Collecting && attempts < 120 {
        let accepted = session.accepted().len();
        for try_number in 0..6 {
            attempts += 1;
            // A ghost may be drawn again on the way.
            let Some(target) = session.target().cloned() else { break };
            let Some(pose) = world.pose_for(&target.ghost_px, 0.7_f64.powi(try_number)) else {
                continue;
            };
            if let Some(whole) = world.whole_first(&target) {
                let input = Input::Observed(whole);
                let decision = session.handle(&input);
                seen(&input, &decision);
            }
            for _ in 0..24 {
                let input = Input::Observed(world.observe(&pose));
                let decision = session.handle(&input);
                seen(&input, &decision);
                if matches!(decision.outcome, Outcome::Accepted { .. }) {
                    break;
                }
            }
            if session.accepted().len() > accepted {
                break;
            }
        }
    }
    (world, session, attempts)
}
