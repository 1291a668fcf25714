//! Grids of circles: detections are the images of the circles' centres, not the ellipses' centres.

use boresight_calibrate::{CalibrationParams, NotCalibrated, calibrate};
use boresight_detect::{
    Detection, Detector, DetectorParams, GridOutcome, Miss, OtherBoard, WeighedGrid,
};
use boresight_formats::CalibrationFile;
use boresight_geometry::{
    Corner,
    boards::{Board, Pattern},
    frame::ImageSize,
    markers::CircleRows,
};
use boresight_present::text;
use boresight_sim::{Scene, render_view};
use image::{GrayImage, Luma, imageops};
use nalgebra::{Isometry3, Matrix3, Point2, Point3, UnitQuaternion, Vector2, Vector3};

const STEP_M: f64 = 0.03;

fn board(columns: u16, rows: u16, layout: CircleRows) -> Board {
    let plain = Board::new(columns, rows, STEP_M).expect("valid");
    plain.with(Pattern::Circles(layout)).expect("circles need nothing else")
}

fn detect(picture: &GrayImage, board: &Board) -> Result<Detection, Miss> {
    Detector::new(DetectorParams::default()).detect(picture, board)
}

/// Drawing independent of the simulation: by samples of each pixel.
fn drawn(board: &Board, image_from_board: &Matrix3<f64>, diameter: f64) -> GrayImage {
    const SAMPLES: u32 = 6;
    let back = image_from_board.try_inverse().expect("a map");
    let points = board.corners_in_board_m();
    let [half_x, half_y] = board.target().size_m().map(|side_m| 0.5 * side_m + STEP_M);
    let sharp = GrayImage::from_fn(960, 600, |x, y| {
        let place = |dx: f64, dy: f64| {
            let at = back * Vector3::new(f64::from(x) + dx, f64::from(y) + dy, 1.0);
            Point2::new(at.x / at.z, at.y / at.z)
        };
        // Most pixels show one colour.
        let middle = place(0.0, 0.0);
        let pixel_m = (place(1.0, 0.0) - middle).norm().max((place(0.0, 1.0) - middle).norm());
        let is_clear = |point: &Point2<f64>| {
            ((middle - point).norm() - 0.5 * diameter * STEP_M).abs() > 1.5 * pixel_m
        };
        let off_m = [middle.x.abs() - half_x, middle.y.abs() - half_y];
        let is_clear =
            points.iter().all(is_clear) && off_m.iter().all(|off_m| off_m.abs() > 1.5 * pixel_m);
        let samples = if is_clear { 1 } else { SAMPLES };
        let mut sum = 0.0;
        for sample in 0..samples * samples {
            let within = |k: u32| (f64::from(k) + 0.5) / f64::from(samples) - 0.5;
            let at = place(within(sample % samples), within(sample / samples));
            let is_sheet = at.x.abs() < half_x && at.y.abs() < half_y;
            let is_in = |point: &Point2<f64>| (at - point).norm() < 0.5 * diameter * STEP_M;
            sum += match is_sheet {
                false => 90.0,
                true if points.iter().any(is_in) => 30.0,
                true => 210.0,
            };
        }
        Luma([(sum / f64::from(samples * samples)).round() as u8])
    });
    imageops::blur(&sharp, 0.7)
}

/// Map of a camera with a focal length of 800 px, in the middle of the picture.
fn seen_at(tilt_deg: f64, azimuth_deg: f64, depth_m: f64) -> Matrix3<f64> {
    let (sin, cos) = azimuth_deg.to_radians().sin_cos();
    let axis = Vector3::new(cos, sin, 0.0) * tilt_deg.to_radians();
    let turn = UnitQuaternion::from_scaled_axis(axis).to_rotation_matrix();
    let camera = Matrix3::new(800.0, 0.0, 479.5, 0.0, 800.0, 299.5, 0.0, 0.0, 1.0);
    let at_m = Vector3::new(0.01, -0.005, depth_m);
    let columns =
        [turn.matrix().column(0).into_owned(), turn.matrix().column(1).into_owned(), at_m];
    camera * Matrix3::from_columns(&columns)
}

fn seen_px(image_from_board: &Matrix3<f64>, point: &Point2<f64>) -> Point2<f64> {
    let at = image_from_board * point.to_homogeneous();
    Point2::new(at.x / at.z, at.y / at.z)
}

/// Errors of a whole board's centres against the truth, in the nearer of two numberings if a half
/// turn maps the board to itself.
fn errors_px(found: &Detection, board: &Board, map: &Matrix3<f64>) -> Vec<Vector2<f64>> {
    let points = board.corners_in_board_m();
    let off = |turned: bool| -> Vec<Vector2<f64>> {
        let points = points.iter().map(|point| if turned { -point } else { *point });
        let pairs = found.corners.iter().zip(points);
        pairs.map(|(corner, point)| corner.px - seen_px(map, &point)).collect()
    };
    let sum = |off: &[Vector2<f64>]| off.iter().map(Vector2::norm).sum::<f64>();
    let (one, other) = (off(false), off(true));
    if board.looks_the_same_upside_down() && sum(&other) < sum(&one) { other } else { one }
}

