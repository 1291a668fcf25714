//! A literal reader of the sentences about a watched camera: pushes, turns and wipes exactly as
//! told, by the stated number, and does nothing else. The camera is a body in space here; its
//! pictures follow.

#![expect(clippy::expect_used, reason = "a test fails by panicking")]

use std::{collections::BTreeMap, sync::OnceLock};

use boresight_geometry::Camera;
use boresight_station::{
    street::{Planted, Street, What},
    with_scale, words,
};
use boresight_watch::{
    Adjust, Advice, Answer, Decision, HOUR_SECS, Input, Lens, NoAnswer, Picture, State, Station,
    View, Watch,
};
use image::GrayImage;
use nalgebra::{UnitQuaternion, Vector3, Vector4};

/// A camera on a mount over a street, with a watch.
#[derive(Clone)]
struct Installed {
    street: Street,
    lens: Lens,
    /// Rotation since the installation: x to its right, y down, z ahead.
    turned: UnitQuaternion<f64>,
    /// Magnification, per cent.
    larger_percent: f64,
    /// Dirt on the glass.
    glass: Vec<(What, f64)>,
    station: Station,
    watch: Watch,
    shelf: BTreeMap<u64, GrayImage>,
    at_secs: f64,
}

/// Ending of an action, subject of the amount, and direction: right, up, clockwise.
const DEEDS: [(&str, [&str; 2], [f64; 3]); 6] = [
    ("to the right", ["to the left of", "to the right of"], [1.0, 0.0, 0.0]),
    ("to the left", ["to the left of", "to the right of"], [-1.0, 0.0, 0.0]),
    ("up", ["above", "below"], [0.0, 1.0, 0.0]),
    ("down", ["above", "below"], [0.0, -1.0, 0.0]),
    ("anticlockwise", ["clockwise"; 2], [0.0, 0.0, -1.0]),
    ("clockwise", ["clockwise"; 2], [0.0, 0.0, 1.0]),
];

/// Unit of a person's measurements.
#[derive(Clone, Copy)]
enum Ruler {
    /// Motion of the picture.
    Pixels,
    /// By the angle.
    Degrees,
}

impl Installed {
    /// A camera after three days of learning; the same for every test.
    fn learned() -> Self {
        static LEARNED: OnceLock<Installed> = OnceLock::new();
        LEARNED.get_or_init(Self::learn).clone()
    }

    fn learn() -> Self {
        let street = Street::new(11);
        let lens = Lens::new(street.camera, None, street.image_size);
        let mut camera = Self {
            at_secs: street.began_secs - HOUR_SECS,
            station: Station::new(lens.clone()),
            watch: Watch::new(&lens),
            turned: UnitQuaternion::identity(),
            larger_percent: 0.0,
            glass: Vec::new(),
            shelf: BTreeMap::new(),
            street,
            lens,
        };
        camera.wait(74, 1.0);
        assert!(camera.station.is_learned && camera.state() == State::Ok, "{:?}", camera.state());
        camera
    }

    /// A picture in the present pose.
    fn picture(&mut self, at_secs: f64) -> GrayImage {
        let f = self.street.camera.f_px;
        let seen_rad = self.turned.inverse().scaled_axis();
        let stands = [
            (What::Tilt, seen_rad.x * f.x),
            (What::Pan, seen_rad.y * f.x),
            (What::Roll, seen_rad.z.to_degrees()),
            (What::Focal, self.larger_percent),
        ];
        let planted = stands.into_iter().chain(self.glass.iter().copied());
        let days = [f64::MIN, f64::MAX];
        let planted = planted.map(|(what, amount)| Planted { what, amount, days });
        self.street.planted = planted.collect();
        self.street.picture(at_secs)
    }

    /// Lets hours pass with `pictures` pictures; returns the state after them.
    fn wait(&mut self, pictures: usize, every_hours: f64) -> State {
        for _ in 0..pictures {
            self.at_secs += every_hours * HOUR_SECS;
            let grey = self.picture(self.at_secs);
            let looked = self.station.look(grey, self.at_secs, &self.watch, &mut self.shelf);
            for input in &looked.inputs {
                self.watch.handle(input);
            }
        }
        self.state()
    }

    fn state(&self) -> State {
        self.watch.decision().state
    }

    /// Text for the person.
    fn said(&self) -> String {
        said(&self.lens, self.watch.decision())
    }

