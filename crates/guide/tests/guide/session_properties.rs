//! Properties of a session after any sequence of inputs.

use std::collections::BTreeMap;

use boresight_calibrate::CalibrationParams;
use boresight_detect::{Detection, Miss, Quality};
use boresight_geometry::{
    Camera, Corner, Distortion,
    boards::Board,
    device::{CameraEvent, Control, ControlChange, Fault, Lock, Mode, PixelLayout},
    fit_pose,
    frame::{CaptureTime, FrameId, FrameKind, ImageSize},
};
use boresight_guide::{
    guidance::{GuidanceParams, Role},
    session::{
        Command, Decision, Input, Observation, Outcome, Session, SessionSetup, ViewNumber,
        ViewSummary,
    },
};
use boresight_run::recording::{Line, Replayed, replay};
use nalgebra::{Isometry3, Point2, UnitQuaternion, Vector2, Vector3};
use proptest::{prelude::*, sample::Index};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};

const SIZE: ImageSize = ImageSize { width_px: 1280, height_px: 720 };
const MODE: Mode = Mode { size: SIZE, layout: PixelLayout::Mjpeg, interval_secs: Some((1, 30)) };
const NOISE_PX: f64 = 0.05;

/// Next event; its meaning depends on the session.
#[derive(Clone, Debug)]
enum Happening {
    /// The board at the target, turned and shifted by some errors of a hand.
    Target {
        turn_rad: [f64; 3],
        shift: [f64; 2],
        kind: FrameKind,
    },
    /// The board anywhere: azimuth and tilt in radians, place as shares of the picture, distance in
    /// metres.
    Anywhere {
        azimuth_rad: f64,
        tilt_rad: f64,
        place: [f64; 2],
        distance_m: f64,
        kind: FrameKind,
    },
    NoBoard,
    OtherSize,
    Command(Command),
    RemoveOne(Index),
    /// Focus or another control left the value; last in place this many frames ago.
    Moved {
        control: Control,
        frames_ago: u64,
    },
    Restored(Control),
    SetByHand(Control),
    Lost,
    Returned,
    Frozen,
    Dispelled,
    WorkerFailed,
    SourceEnded,
    Resumed,
}

fn kind() -> impl Strategy<Value = FrameKind> {
    prop_oneof![4 => Just(FrameKind::Photograph), 1 => Just(FrameKind::Video)]
}

fn control() -> impl Strategy<Value = Control> {
    prop_oneof![Just(Control::Focus), Just(Control::Zoom), Just(Control::Exposure)]
}

fn happening() -> impl Strategy<Value = Happening> {
    let small = -0.05..0.05;
    let target = (prop::array::uniform3(small.clone()), prop::array::uniform2(small), kind())
        .prop_map(|(turn_rad, shift, kind)| Happening::Target { turn_rad, shift, kind });
    let place = prop::array::uniform2(0.3..0.7);
    let anywhere = (0.0..std::f64::consts::TAU, 0.0..1.0, place, 0.2..0.6, kind()).prop_map(
        |(azimuth_rad, tilt_rad, place, distance_m, kind)| Happening::Anywhere {
            azimuth_rad,
            tilt_rad,
            place,
            distance_m,
            kind,
        },
    );
    let command = |command| Just(Happening::Command(command));
    prop_oneof![
        12 => target,
        3 => anywhere,
        1 => Just(Happening::NoBoard),
        1 => Just(Happening::OtherSize),
        1 => command(Command::ForceNext),
        3 => command(Command::UndoLast),
        3 => command(Command::Restore),
        1 => command(Command::Pause),
        2 => command(Command::Resume),
        1 => command(Command::TakeMore),
        2 => any::<Index>().prop_map(Happening::RemoveOne),
        2 => (control(), 0_u64..12)
            .prop_map(|(control, frames_ago)| Happening::Moved { control, frames_ago }),
        4 => control().prop_map(Happening::Restored),
        1 => control().prop_map(Happening::SetByHand),
        1 => Just(Happening::Lost),
        3 => Just(Happening::Returned),
        1 => Just(Happening::Frozen),
        2 => Just(Happening::Dispelled),
        1 => Just(Happening::WorkerFailed),
        1 => Just(Happening::SourceEnded),
        1 => Just(Happening::Resumed),
    ]
}

