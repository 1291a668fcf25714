//! A simulated person who places a board where the fold asks for it, in front of real sessions.

use nalgebra::{Isometry3, Point2, Point3, UnitQuaternion, Vector2, Vector3};

use super::*;
use crate::{
    guidance::GuidanceParams,
    session::{Input, Observation, Session, SessionSetup},
};
use boresight_calibrate::CalibrationParams;
use boresight_detect::{Detection, Miss, Quality};
use boresight_geometry::{
    Camera, Corner, Distortion, Rig,
    boards::Board,
    fit_pose,
    frame::{CaptureTime, FrameId, FrameKind, ImageSize},
};

const SIZE: ImageSize = ImageSize { width_px: 1280, height_px: 720 };
const NOISE_PX: f64 = 0.05;
const FRAMES_PER_SEC: u64 = 30;
/// Frames of a move to another place, and frames that the person then waits there.
const MOVE_FRAMES: u64 = 30;

/// Cameras, their sessions, and a person with a board.
struct World {
    truth: Rig,
    board: Board,
    sessions: Vec<Session>,
    rig: RigSession,
    random: u64,
    frame: u64,
    from: Isometry3<f64>,
    to: Isometry3<f64>,
    /// Frame in which the person reached the place.
    arrived: u64,
    kept: Vec<Place>,
    forgotten: Vec<u64>,
    /// Amplitude of the hand's tremor, in metres; 0 for a board that leans on something.
    tremor_m: f64,
}

impl World {
    /// Cameras side by side.
    fn of(baselines_m: &[f64]) -> Self {
        let place = |x: &f64| Isometry3::new(Vector3::new(-x, 0.0, 0.0), Vector3::y() * (-0.4 * x));
        let start = Isometry3::translation(0.05, 0.0, 0.7);
        Self::at(baselines_m.iter().map(place).collect(), 0.025, start)
    }

