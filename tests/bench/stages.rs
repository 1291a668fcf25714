//! Durations of the stages, each on a usual load. The names state the goals.

#![expect(clippy::expect_used, reason = "a benchmark that cannot go on has failed")]

use std::{hint::black_box, time::Duration};

use boresight::{
    boards::Board,
    calibration::{BundleState, CalibrationParams, LensModel, Observations, adjust, calibrate},
    config::Config,
    detection::{Detection, Detector, DetectorParams, Miss, Prediction, Quality, Search},
    frame::{CaptureTime, FrameId, FrameKind, ImageSize},
    geometry::{Camera, Corner, Distortion, Homography, PrincipalLine},
    session::{Input, Observation, Session},
    simulation::{Scene, render_view},
};
use criterion::{BatchSize, Criterion, criterion_group, criterion_main};
use nalgebra::{Isometry3, Point2, Vector2, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

const SIZE: ImageSize = ImageSize { width_px: 1280, height_px: 720 };

fn board() -> Board {
    Board::new(9, 6, 0.025).expect("valid")
}

fn camera() -> Camera {
    let distortion = Distortion { k1: -0.12, k2: 0.05, ..Distortion::default() };
    Camera { distortion, ..Camera::pinhole(980.0, Point2::new(653.0, 348.0)) }
}

fn pose(tilt_deg: f64, slot_deg: f64) -> Isometry3<f64> {
    let (sin, cos) = slot_deg.to_radians().sin_cos();
    Isometry3::new(
        Vector3::new(0.003, -0.002, 0.31),
        Vector3::new(sin, -cos, 0.0) * tilt_deg.to_radians(),
    )
}

fn corners(tilt_deg: f64, slot_deg: f64) -> Vec<Corner> {
    let mut rng = ChaCha8Rng::seed_from_u64(slot_deg as u64);
    let (camera, pose) = (camera(), pose(tilt_deg, slot_deg));
    let corner = |m: &Point2<f64>| {
        let px = camera.px_from_board(&pose, m).expect("in front");
        let mut normal = || 0.1 * rng.sample::<f64, _>(StandardNormal);
        Corner::isotropic(px + Vector2::new(normal(), normal()), 0.1)
    };
    board().corners_in_board_m().iter().map(corner).collect()
}

fn eight_views() -> Vec<Vec<Corner>> {
    (0..8).map(|slot| corners(40.0, 45.0 * f64::from(slot))).collect()
}

/// Describes the machine, to compare numbers.
fn describe_machine() {
    let cpus = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = cpus
        .lines()
        .find_map(|line| {
            line.strip_prefix("model name").map(|rest| rest.trim_start_matches([' ', '\t', ':']))
        })
        .unwrap_or("unknown processor");
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    println!("machine: {model}, {cores} cores, {}", std::env::consts::ARCH);
}

fn geometry(c: &mut Criterion) {
    describe_machine();
    let (board_m, corners) = (board().corners_in_board_m(), corners(40.0, 30.0));
    c.bench_function("homography + PL + covariance, 54 corners (goal 100 us)", |b| {
        b.iter(|| {
            let homography = Homography::fit(black_box(&board_m), black_box(&corners));
            let homography = homography.expect("a view");
            PrincipalLine::of(&homography, SIZE.centre_px(), Point2::new(640.0, 360.0))
        });
    });
}

fn observation(seen: Result<Detection, Miss>, frame: u64) -> Input {
    Input::Observed(Observation {
        frame_id: FrameId(frame),
        captured_at: CaptureTime { nanos: frame * 33_000_000 },
        kind: FrameKind::Video,
        name: String::new(),
        image_size: SIZE,
        seen,
    })
}

fn session(c: &mut Criterion) {
    let config = Config::load(None, &[]).expect("defaults");
    let mut session = Session::new(config.session(SIZE).expect("board"));
    let quality = Quality { blur_px: 0.8, contrast: 80.0, glare: 0.0, motion_px: 0.0 };
    // Too flat: judged in full, refused, nothing to solve.
    let seen = |tilt_deg| Ok(Detection { corners: corners(tilt_deg, 30.0), quality });
    let inputs: Vec<Input> = (0..64).map(|i| observation(seen(18.0), i)).collect();
    let mut at = 0;
    c.bench_function("Session::handle without solving (goal 1 ms)", |b| {
        b.iter(|| {
            at = (at + 1) % inputs.len();
            session.handle(black_box(&inputs[at]))
        });
    });
}

fn calibration(c: &mut Criterion) {
    let (board, views) = (board(), eight_views());
    let slices: Vec<&[Corner]> = views.iter().map(Vec::as_slice).collect();
    let observations = Observations::new(&board.corners_in_board_m(), &slices).expect("whole");
    // f, cx, cy, k1, k2, p1, p2, k3; started as the session starts it, without distortion.
    let freedom = LensModel::K1K2P1P2K3.freedom(true);
    let start = BundleState {
        camera: Camera::pinhole(960.0, SIZE.centre_px()),
        cam_from_board: (0..8).map(|slot| pose(37.0, 45.0 * f64::from(slot) + 3.0)).collect(),
    };
    c.bench_function("bundle adjustment, 8 views x 54 corners, 8 parameters (goal 30 ms)", |b| {
        b.iter_batched(
            || start.clone(),
            |start| adjust(black_box(&observations), &freedom, None, start).expect("a minimum"),
            BatchSize::SmallInput,
        );
    });
    let params = CalibrationParams::default();
    c.bench_function("calibrate: all models, free homographies, checks; 8 views", |b| {
        b.iter(|| calibrate(black_box(&views), &board, SIZE, &params).expect("a lens"));
    });
}

fn detection(c: &mut Criterion) {
    let mut detector = Detector::new(DetectorParams::default());
    for (width_px, height_px) in [(640, 480), (1280, 720), (1920, 1080), (3840, 2160)] {
        let scale = f64::from(width_px) / 1280.0;
        let mut scene = Scene::default_720p(1);
        scene.image_size = ImageSize { width_px, height_px };
        scene.camera = Camera::pinhole(980.0 * scale, scene.image_size.centre_px());
        let with_board = render_view(&scene, &pose(35.0, 30.0));
        let seen = detector.detect(&with_board, &scene.board).expect("found");
        // As far off as a prediction at constant speed.
        let corners_px = seen.corners.iter().map(|corner| [corner.px.x + 1.5, corner.px.y - 1.0]);
        let corners_px: Vec<_> = corners_px.collect();
        let near = Prediction {
            seen: vec![true; corners_px.len()],
            corners_px,
            spread_squares: 0.25,
            everywhere: false,
        };
        c.bench_function(&format!("follow in {width_px}x{height_px}"), |b| {
            let search = Search { near: Some(&near), ..Search::FULL };
            b.iter(|| detector.search(black_box(&with_board), &scene.board, search));
        });
        let away = Isometry3::translation(9.0, 0.0, 0.4);
        let without = render_view(&scene, &away);
        for (name, picture) in [("a board", &with_board), ("no board", &without)] {
            assert_eq!(detector.detect(picture, &scene.board).is_ok(), name == "a board");
            c.bench_function(&format!("detect in {width_px}x{height_px}, {name}"), |b| {
                b.iter(|| detector.detect(black_box(picture), &scene.board));
            });
        }
    }
}

criterion_group! {
    name = stages;
    config = Criterion::default()
        .sample_size(30)
        .warm_up_time(Duration::from_millis(500))
        .measurement_time(Duration::from_secs(2))
        .without_plots();
    targets = geometry, session, calibration, detection
}
criterion_main!(stages);
