//! Cameras, lenses and hand-held poses drawn at random: the right answer, or a verdict to warn of
//! it.

use std::time::{Duration, Instant};

use boresight_calibrate::{CalibrationParams, Verdict, calibrate};
use boresight_geometry::{Camera, Corner, Distortion, boards::Board, frame::ImageSize};
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector2, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};

const SIZE: ImageSize = ImageSize { width_px: 1280, height_px: 720 };

struct Scene {
    camera: Camera,
    views: Vec<Vec<Corner>>,
}

fn scene(board: &Board, rng: &mut ChaCha8Rng) -> Scene {
    let width = f64::from(SIZE.width_px);
    let f_px = width * 0.5 * 6.0_f64.powf(rng.random_range(0.0..1.0));
    let off = Vector2::new(rng.random_range(-60.0..60.0), rng.random_range(-40.0..40.0));
    let mut camera = Camera::pinhole(f_px, SIZE.centre_px() + off);
    let strength = (2.0 * f_px / width).powi(2);
    camera.distortion = Distortion {
        k1: rng.random_range(-0.12..0.06) * strength.min(4.0),
        k2: rng.random_range(-0.01..0.02) * strength.min(2.0),
        ..Distortion::default()
    };
    let noise = Normal::new(0.0, rng.random_range(0.05..0.5)).expect("positive");
    let count = rng.random_range(4..13);
    let mut views = Vec::new();
    while views.len() < count {
        let share = rng.random_range(0.35..0.7);
        let distance_m = f_px * 8.0 * board.square_m() / (share * width);
        let ahead = Vector3::new(
            rng.random_range(-0.25..0.25) * width / f_px,
            rng.random_range(-0.15..0.15) * width / f_px,
            1.0,
        );
        let turn = UnitQuaternion::from_scaled_axis(Vector3::new(
            rng.random_range(-0.8..0.8),
            rng.random_range(-0.8..0.8),
            rng.random_range(-0.5..0.5),
        ));
        let pose = Isometry3::from_parts(Translation3::from(ahead * distance_m), turn);
        let corners: Option<Vec<Corner>> = board
            .corners_in_board_m()
            .iter()
            .map(|p| {
                let px = camera.project_board_point(&pose, p)?.px;
                let inside = (0.0..width).contains(&px.x)
                    && (0.0..f64::from(SIZE.height_px)).contains(&px.y);
                let px = px + Vector2::new(noise.sample(rng), noise.sample(rng));
                inside.then(|| Corner::isotropic(px, 0.2))
            })
            .collect();
        views.extend(corners);
    }
    Scene { camera, views }
}

#[test]
fn random_scenes_are_solved_or_say_so() {
    let board = Board::new(9, 6, 0.03).expect("valid");
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    let (mut within, mut far, mut verdicts, mut slowest) = (0, 0, [0; 3], Duration::ZERO);
    let scenes = 150;
    for index in 0..scenes {
        let Scene { camera, views } = scene(&board, &mut rng);
        let start = Instant::now();
        let found =
            calibrate(&views, &board, SIZE, &CalibrationParams::default()).expect("calibrates");
        slowest = slowest.max(start.elapsed());
        let off: Vector2<f64> = found.camera.pp_px - camera.pp_px;
        let inverse = found.pp_covariance_px2().try_inverse().expect("positive definite");
        let sigmas = (off.transpose() * inverse * off).x.sqrt();
        let f_sigmas = (found.camera.f_px.x - camera.f_px.x).abs() / found.sd()[0];
        within += u32::from(sigmas <= 2.0);
        let lost = sigmas.max(f_sigmas) > 6.0;
        far += u32::from(lost);
        verdicts[found.verdict as usize] += 1;
        assert!(!(lost && found.verdict == Verdict::Good), "scene {index}: {:?}", found.findings);
    }
    println!("within 2 sd {within}, far {far}, verdicts {verdicts:?}, slowest {slowest:?}");
    assert!(far <= 3, "{far}");
    assert!(within >= scenes * 7 / 10, "{within}");
}
