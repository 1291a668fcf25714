//! Lenses that nobody has, and views that nobody could judge by.

use std::f64::consts::TAU;

use nalgebra::{Isometry3, Point2, UnitQuaternion, Vector2, Vector3};

use super::*;

use boresight_geometry::Distortion;

const SIZE: ImageSize = ImageSize { width_px: 1280, height_px: 720 };
const NOISE_PX: f64 = 0.1;

fn board() -> Board {
    Board::new(9, 6, 0.025).expect("valid")
}

fn lens() -> Camera {
    let distortion = Distortion { k1: -0.2, k2: 0.08, ..Distortion::default() };
    Camera { distortion, ..Camera::pinhole(1000.0, Point2::new(652.0, 349.0)) }
}

/// Views of a board tipped by `tilts_deg`, each in another direction and place.
fn views(tilts_deg: &[f64]) -> Vec<Vec<Corner>> {
    views_by(&lens(), tilts_deg)
}

fn views_by(camera: &Camera, tilts_deg: &[f64]) -> Vec<Vec<Corner>> {
    let board_m = board().corners_in_board_m();
    let mut draws = 0_u64;
    // Sum of four equal distributions, by SplitMix64.
    let mut noise_px = || {
        let draw = |_| {
            draws += 1;
            let mut z = draws.wrapping_mul(0x9e37_79b9_7f4a_7c15);
            z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
            (z >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        NOISE_PX * 3_f64.sqrt() * (0..4).map(draw).sum::<f64>()
    };
    let view = |(number, tilt_deg): (usize, &f64)| {
        let towards = TAU * number as f64 * 0.3;
        let axis = Vector3::new(towards.sin(), -towards.cos(), 0.0) * tilt_deg.to_radians();
        let turn = UnitQuaternion::from_scaled_axis(axis);
        let off_m = Vector3::new(-0.08 * towards.cos(), -0.05 * towards.sin(), 0.42);
        let pose = Isometry3::from_parts(off_m.into(), turn);
        let corner = |point: &Point2<f64>| {
            let px = camera.project_board_point(&pose, point).expect("in front").px;
            Corner::isotropic(px + Vector2::new(noise_px(), noise_px()), NOISE_PX)
        };
        board_m.iter().map(corner).collect()
    };
    tilts_deg.iter().enumerate().map(view).collect()
}

fn fresh(views: &[Vec<Corner>]) -> Calibration {
    let fresh = calibrate(views, &board(), SIZE, &CalibrationParams::default());
    let fresh = fresh.expect("calibrates");
    assert_ne!(fresh.verdict, Verdict::Untrustworthy, "{:?}", fresh.findings);
    fresh
}

#[test]
fn no_lens_is_off_by_more_than_the_picture() {
    let views = views(&[40.0; 10]);
    let fresh = fresh(&views);
    let judged = |camera| {
        let given = GivenLens { camera, image_size: SIZE };
        judge(&given, &views, &board(), &fresh, None)
    };
    let sound = judged(lens()).expect("judged");
    assert_eq!(sound.answer, Answer::True, "{sound:?}");

    let mut told = [0; 2];
    for widths in [0.06, 0.4, 0.78, 2.0, 8.0, 900.0] {
        for k1 in [0.0, -0.2, -0.6, -1.2, 3.0, 1e3] {
            for (k3, k4) in [(0.0, 0.0), (-0.5, 0.0), (9.0, 0.0), (1e20, 0.0), (0.0, -3.0)] {
                let distortion = Distortion { k1, k3, k4, ..Distortion::default() };
                let f_px = widths * f64::from(SIZE.width_px);
                let camera = Camera { distortion, ..Camera::pinhole(f_px, SIZE.centre_px()) };
                let found = judged(camera);
                told[usize::from(found.is_ok())] += 1;
                match found {
                    Err(reason) => assert_eq!(reason.answer(), Answer::Off, "{camera:?}"),
                    Ok(found) => {
                        let width_px = f64::from(SIZE.width_px);
                        let worst_px = found.displaced_px.iter().map(|(_, by)| by.norm());
                        let most_px = worst_px.fold(found.worst_px.max(found.most_px), f64::max);
                        assert!(most_px < 2.0 * width_px, "{camera:?}: {most_px}");
                        assert!(found.rms_px.is_none_or(|px| px < width_px), "{camera:?}");
                    }
                }
            }
        }
    }
    assert!(told.iter().all(|count| *count > 10), "{told:?}");
}

#[test]
fn a_longer_focal_length_measures_lengths_shorter() {
    let views = views(&[40.0; 10]);
    let fresh = fresh(&views);
    let by = |f_ratio: f64, length_m: f64, within_m: f64| {
        let mut camera = fresh.camera;
        camera.f_px *= f_ratio;
        let given = GivenLens { camera, image_size: SIZE };
        let goal = AcceptanceGoal::Length { length_m, at_m: 2.0, within_m };
        judge(&given, &views, &board(), &fresh, Some(goal))
    };
    let found = |f_ratio, within_m| by(f_ratio, 0.5, within_m).expect("judged");
    let long = found(1.02, 0.005);
    let length = long.length.expect("about a length");
    // Part of the difference is a turn of the camera.
    assert!((length.off_m - 0.0098).abs() < 0.002, "{length:?}");
    assert!(length.least_m < length.off_m && length.off_m < length.most_m, "{length:?}");
    assert_eq!(long.answer, Answer::Off, "{length:?}");
    assert_eq!(found(1.02, 0.02).answer, Answer::True);
    assert_eq!(found(1.0, 0.005).answer, Answer::True);
    assert_eq!(found(1.0, 1e-6).answer, Answer::CannotTell);
    assert_eq!(by(1.0, 10.0, 0.005).err(), Some(NotJudged::LengthTooLong));
}

#[test]
fn a_lens_of_pictures_of_another_size_is_named_even_if_it_misses_these() {
    let views = views(&[40.0; 10]);
    let mut camera = fresh(&views).camera;
    camera.f_px *= 6.0;
    camera.pp_px = (camera.pp_px.coords * 6.0).into();
    let given = GivenLens { camera, image_size: SIZE };
    let found = judge(&given, &views, &board(), &fresh(&views), None);
    let Err(NotJudged::Misses { wrong: Some(WrongPart::Scaled { ratio }), .. }) = found else {
        panic!("{found:?}")
    };
    assert!((ratio - 6.0).abs() < 0.1, "{ratio}");
}

#[test]
fn a_lens_of_smaller_pictures_is_named_even_if_it_folds_over_in_these() {
    let distortion = Distortion { k1: -0.5, ..Distortion::default() };
    let views = views_by(&Camera { distortion, ..lens() }, &[40.0; 10]);
    let fresh = fresh(&views);
    let mut camera = fresh.camera;
    camera.f_px *= 0.5;
    camera.pp_px = (camera.pp_px.coords * 0.5).into();
    let outlines: Vec<_> = views.iter().filter_map(|view| outline(view, &board())).collect();
    assert!(LensFlaw::of(&camera, SIZE, &outlines).is_some());
    let given = GivenLens { camera, image_size: SIZE };
    let found = judge(&given, &views, &board(), &fresh, None);
    let Err(NotJudged::Misses { wrong: Some(WrongPart::Scaled { ratio }), .. }) = found else {
        panic!("{found:?}")
    };
    assert!((ratio - 0.5).abs() < 0.01, "{ratio}");
}

#[test]
fn mistaken_axes_and_missing_terms_are_named() {
    let distortion = Distortion { p1: 0.002, p2: -0.001, ..lens().distortion };
    let pp_px = Point2::new(700.0, 300.0);
    let views = views_by(&Camera { distortion, pp_px, ..lens() }, &[40.0; 10]);
    let fresh = fresh(&views);
    let [right, below] = [SIZE.width_px, SIZE.height_px].map(|side| f64::from(side) - 1.0);
    let named = |change: &dyn Fn(&mut Camera)| {
        let mut given = GivenLens { camera: fresh.camera, image_size: SIZE };
        change(&mut given.camera);
        let goal = Some(AcceptanceGoal::Projection { px: 0.3 });
        judge(&given, &views, &board(), &fresh, goal).expect("judged").wrong
    };
    let mirror = |camera: &mut Camera| {
        camera.pp_px.x = right - camera.pp_px.x;
        camera.distortion.p2 *= -1.0;
    };
    let from_below = |camera: &mut Camera| {
        camera.pp_px.y = below - camera.pp_px.y;
        camera.distortion.p1 *= -1.0;
    };
    let half_turn = |camera: &mut Camera| {
        mirror(camera);
        from_below(camera);
    };
    assert_eq!(named(&mirror), Some(WrongPart::Axes(Axes::Mirrored)));
    assert_eq!(named(&from_below), Some(WrongPart::Axes(Axes::FromBelow)));
    assert_eq!(named(&half_turn), Some(WrongPart::Axes(Axes::HalfTurned)));
    let exchange = |camera: &mut Camera| camera.pp_px = camera.pp_px.yx();
    assert_eq!(named(&exchange), Some(WrongPart::Axes(Axes::Exchanged)));
    let move_pp = |camera: &mut Camera| camera.pp_px.x -= 60.0;
    assert!(matches!(named(&move_pp), Some(WrongPart::PrincipalPoint { .. })));
}

#[test]
fn a_lens_with_too_few_terms_is_named() {
    let distortion = Distortion { k1: -0.4, k2: 0.6, ..Distortion::default() };
    let views = views_by(&Camera { distortion, ..lens() }, &[40.0; 10]);
    let fresh = fresh(&views);
    let params = CalibrationParams { models: vec![LensModel::K1], ..Default::default() };
    let camera = calibrate(&views, &board(), SIZE, &params).expect("calibrates").camera;
    let goal = Some(AcceptanceGoal::Projection { px: 0.3 });
    let given = GivenLens { camera, image_size: SIZE };
    let found = judge(&given, &views, &board(), &fresh, goal).expect("judged").wrong;
    assert_eq!(found, Some(WrongPart::TooFewTerms));
}

#[test]
fn pictures_cut_from_the_middle_are_judged_only_if_the_lens_surely_fits() {
    let views = views(&[40.0; 10]);
    let fresh = fresh(&views);
    let image_size = ImageSize { width_px: 1600, height_px: 1200 };
    let judged = |change: f64| {
        let pp_px = Point2::from(
            1.25 * (fresh.camera.pp_px - SIZE.centre_px()) + image_size.centre_px().coords,
        );
        let camera = Camera { f_px: 1.25 * change * fresh.camera.f_px, pp_px, ..fresh.camera };
        judge(&GivenLens { camera, image_size }, &views, &board(), &fresh, None)
    };
    let sound = judged(1.0).expect("judged");
    assert_eq!((sound.answer, sound.resized), (Answer::True, Some(Resized::Cut(0.8))));
    let other = judged(1.1).expect_err("no shape fits");
    assert_eq!(other, NotJudged::OtherSize { pictures: SIZE, given: image_size });
}

#[test]
fn flat_views_judge_nothing() {
    let given = GivenLens { camera: lens(), image_size: SIZE };
    for tilts_deg in [[0.0; 4], [0.5, 1.0, 0.2, 0.8], [2.0, 1.0, 3.0, 2.0]] {
        let flat = views(&tilts_deg);
        for models in [LensModel::ALL.to_vec(), vec![LensModel::K1K2P1P2K3]] {
            let params = CalibrationParams { models, ..CalibrationParams::default() };
            let Ok(fresh) = calibrate(&flat, &board(), SIZE, &params) else { continue };
            let found = judge(&given, &flat, &board(), &fresh, None);
            assert_eq!(found.err(), Some(NotJudged::NoFreshLens), "{tilts_deg:?}");
        }
    }
}
