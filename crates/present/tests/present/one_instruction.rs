//! Sentence, sign, card, outline, ring, gauges and spoken words never contradict each other, nor
//! the measurements.
//!
//! `BORESIGHT_SESSIONS=400 cargo test -p boresight-present one_instruction -- --nocapture` prints
//! the rate of changes of the sentence, and the time of people with card and sentence. People with
//! the card alone are in `tests/window/blind_follow.rs`, those with the voice alone in
//! `listener.rs`.

use std::collections::BTreeMap;

use boresight_app::PersonCues;
use boresight_calibrate::Verdict;
use boresight_geometry::frame::CaptureTime;
use boresight_guide::{
    guidance::{HOLD_WIDTHS_PER_SEC, Progress},
    session::{Input, Session, Snapshot},
};
use boresight_present::{
    ghost::closeness,
    instruction::{Instruction, Moment, Movement},
    speech::{Narrator, Rank},
};
use boresight_sim::{
    Scene,
    technician::{Person, Technician, TechnicianParams},
};
use boresight_testkit::{
    asked_for,
    world::{SIZE, World, setup},
};
use nalgebra::{Point2, Vector2};

const PATIENCE_SECS: f64 = 120.0;

/// Runs a session on projected corners and passes each screen to `each`. Returns the session and
/// its length.
pub(crate) fn sitting(
    (seed, params): (u64, TechnicianParams),
    (step_nanos, noise_px): (u64, f64),
    mut each: impl FnMut(f64, &Snapshot, &Instruction),
) -> (Session, f64) {
    let scene = Scene { technician: params, ..Scene::random(seed) };
    let mut world = World::new(seed);
    (world.camera, world.board) = (scene.camera, scene.board);
    (world.step_nanos, world.noise_px) = (step_nanos, noise_px);
    let mut person = Technician::new(&scene);
    let mut cues = PersonCues::default();
    let mut session = Session::new(setup(scene.board));
    let mut secs = 0.0;
    while session.progress() == Progress::Collecting && secs < PATIENCE_SECS {
        let seen_at = CaptureTime { nanos: (1e9 * secs) as u64 };
        let observation = world.observe(&person.pose_at(seen_at));
        let decision = session.handle(&Input::Observed(observation));
        let snapshot = session.snapshot(decision);
        each(secs, &snapshot, &Instruction::of(&snapshot));
        for cue in cues.after(seen_at, &snapshot) {
            person.read(cue);
        }
        secs += 1e-9 * step_nanos as f64;
    }
    (session, secs)
}

/// Direction named by a sentence, right and down; `None` without one.
fn way_named(sentence: &str) -> Option<Vector2<f32>> {
    let words: Vec<&str> = sentence.split(|c: char| !c.is_alphabetic()).collect();
    let says = |word: &str| f32::from(u8::from(words.contains(&word)));
    let way = Vector2::new(
        says("right") - says("left"),
        says("bottom") + says("down") - says("top") - says("up"),
    );
    (way.norm() > 0.5).then(|| way.normalize())
}

fn angle_between(a: Vector2<f32>, b: Vector2<f32>) -> f32 {
    a.angle(&b)
}

fn middle(points: &[Point2<f64>]) -> Point2<f64> {
    let sum = points.iter().fold(Vector2::zeros(), |sum, point| sum + point.coords);
    Point2::from(sum / points.len() as f64)
}

fn radius(points: &[Point2<f64>]) -> f64 {
    let middle = middle(points);
    let squares: f64 = points.iter().map(|point| (point - middle).norm_squared()).sum();
    (squares / points.len() as f64).sqrt()
}

/// Contradictions among the shown and the measured.
fn contradictions(now: &Instruction, snapshot: &Snapshot) -> Vec<&'static str> {
    let mut found = Vec::new();
    let mut check = |is_so: bool, what| {
        if !is_so {
            found.push(what);
        }
    };
    let sentence = now.sentence(false);
    let holds = now.moment == Moment::Hold;
    check(holds == (sentence == "Hold still"), "the sentence and the hold");
    check(holds == now.hold.is_some(), "the ring and the hold");
    check(holds == (Narrator::word(now).rank == Rank::Hold), "the voice and the hold");
    let is_news = matches!(now.moment, Moment::Taken | Moment::Done);
    check(
        is_news == (Narrator::word(now).rank == Rank::Taken) || sentence.starts_with("Stopped"),
        "the news",
    );
    if holds || is_news {
        check(now.card.is_none(), "a card beside the hold, or the news");
        check(now.movement(false).is_none(), "a sign beside the hold, or the news");
        check(now.lacks.is_none(), "a gauge beside the hold, or the news");
    }
    check(now.moment != Moment::Taken || now.board.is_none(), "an outline beside the news");
    for mirrored in [false, true] {
        let named = way_named(&now.sentence(mirrored));
        let signed = now.movement(mirrored).and_then(|movement| match movement {
            Movement::Tip { towards_rad } | Movement::Shift { towards_rad } => {
                Some(Vector2::new(towards_rad.cos(), towards_rad.sin()))
            }
            Movement::Nearer | Movement::Farther => None,
        });
        check(named.is_some() == signed.is_some(), "a sign without words");
        check(
            named.zip(signed).is_none_or(|(a, b)| angle_between(a, b) < 0.01),
            "the sign and the words",
        );
        let aloud = Narrator::word(now);
        let heard = way_named(if mirrored { &aloud.mirrored } else { &aloud.text });
        check(heard == named || is_news, "the voice and the words");
    }
    let Some(target) = snapshot.target.as_ref().filter(|_| now.card.is_some()) else {
        return found;
    };
    if let Some(Movement::Tip { towards_rad }) = now.movement(false) {
        let off_rad = (f64::from(towards_rad) - target.tilt_azimuth_rad).cos().acos();
        check(off_rad.to_degrees() < 23.0, "the edge and the card");
    }
    let Some(live) = snapshot.live.as_ref() else { return found };
    let Ok(corners_px) = &live.corners_px else { return found };
    // The middle of a part isn't the board's.
    if !live.unseen.is_empty() {
        return found;
    }
    let ratio = radius(&target.ghost_px) / radius(corners_px);
    match now.movement(false) {
        Some(Movement::Nearer) => check(ratio > 0.98, "come closer, and the card is smaller"),
        Some(Movement::Farther) => check(ratio < 1.02, "step back, and the card is larger"),
        Some(Movement::Shift { towards_rad }) if now.moment == Moment::Approach => {
            let way = Vector2::new(f64::from(towards_rad.cos()), f64::from(towards_rad.sin()));
            let off = middle(&target.ghost_px) - middle(corners_px);
            check(off.dot(&way) > -8.0, "the way and the card");
        }
        _ => {}
    }
    if let Some(tilt_rad) = live.measured.as_ref().and_then(|measured| measured.tilt_rad) {
        let ratio = tilt_rad / target.tilt_rad;
        check(!sentence.ends_with("further") || ratio < 1.02, "further, and it's tipped enough");
        check(!sentence.ends_with("less") || ratio > 0.98, "less, and it's tipped too little");
    }
    found
}

