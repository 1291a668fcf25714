//! Views as people take without guidance: boards of every size, tilt and place. Sound data must not
//! be blamed.

use boresight_calibrate::{Calibration, CalibrationParams, Verdict, calibrate};
use boresight_geometry::{Camera, Distortion};
use boresight_testkit::trust::{Pose, SIZE, Scene, board};
use nalgebra::Vector2;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// A camera with a focal length of up to three picture widths.
fn camera_and_hand(seed: u64, longest: f64) -> Scene {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let f_px = rng.random_range(0.7..longest) * f64::from(SIZE.width_px);
    let off = Vector2::new(rng.random_range(-30.0..30.0), rng.random_range(-30.0..30.0));
    let narrow = (f64::from(SIZE.width_px) / f_px).powi(2);
    let distortion = Distortion {
        k1: -0.2 / narrow.max(0.3),
        k2: 0.05 / narrow.max(0.3),
        ..Distortion::default()
    };
    let camera = Camera { distortion, ..Camera::pinhole(f_px, SIZE.centre_px() + off) };
    Scene { camera, noise_px: 0.2, rng, whole_board: true }
}

fn natural(scene: &mut Scene, count: usize, fill: std::ops::Range<f64>) -> Vec<Pose> {
    (0..count)
        .map(|_| Pose {
            tilt_deg: scene.rng.random_range(5.0..55.0),
            slot_deg: scene.rng.random_range(0.0..360.0),
            fill: scene.rng.random_range(fill.clone()),
            off: [scene.rng.random_range(-0.3..0.3), scene.rng.random_range(-0.3..0.3)],
        })
        .collect()
}

fn calibrated(scene: &mut Scene, plan: &[Pose]) -> Calibration {
    let views = scene.views(plan);
    calibrate(&views, &board(), SIZE, &CalibrationParams::default()).expect("calibrates")
}

#[test]
fn no_view_keeps_the_reversed_tilt() {
    let mut worst: f64 = 0.0;
    for seed in 0..100 {
        let (longest, fill) = if seed % 2 == 0 { (1.1, 0.2..0.7) } else { (3.0, 0.12..0.4) };
        let mut scene = camera_and_hand(seed, longest);
        let plan = natural(&mut scene, 12 + (seed as usize % 3) * 9, fill);
        let found = calibrated(&mut scene, &plan);
        let ratio = found.rms_px / scene.noise_px;
        worst = worst.max(ratio);
        assert!(ratio < 1.1, "seed {seed}: residuals are {ratio:.2} times the noise");
    }
    println!("largest residuals: {worst:.3} times the noise");
}

#[test]
fn many_sound_views_are_of_one_camera() {
    for (seed, count) in [(1, 60), (2, 100), (3, 200), (4, 400)] {
        let mut scene = camera_and_hand(1000 + seed, 1.1);
        let plan = natural(&mut scene, count, 0.3..0.7);
        let found = calibrated(&mut scene, &plan);
        let codes: Vec<&str> = found.findings.iter().map(|finding| finding.code.code()).collect();
        assert_eq!(found.verdict, Verdict::Good, "{count} views: {codes:?}");
        assert!(!codes.contains(&"VIEWS-MIXED"), "{count} views: {codes:?}");
    }
}