#[test]
fn true_centres_are_found_where_the_ellipses_are_tenths_of_a_pixel_off() {
    let boards = [
        (board(7, 5, CircleRows::Symmetric), 0.5),
        (board(4, 11, CircleRows::Asymmetric), 0.6),
        (board(4, 6, CircleRows::Asymmetric), 0.4),
    ];
    for (board, diameter) in boards {
        for (tilt_deg, azimuth_deg) in [(0.0, 0.0), (45.0, 20.0), (65.0, 110.0)] {
            let map = seen_at(tilt_deg, azimuth_deg, 0.55);
            let mut picture = drawn(&board, &map, diameter);
            // Also as a thermal camera shows them.
            for is_negative in [false, true] {
                if is_negative {
                    imageops::invert(&mut picture);
                }
                let found = detect(&picture, &board);
                let found = found.unwrap_or_else(|miss| panic!("{board:?} {tilt_deg}: {miss:?}"));
                assert!(found.corners.iter().all(Corner::is_seen), "{board:?} {tilt_deg}");
                let errors = errors_px(&found, &board, &map);
                let mean = errors.iter().sum::<Vector2<f64>>() / errors.len() as f64;
                let worst = errors.iter().map(Vector2::norm).fold(0.0, f64::max);
                assert!(mean.norm() < 0.01 && worst < 0.05, "{tilt_deg}: {mean} {worst}");
            }
        }
    }
}

#[test]
fn other_grids_and_parts_are_refused_and_said_to_be_that() {
    let shown = board(8, 6, CircleRows::Symmetric);
    let picture = drawn(&shown, &seen_at(20.0, 30.0, 0.4), 0.5);
    let is_shown = OtherBoard::Circles { columns: 8, rows: 6, layout: CircleRows::Symmetric };
    let smaller = detect(&picture, &board(7, 5, CircleRows::Symmetric));
    assert_eq!(smaller, Err(Miss::OtherBoard(is_shown)));
    // An extra row isn't a covered one.
    let larger = detect(&picture, &board(8, 7, CircleRows::Symmetric));
    assert_eq!(larger, Err(Miss::OtherBoard(is_shown)));
    let shifted = detect(&picture, &board(4, 6, CircleRows::Asymmetric));
    assert!(shifted.is_err(), "{shifted:?}");
    // The last column is outside.
    let end = seen_px(&seen_at(20.0, 30.0, 0.4), &Point2::new(2.9 * STEP_M, 0.0)).x as u32;
    let part = imageops::crop_imm(&picture, 0, 0, end, 600).to_image();
    let cut = detect(&part, &board(7, 6, CircleRows::Symmetric));
    assert!(cut.is_err(), "{cut:?}");
    let cut = detect(&part, &shown);
    assert!(matches!(cut, Err(Miss::PartialBoard { wanted: 48, .. })), "{cut:?}");
    // A plain board isn't detected in the gaps between circles, nor circles in its squares.
    for [columns, rows] in [[4, 3], [7, 5], [6, 4]] {
        let plain = Board::new(columns, rows, STEP_M).expect("valid");
        let found = detect(&picture, &plain);
        assert!(found.is_err(), "{columns}x{rows}: {found:?}");
    }
    let squares = GrayImage::from_fn(640, 480, |x, y| {
        let (column, row) = (x.wrapping_sub(120) / 30, y.wrapping_sub(70) / 30);
        Luma([if column < 8 && row < 11 && (column + row).is_multiple_of(2) { 30 } else { 210 }])
    });
    let eroded = imageops::blur(&squares, 1.0);
    for picture in [&squares, &eroded] {
        let found = detect(picture, &board(4, 11, CircleRows::Asymmetric));
        assert!(found.is_err(), "{found:?}");
    }
}

/// Tipped so far, near and distant circles aren't detected in a single search of the picture.
#[test]
fn circles_of_a_larger_grid_are_no_part_of_a_smaller_one() {
    let layout = CircleRows::Asymmetric;
    for (shown, asked, azimuth_deg) in
        [([4, 4], [3, 4], 60.0), ([3, 6], [3, 5], 0.0), ([4, 6], [3, 6], 270.0)]
    {
        let [shown, asked] = [shown, asked].map(|[columns, rows]| board(columns, rows, layout));
        let picture = drawn(&shown, &seen_at(50.0, azimuth_deg, 0.28), 0.6);
        let found = detect(&picture, &asked);
        assert!(found.is_err(), "{azimuth_deg}: {found:?}");
    }
}

