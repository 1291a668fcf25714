//! Detector against rendered pictures with known truth.

use std::{cell::Cell, convert::Infallible};

use boresight_detect::{
    Detection, Detector, DetectorParams, Miss, OtherBoard, Search, Side, Track, detect,
};
use boresight_geometry::{
    Camera, Distortion,
    boards::{BOARD_KINDS, Board, BoardChoice},
    frame::{CaptureTime, FrameKind},
};
use boresight_run::pipeline::detect_many;
use boresight_sim::{Scene, render_view};
use image::{GrayImage, imageops};
use nalgebra::{Isometry3, Point2, UnitQuaternion, Vector2, Vector3};
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
    let project = |m: &Point2<f64>| scene.camera.px_from_board(pose, m);
    scene.board.corners_in_board_m().iter().map(|m| project(m).expect("in front")).collect()
}

fn find(picture: &GrayImage, board: &Board) -> Result<Detection, Miss> {
    detect(picture, board, DetectorParams::default())
}

/// Errors of a detection, and errors over the stated standard deviations, per coordinate.
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
        let Ok(detection) = find(&render_view(&scene, &pose), &scene.board) else { continue };
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
fn edges_that_the_lens_bends_do_not_move_the_corners() {
    for (k1, k2) in [(-0.35, 0.12), (-0.15, 0.0), (0.08, 0.0)] {
        let mut scene = Scene::random(3);
        scene.camera.distortion = Distortion { k1, k2, ..Distortion::default() };
        let (mut outward_px, mut squares_px2, mut normalised, mut count) = (0.0, 0.0, 0.0, 0.0);
        for slot in 0..8 {
            let depth_m = 0.24 * scene.camera.f_px.x / 1000.0;
            let pose = pose(20.0, 45.0 * f64::from(slot), 0.0, [0.0, 0.0, depth_m]);
            let found = find(&render_view(&scene, &pose), &scene.board).expect("a large board");
            for (corner, truth_px) in found.corners.iter().zip(truth_px(&scene, &pose)) {
                let off_px = corner.px - truth_px;
                outward_px += off_px.dot(&(truth_px - scene.camera.pp_px).normalize());
                squares_px2 += off_px.norm_squared() / 2.0;
                normalised += off_px.norm_squared() / corner.covariance_px2.trace();
                count += 1.0;
            }
        }
        let rms_px = f64::sqrt(squares_px2 / count);
        let (outward_px, ratio) = (outward_px / count, f64::sqrt(normalised / count));
        println!(
            "k1 {k1}: pull {outward_px:.4} px, rms {rms_px:.4} px, {ratio:.2} times the stated sd"
        );
        assert!(outward_px.abs() < 0.005, "k1 {k1}: pulled outward by {outward_px} px");
        assert!(rms_px < 0.012 && ratio < 1.3, "k1 {k1}: {rms_px} px, {ratio} sd");
    }
}