    /// Pushes, as seen from behind the camera: to the right, up, and clockwise.
    fn push(&mut self, [right_rad, up_rad, clockwise_rad]: [f64; 3]) {
        // Its axis of view goes to +x about y (down), and to −y about x; its right side goes down
        // about z.
        let about = Vector3::new(up_rad, right_rad, clockwise_rad);
        self.turned *= UnitQuaternion::from_scaled_axis(about);
    }

    /// Does the actions by the stated amounts; returns the number of actions.
    fn follow(&mut self, said: &str, ruler: Ruler, faces: bool) -> usize {
        let sentences = said.split(". ").map(|sentence| sentence.trim_end_matches('.'));
        let parts = sentences.clone().flat_map(|sentence| sentence.split(", and "));
        let amounts: Vec<(&str, [Option<f64>; 2])> = parts
            .map(|part| (part, [number_before(part, " px"), number_before(part, "°")]))
            .filter(|(_, amounts)| *amounts != [None; 2])
            .collect();
        let mut done = 0;
        for action in sentences.filter(|s| s.starts_with("Push it") || s.starts_with("Turn it")) {
            let (_, about, [right, up, clockwise]) =
                DEEDS.into_iter().find(|(end, ..)| action.ends_with(end)).expect(action);
            let is_it = |part: &str| amounts.len() == 1 || about.iter().any(|w| part.contains(w));
            let (_, [px, degrees]) = amounts.iter().find(|(part, _)| is_it(part)).expect(said);
            let by_px = px.map(|px| px / self.street.camera.f_px.x);
            let by_angle = degrees.map(f64::to_radians);
            let rad = match ruler {
                Ruler::Pixels => by_px.or(by_angle),
                Ruler::Degrees => by_angle.or(by_px),
            };
            let side = if faces { -1.0 } else { 1.0 };
            self.push([side * right, up, side * clockwise].map(|way| way * rad.expect(said)));
            done += 1;
        }
        done
    }

    /// Deviation from the direction expected at the present hour, as measured by the page.
    fn off(&mut self) -> Result<Vector4<f64>, NoAnswer> {
        let view = View::of(self.picture(self.at_secs));
        let target_px = self.watch.target_px(self.at_secs);
        self.station.measure(&view).map(|measured| measured.turn.in_px(&self.lens) - target_px)
    }

    /// Rotation since the installation, px of the picture: pan, tilt, roll.
    fn off_px(&self) -> [f64; 3] {
        let rad = self.turned.scaled_axis();
        let f = self.street.camera.f_px;
        [rad.y * f.x, rad.x * f.y, rad.z * self.lens.half_diagonal_px()].map(f64::abs)
    }
}

fn said(lens: &Lens, decision: &Decision) -> String {
    let (what, action) = with_scale(lens, |scale| words::state(decision, scale));
    let findings = decision.findings.iter().map(words::finding);
    [what, action].into_iter().chain(findings).collect::<Vec<_>>().join(" ")
}

/// Number before a unit.
fn number_before(text: &str, unit: &str) -> Option<f64> {
    let before = text.split_once(unit)?.0;
    before.rsplit([' ', '(']).next()?.parse().ok()
}

