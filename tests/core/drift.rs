//! An installed camera checked with four new views: what changed is told, what did not is left alone.

use boresight::{
    calibration::{
        Calibration, CalibrationParams, Drift, DriftVerdict, NoDrift, OldLens, calibrate, drift,
    },
    frame::ImageSize,
    geometry::{BoardOutline, Camera, Corner},
};
use nalgebra::Vector2;
use rand::RngExt;

use crate::trust::{SIZE, Scene, board};

/// A camera calibrated some time ago, with frame-filling boards.
struct Installed {
    scene: Scene,
    old: Calibration,
    outlines: Vec<BoardOutline>,
}

impl Installed {
    fn new(seed: u64) -> Self {
        let mut scene = Scene::ordinary(seed);
        // f = 1400 px at a width of 1920 px.
        let scale = 0.73 * f64::from(SIZE.width_px) / scene.camera.f_px.x;
        scene.camera.f_px *= scale * scene.rng.random_range(0.97..1.03);
        let views = filling(&mut scene, 10);
        let old =
            calibrate(&views, &board(), SIZE, &CalibrationParams::default()).expect("calibrates");
        let outlines = views
            .iter()
            .filter_map(|view| {
                let px: Vec<_> = view.iter().map(|corner| corner.px).collect();
                BoardOutline::of(&px, board().columns())
            })
            .collect();
        scene.noise_px = 0.3;
        Self { scene, old, outlines }
    }

    fn lens(&self) -> OldLens<'_> {
        OldLens {
            camera: self.old.camera,
            covariance: Some(self.old.covariance_all),
            outlines: &self.outlines,
            image_size: SIZE,
        }
    }

    /// Two opposed pairs of today's camera against the old calibration.
    fn check(&mut self) -> Result<Drift, NoDrift> {
        let views = filling(&mut self.scene, 4);
        drift(&views, &board(), SIZE, &self.lens())
    }
}

/// Views of boards as large as the picture allows: they are drawn back until they are whole.
fn filling(scene: &mut Scene, count: usize) -> Vec<Vec<Corner>> {
    let mut plan = scene.plan(count);
    for (index, pose) in plan.iter_mut().enumerate() {
        if index < 8 {
            pose.fill += 0.25;
        }
    }
    scene.views(&plan)
}

const CAMERAS: u64 = 500;

/// Of `count` cameras, the checks that told a change, and the mean of what they could have seen.
fn told(count: u64, mut change: impl FnMut(&mut Scene)) -> (u32, f64, f64) {
    let (mut told, mut visible_pp_px, mut visible_f_px) = (0, 0.0, 0.0);
    for seed in 0..count {
        let mut installed = Installed::new(9000 + seed);
        change(&mut installed.scene);
        let found = installed.check().expect("a verdict");
        told += u32::from(found.verdict != DriftVerdict::Ok);
        visible_pp_px += found.visible_pp_px / count as f64;
        visible_f_px += found.visible_f_px / count as f64;
    }
    (told, visible_pp_px, visible_f_px)
}

#[test]
fn an_unchanged_camera_is_left_alone() {
    let count = CAMERAS;
    let (told, visible_pp_px, visible_f_px) = told(count, |_| ());
    println!(
        "unchanged: told {told} of {count}; visible PP {visible_pp_px:.2} px, f {visible_f_px:.2} px"
    );
    assert!(f64::from(told) <= 0.02 * count as f64, "{told} of {count}");
}

#[test]
fn three_pixels_are_seen() {
    let count = CAMERAS;
    let (of_pp, ..) = told(count, |scene| {
        let angle = scene.rng.random_range(0.0..std::f64::consts::TAU);
        scene.camera.pp_px += Vector2::new(angle.cos(), angle.sin()) * 3.0;
    });
    let (of_f, ..) = told(count, |scene| scene.camera.f_px += Vector2::repeat(3.0));
    println!("3 px of PP told {of_pp}, 3 px of f told {of_f}, of {count}");
    assert!(f64::from(of_pp) >= 0.95 * count as f64, "{of_pp} of {count}");
    assert!(f64::from(of_f) >= 0.95 * count as f64, "{of_f} of {count}");
}

#[test]
fn a_change_is_measured_within_its_uncertainty() {
    for seed in 0..20 {
        let mut installed = Installed::new(9000 + seed);
        let before = installed.scene.camera;
        installed.scene.camera.pp_px += Vector2::new(6.0, -4.0);
        installed.scene.camera.f_px *= 1.01;
        let found = installed.check().expect("a verdict");
        assert_eq!(found.verdict, DriftVerdict::Recalibrate);
        let f_px = 0.01 * before.f_px.x;
        for (got, (want, sd)) in
            found.change_px.iter().zip([f_px, 6.0, -4.0].into_iter().zip(found.sd_px.iter()))
        {
            assert!((got - want).abs() < 4.5 * sd, "{seed}: {got} for {want} ± {sd}");
        }
    }
}