#[test]
fn every_turn_in_the_picture_numbers_the_corners_alike() {
    // 9x6 has a distinct upper end: corner 0 stays corner 0 through a whole turn.
    let scene = Scene::default_720p(3);
    for turn_deg in (0..360).step_by(15) {
        let pose = pose(25.0, 40.0, f64::from(turn_deg), [0.0, 0.0, 0.44]);
        let detection = find(&render_view(&scene, &pose), &scene.board)
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
    let upright = find(&picture, &scene.board).expect("found");
    let turned = find(&imageops::rotate90(&picture), &scene.board).expect("found");
    let height = f64::from(picture.height());
    for (before, after) in upright.corners.iter().zip(&turned.corners) {
        let expected = Point2::new(height - 1.0 - before.px.y, before.px.x);
        assert!((after.px - expected).norm() < 0.01, "{} for {expected}", after.px);
    }
}

#[test]
fn a_mirrored_board_is_never_taken_for_the_board() {
    // In a mirror the colours of 9x6 fit no right-handed numbering.
    let scene = Scene::default_720p(5);
    let picture = render_view(&scene, &pose(30.0, 110.0, 5.0, [0.0, 0.0, 0.36]));
    let upright = find(&picture, &scene.board).expect("found");
    let handed = |detection: &Detection| {
        let at = |i: usize| detection.corners[i].px;
        (at(8) - at(0)).perp(&(at(45) - at(0)))
    };
    if let Ok(mirrored) = find(&imageops::flip_horizontal(&picture), &scene.board) {
        assert!(handed(&mirrored) * handed(&upright) > 0.0, "numbered as its mirror image");
    }
}

#[test]
fn a_board_that_is_cut_off_is_a_miss_with_its_side() {
    // The cluttered room has chequered things of its own, perhaps closer to the board.
    let scene = Scene { clutter: 0.0, ..Scene::default_720p(6) };
    for (at_m, side) in [
        ([-0.16, 0.0, 0.36], Side::Left),
        ([0.16, 0.0, 0.36], Side::Right),
        ([0.0, -0.1, 0.36], Side::Top),
        ([0.0, 0.1, 0.36], Side::Bottom),
    ] {
        let seen = find(&render_view(&scene, &pose(15.0, 20.0, 0.0, at_m)), &scene.board);
        match seen {
            Err(Miss::PartialBoard { found, wanted: 54, cut_off_by, .. }) => {
                assert!(found < 54);
                assert_eq!(cut_off_by, Some(side), "{found} corners");
            }
            other => panic!("{side:?}: {other:?}"),
        }
    }
}

#[test]
fn another_board_is_named_whatever_its_size() {
    let scene = Scene::default_720p(7);
    let picture = render_view(&scene, &pose(20.0, 200.0, 0.0, [0.0, 0.0, 0.4]));
    for (columns, rows) in [(8, 6), (9, 5), (7, 7), (4, 3), (10, 6), (9, 7), (11, 8), (18, 15)] {
        let other = Board::new(columns, rows, 0.025).expect("valid");
        let seen = find(&picture, &other);
        assert_eq!(
            seen,
            Err(Miss::OtherBoard(OtherBoard::Plain { columns: 9, rows: 6 })),
            "{columns}x{rows}"
        );
    }
}

/// A tablecloth has no end of fields: no part is a board of any size.
#[test]
fn a_part_of_a_larger_pattern_is_no_board() {
    let cloth = Board::new(25, 18, 0.01).expect("valid");
    for seed in 0..16 {
        let scene = Scene { board: cloth, clutter: 0.0, ..Scene::default_720p(seed) };
        let (tilt_deg, towards_deg) = (8.0 + 3.0 * seed as f64, 23.0 * seed as f64);
        let depth_m = 0.5 + 0.05 * seed as f64;
        let at_m = [0.02, 0.01, depth_m];
        let picture = render_view(&scene, &pose(tilt_deg, towards_deg, 17.0, at_m));
        for (columns, rows) in [(6, 4), (7, 5), (8, 6), (9, 6)] {
            let named = Board::new(columns, rows, 0.025).expect("valid");
            let seen = find(&picture, &named);
            assert!(seen.is_err(), "#{seed}: {columns}x{rows}");
        }
    }
}

/// A board cut out within the outer squares has no white margin; counting squares is the usual
/// slip.
#[test]
fn a_board_whose_squares_were_counted_is_named() {
    let scene = Scene { clutter: 0.0, ..Scene::default_720p(7) };
    let facing = pose(0.0, 0.0, 0.0, [0.0, 0.0, 0.4]);
    let mut picture = render_view(&scene, &facing);
    let px = |column: f64, row: f64| {
        let at_m = Point2::new((column - 4.0) * 0.025, (row - 2.5) * 0.025);
        scene.camera.px_from_board(&facing, &at_m).expect("in front")
    };
    let (low, high) = (px(-0.6, -0.7), px(8.6, 5.7));
    for (x, y, pixel) in picture.enumerate_pixels_mut() {
        let inside = |at: u32, low: f64, high: f64| (low..high).contains(&f64::from(at));
        if !inside(x, low.x, high.x) || !inside(y, low.y, high.y) {
            pixel.0 = [90];
        }
    }
    let squares = Board::new(10, 7, 0.025).expect("valid");
    assert_eq!(
        find(&picture, &squares),
        Err(Miss::OtherBoard(OtherBoard::Plain { columns: 9, rows: 6 }))
    );
    assert!(find(&picture, &scene.board).is_ok());
}

#[test]
fn a_board_of_unknown_size_is_counted() {
    for (columns, rows, seed) in [(9, 6, 7), (7, 5, 8), (11, 8, 9), (4, 4, 10)] {
        let board = Board::new(columns, rows, 0.02).expect("valid");
        let scene = Scene { board, ..Scene::default_720p(seed) };
        let picture = render_view(&scene, &pose(20.0, 40.0, 0.0, [0.0, 0.0, 0.5]));
        let counted = Detector::new(DetectorParams::default()).count(&picture);
        assert_eq!(counted, Some((usize::from(columns), usize::from(rows))));
    }
}

#[test]
fn a_board_that_is_covered_or_cut_off_is_no_other_board() {
    let scene = Scene { clutter: 0.0, ..Scene::default_720p(7) };
    let facing = pose(0.0, 0.0, 0.0, [0.0, 0.0, 0.4]);
    let whole = render_view(&scene, &facing);
    let px = |column: f64, row: f64| {
        let at_m = Point2::new((column - 4.0) * 0.025, (row - 2.5) * 0.025);
        scene.camera.px_from_board(&facing, &at_m).expect("in front")
    };
    // A sleeve over the last columns, ending between squares and within one.
    for (last, grey) in [(7.0, 90), (7.5, 90), (6.8, 150)] {
        let mut covered = whole.clone();
        let left = px(last, 0.0).x as u32;
        for (x, _, pixel) in covered.enumerate_pixels_mut() {
            if x >= left {
                pixel.0 = [grey];
            }
        }
        let seen = find(&covered, &scene.board);
        assert!(!matches!(seen, Err(Miss::OtherBoard(_))), "{last} {grey}: {seen:?}");
        if let Ok(found) = seen {
            for (corner, truth) in found.corners.iter().zip(truth_px(&scene, &facing)) {
                let is_covered = truth.x > f64::from(left) - 2.0;
                assert!(corner.is_seen() != is_covered, "{last} {grey}: {truth}");
                assert!(is_covered || (corner.px - truth).norm() < 0.2, "{last} {grey}: {truth}");
            }
        }
        assert_eq!(Detector::new(DetectorParams::default()).count(&covered), None, "{last} {grey}");
    }
    // The picture ends within the board, larger than named by any amount.
    let right = px(6.6, 0.0).x as u32;
    let cut = imageops::crop_imm(&whole, 0, 0, right, whole.height()).to_image();
    let smaller = Board::new(5, 4, 0.025).expect("valid");
    let larger = OtherBoard::Larger { columns: 7, rows: 6 };
    assert_eq!(find(&cut, &smaller), Err(Miss::OtherBoard(larger)));
    assert_eq!(Detector::new(DetectorParams::default()).count(&cut), None);
}

#[test]
fn pictures_without_a_board_have_none() {
    let away = Isometry3::translation(9.0, 0.0, 0.4);
    for seed in 1..=30 {
        let scene = Scene { clutter: 1.0, ..Scene::random(seed) };
        let seen = find(&render_view(&scene, &away), &scene.board);
        assert!(seen.is_err(), "seed {seed}");
    }
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let board = Board::new(9, 6, 0.025).expect("valid");
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
        assert!(find(&picture, &board).is_err(), "{name}");
    }
    for (width, height) in [(1, 1), (1, 500), (500, 1), (7, 9), (40, 30)] {
        assert!(find(&GrayImage::new(width, height), &board).is_err());
    }
}

