//! Stated uncertainty against the spread of repeated experiments with known truth.

use boresight_calibrate::{
    Calibration, CalibrationParams, LensModel, NotCalibrated, Severity, Verdict, calibrate,
};
use boresight_geometry::{Camera, Corner, Distortion, boards::Board, frame::ImageSize};
use nalgebra::{Isometry3, Point2, Translation3, UnitQuaternion, Vector2, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};

const SIZE: ImageSize = ImageSize { width_px: 1920, height_px: 1080 };
const NOISE_PX: f64 = 0.3;

fn board() -> Board {
    Board::new(9, 6, 0.03).expect("valid")
}

fn camera(distortion: Distortion) -> Camera {
    Camera { distortion, ..Camera::pinhole(1400.0, Point2::new(1010.0, 500.0)) }
}

/// Board tilted by `tilt_deg`, receding towards `slot_deg`, the centre ahead of the principal
/// point.
fn pose(tilt_deg: f64, slot_deg: f64, distance_m: f64) -> Isometry3<f64> {
    let slot = slot_deg.to_radians();
    // Depth of the board point (cos, sin) becomes positive.
    let axis = Vector3::new(slot.sin(), -slot.cos(), 0.0) * tilt_deg.to_radians();
    let rotation = UnitQuaternion::from_scaled_axis(axis);
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

struct Trials {
    /// Root mean square error over root mean square stated sd, per f, cx, cy.
    ratio: [f64; 3],
    /// Ratio for the principal point of the free homographies.
    free_ratio: f64,
    /// Share of trials with the true PP inside the 2-sd ellipse.
    coverage: f64,
    good: usize,
    median_off_px: f64,
}

fn trials(count: u32, truth: &Camera, params: &CalibrationParams) -> Trials {
    let poses = eight_slots();
    let mut squares = [[0.0; 2]; 3];
    let (mut inside, mut good, mut off_px) = (0, 0, Vec::new());
    let mut free_squares = [0.0; 2];
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
        let free = found.principal_point.free_homography.expect("eight tilted views");
        free_squares[0] += (free.px - truth.pp_px).norm_squared();
        free_squares[1] += free.covariance_px2.expect("stated").trace();
        good += usize::from(found.verdict == Verdict::Good);
        off_px.push(off.norm());
    }
    off_px.sort_by(f64::total_cmp);
    Trials {
        ratio: squares.map(|[error, sd]| (error / sd).sqrt()),
        free_ratio: (free_squares[0] / free_squares[1]).sqrt(),
        coverage: f64::from(inside) / f64::from(count),
        good,
        median_off_px: off_px[off_px.len() / 2],
    }
}

#[test]
#[ignore = "takes minutes: make long-tests"]
fn long_stated_uncertainty_is_the_observed_spread() {
    let truth = camera(Distortion { k1: -0.1, k2: -0.02, ..Distortion::default() });
    let params =
        CalibrationParams { models: vec![LensModel::K1K2], ..CalibrationParams::default() };
    let trials = trials(300, &truth, &params);
    println!("{:.3?}, free {:.3}, {:.3}", trials.ratio, trials.free_ratio, trials.coverage);
    assert!((trials.free_ratio - 1.0).abs() < 0.15, "{}", trials.free_ratio);
    let [of_f, of_x, of_y] = trials.ratio;
    for ratio in [of_x, of_y] {
        assert!((ratio - 1.0).abs() < 0.15, "{:?}", trials.ratio);
    }
    // The stated error of f allows for an invisibly small drift; this camera has none.
    assert!((0.65..1.1).contains(&of_f), "{:?}", trials.ratio);
    // 2 sd in two dimensions: 86.5 %.
    assert!((trials.coverage - 0.865).abs() < 0.06, "{}", trials.coverage);
}

#[test]
#[ignore = "takes minutes: make long-tests"]
fn long_the_chosen_model_covers_the_truth() {
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
        assert!(trials.coverage > 0.75, "{name}: {}", trials.coverage);
    }
}

#[test]
fn eight_slots_give_a_good_result() {
    let truth = camera(Distortion { k1: -0.1, k2: -0.02, ..Distortion::default() });
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let seen = views(&truth, &eight_slots(), NOISE_PX, NOISE_PX, &mut rng);
    let found = run(&seen, &CalibrationParams::default());
    assert_eq!(found.verdict, Verdict::Good, "{:?}", found.findings);
    assert_eq!(found.model, LensModel::K1K2);
    assert!((found.noise_px - NOISE_PX).abs() < 0.03 && (found.noise_factor - 1.0).abs() < 0.1);
    for (view, slot_deg) in found.views.iter().zip([0.0, 180.0, 90.0, 270.0, 45.0]) {
        let focal = view.focal.expect("tilted");
        assert!((focal.f_px - 1400.0).abs() < 4.0 * focal.sigma_px);
        let turned =
            (view.tilt_azimuth_rad.to_degrees() - slot_deg + 180.0).rem_euclid(360.0) - 180.0;
        assert!(turned.abs() < 1.0 && (view.tilt_rad.to_degrees() - 40.0).abs() < 1.0);
    }
}