#[test]
fn who_takes_each_sentence_literally_sets_the_camera_right() {
    let learned = Installed::learned();
    let visible_px = learned.watch.decision().smallest_visible_px;
    let f = learned.street.camera.f_px.x;
    let deg = 1_f64.to_radians();
    // To the right, up, clockwise: px of the middle, px, degrees.
    let knocks = [
        [6.0, 0.0, 0.0],
        [-3.0, 0.0, 0.0],
        [0.0, 5.0, 0.0],
        [0.0, -2.5, 0.0],
        [0.0, 0.0, 0.6],
        [0.0, 0.0, -1.2],
        [14.0, -9.0, 0.0],
        [-8.0, 5.0, -1.0],
    ];
    for (n, [right_px, up_px, clockwise_deg]) in knocks.into_iter().enumerate() {
        let mut camera = learned.clone();
        camera.push([right_px / f, up_px / f, clockwise_deg * deg]);
        let state = camera.wait(3, 1.0);
        assert!(matches!(state, State::Moved(_)), "{state:?} after {:?}", knocks[n]);
        let told = camera.said();
        let ruler = if n % 2 == 0 { Ruler::Pixels } else { Ruler::Degrees };
        let may_be_knocked = right_px != 0.0 || up_px != 0.0;
        assert!(may_be_knocked || !told.contains("knocked"), "a lens doesn't roll: {told}");
        let done = camera.follow(&told, ruler, false);
        let off_px = camera.off_px();
        assert!(done > 0 && (0..3).all(|i| off_px[i] < visible_px[i]), "{off_px:?} px off: {told}");
        let hours = (1..=6).find(|_| camera.wait(1, 1.0) == State::Ok);
        println!("{told} → {done} done, {off_px:.2?} px left, OK after {hours:?} pictures");
        assert!(hours.is_some(), "{}", camera.said());
    }

    // After a turn of the zoom ring, a new calibration finds the stated focal length.
    let mut camera = learned.clone();
    camera.larger_percent = 0.6;
    assert_eq!(camera.wait(3, 1.0), State::Zoom);
    let told = camera.said();
    let percent = number_before(&told, " %").expect(&told);
    assert!(told.contains("larger") && told.ends_with("Calibrate again."), "{told}");
    let left_px = camera.lens.half_diagonal_px() * (percent - 0.6).abs() / 100.0;
    println!("{told} → {left_px:.2} px left in the corner");
    assert!(left_px < visible_px[3], "{told}");

    // A hand before the lens.
    let mut camera = learned.clone();
    camera.glass = vec![(What::Cover, 1.0)];
    assert!(matches!(camera.wait(4, 1.0), State::CannotTell { .. }), "{}", camera.said());
    let told = camera.said();
    assert!(told.contains("Check whether the camera is covered"), "{told}");
    camera.glass.clear();
    println!("{told} → uncovered");
    assert_eq!(camera.wait(3, 1.0), State::Ok, "{}", camera.said());
}

#[test]
fn who_wipes_as_told_sees_clearly() {
    let learned = Installed::learned();
    let mut camera = learned;
    camera.glass = vec![(What::Blur, 1.5)];
    let seen = (1..=12).find(|_| camera.wait(1, 3.0) == State::Blurred);
    let told = camera.said();
    assert!(seen.is_some() && told.contains("Wipe the glass."), "{told}");
    camera.glass.clear();
    let back = (1..=9).find(|_| camera.wait(1, 3.0) == State::Ok);
    println!("{told} → seen after {seen:?} pictures, wiped, OK after {back:?}");
    assert!(back.is_some(), "{}", camera.said());
}

/// The way back with somebody at the page, behind the camera or before the camera: each sign,
/// number and sentence is followed on the spot. After following the page, nobody is called again.
#[test]
#[ignore = "takes a minute"]
fn long_who_follows_the_page_literally_is_right_for_good() {
    let learned = Installed::learned();
    let visible_px = learned.watch.decision().smallest_visible_px;
    let f = learned.street.camera.f_px.x;
    // To the right, up: px; clockwise: rad.
    let knocks = [[25.0, -18.0, -0.05], [-3.0, 2.0, 0.0], [0.0, -6.0, 0.02], [1.5, 1.5, 0.004]];
    for (n, [right_px, up_px, clockwise_rad]) in knocks.into_iter().enumerate() {
        let faces = n % 2 == 1;
        let mut camera = learned.clone();
        camera.at_secs += 5.0 * n as f64 * HOUR_SECS;
        camera.push([right_px / f, up_px / f, clockwise_rad]);
        let state = camera.wait(3, 1.0);
        assert!(matches!(state, State::Moved(_)), "{state:?} after {:?}", knocks[n]);
        let mut way = Adjust::new(camera.watch.may_be_left_px());
        let (mut now_secs, mut pushes, mut told) = (0.0, 0, Vec::new());
        loop {
            let advice = way.handle(now_secs, camera.off());
            if advice == Advice::Right {
                break;
            }
            let seen = if faces { words::facing(&advice) } else { advice };
            let cue = with_scale(&camera.lens, |scale| words::cue(&seen, scale));
            if told.last() != Some(&cue.sentence) {
                told.push(cue.sentence.clone());
            }
            // To hold or tighten it, the person waits as long as told.
            match advice {
                Advice::Hold { .. } | Advice::Tighten { .. } => {
                    now_secs += cue.number.trim_end_matches(" s").parse::<f64>().expect("s") + 0.5;
                }
                _ => {
                    let by = format!("It's {} off. {}", cue.number, cue.sentence);
                    pushes += camera.follow(&by, Ruler::Pixels, faces);
                    now_secs += 1.0;
                }
            }
            assert!(pushes < 12 && now_secs < 120.0, "{told:?}, {:?} px off", camera.off_px());
        }
        let off_px = camera.off_px();
        let hours = (1..=6).find(|_| camera.wait(1, 1.0) == State::Ok);
        let stays = (0..16).all(|_| camera.wait(1, 3.0) == State::Ok);
        println!("{told:?}: {pushes} pushes, {off_px:.2?} px left, OK after {hours:?} pictures");
        assert!((0..3).all(|i| off_px[i] < visible_px[i]), "{off_px:?} px off");
        assert!(hours.is_some() && stays, "{}", camera.said());
    }
}

