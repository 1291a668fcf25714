//! A pinned camera: compared with the answers of a minute, until it's learned. Answers are made
//! up; no picture is looked at.

use boresight_geometry::{Camera, frame::ImageSize};
use boresight_watch::{
    Answer, Decision, Finding, HOUR_SECS, Input, LearnedSample, Lens, NoAnswer, Picture, State,
    Watch,
};
use nalgebra::Point2;

const F_PX: f64 = 800.0;

struct Tripod {
    watch: Watch,
    at_secs: f64,
    looks: u32,
}

impl Tripod {
    /// A camera of which `count` pictures were taken in a minute; they scatter by `scatter_px`.
    fn pinned(count: u32, scatter_px: f64) -> Self {
        let camera = Camera::pinhole(F_PX, Point2::new(512.0, 384.0));
        let lens = Lens::new(camera, None, ImageSize { width_px: 1024, height_px: 768 });
        let mut tripod = Self { watch: Watch::new(&lens), at_secs: 1.774e9, looks: 0 };
        tripod.learn(count, scatter_px);
        tripod
    }

    /// Learns references from the minute's pictures.
    fn learn(&mut self, count: u32, scatter_px: f64) {
        let sample = |n: u32| {
            let chance_px = scatter_px * (f64::from((n * 7919) % 97) / 28.0 - 1.73);
            let turn = [1e6 * chance_px / F_PX, 0.0, 0.0, 0.0];
            LearnedSample { at: 1.774e9 - 5.0 * f64::from(count - n), turn }
        };
        let samples = (0..count).map(sample).collect();
        let at = self.at_secs;
        self.watch.handle(&Input::Learned { at, references: count, samples, pinned: true });
    }

    fn state(&self) -> State {
        self.watch.decision().state
    }

    fn limit_px(&self) -> f64 {
        self.watch.decision().smallest_visible_px[0]
    }

    fn look(&mut self, pan_px: Result<f64, NoAnswer>, after_secs: f64) -> Decision {
        self.at_secs += after_secs;
        self.looks += 1;
        let chance_px = 0.1 * (f64::from((self.looks * 7919) % 97) / 97.0 - 0.5);
        let answer = pan_px.map(|pan_px| Answer {
            turn: [1e6 * (pan_px + chance_px) / F_PX, 0.0, 0.0, 0.0],
            cov: [100.0, 0.0, 0.0, 0.0, 100.0, 0.0, 0.0, 100.0, 0.0, 100.0],
            patches: [180, 140],
            sought: Some(200),
            sharp: None,
            contrast: None,
            shake: None,
            causes: None,
        });
        let (answer, none) = (answer.as_ref().ok().cloned(), answer.err());
        let picture = Picture { at: self.at_secs, late: false, answer, none };
        self.watch.handle(&Input::Picture(Box::new(picture)))
    }

    fn panned(&mut self, pan_px: f64) -> Decision {
        self.look(Ok(pan_px), 5.0)
    }
}

#[test]
fn six_pictures_are_a_pin_with_wide_limits_that_are_said() {
    let mut camera = Tripod::pinned(6, 0.02);
    assert_eq!(camera.state(), State::Ok);
    assert_eq!(camera.watch.decision().findings, [Finding::Pinned]);
    // A quarter of a per cent of the width.
    assert!((2.0..3.0).contains(&camera.limit_px()), "{}", camera.limit_px());
    let decision = camera.panned(0.0);
    assert_eq!(decision.findings, [Finding::Pinned]);
    // The offset of the newest looks is known, also below the limit.
    (0..3).for_each(|_| drop(camera.panned(1.5)));
    let decision = camera.panned(1.5);
    assert!((decision.off_px[0] - 1.5).abs() < 0.1, "{}", decision.off_px);
    assert_eq!(decision.state, State::Ok);
    // Few answers that scatter more bound the next one less.
    let shaky = Tripod::pinned(6, 0.6);
    assert!(shaky.limit_px() > 5.0, "{}", shaky.limit_px());
}