fn has(calibration: &Calibration, code: &str) -> Option<Severity> {
    let found = calibration.findings.iter().find(|finding| finding.code.code() == code);
    found.map(|finding| finding.severity)
}

fn finite(calibration: &Calibration) {
    assert!(calibration.camera.lens_parameters().iter().all(|x| x.is_finite()));
    assert!(calibration.covariance.iter().all(|x| x.is_finite()));
    assert!(calibration.covariance_all.iter().all(|x| x.is_finite()));
    assert!(calibration.rms_px.is_finite() && calibration.noise_px.is_finite());
    assert!(calibration.projection_sd.mean_px.is_finite());
    for view in &calibration.views {
        assert!(view.tilt_rad.is_finite() && view.tilt_azimuth_rad.is_finite());
    }
}

fn mild() -> Camera {
    camera(Distortion { k1: -0.1, k2: -0.02, ..Distortion::default() })
}

fn seen(poses: &[Isometry3<f64>], noise_px: f64, seed: u64) -> Vec<Vec<Corner>> {
    views(&mild(), poses, noise_px, NOISE_PX, &mut ChaCha8Rng::seed_from_u64(seed))
}

#[test]
fn one_view_is_not_enough() {
    for poses in [vec![pose(40.0, 20.0, 0.28)], vec![pose(0.0, 0.0, 0.28)]] {
        for noise_px in [NOISE_PX, 1e-9] {
            let found = run(&seen(&poses, noise_px, 2), &CalibrationParams::default());
            finite(&found);
            assert_eq!(found.verdict, Verdict::Untrustworthy);
            assert_eq!(has(&found, "VIEWS-FEW"), Some(Severity::Bad));
        }
    }
}

#[test]
fn frontal_views_are_not_enough() {
    let poses: Vec<_> = (0..6)
        .map(|i| {
            Translation3::new(0.01 * f64::from(i), 0.02, 0.0)
                * pose(0.0, 0.0, 0.3 + 0.05 * f64::from(i))
        })
        .collect();
    for noise_px in [NOISE_PX, 1e-9] {
        let found = run(&seen(&poses, noise_px, 3), &CalibrationParams::default());
        finite(&found);
        assert_eq!(found.verdict, Verdict::Untrustworthy);
        assert_eq!(has(&found, "TILT-LOW"), Some(Severity::Bad));
    }
}

#[test]
fn twenty_copies_are_one_view() {
    for (tilt_deg, noise_px) in [(40.0, 0.0), (40.0, NOISE_PX), (0.0, NOISE_PX)] {
        let one = seen(&[pose(tilt_deg, 20.0, 0.28)], NOISE_PX, 4);
        let copies = if noise_px > 0.0 {
            seen(&vec![pose(tilt_deg, 20.0, 0.28); 20], noise_px, 4)
        } else {
            vec![one[0].clone(); 20]
        };
        let found = run(&copies, &CalibrationParams::default());
        finite(&found);
        assert_eq!(found.verdict, Verdict::Untrustworthy);
        assert_eq!(has(&found, "VIEWS-ALIKE"), Some(Severity::Bad));
    }
}

#[test]
fn two_pairs_start_a_result() {
    for count in [2, 3, 4] {
        let found = run(&seen(&eight_slots()[..count], NOISE_PX, 5), &CalibrationParams::default());
        finite(&found);
        assert!((found.camera.f_px.x - 1400.0).abs() < 5.0 * found.sd()[0].max(1.0));
        assert!(found.verdict >= if count < 4 { Verdict::Care } else { Verdict::Good });
    }
}

#[test]
fn exact_corners_are_no_special_case() {
    let found = run(&seen(&eight_slots(), 1e-12, 6), &CalibrationParams::default());
    finite(&found);
    assert!((found.camera.pp_px - mild().pp_px).norm() < 1e-6, "{:?}", found.camera);
    assert_eq!(found.model, LensModel::K1K2);
    assert_eq!(found.verdict, Verdict::Good, "{:?}", found.findings);
}

#[test]
fn a_moving_focus_is_noticed() {
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let moved: Vec<Vec<Corner>> = eight_slots()
        .iter()
        .enumerate()
        .map(|(i, pose)| {
            let mut camera = mild();
            camera.f_px *= 1.0 + 0.01 * (i as f64 * 2.4).sin();
            views(&camera, &[*pose], NOISE_PX, NOISE_PX, &mut rng).remove(0)
        })
        .collect();
    let found = run(&moved, &CalibrationParams::default());
    assert!(has(&found, "FOCUS-MOVED").is_some());
    assert_ne!(found.verdict, Verdict::Good);
    let free = found.principal_point.free_homography.expect("fits").px;
    assert!((free - mild().pp_px).norm() < 4.0, "{free}");
}

