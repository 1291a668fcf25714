//! The stated uncertainty against the spread of repeated experiments with known truth.

use std::time::Instant;

use boresight::board::Checkerboard;
use boresight::calibration::{Calibration, CalibrationParams, LensModel, Verdict, calibrate};
use boresight::frame::ImageSize;
use boresight::geometry::{Camera, Corner, Distortion};
use nalgebra::{Isometry3, Point2, Rotation3, Translation3, UnitQuaternion, Vector2, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};

const SIZE: ImageSize = ImageSize { width_px: 1920, height_px: 1080 };
const NOISE_PX: f64 = 0.3;

fn board() -> Checkerboard {
    Checkerboard::new(9, 6, 0.03).expect("valid")
}

fn camera(distortion: Distortion) -> Camera {
    Camera { distortion, ..Camera::pinhole(1400.0, Point2::new(1010.0, 500.0)) }
}

/// Board tilted by `tilt_deg`, receding towards `slot_deg`, its centre ahead of the principal point.
fn pose(tilt_deg: f64, slot_deg: f64, distance_m: f64) -> Isometry3<f64> {
    let slot = slot_deg.to_radians();
    // Turning about (−sin, cos)·s makes the side towards the slot recede.
    let axis = Vector3::new(slot.sin(), -slot.cos(), 0.0) * tilt_deg.to_radians();
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_scaled_axis(-axis));
    Isometry3::from_parts(Translation3::new(0.0, 0.0, distance_m), rotation)
}

fn eight_slots() -> Vec<Isometry3<f64>> {
    [0.0, 180.0, 90.0, 270.0, 45.0, 225.0, 135.0, 315.0].map(|slot| pose(40.0, slot, 0.28)).to_vec()
}

fn views(
    camera: &Camera,
    poses: &[Isometry3<f64>],
    noise_px: f64,
    claimed_px: f64,
    rng: &mut ChaCha8Rng,
) -> Vec<Vec<Corner>> {
    let normal = Normal::new(0.0, noise_px).expect("positive");
    let board_m = board().corners_in_board_m();
    poses
        .iter()
        .map(|pose| {
            board_m
                .iter()
                .map(|p| {
                    let px = camera.project_board_point(pose, p).expect("in front").px;
                    let noise = Vector2::new(normal.sample(rng), normal.sample(rng));
                    Corner::isotropic(px + noise, claimed_px)
                })
                .collect()
        })
        .collect()
}

fn run(views: &[Vec<Corner>], params: &CalibrationParams) -> Calibration {
    calibrate(views, &board(), SIZE, params).expect("calibrates")
}

fn codes(calibration: &Calibration) -> Vec<&'static str> {
    calibration.findings.iter().map(|finding| finding.code.code()).collect()
}

struct Trials {
    /// Root mean square error over root mean square stated sd, per f, cx, cy.
    ratio: [f64; 3],
    /// Share of trials with the true PP inside the 2-sd ellipse.
    coverage: f64,
    good: usize,
    median_off_px: f64,
}

fn trials(count: u32, truth: &Camera, params: &CalibrationParams) -> Trials {
    let poses = eight_slots();
    let mut squares = [[0.0; 2]; 3];
    let (mut inside, mut good, mut off_px) = (0, 0, Vec::new());
    for seed in 0..count {
        let mut rng = ChaCha8Rng::seed_from_u64(u64::from(seed));
        // Corners claim twice their real error: the result must not believe them.
        let seen = views(truth, &poses, NOISE_PX, 2.0 * NOISE_PX, &mut rng);
        let found = run(&seen, params);
        let (sd, ours, theirs) =
            (found.sd(), found.camera.lens_parameters(), truth.lens_parameters());
        for (slot, i) in [0, 2, 3].into_iter().enumerate() {
            squares[slot][0] += (ours[i] - theirs[i]).powi(2);
            squares[slot][1] += sd[i] * sd[i];
        }
        let off = found.camera.pp_px - truth.pp_px;
        let covariance = found.pp_covariance_px2();
        let inverse = covariance.try_inverse().expect("positive definite");
        inside += u32::from((off.transpose() * inverse * off).x <= 4.0);
        good += usize::from(found.verdict == Verdict::Good);
        off_px.push(off.norm());
    }
    off_px.sort_by(f64::total_cmp);
    Trials {
        ratio: squares.map(|[error, sd]| (error / sd).sqrt()),
        coverage: f64::from(inside) / f64::from(count),
        good,
        median_off_px: off_px[off_px.len() / 2],
    }
}

#[test]
fn stated_uncertainty_is_the_observed_spread() {
    let truth = camera(Distortion { k1: -0.1, k2: -0.02, ..Distortion::default() });
    let params =
        CalibrationParams { models: vec![LensModel::K1K2], ..CalibrationParams::default() };
    let trials = trials(300, &truth, &params);
    println!("ratio {:?} coverage {}", trials.ratio, trials.coverage);
    for ratio in trials.ratio {
        assert!((ratio - 1.0).abs() < 0.15, "{:?}", trials.ratio);
    }
    // 2 sd in two dimensions: 86.5 %.
    assert!((trials.coverage - 0.865).abs() < 0.06, "{}", trials.coverage);
}

#[test]
fn the_chosen_model_covers_the_truth() {
    let lenses = [
        ("none", Distortion::default()),
        ("k1k2", Distortion { k1: -0.1, k2: -0.02, ..Distortion::default() }),
        ("strong", Distortion { k1: -0.35, k2: 0.15, ..Distortion::default() }),
        (
            "tangential",
            Distortion { k1: -0.2, k2: 0.08, p1: 1e-3, p2: 1e-3, ..Distortion::default() },
        ),
        (
            "slightly tangential",
            Distortion { k1: -0.2, k2: 0.08, p1: 1e-4, p2: 1e-4, ..Distortion::default() },
        ),
    ];
    for (name, lens) in lenses {
        let trials = trials(60, &camera(lens), &CalibrationParams::default());
        println!(
            "{name}: coverage {} good {} of 60, ratio {:.2?}, median off {:.2}",
            trials.coverage, trials.good, trials.ratio, trials.median_off_px
        );
        if name != "slightly tangential" {
            assert!(trials.coverage > 0.75, "{name}: {}", trials.coverage);
        }
    }
}

#[test]
fn eight_views_are_quick() {
    let truth = camera(Distortion { k1: -0.1, k2: -0.02, ..Distortion::default() });
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let seen = views(&truth, &eight_slots(), NOISE_PX, NOISE_PX, &mut rng);
    let start = Instant::now();
    let found = run(&seen, &CalibrationParams::default());
    println!("{:?} {:?} {:?}", start.elapsed(), found.verdict, codes(&found));
    println!("{:#?}", found.findings);
    println!(
        "{:?} sd {:.3?} proj {:.3} {:.3} cov {:.2} skip {:?}",
        found.camera,
        found.sd(),
        found.projection_sd.mean_px,
        found.projection_sd.max_px,
        found.coverage,
        found.skip_one_ratio
    );
    println!("{:#?}", found.principal_point);
    for v in &found.views {
        println!(
            "tilt {:.1} slot {:.1} pl slot {:?} f {:?} res {:?}",
            v.tilt_rad.to_degrees(),
            v.slot_rad.to_degrees(),
            v.principal_line.as_ref().map(|l| l.slot_rad.to_degrees()),
            v.focal,
            v.pl_residual_px
        );
    }
}
