//! Guided sessions of simulated people with ordinary cameras, as a table: duration, result, and
//! coverage of the truth by the stated uncertainty. Corners are projected row by row through a
//! rolling shutter; no picture is drawn.
//!
//! ```text
//! people SEEDS [ROW | grid [ROW]]
//! ```
//!
//! `grid` varies the frame rate and the readout of the usual person's camera.

mod best_turn;
mod outlines;

use std::{
    collections::{BTreeMap, VecDeque},
    sync::Mutex,
    thread,
};

use best_turn::{differences_px, rms_px};
use boresight_app::PersonCues;
use boresight_calibrate::{
    Calibration, CalibrationParams, Finding, FindingCode, Verdict, calibrate,
};
use boresight_detect::{Detection, Miss, Quality};
use boresight_geometry::{
    Camera, Corner,
    frame::{CaptureTime, FrameId, FrameKind, ImageSize},
};
use boresight_guide::{
    guidance::{GuidanceParams, Progress},
    session::{Input, Observation, Outcome, Session, SessionSetup},
};
use boresight_sim::{
    Scene,
    technician::{Person, Technician, TechnicianParams},
};
use nalgebra::{Isometry3, Point2, Point3, Vector2};
use outlines::outlines;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// Time limit of a person.
const PATIENCE_SECS: f64 = 120.0;
/// Causes of a finding that may be named.
const CAUSES: [&str; 10] = [
    "FOCUS-MOVED",
    "VIEWS-MIXED",
    "PIXELS-NOT-SQUARE",
    "PIXELS-SKEWED",
    "BOARD-STRETCHED",
    "BOARD-BENT",
    "BOARD-FLEXES",
    "ROLLING-SHUTTER",
    "PICTURE-SHIFTED",
    "LENS-OTHER",
];
/// Minimum distance of a measured corner from the picture's edge.
const EDGE_PX: f64 = 4.0;

/// A person with a camera: times in milliseconds, the noise of a corner in pixels, the board's bend
/// in millimetres.
struct Row {
    name: String,
    person: Person,
    habit: fn(TechnicianParams) -> TechnicianParams,
    size: (u32, u32),
    per_sec: f64,
    exposure_ms: f64,
    readout_ms: f64,
    noise_px: f64,
    bend_mm: f64,
}

impl Row {
    /// True if the simulated camera or board has the cause.
    fn has(&self, cause: &str) -> bool {
        match cause {
            "BOARD-BENT" => self.bend_mm > 0.0,
            "ROLLING-SHUTTER" => self.readout_ms > 0.0,
            _ => false,
        }
    }

    /// Code of a finding that names only causes that aren't there.
    fn false_cause(&self, finding: &Finding) -> Option<&'static str> {
        let code = finding.code.code();
        let is_false = match finding.code {
            FindingCode::CauseUnclear { candidates, .. } => {
                !candidates.into_iter().flatten().any(|cause| self.has(cause))
            }
            _ => CAUSES.contains(&code) && !self.has(code),
        };
        is_false.then_some(code)
    }
}

fn rows() -> Vec<Row> {
    let same = |habit| habit;
    let row = |name: &str,
               person,
               size,
               per_sec,
               [exposure_ms, readout_ms, noise_px, bend_mm]: [f64; 4]| Row {
        name: name.into(),
        person,
        habit: same,
        size,
        per_sec,
        exposure_ms,
        readout_ms,
        noise_px,
        bend_mm,
    };
    let (hd, vga, usual) = ((1280, 720), (640, 480), Person::Usual);
    vec![
        row("usual 1280, 8 ms", usual, hd, 30.0, [8.0, 0.0, 0.05, 0.0]),
        row("usual 1280, 25 ms, readout 15 ms", usual, hd, 30.0, [25.0, 15.0, 0.1, 0.3]),
        row("usual 1280, 33 ms, readout 25 ms", usual, hd, 30.0, [33.0, 25.0, 0.1, 0.3]),
        row("usual 640, 8 ms, readout 10 ms", usual, vga, 15.0, [8.0, 10.0, 0.05, 0.0]),
        row("usual 640, 60 ms, readout 25 ms", usual, vga, 15.0, [60.0, 25.0, 0.1, 0.5]),
        row("usual 640, 33 ms, readout 30 ms", usual, vga, 10.0, [33.0, 30.0, 0.3, 1.0]),
        row("portrait 720", usual, (720, 1280), 30.0, [16.0, 15.0, 0.1, 0.0]),
        row("shaky 1280", Person::Shaky, hd, 30.0, [16.0, 15.0, 0.1, 0.3]),
        row("tired 640", Person::Tired, vga, 30.0, [16.0, 15.0, 0.1, 0.0]),
        row("steady 1920", Person::Steady, (1920, 1080), 60.0, [5.0, 5.0, 0.05, 0.0]),
        Row {
            habit: |habit| TechnicianParams { wanders: true, ..habit },
            ..row("doesn't look, 1280", usual, hd, 30.0, [25.0, 15.0, 0.1, 0.0])
        },
        Row {
            habit: |habit| TechnicianParams { wanders: true, ..habit },
            ..row("doesn't look, 640", usual, vga, 15.0, [33.0, 15.0, 0.1, 0.0])
        },
        Row {
            habit: |habit| TechnicianParams { leaves_for_secs: 30.0, ..habit },
            ..row("walks away for 30 s", usual, hd, 30.0, [16.0, 15.0, 0.1, 0.0])
        },
        Row {
            habit: |habit| TechnicianParams { covers_every_secs: 8.0, ..habit },
            ..row("covers the board", usual, hd, 30.0, [16.0, 15.0, 0.1, 0.0])
        },
    ]
}