#[test]
fn a_lens_that_is_too_simple_is_noticed() {
    let lens = Distortion { k1: -0.2, k2: 0.08, p1: 1e-3, p2: 1e-3, ..Distortion::default() };
    let mut rng = ChaCha8Rng::seed_from_u64(8);
    let tangential = views(&camera(lens), &eight_slots(), NOISE_PX, NOISE_PX, &mut rng);
    let right = run(&tangential, &CalibrationParams::default());
    assert_eq!((right.model, right.verdict), (LensModel::K1K2P1P2, Verdict::Good));
    let simple = CalibrationParams {
        models: vec![LensModel::Pinhole, LensModel::K1, LensModel::K1K2],
        ..CalibrationParams::default()
    };
    let wrong = run(&tangential, &simple);
    assert_eq!(has(&wrong, "LENS-SIMPLE"), Some(Severity::Bad), "{:?}", wrong.findings);
    assert_ne!(wrong.verdict, Verdict::Good);
}

#[test]
fn nonsense_is_refused_not_computed() {
    let board = board();
    let calibrate = |views: &[Vec<Corner>]| {
        calibrate(views, &board, SIZE, &CalibrationParams::default()).map(|_| ())
    };
    assert_eq!(calibrate(&[]), Err(NotCalibrated::NoViews));
    let good = seen(&eight_slots(), NOISE_PX, 9);
    let mut short = good.clone();
    short[3].pop();
    let want = board.corner_count();
    let got = want - 1;
    assert_eq!(calibrate(&short), Err(NotCalibrated::CornerCount { view: 3, got, want }));
    let mut nan = good.clone();
    nan[2][7].px.x = f64::NAN;
    assert_eq!(calibrate(&nan), Err(NotCalibrated::CornerValue { view: 2, corner: 7 }));
    let mut sigma = good.clone();
    sigma[1][5].covariance_px2.fill(0.0);
    assert_eq!(calibrate(&sigma), Err(NotCalibrated::CornerValue { view: 1, corner: 5 }));
    let mut line = good.clone();
    for corner in &mut line[4] {
        corner.px.y = corner.px.x;
    }
    assert!(calibrate(&line).is_err());
    let mut point = good;
    for corner in &mut point[0] {
        corner.px = Point2::new(5.0, 5.0);
    }
    assert!(calibrate(&point).is_err());
}

#[test]
fn random_corners_end_in_a_value() {
    let mut rng = ChaCha8Rng::seed_from_u64(10);
    let anywhere = Normal::new(500.0, 300.0).expect("positive");
    for _ in 0..20 {
        let views: Vec<Vec<Corner>> = (0..5)
            .map(|_| {
                (0..54)
                    .map(|_| Point2::new(anywhere.sample(&mut rng), anywhere.sample(&mut rng)))
                    .map(|px| Corner::isotropic(px, NOISE_PX))
                    .collect()
            })
            .collect();
        match calibrate(&views, &board(), SIZE, &CalibrationParams::default()) {
            Ok(found) => assert_eq!(found.verdict, Verdict::Untrustworthy),
            Err(
                NotCalibrated::NoGrid { .. }
                | NotCalibrated::NoHomography { .. }
                | NotCalibrated::Undetermined { .. },
            ) => {}
            Err(other) => panic!("{other:?}"),
        }
    }
}

/// A printer puts corners some hundredths of a millimetre off, the same in all views: more views
/// don't average the error out.
#[test]
fn errors_of_the_print_are_in_the_stated_error() {
    const NOISE_PX: f64 = 0.05;
    let truth = camera(Distortion::default());
    let slots = eight_slots();
    for (print_m, views) in [(5e-5, 8), (5e-5, 16), (2e-4, 16)] {
        let (mut squares, mut count) = (0.0, 0.0);
        for seed in 0..12 {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            let printed = Normal::new(0.0, print_m).expect("not negative");
            let noise = Normal::new(0.0, NOISE_PX).expect("positive");
            let board_m: Vec<Point2<f64>> = board()
                .corners_in_board_m()
                .into_iter()
                .map(|p| p + Vector2::new(printed.sample(&mut rng), printed.sample(&mut rng)))
                .collect();
            let poses = (0..views).map(|view| {
                let turned = pose(25.0 + (view % 5) as f64 * 5.0, 22.5 * view as f64, 0.0).rotation;
                Isometry3::from_parts(slots[view % 8].translation, turned)
            });
            let seen: Vec<Vec<Corner>> = poses
                .map(|pose| {
                    let corner = |p: &Point2<f64>| {
                        let px = truth.project_board_point(&pose, p).expect("in front").px;
                        let off = Vector2::new(noise.sample(&mut rng), noise.sample(&mut rng));
                        Corner::isotropic(px + off, NOISE_PX)
                    };
                    board_m.iter().map(corner).collect()
                })
                .collect();
            let found = run(&seen, &CalibrationParams::default());
            let (sd, ours, theirs) =
                (found.sd(), found.camera.lens_parameters(), truth.lens_parameters());
            for i in [2, 3] {
                squares += ((ours[i] - theirs[i]) / sd[i]).powi(2);
                count += 1.0;
            }
        }
        let ratio = f64::sqrt(squares / count);
        assert!(ratio < 1.35, "{print_m} m in {views} views: error over stated sd {ratio}");
    }
}