#[test]
fn fewer_pixels_are_enough_down_to_vga() {
    let mut scene = Scene::default_720p(8);
    scene.image_size = boresight_geometry::frame::ImageSize { width_px: 640, height_px: 480 };
    scene.camera = Camera::pinhole(560.0, Point2::new(322.0, 236.0));
    let pose = pose(40.0, 300.0, 0.0, [0.0, 0.0, 0.42]);
    let detection = find(&render_view(&scene, &pose), &scene.board).expect("found");
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
        let found = detect_many(pictures.len(), threads, &scene.board, load, |_| None, |_| ());
        let found = found.expect("no thread failed");
        found.into_iter().map(|seen| seen.expect("loaded")).collect::<Vec<_>>()
    };
    let one = with(1);
    assert!(one.iter().all(Result::is_ok));
    for threads in [2, 8] {
        assert_eq!(with(threads), one);
    }
}

/// Views of a carried board, 1/30 s apart, with times.
fn carried(scene: &Scene, count: usize) -> Vec<(CaptureTime, GrayImage)> {
    (0..count)
        .map(|i| {
            // Up to 30 px from picture to picture, turning and tilting on the way.
            let t = i as f64 / 30.0;
            let at_m = [0.05 * (3.1 * t).sin(), 0.04 * (2.3 * t).cos(), 0.45 + 0.05 * t.sin()];
            let pose = pose(25.0 + 15.0 * (1.7 * t).sin(), 40.0 + 50.0 * t, 60.0 * t.sin(), at_m);
            (CaptureTime { nanos: i as u64 * 33_333_333 }, render_view(scene, &pose))
        })
        .collect()
}

