//! Wide lenses: the family chosen from the corners, its uncertainty, and the principal line.

use boresight_calibrate::{
    CalibrationParams, Finding, FindingCode, KnownLens, LensFamily, LensModel, NotHeld, Verdict,
    calibrate,
};
use boresight_geometry::{
    Camera, Corner, Distortion, Homography, LensKind, PrincipalLine, boards::Board, fit_pose,
    frame::ImageSize, mean_px,
};
use boresight_testkit::error_px;
use nalgebra::{Isometry3, Point3, SMatrix, Translation3, UnitQuaternion, Vector2, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};

const SIZE: ImageSize = ImageSize { width_px: 1280, height_px: 960 };
const NOISE_PX: f64 = 0.1;

fn board() -> Board {
    Board::new(9, 6, 0.025).expect("valid")
}

/// A fisheye lens with `field_deg` across the picture.
fn fisheye(field_deg: f64) -> Camera {
    let half_rad = (field_deg / 2.0).to_radians();
    let (kind, k1, k2) = (LensKind::Fisheye, -0.02, 0.004);
    let height = half_rad * (1.0 + k1 * half_rad.powi(2) + k2 * half_rad.powi(4));
    Camera {
        distortion: Distortion { kind, k1, k2, ..Distortion::default() },
        ..Camera::pinhole(640.0 / height, SIZE.centre_px() + Vector2::new(9.0, -6.0))
    }
}

fn rational() -> Camera {
    let distortion = Distortion {
        k1: 0.9,
        k2: 0.15,
        k3: 0.01,
        k4: 1.2,
        k5: 0.35,
        k6: 0.03,
        ..Distortion::default()
    };
    Camera { distortion, ..Camera::pinhole(470.0, SIZE.centre_px()) }
}

/// Views of a board facing the ray and then tilted by 35° in eight directions, at the middle and
/// all around.
fn views(camera: &Camera, count: usize, seed: u64) -> Vec<Vec<Corner>> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let noise = Normal::new(0.0, NOISE_PX).expect("positive");
    let mut views = Vec::new();
    while views.len() < count {
        let px = SIZE.centre_px()
            + Vector2::new(rng.random_range(-430.0..430.0), rng.random_range(-300.0..300.0));
        let Some(ray) = camera.ray_from_px(&px) else { continue };
        let ray = ray.normalize();
        let Some(facing) = UnitQuaternion::rotation_between(&Vector3::z(), &ray) else { continue };
        let direction = views.len() as f64 * std::f64::consts::FRAC_PI_4;
        let tilt = Vector3::new(direction.sin(), -direction.cos(), 0.0) * 35_f64.to_radians();
        let turn = facing * UnitQuaternion::from_scaled_axis(tilt);
        let distance_m = rng.random_range(0.16..0.3);
        let pose = Isometry3::from_parts(Translation3::from(ray * distance_m), turn);
        let corners: Option<Vec<Corner>> = board()
            .corners_in_board_m()
            .iter()
            .map(|point_m| {
                let px = camera.px_from_board(&pose, point_m)?;
                let inside = (4.0..1275.0).contains(&px.x) && (4.0..955.0).contains(&px.y);
                let error = Vector2::new(noise.sample(&mut rng), noise.sample(&mut rng));
                inside.then(|| Corner::isotropic(px + error, NOISE_PX))
            })
            .collect();
        views.extend(corners);
    }
    views
}

#[test]
fn the_family_of_the_lens_is_found_and_its_bound_holds() {
    let cameras = [fisheye(90.0), fisheye(120.0), fisheye(150.0), fisheye(185.0), rational()];
    let (mut inside, mut good, mut all) = (0, 0, 0);
    for (number, camera) in cameras.iter().enumerate() {
        for seed in 0..4 {
            let found =
                calibrate(&views(camera, 14, seed), &board(), SIZE, &CalibrationParams::default())
                    .expect("calibrates");
            let off_px = error_px(&found.camera, camera, SIZE);
            let bound_px = found.picture_bound_px().expect("every pixel has a ray");
            println!(
                "{number} {seed}: {} {} off {off_px:.3} px, bound {bound_px:.3} px {:?}",
                found.model.code(),
                found.verdict.code(),
                found.findings.iter().map(|finding| finding.code.code()).collect::<Vec<_>>()
            );
            // A quotient and a polynomial of the angle may describe the same picture.
            if number > 0 {
                assert_ne!(found.model.family(), LensFamily::Brown, "camera {number}");
            }
            assert!((found.noise_factor - 1.0).abs() < 0.12, "{}", found.noise_factor);
            inside += u32::from(off_px <= bound_px);
            good += u32::from(found.verdict == Verdict::Good);
            all += 1;
        }
    }
    println!("inside {inside}, good {good} of {all}");
    assert!(inside >= all - 2, "{inside} of {all}");
    assert!(good >= all / 2, "{good} of {all}");
}

#[test]
fn a_wide_lens_of_browns_stays_browns() {
    let distortion = Distortion { k1: -0.18, k2: 0.03, ..Distortion::default() };
    let camera = Camera { distortion, ..Camera::pinhole(760.0, SIZE.centre_px()) };
    for seed in 0..4 {
        let found =
            calibrate(&views(&camera, 12, seed), &board(), SIZE, &CalibrationParams::default())
                .expect("calibrates");
        assert_eq!(found.model.family(), LensFamily::Brown, "{:?}", found.model);
    }
}