/// A camera, a board and a clock.
struct World {
    camera: Camera,
    board: Board,
    frame: u64,
    rng: ChaCha8Rng,
}

impl World {
    fn new() -> Self {
        let camera = Camera {
            f_px: Vector2::new(1100.0, 1100.0),
            pp_px: Point2::new(655.0, 348.0),
            distortion: Distortion { k1: -0.2, k2: 0.08, ..Distortion::default() },
        };
        let board = Board::new(9, 6, 0.025).expect("valid");
        Self { camera, board, frame: 0, rng: ChaCha8Rng::seed_from_u64(1) }
    }

    fn time(frame: u64) -> CaptureTime {
        CaptureTime { nanos: 100_000_000 * frame }
    }

    fn observation(&mut self, pose: Option<Isometry3<f64>>, kind: FrameKind) -> Observation {
        self.frame += 1;
        let noise = Normal::new(0.0, NOISE_PX).expect("valid");
        let corners: Option<Vec<Corner>> = pose.and_then(|pose| {
            let points = self.board.corners_in_board_m();
            let corner = |point| {
                let error = Vector2::new(noise.sample(&mut self.rng), noise.sample(&mut self.rng));
                let px = self.camera.px_from_board(&pose, point)? + error;
                let inside = px.x > 4.0 && px.y > 4.0 && px.x < 1275.0 && px.y < 715.0;
                inside.then(|| Corner::isotropic(px, NOISE_PX))
            };
            points.iter().map(corner).collect()
        });
        let quality = Quality { blur_px: 0.8, contrast: 80.0, glare: 0.0, motion_px: 0.0 };
        Observation {
            frame_id: FrameId(self.frame),
            captured_at: Self::time(self.frame),
            kind,
            name: String::new(),
            image_size: SIZE,
            seen: corners.map(|corners| Detection { corners, quality }).ok_or(Miss::NoBoard),
        }
    }

    fn at_target(
        &self,
        session: &Session,
        turn_rad: [f64; 3],
        shift: [f64; 2],
    ) -> Option<Isometry3<f64>> {
        let ghost_px = &session.target()?.ghost_px;
        let corners: Vec<Corner> = ghost_px.iter().map(|px| Corner::isotropic(*px, 1.0)).collect();
        let fit = fit_pose(&self.camera, &self.board.corners_in_board_m(), &corners).ok()?;
        let pose = fit.cam_from_board;
        let shift_m = 0.3 * pose.translation.z * Vector3::new(shift[0], shift[1], 0.0);
        Some(Isometry3::from_parts(
            (pose.translation.vector + shift_m).into(),
            UnitQuaternion::from_scaled_axis(Vector3::from(turn_rad)) * pose.rotation,
        ))
    }

    fn input(&mut self, session: &Session, happening: &Happening) -> Input {
        let now = Self::time(self.frame);
        Input::Camera(match *happening {
            Happening::Target { turn_rad, shift, kind } => {
                let pose = self.at_target(session, turn_rad, shift);
                return Input::Observed(self.observation(pose, kind));
            }
            Happening::Anywhere { azimuth_rad, tilt_rad, place, distance_m, kind } => {
                let axis = Vector3::new(azimuth_rad.sin(), -azimuth_rad.cos(), 0.0);
                let away = |share: f64, size: u32| {
                    (share - 0.5) * f64::from(size) / self.camera.f_px.x * distance_m
                };
                let shift = Vector3::new(away(place[0], 1280), away(place[1], 720), distance_m);
                let pose = Isometry3::new(shift, tilt_rad * axis);
                return Input::Observed(self.observation(Some(pose), kind));
            }
            Happening::NoBoard => {
                return Input::Observed(self.observation(None, FrameKind::Video));
            }
            Happening::OtherSize => {
                let image_size = ImageSize { width_px: 640, height_px: 480 };
                let seen = self.observation(None, FrameKind::Video);
                return Input::Observed(Observation { image_size, ..seen });
            }
            Happening::Command(command) => return Input::Command(command),
            Happening::RemoveOne(index) => {
                let accepted = session.accepted();
                // Numbers beyond the views are requested, too.
                let number = index.index(accepted.len() + 1);
                let view = accepted.get(number).map_or(ViewNumber(1000), |taken| taken.number);
                return Input::Command(Command::Remove { view });
            }
            Happening::WorkerFailed => {
                let (worker, reason) = ("detector".into(), "out of memory".into());
                return Input::WorkerFailed { worker, reason };
            }
            Happening::SourceEnded => return Input::SourceEnded,
            Happening::Resumed => return Input::Resumed,
            Happening::Moved { control, frames_ago } => {
                let good_until = Self::time(self.frame.saturating_sub(frames_ago));
                CameraEvent::ControlChanged(ControlChange { control, from: 30, to: 45, good_until })
            }
            Happening::Restored(control) => {
                CameraEvent::ControlRestored { control, good_from: now }
            }
            Happening::SetByHand(control) => {
                let lock = Lock::Locked { value: 45 };
                CameraEvent::ControlSet { control, lock, good_from: now }
            }
            Happening::Lost => CameraEvent::Lost { fault: Fault::Unplugged, detail: String::new() },
            Happening::Returned => CameraEvent::Returned { mode: MODE, good_from: now },
            Happening::Frozen => {
                CameraEvent::Doubtful { fault: Fault::Frozen, detail: String::new() }
            }
            Happening::Dispelled => CameraEvent::Dispelled { fault: Fault::Frozen },
        })
    }
}