/// Cameras at all frame rates and readouts; every other one is quiet.
fn grid() -> Vec<Row> {
    let readouts = [0.0, 10.0, 20.0, 30.0].into_iter().enumerate();
    let row = |(nth, (per_sec, (of_readout, readout_ms))): (usize, (f64, (usize, f64)))| Row {
        name: format!("{per_sec} per s, readout {readout_ms} ms"),
        person: Person::Usual,
        habit: |habit| habit,
        size: if nth % 3 == 2 { (720, 1280) } else { (1280, 720) },
        per_sec,
        exposure_ms: [8.0, 16.0, 25.0, 33.0][(nth + of_readout) % 4],
        readout_ms,
        noise_px: if nth % 2 == 0 { 0.03 } else { 0.1 },
        bend_mm: 0.2,
    };
    let rates = [6.0, 10.0, 15.0, 30.0].into_iter();
    rates.flat_map(|rate| readouts.clone().map(move |it| (rate, it))).enumerate().map(row).collect()
}

/// Result of a session.
struct Came {
    secs: f64,
    views: usize,
    longest_wait_secs: f64,
    complete: bool,
    verdict: Option<Verdict>,
    /// Error over the boards and over the picture, each as a multiple of the bound.
    beyond: Option<[f64; 2]>,
    /// Error over the boards from the corners as seen, as a multiple of the session's error.
    plain: Option<f64>,
    false_causes: Vec<&'static str>,
    /// Of f and the principal point.
    z: Option<[f64; 3]>,
    sentences_per_sec: f64,
}

/// Poses of the person's board, by millisecond: rows of a picture are read while the next is
/// exposed.
struct Poses {
    person: Technician,
    known: VecDeque<(u64, Isometry3<f64>)>,
}

impl Poses {
    fn at(&mut self, secs: f64) -> Isometry3<f64> {
        let ms = (1e3 * secs).max(0.0);
        let first = ms.floor() as u64;
        while self.known.back().is_none_or(|(last, _)| *last <= first) {
            let next = self.known.back().map_or(0, |(last, _)| last + 1);
            let pose = self.person.pose_at(CaptureTime { nanos: next * 1_000_000 });
            self.known.push_back((next, pose));
            if self.known.len() > 400 {
                self.known.pop_front();
            }
        }
        let from = self.known.front().map_or(0, |(ms, _)| *ms);
        let index = first.saturating_sub(from) as usize;
        let (a, b) = (self.known[index].1, self.known[index + 1].1);
        a.try_lerp_slerp(&b, ms - first as f64, 1e-12).unwrap_or(a)
    }
}