/// Reports on a refused picture list the grids of circles compared with the board.
#[test]
fn grids_of_circles_are_listed() {
    let drawn_board = board(7, 5, CircleRows::Symmetric);
    let picture = drawn(&drawn_board, &seen_at(20.0, 0.0, 0.55), 0.5);
    let mut detector = Detector::new(DetectorParams::default());
    let (found, grids) = detector.explain(&picture, &drawn_board);
    assert!(found.is_ok(), "{found:?}");
    let last = grids.last().expect("a grid");
    assert_eq!((last.outcome, last.corners_px.len()), (GridOutcome::Named(35), 35));
    let (missed, grids) = detector.explain(&picture, &board(8, 5, CircleRows::Symmetric));
    let missed = missed.expect_err("another board");
    let says_why = |grid: &WeighedGrid| grid.outcome == GridOutcome::Missed(missed);
    assert!(grids.iter().any(says_why), "{missed:?}, {grids:?}");
}

/// A finger on a circle doesn't hide the others.
#[test]
fn a_covered_circle_is_unseen() {
    let (board, map) = (board(7, 5, CircleRows::Symmetric), seen_at(25.0, 60.0, 0.4));
    let mut picture = drawn(&board, &map, 0.5);
    let covered = seen_px(&map, &board.corners_in_board_m()[16]);
    for (x, y, Luma([value])) in picture.enumerate_pixels_mut() {
        if (Point2::new(f64::from(x), f64::from(y)) - covered).norm() < 25.0 {
            *value = 140;
        }
    }
    let found = detect(&picture, &board).expect("34 circles");
    let unseen = found.corners.iter().filter(|corner| !corner.is_seen()).count();
    assert_eq!(unseen, 1);
    let errors = errors_px(&found, &board, &map);
    assert!(errors.iter().all(|error| error.norm() < 0.5));
}

#[test]
fn views_of_circles_calibrate_a_camera() {
    for board in [board(7, 5, CircleRows::Symmetric), board(4, 11, CircleRows::Asymmetric)] {
        let scene = Scene { board, ..Scene::default_720p(5) };
        let mut detector = Detector::new(DetectorParams::default());
        let views: Vec<Vec<Corner>> = (0..8)
            .map(|view| {
                let (sin, cos) = (f64::from(view) * std::f64::consts::FRAC_PI_4).sin_cos();
                let tilt_rad = if view % 2 == 0 { 35_f64 } else { 25.0 }.to_radians();
                let tilt =
                    UnitQuaternion::from_scaled_axis(Vector3::new(sin, -cos, 0.0) * tilt_rad);
                let at_m = Vector3::new(0.05 * cos, 0.03 * sin, 0.5);
                let pose = Isometry3::from_parts(at_m.into(), tilt);
                let found = detector.detect(&render_view(&scene, &pose), &scene.board);
                let corners = found.expect("seen").corners;
                let points = scene.board.corners_in_board_m();
                let truth = |point: &Point2<f64>| {
                    scene.camera.project(&(pose * Point3::new(point.x, point.y, 0.0)))
                };
                let off = |corner: &Corner, point: &Point2<f64>| {
                    truth(point).map_or(f64::INFINITY, |truth| (corner.px - truth).norm())
                };
                let same = corners.iter().zip(&points).map(|(c, p)| off(c, p)).sum::<f64>();
                let turned = corners.iter().zip(&points).map(|(c, p)| off(c, &-p)).sum::<f64>();
                assert!(same.min(turned) < 0.1 * corners.len() as f64, "{same} {turned}");
                corners
            })
            .collect();
        let params = CalibrationParams::default();
        let result = calibrate(&views, &scene.board, scene.image_size, &params);
        let (found, truth) = (result.expect("a calibration").camera, scene.camera);
        println!("f {} of {}, pp {} of {}", found.f_px, truth.f_px, found.pp_px, truth.pp_px);
        let (f, pp) = (found.f_px - truth.f_px, found.pp_px - truth.pp_px);
        assert!(f.norm() < 1.5 && pp.norm() < 1.5, "{f} {pp}");
    }
}

#[test]
fn a_calibration_names_the_circles_of_its_board() {
    let size = ImageSize { width_px: 1280, height_px: 720 };
    for (layout, said) in [
        (CircleRows::Symmetric, "Circles, 4 × 11, rows 30 mm apart"),
        (CircleRows::Asymmetric, "Asymmetric circles, 4 × 11, rows 30 mm apart"),
    ] {
        let board = board(4, 11, layout);
        let none = Err(&NotCalibrated::NoViews);
        let file = CalibrationFile::of(none, size, &board, &[], text::FINDING_WORDS);
        let read = CalibrationFile::read(&file.to_json().expect("JSON")).expect("whole");
        assert_eq!(text::report::board(read.board.as_ref().expect("a board")), said);
        assert_eq!(read.checkerboard(), Some(board));
    }
}

/// `cv::CirclesGridFinder` and the tutorial's `calcBoardCornerPositions`: `((2 j + i % 2) s, i s)`.
#[test]
fn points_lie_where_opencv_has_them() {
    let points_m = board(4, 11, CircleRows::Asymmetric).corners_in_board_m();
    for (index, point) in points_m.iter().enumerate() {
        let (row, column) = (index / 4, index % 4);
        let opencv = Vector2::new((2 * column + row % 2) as f64, row as f64) * STEP_M;
        assert!((point - points_m[0] - opencv).norm() < 1e-12);
    }
}
