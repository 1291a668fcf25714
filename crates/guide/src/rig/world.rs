//! A simulated person who places a board where the fold asks for it, in front of real sessions: for
//! tests, and for `lab/examples/rig_people`.

use nalgebra::{Isometry3, Point2, Point3, UnitQuaternion, Vector2, Vector3};

use boresight_calibrate::CalibrationParams;
use boresight_detect::{Detection, Miss, Quality};
use boresight_geometry::{
    Camera, Corner, Distortion, Rig,
    boards::Board,
    fit_pose,
    frame::{CaptureTime, FrameId, FrameKind, ImageSize},
};
use boresight_guide::{
    guidance::GuidanceParams,
    rig::{Order, Place, RigPrompt, RigSession, plan},
    session::{Input, Observation, Session, SessionSetup},
};

const SIZE: ImageSize = ImageSize { width_px: 1280, height_px: 720 };
const NOISE_PX: f64 = 0.05;
const FRAMES_PER_SEC: u64 = 30;
/// Time in which a person reads a request, and speeds of the move to another place.
const READING_SECS: f64 = 1.0;
const SPEED_M_PER_SEC: f64 = 0.5;
const TURN_RAD_PER_SEC: f64 = 60.0 * std::f64::consts::PI / 180.0;

/// Cameras, their sessions, and a person with a board.
pub(crate) struct World {
    pub(crate) truth: Rig,
    pub(crate) board: Board,
    pub(crate) sessions: Vec<Session>,
    pub(crate) rig: RigSession,
    /// Seed of the person's misses and of the corners' noise.
    pub(crate) random: u64,
    pub(crate) frame: u64,
    pub(crate) from: Isometry3<f64>,
    pub(crate) to: Isometry3<f64>,
    /// Frames of the move to the place.
    pub(crate) way_frames: u64,
    /// Frame in which the person reached the place.
    pub(crate) arrived: u64,
    pub(crate) kept: Vec<Place>,
    pub(crate) forgotten: Vec<u64>,
    /// Amplitude of the hand's tremor, in metres; 0 for a board that leans on something.
    pub(crate) tremor_m: f64,
}

impl World {
    /// Cameras side by side.
    pub(crate) fn of(baselines_m: &[f64]) -> Self {
        Self::at(Self::places(baselines_m), 0.025, Isometry3::translation(0.05, 0.0, 0.7))
    }

    /// Places of cameras side by side.
    pub(crate) fn places(baselines_m: &[f64]) -> Vec<Isometry3<f64>> {
        let place = |x: &f64| Isometry3::new(Vector3::new(-x, 0.0, 0.0), Vector3::y() * (-0.4 * x));
        baselines_m.iter().map(place).collect()
    }

    /// Four cameras in the corners of a room, which look at its middle.
    pub(crate) fn in_corners() -> Self {
        let corner = |quarter: u32| {
            let turn = std::f64::consts::FRAC_PI_2 * f64::from(quarter);
            let (sin, cos) = libm::sincos(turn);
            let eye = Point3::new(2.0 * sin, -1.0, -2.0 * cos);
            Isometry3::face_towards(&eye, &Point3::origin(), &Vector3::y()).inverse()
        };
        let start = Isometry3::rotation(Vector3::y() * -std::f64::consts::FRAC_PI_4);
        Self::at((0..4).map(corner).collect(), 0.08, start)
    }

    /// Three cameras of which the outer ones see no common place.
    pub(crate) fn in_a_chain() -> Self {
        let link = |place: f64| {
            let rig_from_cam =
                Isometry3::new(Vector3::new(place, 0.0, 0.0), Vector3::y() * 0.3 * place);
            rig_from_cam.inverse()
        };
        let start = Isometry3::translation(0.0, 0.0, 1.5);
        Self::at([-1.0, 0.0, 1.0].map(link).into(), 0.08, start)
    }

