//! Boards with markers: detected points have the right number, however few.

use boresight_calibrate::{CalibrationParams, NotCalibrated, calibrate};
use boresight_detect::{Detector, DetectorParams, Miss};
use boresight_formats::CalibrationFile;
use boresight_geometry::{
    Corner,
    boards::{Board, MarkerSide, Pattern},
    frame::ImageSize,
    markers::Dictionary,
    seen_count,
};
use boresight_present::{
    sheet::{LINES, Page, Rectangle, Resolution, Square, plan, sheet},
    text,
};
use boresight_sim::{Scene, render_view};
use boresight_testkit::fixture;
use image::{
    GrayImage, Luma,
    imageops::{self, FilterType},
};
use nalgebra::{Isometry3, Point2, UnitQuaternion, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::json;

use crate::turned::turned;

/// Detections of boards with self-identifying points.
#[derive(Default)]
pub(crate) struct Named {
    detector: Detector,
    views: u64,
    visible: usize,
    found: u32,
    squares: f64,
}

impl Named {
    /// Detects the scene's board, seen from a pose, in picture number `seed`. Each detected corner
    /// must be nearer than `limit_px` to its namesake.
    pub(crate) fn look(
        &mut self,
        (scene, pose): (&Scene, &Isometry3<f64>),
        picture: &GrayImage,
        limit_px: f64,
        seed: u64,
    ) {
        let truth = scene.board.corners_in_board_m();
        let truth: Vec<_> = truth.iter().map(|m| scene.camera.px_from_board(pose, m)).collect();
        let inside =
            |px: &Point2<f64>| (2.0..1277.0).contains(&px.x) && (2.0..717.0).contains(&px.y);
        self.visible += truth.iter().flatten().filter(|px| inside(px)).count();
        let Ok(seen) = self.detector.detect(picture, &scene.board) else { return };
        self.views += 1;
        for (index, (corner, truth)) in seen.corners.iter().zip(&truth).enumerate() {
            if corner.is_seen() {
                let off_px = truth.map_or(f64::MAX, |truth| (corner.px - truth).norm());
                assert!(off_px < limit_px, "picture {seed}, corner {index}: {off_px} px");
                self.found += 1;
                self.squares += off_px * off_px;
            }
        }
    }

    /// Number of pictures with a board out of `pictures`, and rms error of the corners.
    pub(crate) fn views_and_rms_px(&self, pictures: u64) -> (u64, f64) {
        let Self { views, visible, found, squares, .. } = self;
        let rms_px = (squares / f64::from(*found)).sqrt();
        println!("{views} of {pictures} views, {found} of {visible} corners, rms {rms_px:.4} px");
        (*views, rms_px)
    }
}

/// A board with a number of *squares*.
fn board([across, down]: [u16; 2], dictionary: &str, side_squares: f64) -> Board {
    let plain = Board::new(across - 1, down - 1, 0.02).expect("valid");
    plain.with(markers(dictionary, side_squares)).expect("enough markers")
}

fn markers(dictionary: &str, side_squares: f64) -> Pattern {
    let dictionary = dictionary.parse().expect("a dictionary");
    Pattern::Charuco { dictionary, side: MarkerSide::Squares(side_squares) }
}

/// Boards drawn by OpenCV 5.0, `CharucoBoard::generateImage`, with squares of 40 px and white
/// around.
const DRAWN: [(&str, [u16; 2], &str, f64); 4] = [
    ("8x11-DICT_4X4_50-75.png", [8, 11], "DICT_4X4_50", 0.75),
    ("11x8-DICT_4X4_50-75-legacy.png", [11, 8], "DICT_4X4_50", 0.75),
    ("7x5-DICT_6X6_250-70.png", [7, 5], "DICT_6X6_250", 0.7),
    ("5x6-DICT_5X5_100-80-legacy.png", [5, 6], "DICT_5X5_100", 0.8),
];
const DRAWN_SQUARE_PX: f64 = 40.0;

fn drawn(name: &str) -> GrayImage {
    let path = fixture("charuco").join(name);
    image::open(path).expect("a picture").into_luma8()
}

#[test]
fn boards_that_opencv_draws_are_found_in_both_layouts() {
    for (name, squares, dictionary, side_squares) in DRAWN {
        let board = board(squares, dictionary, side_squares);
        let picture = drawn(name);
        for quarter_turns in 0..4 {
            let (turned, expected_px) = turned(&picture, quarter_turns);
            let found = Detector::new(DetectorParams::default()).detect(&turned, &board);
            let found = found.unwrap_or_else(|miss| panic!("{name}, {quarter_turns}: {miss:?}"));
            for (index, corner) in found.corners.iter().enumerate() {
                let (column, row) = (index % board.columns(), index / board.columns());
                let at = [column, row].map(|place| (place as f64 + 2.0) * DRAWN_SQUARE_PX - 0.5);
                let off_px = (corner.px - expected_px(at)).norm();
                assert!(corner.is_seen() && off_px < 0.1, "{name} {index}: {off_px} px");
            }
        }
    }
}

/// Boards printed white on black, on a dark sheet or shown by a dark page.
#[test]
fn boards_are_found_in_the_negative_with_the_same_corners() {
    for (name, squares, dictionary, side_squares) in DRAWN {
        let board = board(squares, dictionary, side_squares);
        let find = |picture: &GrayImage| {
            let found = Detector::new(DetectorParams::default()).detect(picture, &board);
            found.unwrap_or_else(|miss| panic!("{name}: {miss:?}")).corners
        };
        let mut picture = drawn_small(name, 30.0, 0.8);
        let positive = find(&picture);
        imageops::invert(&mut picture);
        let negative = find(&picture);
        for (one, other) in positive.iter().zip(&negative) {
            let apart_px = (one.px - other.px).norm();
            assert!(one.is_seen() && apart_px < 0.01, "{name}: {apart_px} px");
        }
    }
}

/// A drawn board with squares of `square_px`, blurred by a Gaussian of `blur_px`.
fn drawn_small(name: &str, square_px: f64, blur_px: f32) -> GrayImage {
    let picture = drawn(name);
    let scaled = |length: u32| (f64::from(length) * square_px / DRAWN_SQUARE_PX).round() as u32;
    let (width, height) = (scaled(picture.width()), scaled(picture.height()));
    let small = imageops::resize(&picture, width, height, FilterType::Triangle);
    imageops::blur(&small, blur_px)
}

/// Half a cell of blur leaves a single white cell among black cells darker than the middle between
/// both.
#[test]
fn markers_are_read_where_blur_is_half_a_cell_wide() {
    for (name, squares, dictionary, side_squares) in DRAWN {
        let board = board(squares, dictionary, side_squares);
        let markers = board.markers().expect("markers");
        let cells = (markers.dictionary.side_cells() + 2) as f64 / side_squares;
        let cell_px = 2.6;
        let picture = drawn_small(name, cell_px * cells, 0.5 * cell_px as f32);
        let found = Detector::new(DetectorParams::default()).detect(&picture, &board);
        let seen = seen_count(&found.unwrap_or_else(|miss| panic!("{name}: {miss:?}")).corners);
        assert_eq!(seen, board.corner_count(), "{name}");
    }
}

#[test]
fn markers_too_small_to_read_ask_for_the_board_closer() {
    let (name, squares, dictionary, side_squares) = DRAWN[2];
    let board = board(squares, dictionary, side_squares);
    for square_px in [12.0, 13.0, 15.0] {
        let picture = drawn_small(name, square_px, 0.9);
        let found = Detector::new(DetectorParams::default()).detect(&picture, &board);
        let miss = found.expect_err("cells of less than one and a half pixels");
        let Miss::TooSmall { square_px: seen_px, needed_px } = miss else { panic!("{miss:?}") };
        assert!((seen_px - square_px).abs() < 0.5 && needed_px > seen_px, "{miss:?}");
    }
}

/// With an even number of rows, both layouts have the same markers except for the first and last
/// columns, moved by a column.
#[test]
fn which_layout_a_board_has_shows_in_its_markers_or_its_ends() {
    let (name, squares, dictionary, side_squares) = DRAWN
        .into_iter()
        .find(|(_, [_, rows], ..)| rows % 2 == 0)
        .expect("a board with an even number of rows");
    let board = board(squares, dictionary, side_squares);
    let square_px = DRAWN_SQUARE_PX as u32;
    let whole = drawn(name);
    let find =
        |picture: &GrayImage| Detector::new(DetectorParams::default()).detect(picture, &board);
    // The markers at both ends are covered; all corners are there.
    let mut covered = whole.clone();
    let (end_px, height) = (7 * square_px / 10, whole.height());
    for left in [square_px, whole.width() - square_px - end_px] {
        let strip = GrayImage::from_pixel(end_px, height, image::Luma([255]));
        imageops::replace(&mut covered, &strip, i64::from(left), 0);
    }
    let found = find(&covered).expect("every corner is seen");
    for (index, corner) in found.corners.iter().enumerate().filter(|(_, it)| it.is_seen()) {
        let (column, row) = (index % board.columns(), index / board.columns());
        let at = [column, row].map(|place| (place as f64 + 2.0) * DRAWN_SQUARE_PX - 0.5);
        let off_px = (corner.px - Point2::from(at)).norm();
        assert!(off_px < 0.5, "{index}: {off_px} px");
    }
    // Without the ends, the layout is ambiguous.
    let width = whole.width() - 5 * square_px;
    let middle = imageops::crop_imm(&whole, 5 * square_px / 2, 0, width, height).to_image();
    let miss = find(&middle).expect_err("two layouts explain it");
    assert!(matches!(miss, Miss::PartialBoard { .. }), "{miss:?}");
}

#[test]
fn a_printed_board_is_the_one_that_opencv_draws() {
    for (name, [across, down], dictionary, side_squares) in DRAWN {
        if name.contains("legacy") {
            continue;
        }
        let resolution = Resolution::from_dpi(100.0).expect("usual");
        let page = Page::screen(1920, 1080, resolution);
        let mut plan =
            plan(across - 1, down - 1, Square::Largest, &[page]).expect("fits on the screen");
        let dictionary: Dictionary = dictionary.parse().expect("a dictionary");
        plan.pattern = Pattern::Charuco { dictionary, side: MarkerSide::Squares(side_squares) };
        let sheet = sheet(&plan, &[const { String::new() }; LINES]);
        let is_black = |x_mm: f64, y_mm: f64| {
            let covers = |it: &Rectangle| {
                (it.left_mm..it.left_mm + it.width_mm).contains(&x_mm)
                    && (it.top_mm..it.top_mm + it.height_mm).contains(&y_mm)
            };
            sheet.squares.iter().chain(&sheet.markers).any(covers)
        };
        let picture = drawn(name);
        // Away from the edges of cells: OpenCV draws them in whole pixels.
        let cells = 2.0 * (dictionary.side_cells() + 2) as f64;
        let places = |count: u16| {
            (0..count).flat_map(move |square| {
                let cell = side_squares / cells;
                let inside = (0..cells as usize).filter(|half| half % 2 == 1);
                let within =
                    inside.map(move |half| (1.0 - side_squares) / 2.0 + cell * half as f64);
                within.chain([0.04, 0.96]).map(move |at| f64::from(square) + at)
            })
        };
        for v in places(down) {
            for u in places(across) {
                let px = [u, v].map(|at| ((at + 1.0) * DRAWN_SQUARE_PX) as u32);
                let is_drawn_black = picture.get_pixel(px[0], px[1]).0[0] < 128;
                let at = [plan.left_mm + u * plan.square_mm, plan.top_mm + v * plan.square_mm];
                assert_eq!(is_black(at[0], at[1]), is_drawn_black, "{name}: square {u}, {v}");
            }
        }
    }
}

/// A pose in front of the camera; many boards leave the picture.
fn pose(rng: &mut ChaCha8Rng, square_px: f64, f_px: f64) -> Isometry3<f64> {
    let tilt_rad = rng.random_range(0.0_f64..55.0).to_radians();
    let (sin, cos) = rng.random_range(0.0..std::f64::consts::TAU).sin_cos();
    let tilt = UnitQuaternion::from_scaled_axis(Vector3::new(sin, -cos, 0.0) * tilt_rad);
    let turn = rng.random_range(0.0..std::f64::consts::TAU);
    let turn = UnitQuaternion::from_scaled_axis(Vector3::z() * turn);
    let depth_m = 0.02 * f_px / square_px;
    let at_m = Vector3::new(
        rng.random_range(-0.6..0.6) * depth_m,
        rng.random_range(-0.35..0.35) * depth_m,
        depth_m,
    );
    Isometry3::from_parts(at_m.into(), tilt * turn)
}

/// A hand of constant grey over a part of the picture.
fn cover(picture: &mut GrayImage, rng: &mut ChaCha8Rng) {
    let at = [rng.random_range(200.0..1080.0), rng.random_range(100.0..620.0)];
    let (radius, level) = (rng.random_range(40.0..150.0), rng.random_range(30..220));
    for (x, y, pixel) in picture.enumerate_pixels_mut() {
        if (f64::from(x) - at[0]).hypot(f64::from(y) - at[1]) < radius {
            *pixel = Luma([level]);
        }
    }
}

#[test]
fn every_corner_that_is_found_has_its_number() {
    const BOARDS: [([u16; 2], &str, f64); 4] = [
        ([8, 11], "DICT_4X4_50", 0.75),
        ([12, 9], "DICT_5X5_100", 0.8),
        ([7, 5], "DICT_6X6_250", 0.7),
        ([10, 7], "DICT_APRILTAG_36h11", 0.75),
    ];
    let mut rng = ChaCha8Rng::seed_from_u64(77);
    let mut named = Named::default();
    // More pictures, to measure: BORESIGHT_PICTURES=2000; without the first ones:
    // BORESIGHT_FIRST=627.
    let pictures = boresight_testkit::asked_for("BORESIGHT_PICTURES").unwrap_or(60);
    let first = boresight_testkit::asked_for("BORESIGHT_FIRST").unwrap_or(0);
    for seed in 0..pictures {
        let (size, dictionary, side) = BOARDS[rng.random_range(0..BOARDS.len())];
        let clutter = rng.random_range(0.0..1.0);
        let board = board(size, dictionary, side);
        let scene = Scene { board, clutter, ..Scene::default_720p(seed) };
        let square_px = rng.random_range(30.0..90.0);
        let pose = pose(&mut rng, square_px, scene.camera.f_px.x);
        let mut picture =
            if seed < first { GrayImage::new(1280, 720) } else { render_view(&scene, &pose) };
        if seed % 2 == 0 {
            cover(&mut picture, &mut rng);
        }
        if seed < first {
            continue;
        }
        named.look((&scene, &pose), &picture, 0.2 * square_px, seed);
    }
    let (views, rms_px) = named.views_and_rms_px(pictures);
    assert!(10 * views > 8 * (pictures - first), "only {views} views of {pictures}");
    assert!(rms_px < 0.05, "{rms_px} px");
}

/// A plain board lies on a part of the board: where its corners are near the board's, none of them
/// is distinctive alone.
#[test]
fn corners_of_something_that_lies_on_a_board_arent_the_boards() {
    const SIDE_PX: u32 = 24;
    const RIM_PX: u32 = 7;
    let sheet = drawn(DRAWN[0].0);
    let columns = usize::from(DRAWN[0].1[0]) - 1;
    let piece = GrayImage::from_fn(8 * SIDE_PX + 2 * RIM_PX, 6 * SIDE_PX + 2 * RIM_PX, |x, y| {
        let [u, v] = [x, y].map(|at| at.checked_sub(RIM_PX).map(|at| at / SIDE_PX));
        let is_dark = u.zip(v).is_some_and(|(u, v)| u < 8 && v < 6 && (u + v).is_multiple_of(2));
        Luma([if is_dark { 20 } else { 240 }])
    });
    let board = board(DRAWN[0].1, DRAWN[0].2, DRAWN[0].3);
    let mut detector = Detector::new(DetectorParams::default());
    let (mut boards, mut seen) = (0, 0);
    for top in (60..260).step_by(26) {
        for left in (60..120).step_by(17) {
            let mut picture = sheet.clone();
            imageops::replace(&mut picture, &piece, left, top);
            let picture = imageops::blur(&picture, 0.8);
            let Ok(found) = detector.detect(&picture, &board) else { continue };
            boards += 1;
            for (index, corner) in found.corners.iter().enumerate().filter(|it| it.1.is_seen()) {
                let place = [index % columns, index / columns];
                let [x, y] = place.map(|at| DRAWN_SQUARE_PX * (at as f64 + 2.0) - 0.5);
                let off_px = (corner.px - Point2::new(x, y)).norm();
                assert!(off_px < 1.0, "{left}, {top}: corner {place:?} is {off_px} px off");
                seen += 1;
            }
        }
    }
    assert!(boards >= 24 && seen > 700, "{boards} of 32 boards, {seen} corners");
}

#[test]
fn a_board_with_other_markers_is_said_to_have_them() {
    let picture = drawn(DRAWN[0].0);
    let find = |picture: &GrayImage, board: &Board| {
        Detector::new(DetectorParams::default()).detect(picture, board)
    };
    let other = find(&picture, &board([8, 11], "DICT_5X5_100", 0.75));
    assert!(matches!(other, Err(Miss::OtherMarkers { markers: 3.. })), "{other:?}");
    // One column more: the markers in the first two rows are at their expected places, those in the
    // third are not. The marker in the corner of the board has a single corner, and is not read.
    let top = imageops::crop_imm(&picture, 0, 0, picture.width(), 176).to_image();
    let found = find(&top, &board([8, 11], "DICT_4X4_50", 0.75)).expect("three rows of corners");
    assert_eq!(seen_count(&found.corners), 21);
    let wider = find(&top, &board([9, 11], "DICT_4X4_50", 0.75));
    assert!(matches!(wider, Err(Miss::OtherSquares { markers: 11 })), "{wider:?}");
    let scene = Scene { clutter: 0.0, ..Scene::default_720p(3) };
    let plain = render_view(&scene, &Isometry3::translation(0.0, 0.0, 0.3));
    let plain = find(&plain, &board([10, 7], "DICT_4X4_50", 0.75));
    assert!(matches!(plain, Err(Miss::OtherMarkers { markers: 0 })), "{plain:?}");
}

#[test]
fn letters_on_a_wall_are_no_board_and_a_mirrored_board_is_called_mirrored() {
    let charuco = board([8, 11], "DICT_4X4_50", 0.75);
    let find = |picture: &GrayImage| {
        Detector::new(DetectorParams::default()).detect(picture, &charuco).err()
    };
    assert_eq!(find(&imageops::flip_horizontal(&drawn(DRAWN[0].0))), Some(Miss::Mirrored));
    // Blocks in a grid that isn't a rectangle.
    let print = GrayImage::from_fn(640, 480, |x, y| {
        let (column, row) = (x.wrapping_sub(140) / 40, y.wrapping_sub(100) / 40);
        let is_there = column < 8 && row < 7 && !(column > 4 && row > 3);
        Luma([if is_there && (column + row) % 2 == 0 { 40 } else { 210 }])
    });
    assert_eq!(find(&imageops::blur(&print, 0.8)), Some(Miss::NoBoard));
}

#[test]
fn a_calibration_names_the_markers_of_its_board() {
    let board = board([8, 11], "DICT_4X4_50", 0.75);
    let size = ImageSize { width_px: 1280, height_px: 720 };
    let file =
        CalibrationFile::of(Err(&NotCalibrated::NoViews), size, &board, &[], text::FINDING_WORDS);
    let json = file.to_json().expect("JSON");
    let markers = json!({ "dictionary": "DICT_4X4_50", "side_mm": 15.0 });
    assert_eq!(json["board"]["markers"], markers);
    let read = CalibrationFile::read(&json).expect("whole");
    let words = text::report::board(read.board.as_ref().expect("a board"));
    assert_eq!(words, "ChArUco, 8 × 11 squares of 20 mm, DICT_4X4_50, markers of 15 mm");
    assert_eq!(read.checkerboard(), Some(board));
}

#[test]
fn views_that_are_cut_off_calibrate_a_camera() {
    let board = board([8, 11], "DICT_4X4_50", 0.75);
    let scene = Scene { board, clutter: 0.3, ..Scene::default_720p(9) };
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let mut detector = Detector::new(DetectorParams::default());
    let mut views: Vec<Vec<Corner>> = Vec::new();
    let mut cut = 0;
    while views.len() < 14 {
        let pose = pose(&mut rng, 70.0, scene.camera.f_px.x);
        let Ok(seen) = detector.detect(&render_view(&scene, &pose), &board) else { continue };
        let count = seen_count(&seen.corners);
        if count >= 20 {
            cut += usize::from(count < board.corner_count());
            views.push(seen.corners);
        }
    }
    assert!(cut > 5, "{cut} views are cut off");
    let result = calibrate(&views, &board, scene.image_size, &CalibrationParams::default());
    let result = result.expect("enough views");
    let off_px = result.camera.f_px - scene.camera.f_px;
    assert!(off_px.norm() < 3.0, "f is off by {off_px:?}");
    assert!((result.camera.pp_px - scene.camera.pp_px).norm() < 2.0);
}
