//! What a watched camera may be called: OK is a claim, and a kind of change is kept. Answers are
//! made up; no picture is looked at.

#![expect(clippy::expect_used, reason = "a test fails by panicking")]

use boresight_geometry::{Camera, frame::ImageSize};
use boresight_watch::{
    Answer, Cause, Causes, Decision, Finding, HOUR_SECS, Input, Lens, Measured, NoAnswer, Picture,
    Sighting, State, Watch, fit,
};
use nalgebra::{Point2, Vector2};

const F_PX: f64 = 800.0;

/// A camera with an answer every hour.
struct Mast {
    watch: Watch,
    at_secs: f64,
    hour: u32,
}

fn lens() -> Lens {
    let camera = Camera::pinhole(F_PX, Point2::new(512.0, 384.0));
    Lens::new(camera, None, ImageSize { width_px: 1024, height_px: 768 })
}

impl Mast {
    fn new() -> Self {
        Self { watch: Watch::new(&lens()), at_secs: 1.774e9, hour: 0 }
    }

    /// A camera that has stood still for five days.
    fn learned() -> Self {
        let mut camera = Self::new();
        (0..120).for_each(|_| drop(camera.panned(0.0)));
        assert_eq!(camera.state(), State::Ok);
        camera
    }

    fn state(&self) -> State {
        self.watch.decision().state
    }

    fn next(&mut self, answer: Result<Answer, NoAnswer>) -> Decision {
        self.at_secs += HOUR_SECS;
        self.hour += 1;
        let (answer, none) = (answer.as_ref().ok().cloned(), answer.err());
        let picture = Picture { at: self.at_secs, late: false, answer, none };
        self.watch.handle(&Input::Picture(Box::new(picture)))
    }

    fn answer(&self, pan_px: f64) -> Answer {
        // Chance, within 0.1 px.
        let chance_px = 0.2 * (f64::from((self.hour * 7919) % 97) / 97.0 - 0.5);
        Answer {
            turn: [1e6 * (pan_px + chance_px) / F_PX, 0.0, 0.0, 0.0],
            cov: [100.0, 0.0, 0.0, 0.0, 100.0, 0.0, 0.0, 100.0, 0.0, 100.0],
            patches: [180, 140],
            sought: Some(200),
            sharp: None,
            contrast: None,
            shake: None,
            causes: None,
        }
    }

    fn panned(&mut self, pan_px: f64) -> Decision {
        self.next(Ok(self.answer(pan_px)))
    }

    /// A pan, with what the turn and the shift of the picture leave over.
    fn caused(&mut self, pan_px: f64, [turned_px, shifted_px]: [f64; 2]) -> Decision {
        let causes = Some(Causes { turned_px, shifted_px, compared: 100 });
        self.next(Ok(Answer { causes, ..self.answer(pan_px) }))
    }
}

fn doubt(reason: NoAnswer) -> State {
    State::CannotTell { reason, before: None }
}

const DARK: NoAnswer = NoAnswer::TooDark;

#[test]
fn three_answers_make_it_ok_again() {
    let mut camera = Mast::learned();
    (0..30).for_each(|_| drop(camera.next(Err(DARK))));
    assert_eq!(camera.state(), doubt(DARK));
    let since = camera.watch.decision().since_secs;
    for _ in 0..2 {
        assert_eq!(camera.panned(0.0).state, doubt(NoAnswer::Unconfirmed));
        assert_eq!(camera.watch.decision().since_secs, since);
    }
    // In a row.
    camera.next(Err(DARK));
    assert_eq!(camera.panned(0.0).state, doubt(NoAnswer::Unconfirmed));
    camera.panned(0.0);
    assert_eq!(camera.panned(0.0).state, State::Ok);
}

#[test]
fn days_without_pictures_make_no_pictures_without_an_answer_usual() {
    let mut camera = Mast::learned();
    camera.at_secs += 96.0 * HOUR_SECS;
    assert_eq!(camera.panned(0.0).state, State::Ok);
    let disagree = NoAnswer::Disagree { agree: 10, found: 60 };
    (0..2).for_each(|_| assert_eq!(camera.next(Err(disagree)).state, State::Ok));
    assert_eq!(camera.next(Err(disagree)).state, doubt(disagree));
}