#[test]
fn a_followed_board_is_the_board_that_is_found_anywhere() {
    let scene = Scene::default_720p(10);
    let mut detector = Detector::new(DetectorParams::default());
    let mut track = Track::default();
    let (mut followed, mut predicted) = (0, 0);
    let pictures = carried(&scene, 60);
    for (at, picture) in &pictures {
        let anywhere = detector.detect(picture, &scene.board).expect("the whole board is there");
        let near = track.predict(FrameKind::Video, *at);
        if let Some(near) = near.as_ref().filter(|near| !near.everywhere) {
            predicted += 1;
            // One query per row of corners suffices for tracking, but not for a search.
            let left = Cell::new(scene.board.rows());
            let keep_on = || left.replace(left.get().saturating_sub(1)) > 0;
            let search = Search { near: Some(near), keep_on: &keep_on, ..Search::FULL };
            if let Ok(seen) = detector.search(picture, &scene.board, search) {
                followed += 1;
                for (one, other) in seen.corners.iter().zip(&anywhere.corners) {
                    assert!((one.px - other.px).norm() < 0.01, "{} or {}", one.px, other.px);
                }
            }
        }
        let search = Search { near: near.as_ref(), ..Search::FULL };
        let seen = detector.search(picture, &scene.board, search);
        track.add(FrameKind::Video, *at, &seen);
    }
    println!("{followed} of {predicted} followed");
    assert!(predicted >= 50, "{predicted} predictions");
    assert!(followed * 100 >= 95 * predicted, "{followed} of {predicted}");
}