fn setup() -> SessionSetup {
    SessionSetup {
        board: Board::new(9, 6, 0.025).expect("valid"),
        image_size: SIZE,
        guidance: GuidanceParams::default(),
        calibration: CalibrationParams::default(),
    }
}

/// Expected views of a reader of inputs and outcomes.
#[derive(Default)]
struct Expected {
    accepted: Vec<ViewNumber>,
    removed: Vec<(usize, ViewNumber)>,
    taken_at: BTreeMap<ViewNumber, CaptureTime>,
    /// True if the person requested the next frame, and nothing ended the request since.
    force_next: bool,
}

impl Expected {
    fn apply(&mut self, input: &Input, decision: &Decision, session: &Session) {
        match input {
            Input::Command(Command::ForceNext) => self.force_next = true,
            Input::Command(Command::UndoLast) => self.remove(self.accepted.last().copied()),
            Input::Command(Command::Remove { view }) => self.remove(Some(*view)),
            Input::Command(Command::Restore) => {
                if let Some((index, view)) = self.removed.pop() {
                    self.accepted.insert(index.min(self.accepted.len()), view);
                }
            }
            Input::Camera(CameraEvent::ControlChanged(change))
                if change.control.moves_geometry() =>
            {
                let taken_at = &self.taken_at;
                let good = |view: &ViewNumber| taken_at[view] <= change.good_until;
                self.accepted.retain(good);
                self.removed.retain(|(_, view)| good(view));
            }
            Input::Resumed => self.force_next = false,
            _ => {}
        }
        if matches!(input, Input::Camera(_)) && !session.camera().may_take() {
            self.force_next = false;
        }
        if let Outcome::Accepted { view, role, .. } = decision.outcome {
            let newest = session.accepted().last().expect("just accepted");
            assert!(self.taken_at.keys().all(|before| *before < view), "{view:?} came before");
            assert_eq!(newest.number, view);
            assert!(role != Role::Forced || self.force_next, "nobody forced {view:?}");
            self.taken_at.insert(view, newest.view.captured_at);
            self.accepted.push(view);
            self.force_next &= role != Role::Forced;
        }
    }

    fn remove(&mut self, view: Option<ViewNumber>) {
        let index = self.accepted.iter().position(|accepted| Some(*accepted) == view);
        if let Some(index) = index {
            self.removed.push((index, self.accepted.remove(index)));
        }
    }
}

/// A session with the same views and no past.
fn restored(session: &Session, seen: &BTreeMap<FrameId, Observation>) -> Option<Session> {
    let mut restored = Session::new(setup());
    let accepted = session.accepted();
    for taken in accepted {
        let role = match taken.role {
            Role::Partner { .. } => {
                let partner = accepted
                    .iter()
                    .position(|other| Some(other.view.frame_id) == taken.view.partner_frame);
                Role::Partner { of: partner.unwrap_or(usize::MAX) }
            }
            role => role,
        };
        // A lens estimate from the first views alone may not reach a later view's corners.
        restored.accept_recorded(&seen[&taken.view.frame_id], taken.number, role).ok()?;
    }
    Some(restored)
}

/// Roles hold indices at the time of acceptance.
fn without_roles(views: &[ViewSummary]) -> Vec<ViewSummary> {
    views.iter().map(|view| ViewSummary { role: Role::NewDirection, ..view.clone() }).collect()
}

