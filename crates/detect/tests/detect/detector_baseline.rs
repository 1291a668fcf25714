//! Detections in a set of hard pictures, with errors: they may only improve.
//!
//! `BORESIGHT_BASELINE=tighten cargo test -p boresight-detect detector_baseline` stores
//! improvements.

use std::{collections::BTreeMap, fs};

use boresight_detect::{Detector, DetectorParams};
use boresight_sim::{Scene, render_view};
use boresight_testkit::fixture;
use nalgebra::{Isometry3, Point2, UnitQuaternion, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

const FILE: &str = "detector_baseline.json";
const PICTURES: u64 = 80;
/// A fit from another start ends slightly elsewhere; mathematical libraries round differently.
const SLACK_RMS_PX: f64 = 0.002;
const SLACK_WORST_PX: f64 = 0.02;

/// Largest and root mean square corner error of a picture; `None` without a board.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct Seen {
    worst_px: f64,
    rms_px: f64,
}

/// A view to avoid: steep, small, blurred, dark or noisy.
fn hard_view(seed: u64) -> (Scene, Isometry3<f64>) {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut scene = Scene::random(seed);
    scene.clutter = rng.random_range(0.3..1.0);
    scene.noise_sigma = [1.0, 2.0, 4.0, 8.0][rng.random_range(0..4)];
    scene.psf_sigma_px = [0.4, 0.7, 1.5, 3.0][rng.random_range(0..4)];
    scene.light.gradient = rng.random_range(0.0..0.7);
    scene.light.light_level = rng.random_range(90.0..250.0);
    let tilt_rad = rng.random_range(20.0_f64..62.0).to_radians();
    let (sin, cos) = rng.random_range(0.0..std::f64::consts::TAU).sin_cos();
    let tilt = UnitQuaternion::from_scaled_axis(Vector3::new(sin, -cos, 0.0) * tilt_rad);
    let turn = UnitQuaternion::from_scaled_axis(
        Vector3::z() * rng.random_range(0.0..std::f64::consts::TAU),
    );
    let depth_m = scene.camera.f_px.x / 1000.0 * rng.random_range(0.35..1.1);
    let at_m = Vector3::new(rng.random_range(-0.1..0.1), rng.random_range(-0.05..0.05), 1.0);
    (scene, Isometry3::from_parts((at_m * depth_m).into(), tilt * turn))
}

#[test]
fn no_picture_has_become_worse() {
    let path = fixture(FILE);
    let known: BTreeMap<u64, Option<Seen>> = fs::read_to_string(&path)
        .map(|text| serde_json::from_str(&text).expect("the baseline is readable"))
        .unwrap_or_default();
    let mut detector = Detector::new(DetectorParams::default());
    let mut now = BTreeMap::new();
    for seed in 0..PICTURES {
        let (scene, pose) = hard_view(seed);
        let truth: Option<Vec<Point2<f64>>> = scene
            .board
            .corners_in_board_m()
            .iter()
            .map(|m| scene.camera.px_from_board(&pose, m))
            .collect();
        let size = scene.image_size;
        let inside = |px: &Point2<f64>| {
            (10.0..f64::from(size.width_px) - 10.0).contains(&px.x)
                && (10.0..f64::from(size.height_px) - 10.0).contains(&px.y)
        };
        let Some(truth) = truth.filter(|truth| truth.iter().all(inside)) else { continue };
        let seen = detector.detect(&render_view(&scene, &pose), &scene.board).ok().map(|seen| {
            let off =
                seen.corners.iter().zip(&truth).map(|(corner, truth)| (corner.px - truth).norm());
            let (worst_px, squares) =
                off.fold((0.0_f64, 0.0), |(worst, sum), off| (worst.max(off), sum + off * off));
            Seen { worst_px, rms_px: (squares / truth.len() as f64).sqrt() }
        });
        // Wrong is worse than missing, whatever the baseline.
        assert!(seen.is_none_or(|seen| seen.worst_px < 3.0), "picture {seed}: {seen:?}");
        now.insert(seed, seen);
    }
    if std::env::var("BORESIGHT_BASELINE").is_ok_and(|word| word == "tighten") {
        let better = now.iter().map(|(seed, seen)| {
            let known = known.get(seed).copied().flatten();
            let best = match (known, *seen) {
                (Some(known), Some(seen)) => Some(Seen {
                    worst_px: known.worst_px.min(seen.worst_px),
                    rms_px: known.rms_px.min(seen.rms_px),
                }),
                (known, seen) => known.or(seen),
            };
            (*seed, best)
        });
        let text = serde_json::to_string_pretty(&better.collect::<BTreeMap<_, _>>());
        fs::write(&path, text.expect("numbers have a text") + "\n")
            .expect("the baseline is written");
    }
    assert!(!known.is_empty(), "there is no fixtures/{FILE}");
    for (seed, known) in known {
        let Some(known) = known else { continue };
        let seen = now.get(&seed).copied().flatten();
        let seen = seen.unwrap_or_else(|| panic!("picture {seed} is no longer found"));
        assert!(
            seen.rms_px <= known.rms_px + SLACK_RMS_PX
                && seen.worst_px <= known.worst_px + SLACK_WORST_PX,
            "picture {seed}: {seen:?}, was {known:?}"
        );
    }
    let found = now.values().flatten().count();
    println!("{found} of {} found", now.len());
}