#[test]
fn a_family_that_is_asked_for_is_taken() {
    let camera = fisheye(120.0);
    let views = views(&camera, 12, 1);
    for family in LensFamily::ALL {
        let params = CalibrationParams { models: family.models(), ..CalibrationParams::default() };
        let found = calibrate(&views, &board(), SIZE, &params).expect("calibrates");
        assert_eq!(found.model.family(), family);
        // The polynomial of tan θ holds this lens in the middle only, and reports it.
        if family == LensFamily::Brown {
            let folds = |finding: &Finding| matches!(finding.code, FindingCode::LensFolds { .. });
            assert!(found.findings.iter().any(folds), "{:?}", found.findings);
            assert_eq!(found.picture_bound_px(), None);
        } else {
            let bound_px = found.picture_bound_px().expect("every pixel has a ray");
            assert!(error_px(&found.camera, &camera, SIZE) <= bound_px, "{family:?}");
        }
    }
    // Also from few views.
    let params =
        CalibrationParams { models: LensFamily::Fisheye.models(), ..CalibrationParams::default() };
    let found = calibrate(&views[..2], &board(), SIZE, &params).expect("calibrates");
    assert!(found.model <= LensModel::FisheyeK1 && found.model.family() == LensFamily::Fisheye);
}

#[test]
fn the_plane_of_symmetry_is_seen_as_a_line_through_the_principal_point() {
    // The claim of docs/method.md, section 2.12: under a lens with symmetry about its centre,
    // points of the plane through the optical axis and the board's normal are imaged on a line
    // through the principal point.
    let camera = fisheye(150.0);
    let pose = Isometry3::from_parts(
        Translation3::new(0.03, -0.02, 0.25),
        UnitQuaternion::from_scaled_axis(Vector3::new(0.5, -0.4, 0.3)),
    );
    let normal = pose.rotation * Vector3::z();
    let across = Vector3::z().cross(&normal).normalize();
    let px: Vec<_> = (-6..=6)
        .map(|step| {
            // A point of the board's plane in the plane of symmetry.
            let along = normal.cross(&across);
            let foot = normal * (normal.dot(&pose.translation.vector));
            let at = foot - across * foot.dot(&across) + along * (0.03 * f64::from(step));
            camera.project(&Point3::from(at)).expect("inside the field")
        })
        .collect();
    let direction = (px[12] - px[0]).normalize();
    for point in &px {
        let off = point - camera.pp_px;
        let distance_px = off.x * direction.y - off.y * direction.x;
        assert!(distance_px.abs() < 1e-9, "{distance_px} px");
    }
    // The closed form finds the line from straightened corners, and not from the distorted ones.
    let line = |straight: bool| {
        let corners: Vec<Corner> = board()
            .corners_in_board_m()
            .iter()
            .map(|point_m| {
                let corner =
                    Corner::isotropic(camera.px_from_board(&pose, point_m).expect("seen"), 0.1);
                if straight { camera.straighten_corner(&corner).expect("seen") } else { corner }
            })
            .collect();
        let homography = Homography::fit(&board().corners_in_board_m(), &corners).expect("a board");
        let line = PrincipalLine::of(&homography, SIZE.centre_px(), mean_px(&corners));
        line.expect("tilted").distance_px(&camera.pp_px).abs()
    };
    assert!(line(true) < 1e-6, "{}", line(true));
    assert!(line(false) > 1.0, "{}", line(false));
}

#[test]
fn a_board_beyond_the_plane_of_the_camera_has_a_pose() {
    let camera = fisheye(200.0);
    // 75° to 105° from the axis.
    let pose = Isometry3::from_parts(
        Translation3::new(0.3, 0.02, 0.0),
        UnitQuaternion::from_scaled_axis(Vector3::new(0.1, 1.3, 0.05)),
    );
    let corners: Vec<Corner> = board()
        .corners_in_board_m()
        .iter()
        .map(|point_m| Corner::isotropic(camera.px_from_board(&pose, point_m).expect("seen"), 0.1))
        .collect();
    let behind = board()
        .corners_in_board_m()
        .iter()
        .filter(|p| (pose * Point3::new(p.x, p.y, 0.0)).z < 0.0)
        .count();
    assert!(behind > 0);
    let found = fit_pose(&camera, &board().corners_in_board_m(), &corners).expect("a pose");
    assert!((found.cam_from_board.translation.vector - pose.translation.vector).norm() < 1e-9);
    assert!(found.cam_from_board.rotation.angle_to(&pose.rotation) < 1e-8);
}

#[test]
fn a_lens_that_cannot_be_held_to_an_earlier_calibration_says_so() {
    let views = views(&fisheye(150.0), 14, 0);
    let not_held = |camera: &Camera, sd: f64| {
        let known = KnownLens::new(camera, &(SMatrix::identity() * sd));
        let params = CalibrationParams { known_lens: Some(known), ..CalibrationParams::default() };
        let found = calibrate(&views, &board(), SIZE, &params).expect("calibrates");
        assert_eq!(found.verdict, Verdict::Care, "{:?}", found.findings);
        found.findings.iter().find_map(|finding| match finding.code {
            FindingCode::LensNotHeld { reason } => Some(reason),
            _ => None,
        })
    };
    let of_kind = NotHeld::OtherKind { earlier: LensKind::Perspective, now: LensKind::Fisheye };
    assert_eq!(not_held(&Camera::pinhole(900.0, SIZE.centre_px()), 1.0), Some(of_kind));
    assert_eq!(not_held(&fisheye(150.0), -1.0), Some(NotHeld::NoCovariance));
    assert_eq!(not_held(&fisheye(150.0), f64::NAN), Some(NotHeld::NoCovariance));
}
