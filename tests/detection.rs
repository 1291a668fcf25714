//! The detector against rendered pictures whose truth is known.

#![expect(clippy::expect_used, reason = "a test fails by panicking")]

use std::convert::Infallible;

use boresight::{
    board::Checkerboard,
    capture::synthetic::{Scene, render_view},
    detection::{Detection, DetectorParams, Miss, Side, detect},
    geometry::Camera,
    pipeline::detect_many,
};
use image::{GrayImage, imageops};
use nalgebra::{Isometry3, Point2, Point3, UnitQuaternion, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// A view tipped by `tilt_deg` towards `slot_deg`, and turned in the picture by `turn_deg`.
fn pose(tilt_deg: f64, slot_deg: f64, turn_deg: f64, at_m: [f64; 3]) -> Isometry3<f64> {
    let (sin, cos) = slot_deg.to_radians().sin_cos();
    let tilt =
        UnitQuaternion::from_scaled_axis(Vector3::new(sin, -cos, 0.0) * tilt_deg.to_radians());
    let turn = UnitQuaternion::from_scaled_axis(Vector3::z() * turn_deg.to_radians());
    Isometry3::from_parts(Vector3::from(at_m).into(), tilt * turn)
}

fn truth_px(scene: &Scene, pose: &Isometry3<f64>) -> Vec<Point2<f64>> {
    let project = |m: &Point2<f64>| scene.camera.project(&(pose * Point3::new(m.x, m.y, 0.0)));
    scene.board.corners_in_board_m().iter().map(|m| project(m).expect("in front")).collect()
}

fn look(picture: &GrayImage, board: &Checkerboard) -> Result<Detection, Miss> {
    detect(picture, board, DetectorParams::default())
}

/// Errors of a detection, and the same over the stated standard deviations, per coordinate.
fn errors(scene: &Scene, pose: &Isometry3<f64>, found: &Detection) -> Vec<(f64, f64)> {
    let truth = truth_px(scene, pose);
    assert_eq!(found.corners.len(), truth.len());
    found
        .corners
        .iter()
        .zip(truth)
        .flat_map(|(corner, truth)| {
            let off = corner.px - truth;
            let c = &corner.covariance_px2;
            [(off.x, off.x / c[(0, 0)].sqrt()), (off.y, off.y / c[(1, 1)].sqrt())]
        })
        .collect()
}

#[test]
fn boards_are_found_whole_and_to_a_fiftieth_of_a_pixel() {
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    let (mut found, mut tried) = (0, 0);
    let (mut squares, mut normalised, mut count) = (0.0, 0.0, 0.0);
    for seed in 1..=40 {
        let scene = Scene::random(seed);
        let tilt_deg = rng.random_range(0.0..60.0);
        let depth_m = rng.random_range(0.28..0.9) * scene.camera.f_px.x / 1000.0;
        let at_m = [rng.random_range(-0.03..0.03), rng.random_range(-0.02..0.02), depth_m];
        let turn_deg = rng.random_range(0.0..360.0);
        let pose = pose(tilt_deg, rng.random_range(0.0..360.0), turn_deg, at_m);
        let inside = truth_px(&scene, &pose)
            .iter()
            .all(|px| (25.0..1255.0).contains(&px.x) && (25.0..695.0).contains(&px.y));
        if !inside {
            continue;
        }
        tried += 1;
        let Ok(detection) = look(&render_view(&scene, &pose), &scene.board) else { continue };
        found += 1;
        for (off_px, sigmas) in errors(&scene, &pose, &detection) {
            // Not one corner is wrong.
            assert!(off_px.abs() < 0.5, "seed {seed}: a corner is off by {off_px} px");
            squares += off_px * off_px;
            normalised += sigmas * sigmas;
            count += 1.0;
        }
    }
    let (rms_px, ratio) = (f64::sqrt(squares / count), f64::sqrt(normalised / count));
    println!("{found} of {tried} found, rms {rms_px:.4} px, {ratio:.2} times the stated sd");
    assert!(tried >= 15 && found * 100 >= 95 * tried, "{found} of {tried}");
    assert!(rms_px < 0.02, "rms {rms_px} px");
    assert!((0.5..2.0).contains(&ratio), "errors are {ratio} times the stated sd");
}

#[test]
fn every_turn_in_the_picture_numbers_the_corners_alike() {
    // 9x6 tells up from down: corner 0 stays corner 0 through a whole turn.
    let scene = Scene::default_720p(3);
    for turn_deg in (0..360).step_by(15) {
        let pose = pose(25.0, 40.0, f64::from(turn_deg), [0.0, 0.0, 0.44]);
        let detection = look(&render_view(&scene, &pose), &scene.board)
            .unwrap_or_else(|miss| panic!("{turn_deg}°: {miss:?}"));
        for (off_px, _) in errors(&scene, &pose, &detection) {
            assert!(off_px.abs() < 0.2, "{turn_deg}°: off by {off_px} px");
        }
    }
}

#[test]
fn a_quarter_turn_of_the_picture_turns_the_corners() {
    let scene = Scene::default_720p(4);
    let picture = render_view(&scene, &pose(30.0, 70.0, 10.0, [0.0, 0.0, 0.36]));
    let upright = look(&picture, &scene.board).expect("found");
    let turned = look(&imageops::rotate90(&picture), &scene.board).expect("found");
    let height = f64::from(picture.height());
    for (before, after) in upright.corners.iter().zip(&turned.corners) {
        let expected = Point2::new(height - 1.0 - before.px.y, before.px.x);
        assert!((after.px - expected).norm() < 0.01, "{} for {expected}", after.px);
    }
}

#[test]
fn a_mirrored_board_is_never_taken_for_the_board() {
    // In a mirror the colours of 9x6 fit no numbering that keeps its handedness.
    let scene = Scene::default_720p(5);
    let picture = render_view(&scene, &pose(30.0, 110.0, 5.0, [0.0, 0.0, 0.36]));
    let upright = look(&picture, &scene.board).expect("found");
    let handed = |detection: &Detection| {
        let at = |i: usize| detection.corners[i].px;
        (at(8) - at(0)).perp(&(at(45) - at(0)))
    };
    if let Ok(mirrored) = look(&imageops::flip_horizontal(&picture), &scene.board) {
        assert!(handed(&mirrored) * handed(&upright) > 0.0, "numbered as its mirror image");
    }
}

#[test]
fn a_board_that_is_cut_off_is_a_miss_with_its_side() {
    // The cluttered room has chequered things of its own, which could come closer to the board.
    let scene = Scene { clutter: 0.0, ..Scene::default_720p(6) };
    for (at_m, side) in [
        ([-0.16, 0.0, 0.36], Side::Left),
        ([0.16, 0.0, 0.36], Side::Right),
        ([0.0, -0.1, 0.36], Side::Top),
        ([0.0, 0.1, 0.36], Side::Bottom),
    ] {
        let seen = look(&render_view(&scene, &pose(15.0, 20.0, 0.0, at_m)), &scene.board);
        match seen {
            Err(Miss::PartialBoard { found, wanted: 54, cut_off_by }) => {
                assert!(found < 54);
                assert_eq!(cut_off_by, Some(side), "{found} corners");
            }
            other => panic!("{side:?}: {other:?}"),
        }
    }
}

#[test]
fn another_board_is_named() {
    let scene = Scene::default_720p(7);
    let picture = render_view(&scene, &pose(20.0, 200.0, 0.0, [0.0, 0.0, 0.4]));
    for (columns, rows) in [(8, 6), (9, 5), (7, 7), (10, 6)] {
        let other = Checkerboard::new(columns, rows, 0.025).expect("valid");
        match look(&picture, &other) {
            Err(Miss::OtherBoard { columns, rows }) => {
                assert_eq!((columns.max(rows), columns.min(rows)), (9, 6));
            }
            Err(Miss::PartialBoard { .. }) if columns == 10 => {}
            seen => panic!("{columns}x{rows}: {seen:?}"),
        }
    }
}

#[test]
fn pictures_without_a_board_have_none() {
    let away = Isometry3::translation(9.0, 0.0, 0.4);
    for seed in 1..=30 {
        let scene = Scene { clutter: 1.0, ..Scene::random(seed) };
        let seen = look(&render_view(&scene, &away), &scene.board);
        assert!(seen.is_err(), "seed {seed}");
    }
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let board = Checkerboard::new(9, 6, 0.025).expect("valid");
    let noise = GrayImage::from_fn(640, 480, |_, _| image::Luma([rng.random()]));
    let blinds =
        GrayImage::from_fn(640, 480, |_, y| image::Luma([if y / 12 % 2 == 0 { 40 } else { 200 }]));
    let bricks = GrayImage::from_fn(640, 480, |x, y| {
        let row = y / 24;
        let joint = y % 24 < 3 || (x + 24 * (row % 2)) % 48 < 3;
        image::Luma([if joint { 210 } else { 120 }])
    });
    let squares = GrayImage::from_fn(1000, 1000, |x, y| {
        image::Luma([if (x / 10 + y / 10) % 2 == 0 { 30 } else { 220 }])
    });
    for (name, picture) in
        [("noise", noise), ("blinds", blinds), ("bricks", bricks), ("squares", squares)]
    {
        assert!(look(&picture, &board).is_err(), "{name}");
    }
    for (width, height) in [(1, 1), (1, 500), (500, 1), (7, 9), (40, 30)] {
        assert!(look(&GrayImage::new(width, height), &board).is_err());
    }
}

#[test]
fn fewer_pixels_are_enough_down_to_vga() {
    let mut scene = Scene::default_720p(8);
    scene.image_size = boresight::frame::ImageSize { width_px: 640, height_px: 480 };
    scene.camera = Camera::pinhole(560.0, Point2::new(322.0, 236.0));
    let pose = pose(40.0, 300.0, 0.0, [0.0, 0.0, 0.42]);
    let detection = look(&render_view(&scene, &pose), &scene.board).expect("found");
    for (off_px, _) in errors(&scene, &pose, &detection) {
        assert!(off_px.abs() < 0.2);
    }
}

#[test]
fn the_number_of_threads_changes_nothing() {
    let scene = Scene::default_720p(9);
    let pictures: Vec<GrayImage> = (0..6)
        .map(|i| render_view(&scene, &pose(35.0, 60.0 * f64::from(i), 0.0, [0.0, 0.0, 0.36])))
        .collect();
    let with = |threads: usize| {
        let load = |i: usize| Ok::<_, Infallible>(pictures[i].clone());
        let found = detect_many(pictures.len(), threads, &scene.board, load, |_| ());
        let found = found.expect("no thread failed");
        found.into_iter().map(|seen| seen.expect("loaded")).collect::<Vec<_>>()
    };
    let one = with(1);
    assert!(one.iter().all(Result::is_ok));
    for threads in [2, 8] {
        assert_eq!(with(threads), one);
    }
}