#[test]
fn three_pictures_of_two_motions_are_told_within_an_hour() {
    let two = NoAnswer::TwoMotions { agree: 90, other: 24, left_out_percent: None };
    let disagree = NoAnswer::Disagree { agree: 10, found: 60 };
    for (reason, third) in [(disagree, State::Ok), (two, doubt(two))] {
        let mut camera = Mast::learned();
        let states = [0; 3].map(|_| {
            // Every ten minutes.
            camera.at_secs -= 50.0 * 60.0;
            camera.next(Err(reason)).state
        });
        assert_eq!(states, [State::Ok, State::Ok, third]);
    }
}

#[test]
fn a_shift_that_looks_like_a_zoom_to_half_of_the_patches_is_a_knocked_lens() {
    let mut camera = Mast::learned();
    let causes = Some(Causes { turned_px: 2.8, shifted_px: 0.4, compared: 60 });
    for _ in 0..3 {
        let mut answer = Answer { causes, ..camera.answer(4.0) };
        answer.turn[3] = 1e6 * 4.5 / lens().half_diagonal_px();
        camera.next(Ok(answer));
    }
    assert_eq!(camera.state(), State::Moved(Cause::Knocked));
}

#[test]
fn an_answer_beyond_the_limit_makes_nothing_ok() {
    let mut camera = Mast::learned();
    let limit_px = camera.watch.decision().smallest_visible_px[0];
    assert!((0.7..1.0).contains(&limit_px), "{limit_px}");
    (0..30).for_each(|_| drop(camera.next(Err(DARK))));
    for _ in 0..12 {
        let decision = camera.panned(limit_px + 0.2);
        assert!(!matches!(decision.state, State::Ok), "{decision:?}");
    }
    // Nor one that isn't sure.
    let mut camera = Mast::learned();
    let unsure = |camera: &mut Mast| {
        let mut answer = camera.answer(0.0);
        // 0.5 px.
        answer.cov[0] = (0.5e6 / F_PX).powi(2);
        camera.next(Ok(answer))
    };
    (0..30).for_each(|_| drop(unsure(&mut camera)));
    assert_eq!(camera.state(), doubt(NoAnswer::Unsure));
    // One of them alone changes nothing.
    let mut camera = Mast::learned();
    assert_eq!(unsure(&mut camera).state, State::Ok);
}

#[test]
fn a_step_is_never_ok_for_longer_than_a_few_looks() {
    for step_px in [-1.2, 1.5, 3.0, 40.0] {
        let mut camera = Mast::learned();
        let ok = (0..48).filter(|_| camera.panned(step_px).state == State::Ok).count();
        assert!(ok <= 2, "{step_px} px: OK {ok} times");
        assert!(matches!(camera.state(), State::Moved(_)), "{step_px} px: {:?}", camera.state());
    }
}

#[test]
fn a_kind_is_kept_until_the_camera_is_back() {
    // Pictures disagree about the cause.
    let mut camera = Mast::learned();
    let mut codes = vec![camera.state().code()];
    for hour in 0..60 {
        let left_px = if hour % 7 < 3 { [0.1, 0.4] } else { [0.4, 0.1] };
        let decision = camera.caused(4.0, left_px);
        if codes.last() != Some(&decision.state.code()) {
            codes.push(decision.state.code());
        }
    }
    assert!(codes.len() <= 3, "{codes:?}");
    // It is dark meanwhile, and then it's what it was.
    let kind = camera.state();
    (0..30).for_each(|_| drop(camera.next(Err(DARK))));
    assert_eq!(camera.state().code(), "CANNOT-TELL");
    assert_eq!(camera.caused(4.0, [0.1, 0.4]).state.code(), kind.code());
    // Pushed back, it's OK after three answers, and any kind may come next.
    let back = (1..=12).find(|_| camera.panned(0.0).state == State::Ok);
    assert!(back.is_some_and(|looks| looks >= 3), "{back:?}");
    let state = (0..12).map(|_| camera.caused(4.0, [0.1, 0.4]).state).last().expect("a state");
    assert_eq!(state.code(), "MOVED");
}

#[test]
fn what_was_moved_is_never_learned_as_sway() {
    let mut camera = Mast::learned();
    // A slow turn, seen only after hours.
    (0..24).for_each(|hour| drop(camera.panned(1.2 * f64::from(hour) / 24.0)));
    (0..24).for_each(|_| drop(camera.panned(1.2)));
    assert!(matches!(camera.state(), State::Moved(_)));
    let visible_px = camera.watch.decision().smallest_visible_px[0];
    for _ in 0..24 * 10 {
        let decision = camera.panned(0.0);
        let sways = decision.findings.iter().any(|f| matches!(f, Finding::SwaysMore { .. }));
        assert!(!sways, "{decision:?}");
    }
    assert_eq!(camera.state(), State::Ok);
    let now_px = camera.watch.decision().smallest_visible_px[0];
    assert!(now_px < 1.2 * visible_px, "{now_px} px instead of {visible_px} px");
}