fn session_of(row: &Row, seed: u64) -> Came {
    let (width_px, height_px) = row.size;
    let image_size = ImageSize { width_px, height_px };
    let random = Scene::random(seed);
    // The same lens for a picture of another size.
    let scale = f64::from(width_px.max(height_px)) / f64::from(random.image_size.width_px);
    let off_px = (random.camera.pp_px - random.image_size.centre_px()) * scale;
    let camera = Camera {
        f_px: random.camera.f_px * scale,
        pp_px: image_size.centre_px() + off_px,
        ..random.camera
    };
    let scene = Scene {
        image_size,
        camera,
        bend_m: 1e-3 * row.bend_mm,
        frame_interval_nanos: (1e9 / row.per_sec) as u64,
        technician: (row.habit)(row.person.params()),
        ..random
    };
    let corners_m = scene.corners_as_bent_m();
    let mut poses = Poses { person: Technician::new(&scene), known: VecDeque::new() };
    let mut rng = ChaCha8Rng::seed_from_u64(seed ^ 0x5eed);
    let mut session = Session::new(SessionSetup {
        board: scene.board,
        image_size,
        guidance: GuidanceParams::default(),
        calibration: CalibrationParams::default(),
    });
    let (mut cues, mut frame, mut last_view_secs, mut longest_wait_secs) =
        (PersonCues::default(), 0, 0.0_f64, 0.0_f64);
    let (mut sentences, mut sentence) = (0, None);
    let mut secs = 0.1;
    while session.progress() == Progress::Collecting && secs < PATIENCE_SECS {
        frame += 1;
        let captured_at = CaptureTime { nanos: (1e9 * secs) as u64 };
        let seen = look(row, &scene, &corners_m, &mut poses, secs, &mut rng);
        let observation = Observation {
            frame_id: FrameId(frame),
            captured_at,
            kind: FrameKind::Video,
            name: String::new(),
            image_size,
            seen,
        };
        let decision = session.handle(&Input::Observed(observation));
        if matches!(decision.outcome, Outcome::Accepted { .. }) {
            longest_wait_secs = longest_wait_secs.max(secs - last_view_secs);
            last_view_secs = secs;
        }
        let snapshot = session.snapshot(decision);
        if sentence.replace(snapshot.shown.prompt) != Some(snapshot.shown.prompt) {
            sentences += 1;
        }
        for cue in cues.after(captured_at, &snapshot) {
            poses.person.read(cue);
        }
        secs += 1.0 / row.per_sec;
    }
    let result = session.calibration();
    let z = result.map(|result| {
        let sd = result.sd();
        let pp_px = result.camera.pp_px - camera.pp_px;
        [(result.camera.f_px.x - camera.f_px.x) / sd[0], pp_px.x / sd[2], pp_px.y / sd[3]]
    });
    let as_seen: Vec<Vec<Corner>> =
        session.accepted().iter().map(|taken| taken.seen.clone()).collect();
    let boards = outlines(&scene.board, &as_seen);
    let is_covered = |px: &Point2<f64>| boards.iter().any(|board| board.covers(px));
    let covered_px = |result: &Calibration| error_px(result, &camera, &is_covered);
    let beyond = result.and_then(|result| {
        let picture = error_px(result, &camera, &|_| true) / result.picture_bound_px()?;
        Some([covered_px(result) / result.covered_bound_px?, picture])
    });
    let plain = calibrate(&as_seen, &scene.board, image_size, &CalibrationParams::default());
    let plain = result.zip(plain.ok());
    let false_causes = result.map_or_else(Vec::new, |result| {
        result.findings.iter().filter_map(|finding| row.false_cause(finding)).collect()
    });
    Came {
        secs,
        views: session.accepted().len(),
        longest_wait_secs: longest_wait_secs.max(secs - last_view_secs),
        complete: session.progress() == Progress::Complete,
        verdict: result.map(|result| result.verdict),
        beyond,
        plain: plain.map(|(result, plain)| covered_px(&plain) / covered_px(result)),
        false_causes,
        z,
        sentences_per_sec: f64::from(sentences) / secs,
    }
}

/// Detection in the picture with the middle row exposed at `secs`.
fn look(
    row: &Row,
    scene: &Scene,
    corners_m: &[Point3<f64>],
    poses: &mut Poses,
    secs: f64,
    rng: &mut ChaCha8Rng,
) -> Result<Detection, Miss> {
    let (width, height) = (f64::from(row.size.0), f64::from(row.size.1));
    let shown = |poses: &mut Poses, point: &Point3<f64>| -> Option<Point2<f64>> {
        let mut row_secs = secs;
        let mut px = Point2::origin();
        for _ in 0..2 {
            let exposed = [-0.4, 0.0, 0.4].map(|part| row_secs + 1e-3 * row.exposure_ms * part);
            let mut sum = Vector2::zeros();
            for at in exposed {
                let seen = poses.at(at).transform_point(point);
                sum += scene.camera.project(&seen)?.coords / 3.0;
            }
            px = Point2::from(sum);
            let part = (px.y / height - 0.5).clamp(-0.5, 0.5);
            row_secs = secs + 1e-3 * row.readout_ms * part;
        }
        Some(px)
    };
    let hand = poses.person.hand_at(CaptureTime { nanos: (1e9 * secs) as u64 });
    let mut normal = || -> f64 { row.noise_px * Distribution::<f64>::sample(&StandardNormal, rng) };
    let corners: Vec<Corner> = corners_m
        .iter()
        .map(|point| {
            let Some(px) = shown(poses, point) else { return Corner::unseen(Point2::origin()) };
            let px = px + Vector2::new(normal(), normal());
            let inside = |at: f64, end: f64| at > EDGE_PX && at < end - EDGE_PX;
            let covered = hand.is_some_and(|hand| hand.distance_m(&point.xy()) < 0.0);
            if inside(px.x, width) && inside(px.y, height) && !covered {
                Corner::isotropic(px, row.noise_px)
            } else {
                Corner::unseen(px)
            }
        })
        .collect();
    let (found, wanted) = (corners.iter().filter(|corner| corner.is_seen()).count(), corners.len());
    let quality = Quality { blur_px: 0.8, contrast: 80.0, glare: 0.0, motion_px: 0.0 };
    match found {
        0 => Err(Miss::NoBoard),
        _ if 2 * found >= wanted => Ok(Detection { corners, quality }),
        _ => Err(Miss::PartialBoard { found, wanted, size: [0; 2], cut_off_by: None }),
    }
}