/// The views, pairs and the lens from them, as text; roles hold indices at the time of acceptance.
fn of_views(session: &Session) -> String {
    let decision = session.clone().handle(&Input::Stop);
    let snapshot = session.snapshot(decision);
    let views = without_roles(&snapshot.views);
    let calibration = snapshot.calibration.map(|c| (c.camera, c.covariance));
    // Rounding apart.
    format!("{:.6?}", (views, snapshot.pairs, calibration))
}

/// Consequences of the views and of other frames, as text; roles hold indices at the time of
/// acceptance.
fn plan(session: &Session) -> String {
    let decision = session.clone().handle(&Input::Stop);
    let snapshot = session.snapshot(decision);
    let views = without_roles(&snapshot.views);
    format!(
        "{:?}",
        (
            (session.progress(), snapshot.views_to_go, snapshot.target),
            (snapshot.lens, snapshot.pp_px, snapshot.pp_covariance_px2),
            (views, snapshot.pairs, snapshot.calibration.map(|c| (c.camera, c.covariance))),
        )
    )
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, ..ProptestConfig::default() })]

    #[test]
    fn any_inputs_leave_a_session_as_it_should_be(
        happenings in prop::collection::vec(happening(), 1..60)
    ) {
        let mut world = World::new();
        let mut session = Session::new(setup());
        let mut expected = Expected::default();
        let mut seen = BTreeMap::new();
        let mut lines = Vec::new();
        let mut paused = false;
        for happening in &happenings {
            let input = world.input(&session, happening);
            if let Input::Observed(observation) = &input {
                seen.insert(observation.frame_id, observation.clone());
            }
            let (could_take, was_paused) = (session.camera().may_take(), paused);
            let decision = session.handle(&input);
            expected.apply(&input, &decision, &session);

            let snapshot = session.snapshot(decision);
            paused = snapshot.paused;
            let accepted: Vec<ViewNumber> =
                session.accepted().iter().map(|taken| taken.number).collect();
            prop_assert_eq!(&accepted, &expected.accepted);
            prop_assert_eq!(decision.accepted, accepted.len());
            let next_restored = expected.removed.last().map(|(_, view)| *view);
            prop_assert_eq!(snapshot.removed, next_restored);
            prop_assert!(expected.removed.iter().all(|(_, view)| !accepted.contains(view)));
            if let Input::Camera(CameraEvent::ControlChanged(change)) = &input
                && change.control.moves_geometry()
            {
                let good = |at: CaptureTime| at <= change.good_until;
                prop_assert!(session.accepted().iter().all(|t| good(t.view.captured_at)));
            }
            if matches!(input, Input::Resumed) {
                prop_assert!(!snapshot.paused && !snapshot.source_ended);
                prop_assert!(snapshot.failures.is_empty());
                prop_assert_eq!(session.frame_in_hand(), None);
                prop_assert!(session.camera().may_take());
            }
            if let Outcome::Accepted { role, .. } = decision.outcome {
                prop_assert!(could_take, "taken from a camera that isn't ready");
                prop_assert!(!was_paused || role == Role::Forced, "taken while paused");
            }
            let decision = serde_json::value::to_raw_value(&decision).expect("plain data");
            let input = (&input).into();
            lines.push(Line { input, decision, stored: None, session: None, synced: None });
        }

        // Consequences of the views alone; the plan also depends on other frames, as does the place
        // of moved corners.
        let have_stood = session.accepted().iter().all(|taken| taken.velocity.is_none());
        if let Some(restored) = restored(&session, &seen).filter(|_| have_stood) {
            prop_assert_eq!(of_views(&restored), of_views(&session));
        }

        // Through the journal's text and back.
        let lines: Vec<Line> = lines
            .iter()
            .map(|line| {
                let text = serde_json::to_string(line).expect("plain data");
                serde_json::from_str(&text).expect("what was written can be read")
            })
            .collect();
        let mut again = Session::new(setup());
        let replayed = replay(&mut again, lines.into_iter().map(Ok), |_, _| ()).expect("readable");
        prop_assert_eq!(replayed, Replayed::default());
        prop_assert_eq!(again.accepted(), session.accepted());
        prop_assert_eq!(again.camera(), session.camera());
        prop_assert_eq!(plan(&again), plan(&session));
    }
}