#[test]
fn a_clock_that_goes_back_is_no_ok() {
    let mut camera = Mast::learned();
    let newest = camera.at_secs;
    // The year 2000, with pictures of a camera that has been pushed.
    camera.at_secs = 946_684_800.0;
    assert_eq!(camera.panned(3.0).state, doubt(NoAnswer::WrongClock));
    (0..200).for_each(|_| drop(camera.panned(3.0)));
    assert_eq!(camera.state(), doubt(NoAnswer::WrongClock));
    // Set right again.
    camera.at_secs = newest + 201.0 * HOUR_SECS;
    let states: Vec<State> = (0..3).map(|_| camera.panned(0.0).state).collect();
    assert_eq!(states[2], State::Ok, "{states:?}");
    assert_eq!(states[1], doubt(NoAnswer::Unconfirmed));
    // A minute isn't worth a word.
    camera.at_secs -= HOUR_SECS + 60.0;
    assert_eq!(camera.panned(0.0).state, State::Ok);
}

#[test]
fn a_clock_that_jumps_ahead_is_no_learning() {
    let mut camera = Mast::new();
    camera.at_secs = 946_684_800.0;
    (0..5).for_each(|_| drop(camera.panned(0.0)));
    camera.at_secs = 1.774e9;
    let State::Learning { hours, .. } = camera.panned(0.0).state else { panic!("learning") };
    assert!(hours < 20.0, "{hours}");
    assert!(!camera.watch.is_settled());
}

#[test]
fn little_of_the_picture_vouches_for_nothing() {
    let mut camera = Mast::learned();
    let little = |camera: &mut Mast| {
        let answer = Answer { patches: [70, 60], ..camera.answer(0.0) };
        camera.next(Ok(answer)).state
    };
    assert_eq!(little(&mut camera), State::Ok);
    assert!((0..5).all(|_| little(&mut camera).code() != "MOVED"));
    assert_eq!(camera.state(), doubt(NoAnswer::LittleSeen { agree: 60, of: 200 }));
}

/// Patches of a picture in two parts, with the shift of each, px.
fn parts(left: (usize, [f64; 2]), right: (usize, [f64; 2])) -> Measured {
    let lens = lens();
    let part = |(count, shift): (usize, [f64; 2]), x: f64| {
        let ray = |px: &Point2<f64>| lens.ray(px).expect("a ray");
        let px = move |n: usize| {
            let n = n as f64;
            Point2::new(x + (n * 173.3) % 500.0, 20.0 + (n * 97.7) % 720.0)
        };
        let sighting = move |px: Point2<f64>, ray| Sighting {
            ray,
            reference_px: px,
            log_focal: 0.0,
            px: px + Vector2::from(shift),
            sigma_px: 0.3,
        };
        (0..count).map(px).map(|px| sighting(px, ray(&px))).collect::<Vec<_>>()
    };
    let sightings = [part(left, 0.0), part(right, 500.0)].concat();
    let fitted = fit(&lens, &sightings, None).expect("fitted");
    Measured {
        turn: fitted.turn,
        covariance: fitted.covariance,
        sought: 150,
        found: sightings.len(),
        inliers: fitted.inliers(),
        spread: 1.0,
        tags: vec![(0, 0); sightings.len()],
        weights: fitted.weights,
        sightings,
        turned_back: None,
    }
}

#[test]
fn a_mount_in_the_picture_that_stays_put_is_no_answer() {
    let lens = lens();
    let own = parts((85, [0.0, 0.0]), (43, [4.0, 0.0]));
    assert!(own.inliers >= 80, "the larger part wins: {}", own.inliers);
    assert!(
        own.second_motion(&lens).is_some_and(|other| other >= 35),
        "{:?}",
        own.second_motion(&lens)
    );
    // One motion, or a few patches on a car, are an answer.
    assert_eq!(parts((85, [4.0, 0.0]), (43, [4.0, 0.0])).second_motion(&lens), None);
    assert_eq!(parts((100, [0.0, 0.0]), (12, [9.0, 0.0])).second_motion(&lens), None);
}