    /// Cameras at the given places, and a board that a person has brought.
    pub(crate) fn at(
        cam_from_rig: Vec<Isometry3<f64>>,
        square_m: f64,
        start: Isometry3<f64>,
    ) -> Self {
        let board = Board::new(9, 6, square_m).expect("a board");
        let lens = |f_px: f64| Camera {
            distortion: Distortion { k1: -0.08, ..Distortion::default() },
            ..Camera::pinhole(f_px, Point2::new(645.0, 352.0))
        };
        let truth = Rig {
            cameras: (0..cam_from_rig.len()).map(|i| lens(900.0 + 20.0 * i as f64)).collect(),
            cam_from_rig,
        };
        let setup = || SessionSetup {
            board,
            image_size: SIZE,
            guidance: GuidanceParams::default(),
            calibration: CalibrationParams::default(),
        };
        let sessions = truth.cameras.iter().map(|_| Session::new(setup())).collect();
        let cameras = truth.cameras.iter().map(|_| (SIZE, None)).collect::<Vec<_>>();
        let mut world = Self {
            truth,
            board,
            sessions,
            rig: RigSession::new(board, cameras, Vec::new(), false),
            random: 7,
            frame: 0,
            from: start,
            to: start,
            way_frames: 1,
            arrived: 0,
            kept: Vec::new(),
            forgotten: Vec::new(),
            tremor_m: 0.0,
        };
        world.plan();
        world
    }

    /// Uniform in (-1, 1), by a linear congruential generator (Knuth's MMIX).
    fn uniform(&mut self) -> f64 {
        let state = self.random.wrapping_mul(6_364_136_223_846_793_005);
        self.random = state.wrapping_add(1_442_695_040_888_963_407);
        ((self.random >> 11) as f64 + 0.5) / (1_u64 << 52) as f64 - 1.0
    }

    pub(crate) fn carry_out(&mut self, orders: Vec<Order>) {
        for order in orders {
            match order {
                Order::Give { camera, input } => {
                    let decision = self.sessions[camera].handle(&input);
                    let snapshot = self.sessions[camera].snapshot(decision);
                    let orders = self.rig.seen(camera, &snapshot);
                    self.carry_out(orders);
                }
                Order::Keep(place) => {
                    self.kept.push(place);
                    self.plan();
                }
                Order::Forget(number) => {
                    self.forgotten.push(number);
                    self.plan();
                }
            }
        }
    }

    fn plan(&mut self) {
        let views = self.rig.views();
        let places = self.rig.places().len();
        let orders =
            self.rig.planned(plan(places, &views, &self.board, &CalibrationParams::default()));
        self.carry_out(orders);
        self.try_what_is_asked_for();
    }

    /// Reads the request, and misses it a little.
    fn try_what_is_asked_for(&mut self) {
        let to = self.asked_for();
        let turn = Vector3::from_fn(|_, _| 0.06 * self.uniform());
        let shift = Vector3::from_fn(|_, _| 0.02 * self.uniform());
        let missed = Isometry3::from_parts(shift.into(), UnitQuaternion::from_scaled_axis(turn));
        self.go(to * missed);
    }

    /// Starts to move the board.
    fn go(&mut self, to: Isometry3<f64>) {
        (self.from, self.to) = (self.to, to);
        let way_m = (self.to.translation.vector - self.from.translation.vector).norm();
        let turn_rad = self.to.rotation.angle_to(&self.from.rotation);
        let secs = (way_m / SPEED_M_PER_SEC).max(turn_rad / TURN_RAD_PER_SEC);
        self.way_frames = (secs * FRAMES_PER_SEC as f64).ceil().max(1.0) as u64;
        let reading_frames = (READING_SECS * FRAMES_PER_SEC as f64) as u64;
        self.arrived = self.frame + reading_frames + self.way_frames;
    }

    /// Place in the true rig of what the lead's picture shows.
    fn asked_for(&self) -> Isometry3<f64> {
        let lead = self.rig.plan().and_then(|plan| plan.wanted.as_ref()).map_or(0, |it| it.lead);
        let target = self.sessions[lead].target().expect("a request");
        let ghost: Vec<Corner> =
            target.ghost_px.iter().map(|px| Corner::isotropic(*px, 1.0)).collect();
        let points_m = self.board.corners_in_board_m();
        let pose = fit_pose(&self.truth.cameras[lead], &points_m, &ghost);
        let pose = pose.expect("a pose");
        self.truth.cam_from_rig[lead].inverse() * pose.cam_from_board
    }

    /// The two cameras, one of each list, that are nearest to each other.
    fn nearest(&self, ones: &[usize], others: &[usize]) -> Option<[usize; 2]> {
        let with = |one: &usize| others.iter().map(|other| [*one, *other]).collect::<Vec<_>>();
        let pairs = ones.iter().flat_map(with).filter(|[a, b]| a != b);
        let apart_m = |[a, b]: &[usize; 2]| self.truth.baseline_m(*a, *b);
        pairs.min_by(|a, b| apart_m(a).total_cmp(&apart_m(b)))
    }