/// A camera nudged along the arrow until the first "Hold it there" ends up at the limit.
#[test]
#[ignore = "takes half a minute"]
fn long_who_stops_as_soon_as_told_is_right_for_good() {
    let learned = Installed::learned();
    let f = learned.street.camera.f_px.x;
    let px_per_rad = [f, f, learned.lens.half_diagonal_px()];
    let limits_px = learned.watch.may_be_left_px();
    for side in [1.0, -1.0] {
        let mut camera = learned.clone();
        camera.push(px_per_rad.map(|px_per_rad| side / px_per_rad));
        let mut way = Adjust::new(limits_px);
        let mut nudges = 0;
        while let Advice::Push { axis, off_px } = way.handle(f64::from(nudges), camera.off()) {
            let mut by_rad = [0.0; 3];
            by_rad[axis as usize] = 0.1 * off_px.signum() / px_per_rad[axis as usize];
            camera.push(by_rad);
            nudges += 1;
            assert!(nudges < 60, "{:?} px off", camera.off_px());
        }
        let off_px = camera.off_px();
        println!("{nudges} nudges into {:.2?} px: {off_px:.2?} px left", limits_px.as_slice());
        let stays = (0..16).all(|_| camera.wait(1, 3.0) == State::Ok);
        assert!(stays, "{}", camera.said());
    }
}

/// Lens of a camera without drawn pictures.
fn undrawn() -> Lens {
    let camera = Camera::pinhole(417.0, nalgebra::Point2::new(320.0, 240.0));
    Lens::new(camera, None, Street::new(1).image_size)
}

/// Measurement of a picture at the given hour: a pan by `pan_px`, and up to half of `chance_px`
/// more.
fn panned(lens: &Lens, hour: u32, (pan_px, chance_px): (f64, f64)) -> Input {
    let chance = f64::from((hour * 7919) % 97) / 97.0 - 0.5;
    let answer = Answer {
        turn: [1e6 * (pan_px + chance_px * chance) / lens.camera.f_px.x, 0.0, 0.0, 0.0],
        cov: [0.01, 0.0, 0.0, 0.0, 0.01, 0.0, 0.0, 0.01, 0.0, 0.01],
        patches: [180, 140],
        sought: Some(200),
        sharp: None,
        contrast: None,
        shake: None,
        causes: None,
    };
    let at = 1.774e9 + HOUR_SECS * f64::from(hour);
    Input::Picture(Box::new(Picture { at, late: false, answer: Some(answer), none: None }))
}

#[test]
fn pictures_from_before_a_push_put_nothing_back() {
    let lens = undrawn();
    let mut watch = Watch::new(&lens);
    let mut moved = 0;
    for hour in 0..24 * 40 {
        let day = f64::from(hour) / 24.0;
        // Pushed for five days, and then for good.
        let pushed_px = if (18.0..23.0).contains(&day) || day > 36.0 { 2.5 } else { 0.0 };
        let decision = watch.handle(&panned(&lens, hour, (pushed_px, 0.1)));
        moved += u32::from(matches!(decision.state, State::Moved(_)));
    }
    assert!(moved > 24 * 7, "{moved} hours");
    // Late pictures from before don't put it back.
    let told = watch.decision().clone();
    assert!(matches!(told.state, State::Moved(_)), "{told:?}");
    for hour in 24 * 34..24 * 35 {
        let Input::Picture(picture) = panned(&lens, hour, (0.0, 0.1)) else { unreachable!() };
        let late = Input::Picture(Box::new(Picture { late: true, ..*picture }));
        assert_eq!(watch.handle(&late), told);
    }
}