/// Root mean square error of projection a coordinate over a part of the picture, after the best
/// rotation of the camera.
fn error_px(found: &Calibration, truth: &Camera, is_inside: &dyn Fn(&Point2<f64>) -> bool) -> f64 {
    let project = |point: &_| found.camera.project(point);
    differences_px(truth, &project, found.image_size, is_inside)
        .map_or(f64::INFINITY, |differences| rms_px(&differences))
}

fn quantile(values: impl Iterator<Item = f64>, part: f64) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    let last = values.len().saturating_sub(1) as f64;
    values.get((part * last).round() as usize).copied().unwrap_or(f64::NAN)
}

fn print(name: &str, all: &[Came]) {
    let count = |is: &dyn Fn(&Came) -> bool| all.iter().filter(|came| is(came)).count();
    let z = |i: usize| {
        let squares: Vec<f64> = all.iter().filter_map(|came| Some(came.z?[i].powi(2))).collect();
        (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt()
    };
    let secs = |part| quantile(all.iter().map(|came| came.secs), part);
    let mut named: BTreeMap<&str, usize> = BTreeMap::new();
    let causes = all.iter().flat_map(|came| &came.false_causes);
    causes.for_each(|cause| *named.entry(cause).or_default() += 1);
    let names: Vec<String> =
        named.iter().map(|(cause, count)| format!("{count} {cause}")).collect();
    let wait = |part| quantile(all.iter().map(|came| came.longest_wait_secs), part);
    println!(
        "| {name} | {:.1} / {:.1} | {:.0} | {:.1} / {:.1} | {} of {} | {} / {} / {} | {}, {} | {} | {:.2} | {}: {} | {:.2} {:.2} {:.2} | {:.2} |",
        secs(0.5),
        secs(0.95),
        quantile(all.iter().map(|came| came.views as f64), 0.5),
        wait(0.5),
        wait(0.95),
        count(&|came| came.complete),
        all.len(),
        count(&|came| came.verdict == Some(Verdict::Good)),
        count(&|came| came.verdict == Some(Verdict::Care)),
        count(&|came| !matches!(came.verdict, Some(Verdict::Good | Verdict::Care))),
        count(&|came| came.beyond.is_some_and(|[boards, _]| boards <= 1.0)),
        count(&|came| came.beyond.is_some_and(|[_, picture]| picture <= 1.0)),
        count(&|came| {
            let is_far = came.beyond.is_none_or(|of| of.into_iter().any(|times| times > 2.0));
            came.verdict == Some(Verdict::Good) && is_far
        }),
        quantile(all.iter().filter_map(|came| came.plain), 0.5),
        count(&|came| !came.false_causes.is_empty()),
        names.join(", "),
        z(0),
        z(1),
        z(2),
        quantile(all.iter().map(|came| came.sentences_per_sec), 0.5),
    );
}

fn main() -> anyhow::Result<()> {
    let mut arguments = std::env::args().skip(1);
    let seeds: u64 = arguments.next().map_or(Ok(10), |seeds| seeds.parse())?;
    let mut only = arguments.next();
    let mut rows = rows();
    if only.as_deref() == Some("grid") {
        (rows, only) = (grid(), arguments.next());
    }
    println!(
        "| person, camera | s: median / 95 % | views | longest wait: median / 95 % | complete | GOOD / CARE / other | inside: boards, picture | GOOD beyond two bounds | error as seen, times | false causes | z of f, cx, cy | sentences per s |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|---|");
    let mut everything = Vec::new();
    for row in rows.iter().filter(|row| only.as_ref().is_none_or(|only| row.name.contains(only))) {
        let (next, came) = (Mutex::new(1..=seeds), Mutex::new(Vec::new()));
        let work = || {
            while let Some(seed) = next.lock().ok().and_then(|mut seeds| seeds.next()) {
                let of_seed = session_of(row, seed);
                if let Ok(mut came) = came.lock() {
                    came.push(of_seed);
                }
            }
        };
        thread::scope(|scope| {
            let other = thread::Builder::new().name("people".into()).spawn_scoped(scope, work);
            work();
            drop(other);
        });
        let came = came.into_inner().unwrap_or_default();
        print(&row.name, &came);
        everything.extend(came);
    }
    print("all", &everything);
    Ok(())
}