#[test]
fn a_wrong_prediction_costs_nothing_but_time() {
    let scene = Scene::default_720p(11);
    let pictures = carried(&scene, 2);
    let mut detector = Detector::new(DetectorParams::default());
    let mut track = Track::default();
    let first = detector.detect(&pictures[0].1, &scene.board);
    track.add(FrameKind::Video, pictures[0].0, &first);
    let near = track.predict(FrameKind::Video, pictures[1].0).expect("a prediction");
    // Turned upside down, the board is elsewhere.
    let turned = imageops::rotate180(&pictures[1].1);
    let anywhere = detector.detect(&turned, &scene.board);
    let search = Search { near: Some(&near), ..Search::FULL };
    let found = anywhere.as_ref().expect("the whole board is there");
    let upright = find(&pictures[1].1, &scene.board).expect("found");
    let far_corner = Point2::new(f64::from(turned.width()), f64::from(turned.height())).coords;
    for (before, after) in upright.corners.iter().zip(&found.corners) {
        let expected = Point2::from(far_corner - Vector2::repeat(1.0) - before.px.coords);
        assert!((after.px - expected).norm() < 0.01, "{} for {expected}", after.px);
    }
    assert_eq!(detector.search(&turned, &scene.board, search), anywhere);
    // Photographs and long gaps predict nothing.
    assert!(track.predict(FrameKind::Photograph, pictures[1].0).is_none());
    assert!(track.predict(FrameKind::Video, CaptureTime { nanos: 900_000_000 }).is_none());
    track.add(FrameKind::Photograph, pictures[1].0, &first);
    assert!(track.predict(FrameKind::Video, pictures[1].0).is_none());
}

#[test]
fn a_prediction_outlasts_misses_and_spreads() {
    let scene = Scene::default_720p(11);
    let mut detector = Detector::new(DetectorParams::default());
    let mut track = Track::default();
    for (at, picture) in carried(&scene, 2) {
        track.add(FrameKind::Video, at, &detector.detect(&picture, &scene.board));
    }
    let since = |nanos: u64| CaptureTime { nanos: 33_333_333 + nanos };
    let spread = |track: &Track, nanos: u64| {
        track.predict(FrameKind::Video, since(nanos)).map(|near| near.spread_squares)
    };
    let mut before = 0.0;
    for missed in [33_000_000, 66_000_000, 99_000_000, 240_000_000] {
        let now = spread(&track, missed).expect("it isn't long ago");
        assert!(now > before, "{now} squares after {missed} ns");
        track.add(FrameKind::Video, since(missed), &Err(Miss::NoBoard));
        before = now;
    }
    assert!(before > 1.0, "a quarter of a second is long for a hand: {before} squares");
    assert_eq!(spread(&track, 260_000_000), None);
}

#[test]
fn earlier_pictures_change_nothing() {
    let scene = Scene::default_720p(12);
    let mut detector = Detector::new(DetectorParams::default());
    for (_, picture) in carried(&scene, 4) {
        let small = imageops::thumbnail(&picture, 500, 300);
        assert_eq!(detector.detect(&picture, &scene.board), find(&picture, &scene.board));
        assert_eq!(detector.detect(&small, &scene.board), find(&small, &scene.board));
    }
}

#[test]
fn a_covered_corner_is_never_guessed() {
    let scene = Scene { clutter: 0.0, ..Scene::default_720p(13) };
    let pose = pose(20.0, 70.0, 8.0, [0.0, 0.0, 0.36]);
    let picture = render_view(&scene, &pose);
    let whole = find(&picture, &scene.board).expect("found");
    assert!(errors(&scene, &pose, &whole).iter().all(|(off_px, _)| off_px.abs() < 0.2));
    let corners = truth_px(&scene, &pose);
    let side_px = (corners[1] - corners[0]).norm();
    for (index, level) in (0..corners.len()).zip([20_u8, 90, 140, 230].into_iter().cycle()) {
        let mut covered = picture.clone();
        for (x, y, pixel) in covered.enumerate_pixels_mut() {
            let off = Point2::new(f64::from(x), f64::from(y)) - corners[index];
            if off.norm() < 0.5 * side_px {
                pixel.0 = [level];
            }
        }
        let Ok(seen) = find(&covered, &scene.board) else { continue };
        let is_seen = seen.corners[index].is_seen();
        assert!(!is_seen, "corner {index} is under a disc of brightness {level}");
        for (corner, truth) in seen.corners.iter().zip(&corners) {
            assert!(!corner.is_seen() || (corner.px - truth).norm() < 0.2, "{index} {level}");
        }
    }
}