#[test]
fn fewer_pictures_or_a_camera_in_the_hand_are_no_pin() {
    for camera in [Tripod::pinned(5, 0.02), Tripod::pinned(6, 5.0)] {
        assert!(matches!(camera.state(), State::Learning { .. }), "{:?}", camera.state());
    }
}

#[test]
fn a_turned_or_covered_camera_is_told_after_three_looks_and_back_after_three() {
    let codes = |camera: &mut Tripod, look: Result<f64, NoAnswer>| {
        [0; 3].map(|_| camera.look(look, 5.0).state.code())
    };
    for pan_px in [3.0, -3.0, 37.0] {
        let mut camera = Tripod::pinned(6, 0.02);
        assert_eq!(codes(&mut camera, Ok(0.0)), ["OK"; 3]);
        assert_eq!(codes(&mut camera, Ok(pan_px)), ["OK", "OK", "MOVED"], "{pan_px} px");
        let off_px = camera.watch.decision().off_px[0];
        assert!((off_px - pan_px).abs() < 0.1, "{off_px} of {pan_px} px");
        assert_eq!(codes(&mut camera, Ok(pan_px)), ["MOVED"; 3]);
    }
    let mut camera = Tripod::pinned(6, 0.02);
    codes(&mut camera, Ok(37.0));
    codes(&mut camera, Ok(0.0));
    assert_eq!(codes(&mut camera, Ok(0.0))[2], "OK");
    assert_eq!(codes(&mut camera, Err(NoAnswer::TooDark)), ["OK", "OK", "CANNOT-TELL"]);
    assert_eq!(codes(&mut camera, Ok(0.0)), ["CANNOT-TELL", "CANNOT-TELL", "OK"]);
}

#[test]
fn learning_narrows_the_limits_of_a_pin() {
    let mut camera = Tripod::pinned(6, 0.02);
    let pinned_px = camera.limit_px();
    for hour in 0..100 {
        let sway_px = 0.4 * (std::f64::consts::TAU * f64::from(hour) / 24.0).sin();
        let decision = camera.look(Ok(sway_px), HOUR_SECS);
        assert_eq!(decision.state, State::Ok, "{hour} h");
    }
    assert!(camera.limit_px() < 0.5 * pinned_px, "{} of {pinned_px} px", camera.limit_px());
    assert!(camera.watch.decision().findings.is_empty());
}

#[test]
fn a_question_isnt_answered_by_what_was_said_before() {
    let mut camera = Tripod::pinned(6, 0.02);
    camera.watch.ask(camera.at_secs);
    for code in ["CANNOT-TELL", "CANNOT-TELL", "OK"] {
        assert_eq!(camera.panned(0.0).state.code(), code);
    }
    camera.watch.ask(camera.at_secs);
    for code in ["CANNOT-TELL", "CANNOT-TELL", "MOVED"] {
        assert_eq!(camera.panned(8.0).state.code(), code);
    }
}

#[test]
fn new_references_dont_answer_a_question_after_a_doubtful_look() {
    let mut camera = Tripod::pinned(6, 0.02);
    camera.panned(8.0);
    let doubted = camera.watch.asked().state;
    assert!(matches!(doubted, State::CannotTell { .. }), "{doubted:?}");
    camera.learn(6, 0.02);
    assert_eq!(camera.watch.asked().state, doubted);
}

#[test]
fn a_camera_that_gives_no_picture_is_no_longer_said_to_be_learning_or_ok() {
    for count in [3, 6] {
        let mut camera = Tripod::pinned(count, 0.02);
        let before = camera.watch.asked().state;
        assert_eq!(matches!(before, State::Ok), count == 6);
        camera.look(Err(NoAnswer::NotLoggedIn), 5.0);
        let (reason, before) = (NoAnswer::NotLoggedIn, None);
        assert_eq!(camera.watch.asked().state, State::CannotTell { reason, before });
        // Who listens all the time hears no single gap.
        assert!(!matches!(camera.state(), State::CannotTell { .. }));
        camera.look(Err(NoAnswer::TooDark), 5.0);
        assert_eq!(matches!(camera.watch.asked().state, State::Learning { .. }), count == 3);
    }
}