    /// Board farther away than now, where both cameras look, and facing both.
    fn between(&self, of: [usize; 2]) -> Isometry3<f64> {
        let rig_from_cam = of.map(|camera| self.truth.cam_from_rig[camera].inverse());
        let eyes = rig_from_cam.map(|pose| pose.translation.vector);
        let far_m = 1.3 * (self.to.translation.vector - eyes[0]).norm();
        let ahead = rig_from_cam.map(|pose| (pose * Point3::new(0.0, 0.0, far_m)).coords);
        let at = 0.5 * (ahead[0] + ahead[1]);
        let away = (at - eyes[0]).normalize() + (at - eyes[1]).normalize();
        Isometry3::face_towards(&at.into(), &(at + away).into(), &Vector3::y())
    }

    pub(crate) fn pose(&mut self) -> Isometry3<f64> {
        let left = self.arrived.saturating_sub(self.frame) as f64 / self.way_frames as f64;
        let share = 1.0 - left.min(1.0);
        let turn = (self.to.rotation * self.from.rotation.inverse()).scaled_axis();
        let at = self.from.translation.vector.lerp(&self.to.translation.vector, share);
        let secs = self.frame as f64 / FRAMES_PER_SEC as f64;
        let tremor = Vector3::new(self.tremor_m * libm::sin(40.0 * secs), 0.0, 0.0);
        let rotation = UnitQuaternion::from_scaled_axis(turn * share) * self.from.rotation;
        Isometry3::from_parts((at + tremor).into(), rotation)
    }

    /// Follows a request at the place where the board has arrived: whoever hears that a camera
    /// doesn't see the board turns it to where both look.
    fn obey(&mut self) {
        let seeing = self.rig.seeing();
        let all = 0..self.sessions.len();
        let two = match self.rig.prompt() {
            RigPrompt::Unseen { camera } => self.nearest(&seeing, &[camera]),
            RigPrompt::ShowToTwo => self.nearest(&seeing, &all.collect::<Vec<_>>()),
            RigPrompt::Link { linked } => {
                let (those, others): (Vec<_>, Vec<_>) = all.partition(|of| linked >> of & 1 == 1);
                self.nearest(&those, &others)
            }
            RigPrompt::OfCamera { .. } | RigPrompt::Elsewhere => {
                return self.try_what_is_asked_for();
            }
            _ => None,
        };
        if let Some(two) = two {
            self.go(self.between(two));
        }
    }

    /// One frame of every camera.
    pub(crate) fn step(&mut self) {
        self.frame += 1;
        if self.frame > self.arrived + FRAMES_PER_SEC {
            self.obey();
        }
        let place = self.pose();
        for camera in 0..self.sessions.len() {
            let points_m = self.board.corners_in_board_m();
            let pose = self.truth.cam_from_rig[camera] * place;
            let is_front = (pose * Vector3::z()).dot(&pose.translation.vector) > 0.0;
            let px: Option<Vec<Point2<f64>>> = points_m
                .iter()
                .map(|point| self.truth.cameras[camera].px_from_board(&pose, point))
                .map(|px| px.filter(|px| is_front && SIZE.contains(px)))
                .collect();
            let mut noisy = |px: Point2<f64>| {
                let mut error = || NOISE_PX * 3.0_f64.sqrt() * self.uniform();
                Corner::isotropic(px + Vector2::new(error(), error()), NOISE_PX)
            };
            let quality = Quality { blur_px: 0.8, contrast: 80.0, glare: 0.0, motion_px: 0.0 };
            let corners = px.map(|px| px.into_iter().map(&mut noisy).collect());
            let seen = corners.map(|corners| Detection { corners, quality }).ok_or(Miss::NoBoard);
            let observation = Observation {
                frame_id: FrameId(self.frame),
                captured_at: CaptureTime { nanos: self.frame * 1_000_000_000 / FRAMES_PER_SEC },
                kind: FrameKind::Video,
                name: String::new(),
                image_size: SIZE,
                seen,
            };
            let input = Input::Observed(observation);
            self.carry_out(vec![Order::Give { camera, input }]);
        }
    }

    pub(crate) fn run(&mut self, secs: u64) {
        let end = self.frame + secs * FRAMES_PER_SEC;
        while self.frame < end && !self.rig.is_complete() {
            self.step();
        }
    }

    pub(crate) fn secs(&self) -> u64 {
        self.frame / FRAMES_PER_SEC
    }
}