/// True if a reader of "Hold still" is in the target pose, or has stopped.
fn is_honest(snapshot: &Snapshot) -> bool {
    let Some(live) = &snapshot.live else { return false };
    let calm_px_per_s = HOLD_WIDTHS_PER_SEC * f64::from(SIZE.width_px);
    let has_stopped = live.speed_px_per_s.is_some_and(|speed| speed <= calm_px_per_s);
    let board = &snapshot.setup.board;
    let close = live.corners_px.as_ref().ok().zip(snapshot.target.as_ref());
    let close = close.and_then(|(corners, target)| closeness(corners, &target.ghost_px, board));
    has_stopped || close.is_none_or(|close| close > 0.75)
}

const PEOPLE: [Person; 4] = [Person::Usual, Person::Steady, Person::Shaky, Person::Tired];
/// Time between pictures, and noise of a corner: by day, at 15 pictures a second, and in the dark.
const CAMERAS: [(u64, f64); 3] = [(33_000_000, 0.05), (67_000_000, 0.1), (100_000_000, 0.3)];

#[test]
fn what_is_shown_and_told_never_contradicts() {
    nothing_contradicts(asked_for("BORESIGHT_SESSIONS").unwrap_or(12));
}

#[test]
#[ignore = "takes half an hour"]
fn long_nothing_contradicts_in_400_sessions() {
    nothing_contradicts(400);
}

fn nothing_contradicts(sessions: u64) {
    let mut found: BTreeMap<&str, u32> = BTreeMap::new();
    let (mut frames, mut changes, mut secs, mut tips, mut instead) = (0, 0, 0.0, 0, 0);
    let mut most: f64 = 0.0;
    for seed in 1..=sessions {
        let person = PEOPLE[seed as usize % PEOPLE.len()];
        let camera = CAMERAS[seed as usize / PEOPLE.len() % CAMERAS.len()];
        let (mut last, mut count) = (String::new(), 0);
        let (_, took) = sitting((seed, person.params()), camera, |_, shown, now| {
            frames += 1;
            let sentence = now.sentence(false);
            let mut wrong = contradictions(now, shown);
            if sentence != last {
                count += 1;
                tips += u32::from(sentence.contains("edge"));
                instead += u32::from(sentence.starts_with("Now"));
                if now.moment == Moment::Hold && !is_honest(shown) {
                    wrong.push("hold still, on the way");
                }
                last = sentence;
            }
            wrong.into_iter().for_each(|what| *found.entry(what).or_default() += 1);
        });
        changes += count - 1;
        secs += took;
        most = most.max(f64::from(count - 1) / took);
    }
    let rate = f64::from(changes) / secs;
    println!(
        "{sessions} sessions, {frames} frames, {secs:.0} s: {found:?}; sentences change {rate:.2} times a second, {most:.2} at most in one session; {instead} of {tips} tips name another edge"
    );
    assert!(found.is_empty(), "{found:?}");
    assert!(rate <= 1.0, "{rate}");
}

#[test]
fn who_sees_and_reads_gets_there() {
    all_get_there(asked_for("BORESIGHT_SESSIONS").unwrap_or(3).min(20));
}

#[test]
#[ignore = "takes minutes"]
fn long_who_sees_and_reads_gets_there_20_times() {
    all_get_there(20);
}

fn all_get_there(sessions: u64) {
    let (mut good, mut times, mut views) = (0, Vec::new(), 0);
    for seed in 1..=sessions {
        let who = (seed, Person::Usual.params());
        let (session, secs) = sitting(who, (33_000_000, 0.1), |_, _, _| ());
        let verdict = session.calibration().map(|calibration| calibration.verdict);
        if verdict != Some(Verdict::Good) {
            let (views, ending) = (session.accepted().len(), session.ending());
            println!("{seed}: {verdict:?}, {ending:?}, {views} views, {secs:.0} s");
        }
        good += u64::from(verdict == Some(Verdict::Good));
        times.push(secs);
        views += session.accepted().len();
    }
    times.sort_by(f64::total_cmp);
    println!(
        "{good} of {sessions} GOOD, median {:.0} s, longest {:.0} s, {:.1} views",
        times[times.len() / 2],
        times[times.len() - 1],
        views as f64 / sessions as f64
    );
    assert_eq!(good, sessions);
}