    /// Cameras at the given places, and a board that a person has brought.
    fn at(cam_from_rig: Vec<Isometry3<f64>>, square_m: f64, start: Isometry3<f64>) -> Self {
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

    fn carry_out(&mut self, orders: Vec<Order>) {
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
        // The person reads the new request, and misses it a little.
        let to = self.asked_for();
        let turn = Vector3::from_fn(|_, _| 0.06 * self.uniform());
        let shift = Vector3::from_fn(|_, _| 0.02 * self.uniform());
        let missed = Isometry3::from_parts(shift.into(), UnitQuaternion::from_scaled_axis(turn));
        (self.from, self.to) = (self.to, to * missed);
        self.arrived = self.frame + MOVE_FRAMES;
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

    fn pose(&mut self) -> Isometry3<f64> {
        let left = self.arrived.saturating_sub(self.frame) as f64 / MOVE_FRAMES as f64;
        let share = 1.0 - left.min(1.0);
        let turn = (self.to.rotation * self.from.rotation.inverse()).scaled_axis();
        let at = self.from.translation.vector.lerp(&self.to.translation.vector, share);
        let secs = self.frame as f64 / FRAMES_PER_SEC as f64;
        let tremor = Vector3::new(self.tremor_m * (40.0 * secs).sin(), 0.0, 0.0);
        let rotation = UnitQuaternion::from_scaled_axis(turn * share) * self.from.rotation;
        Isometry3::from_parts((at + tremor).into(), rotation)
    }

    /// One frame of every camera.
    fn step(&mut self) {
        self.frame += 1;
        // Whoever hears that a camera doesn't see the board turns it to where both look.
        let seeing = self.rig.seeing();
        let all = 0..self.sessions.len();
        let two = match self.rig.prompt() {
            RigPrompt::Unseen { camera } => self.nearest(&seeing, &[camera]),
            RigPrompt::ShowToTwo => self.nearest(&seeing, &all.collect::<Vec<_>>()),
            RigPrompt::Link { linked } => {
                let (those, others): (Vec<_>, Vec<_>) = all.partition(|of| linked >> of & 1 == 1);
                self.nearest(&those, &others)
            }
            _ => None,
        };
        if let Some(two) = two
            && self.frame > self.arrived + FRAMES_PER_SEC
        {
            (self.from, self.to) = (self.to, self.between(two));
            self.arrived = self.frame + MOVE_FRAMES;
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

    fn run(&mut self, secs: u64) {
        let end = self.frame + secs * FRAMES_PER_SEC;
        while self.frame < end && !self.rig.is_complete() {
            self.step();
        }
    }

    fn secs(&self) -> u64 {
        self.frame / FRAMES_PER_SEC
    }
}

#[test]
fn whoever_shows_what_is_asked_for_has_a_calibrated_pair_in_a_minute() {
    let mut world = World::of(&[0.0, 0.12]);
    world.run(90);
    let (places, secs) = (world.kept.len(), world.secs());
    let plan = world.rig.plan().expect("places");
    let found = plan.found.as_ref().expect("a rig");
    assert!(world.rig.is_complete(), "{places} places in {secs} s: {:?}", found.findings);
    assert!(places <= 15 && secs <= 60, "{places} places, {secs} s");
    let sd_m = found.pairs[0].sd.expect("enough places").baseline_m;
    let off_m = found.rig.baseline_m(0, 1) - world.truth.baseline_m(0, 1);
    assert!(off_m.abs() < 3.0 * sd_m, "{off_m} {sd_m}");
    assert_eq!(world.rig.prompt(), RigPrompt::Complete);
}

/// Runs until the rig is complete, within `most_secs`; baselines are as stated.
fn is_calibrated_within(world: &mut World, most_secs: u64) {
    world.run(most_secs);
    let (places, secs) = (world.kept.len(), world.secs());
    let found = world.rig.plan().and_then(|plan| plan.found.clone().ok()).expect("a rig");
    assert!(world.rig.is_complete(), "{places} places in {secs} s: {:?}", found.findings);
    for (pair, sd) in found.pairs.iter().filter_map(|pair| Some((pair, pair.sd?))) {
        let [a, b] = pair.of;
        let off_m = found.rig.baseline_m(a, b) - world.truth.baseline_m(a, b);
        assert!(off_m.abs() < 3.0 * sd.baseline_m, "{a} {b}: {off_m} {}", sd.baseline_m);
    }
}

#[test]
fn four_cameras_in_the_corners_of_a_room_take_a_minute() {
    let corner = |quarter: u32| {
        let turn = std::f64::consts::FRAC_PI_2 * f64::from(quarter);
        let eye = Point3::new(2.0 * turn.sin(), -1.0, -2.0 * turn.cos());
        Isometry3::face_towards(&eye, &Point3::origin(), &Vector3::y()).inverse()
    };
    let start = Isometry3::rotation(Vector3::y() * -std::f64::consts::FRAC_PI_4);
    let mut world = World::at((0..4).map(corner).collect(), 0.08, start);
    is_calibrated_within(&mut world, 60);
}

#[test]
fn a_chain_whose_ends_share_nothing_is_linked_by_its_middle() {
    let link = |place: f64| {
        let rig_from_cam =
            Isometry3::new(Vector3::new(place, 0.0, 0.0), Vector3::y() * 0.3 * place);
        rig_from_cam.inverse()
    };
    let start = Isometry3::translation(0.0, 0.0, 1.5);
    let mut world = World::at([-1.0, 0.0, 1.0].map(link).into(), 0.08, start);
    is_calibrated_within(&mut world, 120);
}

#[test]
fn a_hand_that_trembles_is_asked_to_lean_the_board_and_nothing_is_taken() {
    let mut world = World { tremor_m: 0.5e-3, ..World::of(&[0.0, 0.12]) };
    world.run(20);
    assert_eq!((world.kept.len(), world.rig.prompt()), (0, RigPrompt::Rest));
    world.tremor_m = 0.0;
    world.run(5);
    assert!(!world.kept.is_empty());
}

#[test]
fn whoever_leaves_the_board_where_it_was_taken_hears_to_move_it() {
    let mut world = World::of(&[0.0, 0.12]);
    while world.kept.is_empty() && world.secs() < 30 {
        world.step();
    }
    let stays = world.pose();
    (world.from, world.to) = (stays, stays);
    world.run(3);
    assert_eq!(world.kept.len(), 1);
    let prompt = world.rig.prompt();
    let is_move = matches!(prompt, RigPrompt::OfCamera { .. } | RigPrompt::Elsewhere);
    assert!(is_move, "{prompt:?}");
}

#[test]
fn sessions_of_a_rig_take_nothing_by_themselves_and_undo_leaves_nothing() {
    let mut world = World::of(&[0.0, 0.12]);
    while world.kept.len() < 2 && world.secs() < 30 {
        world.step();
    }
    let views = |world: &World| {
        world.sessions.iter().map(|session| session.accepted().len()).collect::<Vec<_>>()
    };
    assert_eq!(views(&world), [2, 2]);
    let orders = world.rig.undo();
    world.carry_out(orders);
    assert_eq!((views(&world), world.forgotten.as_slice()), (vec![1, 1], &[2][..]));
    assert_eq!(world.rig.places().len(), 1);
}

#[test]
fn a_board_that_one_camera_sees_is_no_place() {
    let mut world = World::of(&[0.0, 0.12]);
    // Far to the left: only the first camera sees it.
    let left = Isometry3::translation(-0.38, 0.0, 0.75);
    (world.from, world.to) = (left, left);
    (world.frame, world.arrived) = (1, 80);
    for _ in 0..90 {
        world.step();
    }
    assert_eq!(world.kept.len(), 0);
    assert_eq!(world.rig.prompt(), RigPrompt::Unseen { camera: 1 });
}
