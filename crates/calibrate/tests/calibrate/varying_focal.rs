//! Views with a varying focal length: the principal point needs no common one.

use boresight_calibrate::{
    Calibration, CalibrationParams, FindingCode, Focal, KnownLens, NotHeld, Verdict, calibrate,
};
use boresight_geometry::{Camera, Corner, Distortion, frame::SceneScale};
use boresight_testkit::trust::{SIZE, Scene, board, px};

/// Eight views of `scene`, each with the focal length times its factor, and distortion fixed in
/// pixels.
pub(crate) fn views_with(scene: &mut Scene, factors: &[f64]) -> Vec<Vec<Corner>> {
    let plan = scene.plan(factors.len());
    let poses = scene.poses(&plan);
    let camera = scene.camera;
    scene.seen(&poses, |view, pose, p| {
        let factor = factors[view];
        let Distortion { k1, k2, .. } = camera.distortion;
        let distortion =
            Distortion { k1: k1 * factor.powi(2), k2: k2 * factor.powi(4), ..camera.distortion };
        px(&Camera { f_px: camera.f_px * factor, distortion, ..camera }, pose, p)
    })
}

fn run(views: &[Vec<Corner>], varying_focal: bool) -> Calibration {
    let params = CalibrationParams { varying_focal, ..CalibrationParams::default() };
    calibrate(views, &board(), SIZE, &params).expect("calibrates")
}

/// Squared distance of the principal point from the truth, in standard deviations.
fn pp_distance2(found: &Calibration, truth: &Camera) -> f64 {
    let off = found.camera.pp_px - truth.pp_px;
    let information = found.pp_covariance_px2().try_inverse().expect("regular");
    (off.transpose() * information * off).x
}

#[test]
fn principal_point_and_focal_lengths_lie_in_their_bounds() {
    const SCENES: u64 = 60;
    for scatter in [0.01, 0.03] {
        let (mut inside, mut focal_inside, mut focal_all) = (0, 0, 0);
        for seed in 0..SCENES {
            let mut scene = Scene::ordinary(3000 + seed);
            let factors: Vec<f64> = (0..8).map(|_| 1.0 + scene.normal(scatter)).collect();
            let views = views_with(&mut scene, &factors);
            let found = run(&views, true);
            assert!(matches!(found.focal, Focal::Varying { .. }));
            // 95 % of a plane's normal distribution.
            inside += u32::from(pp_distance2(&found, &scene.camera) < 5.99);
            for (view, factor) in found.views.iter().zip(&factors) {
                let focal = view.focal.expect("tipped by 40°");
                let off = focal.f_px - scene.camera.f_px.x * factor;
                focal_all += 1;
                focal_inside += u32::from(off.abs() < 2.0 * focal.sigma_px);
            }
        }
        let share = f64::from(inside) / SCENES as f64;
        let focal_share = f64::from(focal_inside) / f64::from(focal_all);
        println!("{scatter}: PP {share:.3} inside 95 %, f {focal_share:.3} inside 2 sd");
        assert!((0.88..=1.0).contains(&share), "{scatter}: {share}");
        assert!((0.90..=1.0).contains(&focal_share), "{scatter}: {focal_share}");
    }
}

#[test]
fn a_common_focal_length_would_have_been_worse() {
    let (mut free, mut bundle) = (0.0, 0.0);
    for seed in 0..60 {
        let mut scene = Scene::ordinary(4000 + seed);
        let factors: Vec<f64> = (0..8).map(|_| 1.0 + scene.normal(0.03)).collect();
        let views = views_with(&mut scene, &factors);
        let found = run(&views, true);
        let of_bundle = found.principal_point.bundle.expect("calibrates").px;
        free += (found.camera.pp_px - scene.camera.pp_px).norm_squared();
        bundle += (of_bundle - scene.camera.pp_px).norm_squared();
    }
    assert!(9.0 * free < bundle, "{free} {bundle}");
}

#[test]
fn a_focus_that_moved_is_noticed_and_varies_on_request() {
    let mut scene = Scene::ordinary(7);
    let views = views_with(&mut scene, &[1.0, 1.0, 1.0, 1.0, 1.03, 1.03, 1.03, 1.03]);
    let found = run(&views, false);
    assert_eq!(found.verdict, Verdict::Untrustworthy);
    assert!(found.findings.iter().any(|finding| finding.code.code() == "FOCUS-MOVED"));
    assert_eq!(found.focal, Focal::Common);
    let asked = run(&views, true);
    assert_ne!(asked.verdict, Verdict::Untrustworthy, "{:?}", asked.findings);
    assert!(matches!(asked.focal, Focal::Varying { .. }));
    assert_eq!(Some(asked.camera.pp_px), asked.principal_point.free_homography.map(|pp| pp.px));
}

#[test]
fn the_scene_behind_the_board_decides_about_a_moved_focus() {
    let factors = [1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.03, 1.03, 1.03, 1.03, 1.03, 1.03];
    let views = views_with(&mut Scene::ordinary(7), &factors);
    let with = |scene: Vec<Option<SceneScale>>| {
        let params = CalibrationParams { scene, ..CalibrationParams::default() };
        let found = calibrate(&views, &board(), SIZE, &params).expect("calibrates");
        let codes: Vec<&str> = found.findings.iter().map(|it| it.code.code()).collect();
        (found.verdict, codes.contains(&"FOCUS-MOVED"), codes.contains(&"SCENE-STILL"))
    };
    let scale = |log_focal| Some(SceneScale { log_focal, sd: 4e-4 });
    let follows = factors.iter().map(|factor: &f64| scale(factor.ln())).collect();
    assert_eq!(with(follows), (Verdict::Untrustworthy, true, false));
    assert_eq!(with(Vec::new()), (Verdict::Untrustworthy, true, false));
    let (verdict, moved, still) = with(vec![scale(0.0); 12]);
    assert_ne!(verdict, Verdict::Untrustworthy);
    assert_eq!((moved, still), (false, true));
    // Pictures of one half tell nothing about a change between halves.
    let half = (0..12).map(|view| scale(0.0).filter(|_| view < 6)).collect();
    assert_eq!(with(half), (Verdict::Untrustworthy, true, false));
}

#[test]
fn a_fixed_focus_is_left_alone() {
    let mut scene = Scene::ordinary(8);
    let views = views_with(&mut scene, &[1.0; 8]);
    assert_eq!(run(&views, false).focal, Focal::Common);
}

#[test]
fn focal_lengths_that_vary_are_not_held_to_an_earlier_calibration() {
    let mut scene = Scene::ordinary(4);
    let factors: Vec<f64> = (0..12).map(|view| 1.0 + 0.01 * f64::from(view)).collect();
    let views = views_with(&mut scene, &factors);
    let known_lens = Some(KnownLens::new(&scene.camera, &nalgebra::SMatrix::identity()));
    let params =
        CalibrationParams { known_lens, varying_focal: true, ..CalibrationParams::default() };
    let found = calibrate(&views, &board(), SIZE, &params).expect("calibrates");
    assert!(matches!(found.focal, Focal::Varying { .. }), "{:?}", found.findings);
    let told = FindingCode::LensNotHeld { reason: NotHeld::FocalVaries };
    let mut codes = found.findings.iter().map(|finding| finding.code);
    assert!(codes.any(|code| code == told), "{:?}", found.findings);
}
