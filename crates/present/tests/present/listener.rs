//! A person who only hears: the board follows the spoken words alone, taken literally.
//!
//! `BORESIGHT_SESSIONS=20 cargo test -p boresight-present listener -- --nocapture` prints the table
//! of 20 sessions a reading.

use boresight_calibrate::Verdict;
use boresight_geometry::frame::CaptureTime;
use boresight_guide::{
    guidance::Progress,
    session::{Input, Prompt, Session},
};
use boresight_present::text;
use boresight_sim::{
    Scene,
    technician::{Cue, CueKind, Technician},
};
use boresight_testkit::{
    asked_for,
    world::{SIZE, World, setup},
};
use nalgebra::{Isometry3, Unit, UnitQuaternion, Vector3};

/// Size of the reaction to a word without an amount.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Reading {
    /// Small, from the present pose.
    Timid,
    /// Large; a named edge recedes from a board facing the camera.
    Bold,
}

/// Time from hearing a sentence to acting, beside the duration of the words.
const REACTION_SECS: f64 = 0.3;
const WORD_SECS: f64 = 0.3;
/// Time without a new sentence before repeating the action.
const AGAIN_SECS: f64 = 4.0;
/// Limit of a hand's tilt.
const STEEPEST_RAD: f64 = 60.0 * std::f64::consts::PI / 180.0;
const PATIENCE_SECS: f64 = 120.0;

struct Listener {
    reading: Reading,
    wanted: Isometry3<f64>,
    heard: (f64, String),
    due_secs: Option<f64>,
    moves: u64,
}

/// Turns a board so as to make a direction of the picture, right and down, recede.
fn tipped(right: f64, down: f64, degrees: f64) -> UnitQuaternion<f64> {
    let axis = Unit::new_normalize(Vector3::new(down, -right, 0.0));
    UnitQuaternion::from_axis_angle(&axis, degrees.to_radians())
}

impl Listener {
    fn hear(&mut self, prompt: Prompt, now_secs: f64) {
        let sentence = text::spoken(prompt);
        if sentence != self.heard.1 || now_secs - self.heard.0 > AGAIN_SECS {
            let words = sentence.split_whitespace().count() as f64;
            self.due_secs = Some(now_secs + REACTION_SECS + WORD_SECS * words);
            self.heard = (now_secs, sentence);
        }
    }

    /// Next pose of the board, if an action is due.
    fn acts(&mut self, now_secs: f64, f_px: f64) -> Option<Isometry3<f64>> {
        self.due_secs.take_if(|due| *due <= now_secs)?;
        let sentence = self.heard.1.to_lowercase();
        let says = |word: &str| sentence.split(|c: char| !c.is_alphabetic()).any(|w| w == word);
        let amount = |timid: f64, bold: f64| match self.reading {
            Reading::Timid => timid,
            Reading::Bold => bold,
        };
        let right = f64::from(u8::from(says("right"))) - f64::from(u8::from(says("left")));
        let down = f64::from(u8::from(says("bottom") || says("down")))
            - f64::from(u8::from(says("top") || says("up")));
        let mut pose = self.wanted;
        let (axis, angle_rad) = pose.rotation.axis_angle().unwrap_or((Vector3::x_axis(), 0.0));
        let turned = |rad: f64| UnitQuaternion::from_axis_angle(&axis, rad.min(STEEPEST_RAD));
        if (says("back") && !says("step")) || says("further") {
            let from = match (says("now"), self.reading) {
                (true, Reading::Timid) | (false, Reading::Bold) if !says("further") => {
                    UnitQuaternion::identity()
                }
                _ => pose.rotation,
            };
            let degrees = if says("further") { amount(10.0, 20.0) } else { amount(25.0, 35.0) };
            pose.rotation = tipped(right, down, degrees) * from;
        } else if says("tip") && says("less") {
            pose.rotation = turned(amount(0.75, 0.5) * angle_rad);
        } else if says("more") {
            pose.rotation = turned(angle_rad + amount(10_f64, 20.0).to_radians());
        } else if says("closer") {
            pose.translation.vector *= amount(0.8, 0.65);
        } else if says("step") || says("whole") {
            pose.translation.vector *= amount(1.25, 1.5);
        } else if says("move") {
            let share = amount(0.08, 0.16) * pose.translation.z / f_px;
            pose.translation.x += share * right * f64::from(SIZE.width_px);
            pose.translation.y += share * down * f64::from(SIZE.height_px);
        } else {
            return None;
        }
        self.wanted = pose;
        self.moves += 1;
        Some(pose)
    }
}

/// Session and duration.
fn listen(seed: u64, reading: Reading) -> (Session, f64) {
    let scene = Scene::random(seed);
    let mut world = World::new(seed);
    (world.camera, world.board, world.noise_px) = (scene.camera, scene.board, 0.1);
    let mut person = Technician::new(&scene);
    let wanted = person.pose_at(CaptureTime { nanos: 0 });
    let heard = (0.0, String::new());
    let mut listener = Listener { reading, wanted, heard, due_secs: None, moves: 0 };
    let mut session = Session::new(setup(scene.board));
    let mut secs = 0.0;
    while session.progress() == Progress::Collecting && secs < PATIENCE_SECS {
        let seen_at = CaptureTime { nanos: (1e9 * secs) as u64 };
        let observation = world.observe(&person.pose_at(seen_at));
        let decision = session.handle(&Input::Observed(observation));
        listener.hear(session.snapshot(decision).shown.prompt, secs);
        if let Some(pose) = listener.acts(secs, scene.camera.f_px.x) {
            let corners_m = scene.board.corners_in_board_m();
            let px = corners_m.iter().filter_map(|at| scene.camera.px_from_board(&pose, at));
            let kind = CueKind::Show { ghost_px: px.collect(), target: listener.moves };
            person.read(Cue { seen_at, kind });
        }
        secs += 1e-9 * world.step_nanos as f64;
    }
    (session, secs)
}

#[test]
fn who_only_hears_gets_there() {
    words_are_enough(asked_for("BORESIGHT_SESSIONS").unwrap_or(3));
}

#[test]
#[ignore = "takes minutes"]
fn long_who_only_hears_gets_there_20_times() {
    words_are_enough(20);
}

fn words_are_enough(sessions: u64) {
    let (mut good, mut all) = (0, 0);
    for reading in [Reading::Timid, Reading::Bold] {
        for seed in 1..=sessions {
            let (session, secs) = listen(seed, reading);
            let verdict = session.calibration().map(|calibration| calibration.verdict);
            println!(
                "{reading:?} {seed}: {secs:.0} s, {} views, {:?}, {verdict:?}",
                session.accepted().len(),
                session.progress()
            );
            all += 1;
            good += u32::from(verdict == Some(Verdict::Good));
        }
    }
    println!("{good} of {all} are GOOD");
    assert_eq!(good, all);
}