#[test]
fn a_reflection_on_the_board_is_named() {
    let scene = Scene { clutter: 0.0, ..Scene::default_720p(14) };
    let pose = pose(20.0, 70.0, 0.0, [0.0, 0.0, 0.36]);
    let corners = truth_px(&scene, &pose);
    let middle = Point2::from((corners[22].coords + corners[31].coords) / 2.0);
    let side_px = (corners[1] - corners[0]).norm();
    let mut dazzled = render_view(&scene, &pose);
    for (x, y, pixel) in dazzled.enumerate_pixels_mut() {
        let off = (Point2::new(f64::from(x), f64::from(y)) - middle).norm() / (1.6 * side_px);
        let glow = 600.0 * (-0.5 * off.powi(4)).exp();
        pixel.0 = [(f64::from(pixel.0[0]) + glow).min(255.0) as u8];
    }
    match find(&dazzled, &scene.board) {
        Err(Miss::Glare { found, wanted: 54 }) => assert!((12..54).contains(&found), "{found}"),
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_search_that_may_not_go_on_ends() {
    let scene = Scene::default_720p(15);
    let pose = pose(20.0, 70.0, 0.0, [0.0, 0.0, 0.36]);
    let picture = render_view(&scene, &pose);
    let mut detector = Detector::new(DetectorParams::default());
    let search = Search { keep_on: &|| false, ..Search::FULL };
    assert_eq!(detector.search(&picture, &scene.board, search), Err(Miss::OutOfTime));
    let whole = detector.detect(&picture, &scene.board).expect("found");
    assert!(errors(&scene, &pose, &whole).iter().all(|(off_px, _)| off_px.abs() < 0.2));
}

#[test]
fn motion_while_the_shutter_is_open_is_measured() {
    let scene = Scene { clutter: 0.0, ..Scene::default_720p(16) };
    let still = render_view(&scene, &pose(15.0, 0.0, 0.0, [0.0, 0.0, 0.36]));
    let motion_px =
        |picture: &GrayImage| find(picture, &scene.board).expect("found").quality.motion_px;
    assert!(motion_px(&still) < 1.0, "{}", motion_px(&still));
    // Moved along the rows of squares by this many pixels.
    for moved in [3, 5, 7] {
        let smeared = GrayImage::from_fn(still.width(), still.height(), |x, y| {
            let sum: u32 = (0..moved)
                .map(|k| u32::from(still.get_pixel((x + k).min(still.width() - 1), y).0[0]))
                .sum();
            image::Luma([((sum + moved / 2) / moved) as u8])
        });
        let seen_px = motion_px(&smeared);
        let moved_px = f64::from(moved);
        assert!((seen_px - moved_px).abs() < 0.25 * moved_px, "{seen_px} px for {moved_px} px");
    }
}

#[test]
fn each_kind_of_board_is_found_in_a_rendered_picture() {
    for kind in &BOARD_KINDS {
        let size = [9, 6].map(|points| kind.nearest(points));
        let named = BoardChoice::of(size, (kind.usual)());
        let board = named.board(0.02).expect("a board");
        let scene = Scene { board, ..Scene::default_720p(17) };
        for turn_deg in [8.0, 172.0] {
            let pose = pose(25.0, 60.0, turn_deg, [0.0, 0.0, 0.45]);
            let found = find(&render_view(&scene, &pose), &board).expect(kind.name);
            let mut truth_px = truth_px(&scene, &pose);
            let far_px = |truth_px: &[Point2<f64>]| {
                let off = found.corners.iter().zip(truth_px).map(|(c, px)| (c.px - px).norm());
                off.fold(0.0, f64::max)
            };
            if board.looks_the_same_upside_down() && far_px(&truth_px) > 0.5 {
                truth_px.reverse();
            }
            assert!(far_px(&truth_px) < 0.5, "{named} {}", far_px(&truth_px));
        }
    }
}
