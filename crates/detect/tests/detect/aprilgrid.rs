//! Kalibr's AprilGrid: detected points have the right number, however few.

use boresight_calibrate::{CalibrationParams, NotCalibrated, calibrate};
use boresight_detect::{Detector, DetectorParams, Miss};
use boresight_formats::CalibrationFile;
use boresight_geometry::{
    Corner,
    boards::{Board, Pattern},
    frame::ImageSize,
    markers::Tags,
    seen_count,
};
use boresight_present::text;
use boresight_sim::{Scene, render_view};
use boresight_testkit::fixture;
use image::{GrayImage, Luma, imageops};
use nalgebra::{Isometry3, Point2, UnitQuaternion, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::{charuco::Named, turned::turned};

const TAG_M: f64 = 0.03;

/// A board with a number of tags.
fn board([across, down]: [u16; 2], spacing: f64, first: u16) -> Board {
    let points = Board::new(2 * across, 2 * down, TAG_M).expect("valid");
    points.with(Pattern::AprilGrid(Tags { spacing, first })).expect("enough tags")
}

/// Boards drawn with OpenCV 5.0's tags (`generateImageMarker` with a frame of two cells), 60 px
/// wide, 18 px apart, and 38 px from the edge of the picture to the first one: as Kalibr arranges
/// them, numbered from the top, and each with OpenCV's tags the right way up, a half turn from
/// Kalibr's.
const DRAWN: [&str; 4] =
    ["4x3-kalibr.png", "4x3-from-top.png", "4x3-opencv-tags.png", "4x3-opencv-from-top.png"];

fn drawn(name: &str) -> GrayImage {
    let path = fixture("aprilgrid").join(name);
    let sharp = image::open(path).expect("a picture").into_luma8();
    imageops::blur(&sharp, 0.8)
}

/// Position of a column or row of points in a drawn board.
fn drawn_px(place: usize) -> f64 {
    37.5 + (place / 2) as f64 * 78.0 + (place % 2) as f64 * 60.0
}

#[test]
fn tags_are_found_whichever_way_they_stand_and_are_numbered() {
    let board = board([4, 3], 0.3, 0);
    for name in DRAWN {
        let picture = drawn(name);
        for quarter_turns in 0..4 {
            let (turned, expected_px) = turned(&picture, quarter_turns);
            let found = Detector::new(DetectorParams::default()).detect(&turned, &board);
            let found = found.unwrap_or_else(|miss| panic!("{name}, {quarter_turns}: {miss:?}"));
            for (index, corner) in found.corners.iter().enumerate() {
                let at = [index % 8, index / 8].map(drawn_px);
                let off_px = (corner.px - expected_px(at)).norm();
                assert!(corner.is_seen() && off_px < 0.01, "{name} {index}: {off_px} px");
            }
        }
        let mirrored = imageops::flip_horizontal(&picture);
        let mirrored = Detector::new(DetectorParams::default()).detect(&mirrored, &board);
        assert_eq!(mirrored.err(), Some(Miss::Mirrored), "{name}");
    }
}

/// A pose in front of the camera; many boards leave the picture.
fn pose(rng: &mut ChaCha8Rng, tag_px: f64, f_px: f64) -> Isometry3<f64> {
    let tilt_rad = rng.random_range(0.0_f64..60.0).to_radians();
    let (sin, cos) = rng.random_range(0.0..std::f64::consts::TAU).sin_cos();
    let tilt = UnitQuaternion::from_scaled_axis(Vector3::new(sin, -cos, 0.0) * tilt_rad);
    let turn = rng.random_range(0.0..std::f64::consts::TAU);
    let turn = UnitQuaternion::from_scaled_axis(Vector3::z() * turn);
    let depth_m = TAG_M * f_px / tag_px;
    let at_m = Vector3::new(
        rng.random_range(-0.6..0.6) * depth_m,
        rng.random_range(-0.35..0.35) * depth_m,
        depth_m,
    );
    Isometry3::from_parts(at_m.into(), tilt * turn)
}

#[test]
fn every_tag_corner_that_is_found_has_its_number() {
    const BOARDS: [([u16; 2], f64, u16); 3] =
        [([6, 6], 0.3, 0), ([7, 4], 0.25, 0), ([5, 6], 0.4, 100)];
    let mut rng = ChaCha8Rng::seed_from_u64(78);
    let mut named = Named::default();
    // More pictures, to measure: BORESIGHT_PICTURES=2000.
    let pictures = boresight_testkit::asked_for("BORESIGHT_PICTURES").unwrap_or(40);
    for seed in 0..pictures {
        let (size, spacing, first) = BOARDS[rng.random_range(0..BOARDS.len())];
        let clutter = rng.random_range(0.0..1.0);
        let scene =
            Scene { board: board(size, spacing, first), clutter, ..Scene::default_720p(seed) };
        let tag_px = rng.random_range(40.0..150.0);
        let pose = pose(&mut rng, tag_px, scene.camera.f_px.x);
        let picture = render_view(&scene, &pose);
        named.look((&scene, &pose), &picture, 0.1 * tag_px, seed);
    }
    let (views, rms_px) = named.views_and_rms_px(pictures);
    assert!(10 * views > 8 * pictures, "only {views} views of {pictures}");
    assert!(rms_px < 0.03, "{rms_px} px");
}

#[test]
fn other_tags_are_said_to_be_others() {
    let picture = drawn(DRAWN[0]);
    let find = |board: &Board| Detector::new(DetectorParams::default()).detect(&picture, board);
    let others = find(&board([4, 3], 0.3, 100));
    assert!(matches!(others, Err(Miss::OtherMarkers { markers: 3.. })), "{others:?}");
    let wider = find(&board([5, 3], 0.3, 0));
    assert!(matches!(wider, Err(Miss::OtherSquares { markers: 3.. })), "{wider:?}");
}

/// In a halved picture, only a few such small tags are read, and none is contradictory.
#[test]
fn tags_in_other_squares_count_even_if_only_the_finer_picture_shows_them() {
    let [width, height] = [226, 178];
    let filter = imageops::FilterType::Triangle;
    let small = imageops::resize(&drawn(DRAWN[0]), width, height, filter);
    let mut picture = GrayImage::from_pixel(1280, 720, Luma([255]));
    imageops::overlay(&mut picture, &small, 100, 100);
    let picture = imageops::blur(&picture, 1.2);
    for first in [1, 2] {
        let board = board([4, 3], 0.3, first);
        let found = Detector::new(DetectorParams::default()).detect(&picture, &board);
        assert!(matches!(found, Err(Miss::OtherSquares { markers: 3.. })), "{first}: {found:?}");
    }
}

/// Two tags of two rows, with a corner of the next ones.
#[test]
fn a_few_tags_are_enough() {
    let part = imageops::crop_imm(&drawn(DRAWN[0]), 0, 0, 210, 210).to_image();
    let board = board([4, 3], 0.3, 0);
    let found = Detector::new(DetectorParams::default()).detect(&part, &board).expect("tags");
    assert!(seen_count(&found.corners) >= 16);
    for (index, corner) in found.corners.iter().enumerate().filter(|(_, it)| it.is_seen()) {
        let off_px = (corner.px - Point2::from([index % 8, index / 8].map(drawn_px))).norm();
        assert!(off_px < 0.01, "{index}: {off_px} px");
    }
}

#[test]
fn views_of_an_aprilgrid_calibrate_a_camera() {
    let scene = Scene { board: board([6, 6], 0.3, 0), ..Scene::default_720p(5) };
    let mut detector = Detector::new(DetectorParams::default());
    let views: Vec<Vec<Corner>> = (0..8)
        .map(|view| {
            let (sin, cos) = (f64::from(view) * std::f64::consts::FRAC_PI_4).sin_cos();
            let tilt_rad = if view % 2 == 0 { 35_f64 } else { 25.0 }.to_radians();
            let tilt = UnitQuaternion::from_scaled_axis(Vector3::new(sin, -cos, 0.0) * tilt_rad);
            let at_m = Vector3::new(0.05 * cos, 0.03 * sin, 0.42);
            let pose = Isometry3::from_parts(at_m.into(), tilt);
            detector.detect(&render_view(&scene, &pose), &scene.board).expect("seen").corners
        })
        .collect();
    let params = CalibrationParams::default();
    let result = calibrate(&views, &scene.board, scene.image_size, &params).expect("a calibration");
    let (found, truth) = (result.camera, scene.camera);
    println!("f {} of {}, pp {} of {}", found.f_px, truth.f_px, found.pp_px, truth.pp_px);
    assert!((found.f_px - truth.f_px).norm() < 1.0 && (found.pp_px - truth.pp_px).norm() < 1.0);
}

#[test]
fn a_calibration_names_the_tags_of_its_board() {
    let board = board([6, 4], 0.25, 36);
    let size = ImageSize { width_px: 1280, height_px: 720 };
    let none = Err(&NotCalibrated::NoViews);
    let file = CalibrationFile::of(none, size, &board, &[], text::FINDING_WORDS);
    let read = CalibrationFile::read(&file.to_json().expect("JSON")).expect("whole");
    let words = text::report::board(read.board.as_ref().expect("a board"));
    assert_eq!(words, "AprilGrid, 6 × 4 tags of 30 mm, 0.25 of a tag apart, from tag 36");
    assert_eq!(read.checkerboard(), Some(board));
}