#[test]
fn pixels_that_are_not_square_stay_so() {
    let mut scene = Scene::ordinary(5);
    scene.camera.f_px.y *= 1.06;
    let views = filling(&mut scene, 10);
    let params = CalibrationParams { square_pixels: false, ..CalibrationParams::default() };
    let old = calibrate(&views, &board(), SIZE, &params).expect("calibrates");
    let lens = OldLens {
        camera: old.camera,
        covariance: Some(old.covariance_all),
        outlines: &[],
        image_size: SIZE,
    };
    let now = filling(&mut scene, 4);
    let found = drift(&now, &board(), SIZE, &lens).expect("a verdict");
    assert_eq!(found.verdict, DriftVerdict::Ok, "{found:?}");
    scene.camera.pp_px.y += 8.0;
    let now = filling(&mut scene, 4);
    let found = drift(&now, &board(), SIZE, &lens).expect("a verdict");
    assert_ne!(found.verdict, DriftVerdict::Ok);
    assert!((found.change_px.z - 8.0).abs() < 5.0 * found.sd_px.z, "{found:?}");
}

#[test]
fn another_lens_is_told_by_its_residual() {
    let mut installed = Installed::new(9003);
    installed.scene.noise_px = 0.1;
    installed.scene.camera.distortion.k1 -= 0.15;
    let found = installed.check().expect("a verdict");
    assert!(found.lens_changed, "{}", found.residual_ratio);
    assert_eq!(found.verdict, DriftVerdict::Recalibrate);
}

/// A distortion that shrank by a tenth, as by another focus, wherever it moves a ray by more than the check could see.
#[test]
fn a_change_of_the_distortion_is_told_where_it_could_be_seen() {
    let (mut told, mut visible) = (0, 0);
    for seed in 0..200 {
        let mut installed = Installed::new(9000 + seed);
        let before = installed.scene.camera;
        let distortion = &mut installed.scene.camera.distortion;
        distortion.k1 *= 0.9;
        distortion.k2 *= 0.9;
        let after = installed.scene.camera;
        let corner = nalgebra::Point2::new(0.0, 0.0);
        let ray = before.normalized_from_px(&corner).expect("inside the field");
        let moved_px = (after.px_from_normalized(&ray) - corner).norm();
        let found = installed.check().expect("a verdict");
        if moved_px > found.visible_lens_px.expect("four views tell") {
            visible += 1;
            told += u32::from(found.verdict != DriftVerdict::Ok);
        }
    }
    println!("told {told} of {visible} visible ones");
    assert!(visible >= 20, "{visible}");
    assert!(told * 10 >= visible * 9, "{told} of {visible}");
}

#[test]
fn what_cannot_be_compared_gets_no_verdict() {
    let mut installed = Installed::new(9001);
    let views = filling(&mut installed.scene, 4);
    let half = ImageSize { width_px: SIZE.width_px / 2, height_px: SIZE.height_px / 2 };
    assert!(matches!(
        drift(&views, &board(), half, &installed.lens()),
        Err(NoDrift::OtherSize { .. })
    ));
    assert_eq!(
        drift(&views[..3], &board(), SIZE, &installed.lens()).map(|_| ()),
        Err(NoDrift::FewViews { usable: 3, outside: 0 })
    );
    // The old boards were all at the left.
    let old = OldLens { outlines: &installed.outlines[..0], ..installed.lens() };
    let corner = BoardOutline::around(
        [[0.0, 0.0], [200.0, 0.0], [200.0, 200.0], [0.0, 200.0]].map(|[x, y]| [x, y].into()),
    )
    .expect("numbers");
    let left = OldLens { outlines: &[corner], ..old };
    assert_eq!(
        drift(&views, &board(), SIZE, &left).map(|_| ()),
        Err(NoDrift::FewViews { usable: 0, outside: 4 })
    );
}

#[test]
fn a_calibration_without_covariance_is_a_weaker_test_that_says_so() {
    let mut installed = Installed::new(9002);
    let views = filling(&mut installed.scene, 4);
    let strong = drift(&views, &board(), SIZE, &installed.lens()).expect("a verdict");
    let unstated = OldLens { covariance: None, ..installed.lens() };
    let weak = drift(&views, &board(), SIZE, &unstated).expect("a verdict");
    assert!(weak.assumed && !strong.assumed);
    assert!(weak.visible_pp_px > strong.visible_pp_px);
    assert!(weak.visible_f_px > strong.visible_f_px);
}

#[test]
fn the_lens_now_is_the_old_one_with_its_change() {
    let mut installed = Installed::new(9004);
    let found = installed.check().expect("a verdict");
    let old: Camera = installed.old.camera;
    assert_eq!(found.camera.distortion, old.distortion);
    assert!((found.camera.f_px.x - old.f_px.x - found.change_px.x).abs() < 1e-9);
}
