//! Partly seen boards: detections are right, and a calibration uses them.

use boresight_calibrate::{CalibrationParams, FindingCode, calibrate};
use boresight_detect::{Detection, Detector, DetectorParams, Miss, Search, Track};
use boresight_formats::{CalibrationFile, ViewName};
use boresight_geometry::{
    Camera, Corner, Distortion, LensKind,
    boards::Board,
    expect_unseen,
    frame::{CaptureTime, FrameId, FrameKind},
    seen_count,
};
use boresight_guide::guidance::{
    GuidanceParams, Knowledge, LensEstimate, Role, View, measure, next_target, role_of,
};
use boresight_present::text;
use boresight_sim::{Scene as Rendered, render_view};
use boresight_testkit::trust::{SIZE, Scene, board};
use image::{GrayImage, Luma};
use nalgebra::{Isometry3, Point2, UnitQuaternion, Vector2, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Errors of the seen corners, in pixels, numbered from the better end if the board looks the same
/// upside down.
fn errors_px(scene: &Rendered, pose: &Isometry3<f64>, found: &Detection) -> Vec<f64> {
    let truth: Vec<Option<Point2<f64>>> = scene
        .board
        .corners_in_board_m()
        .iter()
        .map(|m| scene.camera.px_from_board(pose, m))
        .collect();
    let errors = |truth: &mut dyn Iterator<Item = &Option<Point2<f64>>>| -> Vec<f64> {
        let both = found.corners.iter().zip(truth).filter(|(corner, _)| corner.is_seen());
        both.map(|(corner, truth)| truth.map_or(f64::MAX, |truth| (corner.px - truth).norm()))
            .collect()
    };
    let worst = |errors: &Vec<f64>| errors.iter().copied().fold(0.0, f64::max);
    let same = errors(&mut truth.iter());
    let turned = errors(&mut truth.iter().rev());
    let may_turn = scene.board.looks_the_same_upside_down();
    if may_turn && worst(&turned) < worst(&same) { turned } else { same }
}

/// Something in front of the board: a hand's ellipse, a pole, a glaring lamp, or nothing.
fn cover(picture: &mut GrayImage, rng: &mut ChaCha8Rng, middle: Point2<f64>, reach_px: f64) {
    let kind = rng.random_range(0..4);
    let angle = rng.random_range(0.0..std::f64::consts::TAU);
    let (sin, cos) = angle.sin_cos();
    let off = Vector2::new(sin, cos) * rng.random_range(0.0..0.9) * reach_px;
    let (at, level) = (middle + off, rng.random_range(20.0..235.0));
    let size = Vector2::new(rng.random_range(0.15..0.45), rng.random_range(0.1..0.3)) * reach_px;
    for (x, y, pixel) in picture.enumerate_pixels_mut() {
        let from = Vector2::new(f64::from(x), f64::from(y)) - at.coords;
        let (along, across) = (from.x * cos + from.y * sin, from.y * cos - from.x * sin);
        let covered = match kind {
            0 => (along / size.x).powi(2) + (across / size.y).powi(2) < 1.0,
            1 => across.abs() < 0.3 * size.y,
            2 => {
                let glow = 500.0 * (-(from.norm() / size.x).powi(4)).exp();
                *pixel = Luma([(f64::from(pixel.0[0]) + glow).min(255.0) as u8]);
                false
            }
            _ => false,
        };
        if covered {
            let texture = 6.0 * (f64::from(x) * 0.31).sin() + 5.0 * (f64::from(y) * 0.17).cos();
            *pixel = Luma([(level + texture) as u8]);
        }
    }
}

#[test]
fn no_part_of_a_board_is_taken_for_another() {
    const SIZES: [(u16, u16); 6] = [(9, 6), (8, 6), (7, 5), (11, 8), (10, 7), (6, 4)];
    let mut rng = ChaCha8Rng::seed_from_u64(41);
    let mut detector = Detector::new(DetectorParams::default());
    let (mut whole, mut parts, mut tried, mut squares, mut count) = (0, 0, 0, 0.0, 0.0);
    let mut worst: f64 = 0.0;
    // More pictures, to measure: BORESIGHT_PICTURES=2000.
    let pictures = boresight_testkit::asked_for("BORESIGHT_PICTURES").unwrap_or(120);
    for seed in 0..pictures {
        let (columns, rows) = SIZES[rng.random_range(0..SIZES.len())];
        let board = Board::new(columns, rows, 0.025).expect("valid");
        let clutter = rng.random_range(0.0..1.0);
        let scene = Rendered { board, clutter, ..Rendered::default_720p(seed) };
        let tilt_rad = rng.random_range(0.0_f64..50.0).to_radians();
        let (sin, cos) = rng.random_range(0.0..std::f64::consts::TAU).sin_cos();
        let tilt = UnitQuaternion::from_scaled_axis(Vector3::new(sin, -cos, 0.0) * tilt_rad);
        let turn = UnitQuaternion::from_scaled_axis(
            Vector3::z() * rng.random_range(0.0..std::f64::consts::TAU),
        );
        let depth_m = rng.random_range(0.3..0.6);
        let at_m = Vector3::new(
            rng.random_range(-0.45..0.45) * depth_m,
            rng.random_range(-0.25..0.25) * depth_m,
            depth_m,
        );
        let pose = Isometry3::from_parts(at_m.into(), tilt * turn);
        let mut picture = render_view(&scene, &pose);
        // First whole, to know the board's position.
        let before = detector.detect(&picture, &board);
        let middle = scene.camera.px_from_board(&pose, &Point2::origin()).expect("in front");
        let reach_px = 0.0125 * f64::from(columns) / depth_m * scene.camera.f_px.x;
        cover(&mut picture, &mut rng, middle, reach_px);
        tried += 1;
        if detector
            .detect(&picture, &board)
            .is_ok_and(|alone| seen_count(&alone.corners) * 8 < alone.corners.len() * 7)
        {
            panic!("picture {seed}: a part by itself could be of something else");
        }
        // Chequered cloth in the background may have as many fields.
        let is_the_board = |found: &Detection| {
            errors_px(&scene, &pose, found).into_iter().all(|error_px| error_px < 1.5)
        };
        let Some(before) = before.ok().filter(is_the_board) else { continue };
        let mut track = Track::default();
        for nanos in [0, 33_000_000] {
            track.add(FrameKind::Video, CaptureTime { nanos }, &Ok(before.clone()));
        }
        let near = track.predict(FrameKind::Video, CaptureTime { nanos: 66_000_000 });
        let search = Search { near: near.as_ref(), ..Search::FULL };
        let Ok(found) = detector.search(&picture, &board, search) else { continue };
        let errors = errors_px(&scene, &pose, &found);
        let worst_px = errors.iter().copied().fold(0.0, f64::max);
        let is_whole = errors.len() * 8 >= board.corner_count() * 7;
        (whole, parts) = (whole + u32::from(is_whole), parts + u32::from(!is_whole));
        // Nor is such a cloth the board.
        if is_whole && worst_px > 1.5 {
            continue;
        }
        worst = worst.max(worst_px);
        let seen = errors.len();
        assert!(worst_px < 1.5, "picture {seed}, {seen} of {columns}x{rows}: {worst_px} px");
        squares += errors.iter().map(|off_px| off_px * off_px).sum::<f64>();
        count += errors.len() as f64;
    }
    let rms_px = (squares / f64::max(count, 1.0)).sqrt();
    println!("{whole} whole, {parts} parts of {tried}; rms {rms_px:.4} px, worst {worst:.2} px");
    assert!(parts >= 2, "only {parts} parts of {tried} were used");
    assert!(rms_px < 0.1, "{rms_px} px");
}

/// A board carried out of the picture at 30 pictures a second, and at 5.
#[test]
fn a_board_that_is_followed_keeps_its_corners_while_it_leaves() {
    let scene = Rendered { clutter: 0.0, ..Rendered::default_720p(5) };
    let mut detector = Detector::new(DetectorParams::default());
    for (step_nanos, least_parts, least_corners) in [(33_000_000, 5, 36), (200_000_000, 2, 48)] {
        let mut track = Track::default();
        let (mut parts, mut least) = (0, scene.board.corner_count());
        for number in 0..24_u32 {
            let at = CaptureTime { nanos: step_nanos * u64::from(number) };
            // Upright, to lose both the left and the right end at last.
            let x_m = 0.02 + 0.009 * f64::from(number);
            let pose = Isometry3::new(Vector3::new(x_m, 0.0, 0.36), Vector3::new(0.0, 0.4, 0.0));
            let near = track.predict(FrameKind::Video, at);
            let search = Search { near: near.as_ref(), ..Search::FULL };
            let seen = detector.search(&render_view(&scene, &pose), &scene.board, search);
            track.add(FrameKind::Video, at, &seen);
            let Ok(found) = seen else { break };
            let errors = errors_px(&scene, &pose, &found);
            assert!(errors.iter().all(|off_px| *off_px < 0.3), "frame {number}: {errors:?}");
            parts += usize::from(errors.len() < scene.board.corner_count());
            least = least.min(errors.len());
        }
        let seen = format!("{parts} parts, at least {least} corners, every {step_nanos} ns");
        assert!(parts >= least_parts && least <= least_corners, "{seen}");
    }
}

/// Behind hands that hide both ends, squares look the same two squares further on.
#[test]
fn a_board_that_jumps_behind_hands_is_not_named_by_its_track() {
    let board = Board::new(9, 6, 0.025).expect("valid");
    let scene = Rendered { board, clutter: 0.0, ..Rendered::default_720p(8) };
    let at = |squares: f64| {
        Isometry3::new(Vector3::new(0.025 * squares, 0.0, 0.45), Vector3::new(0.1, 0.1, 0.0))
    };
    let mut detector = Detector::new(DetectorParams::default());
    let before = detector.detect(&render_view(&scene, &at(0.0)), &board).expect("whole");
    let mut picture = render_view(&scene, &at(2.0));
    let px = |squares: f64| {
        let place = Point2::new(0.025 * squares, 0.0);
        scene.camera.px_from_board(&at(2.0), &place).expect("in front").x
    };
    let between_hands = px(-2.4)..px(2.4);
    for (x, _, pixel) in picture.enumerate_pixels_mut() {
        if !between_hands.contains(&f64::from(x)) {
            *pixel = Luma([90 + (x % 7) as u8]);
        }
    }
    for gap_nanos in [33_000_000, 100_000_000] {
        let mut track = Track::default();
        for nanos in [0, 33_000_000] {
            track.add(FrameKind::Video, CaptureTime { nanos }, &Ok(before.clone()));
        }
        let nanos = 33_000_000 + gap_nanos;
        let near = track.predict(FrameKind::Video, CaptureTime { nanos });
        let search = Search { near: near.as_ref(), ..Search::FULL };
        let seen = detector.search(&picture, &board, search);
        assert!(matches!(seen, Err(Miss::PartialBoard { .. })), "{gap_nanos} ns: {seen:?}");
    }
}

/// The gaps between discs look like corners from afar.
#[test]
fn a_grid_of_discs_is_neither_a_board_nor_a_covered_one() {
    let discs = GrayImage::from_fn(640, 480, |x, y| {
        let [x, y] = [x, y].map(|px| f64::from(px) + 0.5);
        let (column, row) = (((x - 80.0) / 48.0).floor(), ((y - 60.0) / 48.0).floor());
        let off = (x - 104.0 - 48.0 * column).hypot(y - 84.0 - 48.0 * row);
        let is_disc = (0.0..10.0).contains(&column) && (0.0..7.0).contains(&row) && off < 15.0;
        Luma([if is_disc { 40 } else { 210 }])
    });
    let page = image::imageops::blur(&discs, 1.0);
    let mut detector = Detector::new(DetectorParams::default());
    for (columns, rows) in [(3, 3), (4, 3), (5, 4), (7, 6), (9, 6)] {
        let board = Board::new(columns, rows, 0.025).expect("valid");
        let seen = detector.detect(&page, &board);
        assert_eq!(seen, Err(Miss::NoBoard), "{columns}x{rows}");
    }
}

#[test]
fn a_part_that_could_lie_anywhere_on_the_board_is_refused() {
    // Everything but the middle of a large board lies outside of the picture.
    let board = Board::new(19, 15, 0.025).expect("valid");
    let scene = Rendered { board, clutter: 0.0, ..Rendered::default_720p(6) };
    let pose = Isometry3::new(Vector3::new(0.0, 0.0, 0.25), Vector3::new(0.3, 0.2, 0.1));
    let seen = Detector::new(DetectorParams::default()).detect(&render_view(&scene, &pose), &board);
    assert!(matches!(seen, Err(Miss::PartialBoard { .. })), "{seen:?}");
}

/// Views with parts cut off by the picture, and missing some corners in the middle, too.
fn cut_views(scene: &mut Scene) -> Vec<Vec<Corner>> {
    scene.whole_board = false;
    let mut plan = scene.plan(16);
    for (index, pose) in plan.iter_mut().enumerate().skip(8) {
        let corner = [[0.42, 0.36], [-0.42, -0.36], [-0.42, 0.36], [0.42, -0.36]];
        pose.off = corner[index % 4];
    }
    let mut views = scene.views(&plan);
    for (index, view) in views.iter_mut().enumerate() {
        for (place, corner) in view.iter_mut().enumerate() {
            let inside = (4.0..f64::from(SIZE.width_px) - 4.0).contains(&corner.px.x)
                && (4.0..f64::from(SIZE.height_px) - 4.0).contains(&corner.px.y);
            let is_covered = index % 3 == 0 && (place == 13 || place == 22);
            if !inside || is_covered {
                *corner = Corner::unseen(Point2::new(f64::NAN, f64::NAN));
            }
        }
    }
    views
}

#[test]
fn cut_views_count_with_the_corners_that_are_there() {
    let mut gains = Vec::new();
    for seed in 0..6 {
        let mut scene = Scene::ordinary(900 + seed);
        let views = cut_views(&mut scene);
        let seen: usize = views.iter().map(|view| seen_count(view)).sum();
        let all = views.len() * board().corner_count();
        assert!(seen < all - 100, "{seen} of {all} corners are seen");
        let found = calibrate(&views, &board(), SIZE, &CalibrationParams::default());
        let found = found.expect("a lens");
        let codes: Vec<_> = found.findings.iter().map(|finding| &finding.code).collect();
        assert!((0.85..1.15).contains(&found.noise_factor), "{seed}: {codes:?}");
        let off_px = found.camera.f_px.x - scene.camera.f_px.x;
        let sd_px = found.covariance[(0, 0)].sqrt();
        assert!(off_px.abs() < 4.0 * sd_px, "{seed}: f off by {off_px} of {sd_px} px");
        // Only the whole views.
        let whole: Vec<Vec<Corner>> =
            views.iter().filter(|view| view.iter().all(Corner::is_seen)).cloned().collect();
        let without = calibrate(&whole, &board(), SIZE, &CalibrationParams::default());
        if let Ok(without) = without {
            gains.push(found.coverage - without.coverage);
        }
    }
    println!("share of the picture covered more: {gains:.2?}");
    // Never less, and more in the mean.
    assert!(gains.iter().all(|gain| *gain >= 0.0), "{gains:?}");
    assert!(gains.iter().sum::<f64>() > 0.02 * gains.len() as f64, "{gains:?}");
}

#[test]
fn residuals_of_a_part_are_those_of_the_corners_that_are_seen() {
    let mut scene = Scene::ordinary(900);
    scene.noise_px = 0.1;
    let plan = scene.plan(12);
    let mut views = scene.views(&plan);
    for (place, corner) in views[9].iter_mut().enumerate() {
        if place % 9 >= 6 || place / 9 >= 4 {
            *corner = Corner::unseen(corner.px);
        }
    }
    assert_eq!(seen_count(&views[9]), 24);
    views[9][11].px.y += 2.5;
    let found = calibrate(&views, &board(), SIZE, &CalibrationParams::default()).expect("a lens");
    let codes: Vec<_> = found.findings.iter().map(|finding| finding.code).collect();
    let is_odd_corner =
        |code: &FindingCode| matches!(code, FindingCode::CornerOdd { view: 9, corner: 11, .. });
    assert!(codes.iter().any(is_odd_corner), "{codes:?}");
    let is_odd_view = |code: &FindingCode| matches!(code, FindingCode::ViewOdd { view: 9, .. });
    assert!(!codes.iter().any(is_odd_view), "{codes:?}");
    let (squares, all) =
        found.views.iter().zip(&views).fold((0.0, 0.0), |(sum, all), (view, seen)| {
            let count = seen_count(seen) as f64;
            (sum + count * view.residual_rms_px.powi(2), all + count)
        });
    assert!((found.rms_px - (squares / all).sqrt()).abs() < 1e-12, "{}", found.rms_px);
}

#[test]
fn the_file_outlines_what_was_seen_of_a_board() {
    let mut scene = Scene::ordinary(900);
    let plan = scene.plan(12);
    let mut views = scene.views(&plan);
    let whole = views[9].clone();
    for (place, corner) in views[9].iter_mut().enumerate() {
        if place % 9 >= 6 || place / 9 >= 4 {
            *corner = Corner::unseen(corner.px);
        }
    }
    let found = calibrate(&views, &board(), SIZE, &CalibrationParams::default());
    let name = |at: usize| ViewName { name: format!("{at}.png"), number: None, reason: None };
    let names: Vec<ViewName> = (0..views.len()).map(name).collect();
    let file = CalibrationFile::of(found.as_ref(), SIZE, &board(), &names, text::FINDING_WORDS);
    for (view, rim) in [(8, [0, 8, 53, 45]), (9, [0, 5, 32, 27])] {
        let outline = file.views[view].outline().expect("an outline");
        for (px, corner) in outline.iter().zip(rim) {
            let seen_px = if view == 9 { whole[corner].px } else { views[view][corner].px };
            assert!((px - seen_px).norm() < 3.0, "{view}, {corner}: {px} for {seen_px}");
        }
    }
}

#[test]
fn an_unseen_corner_changes_nothing_wherever_it_is_expected() {
    let mut scene = Scene::ordinary(77);
    let views = cut_views(&mut scene);
    let mut expected = views.clone();
    for view in &mut expected {
        expect_unseen(&board().corners_in_board_m(), view);
        assert!(view.iter().all(|corner| corner.px.x.is_finite()));
    }
    let [one, other] = [views, expected].map(|views| {
        calibrate(&views, &board(), SIZE, &CalibrationParams::default()).expect("a lens")
    });
    assert_eq!(one.camera, other.camera);
    assert_eq!(one.findings, other.findings);
}

/// A fisheye lens of 120 degrees, a pose with the board leaving the picture at the right, and the
/// reflection about the axis.
fn at_the_edge() -> (LensEstimate, [Isometry3<f64>; 2]) {
    let distortion = Distortion { kind: LensKind::Fisheye, k1: -0.02, ..Distortion::default() };
    let centre_px = SIZE.centre_px();
    let camera = Camera { distortion, ..Camera::pinhole(600.0, centre_px) };
    let lens_estimate = LensEstimate { camera, ..LensEstimate::guess(SIZE) };
    let pose = Isometry3::new(Vector3::new(0.26, 0.02, 0.2), Vector3::new(0.15, 0.25, 0.0));
    let half_turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), std::f64::consts::PI);
    let reflected = Isometry3::from_parts(
        (half_turn * pose.translation.vector).into(),
        half_turn * pose.rotation * half_turn,
    );
    (lens_estimate, [pose, reflected])
}

/// Seen corners of the board up to `inset_px` from the picture's edge; the rest is expected on a
/// plane.
fn seen_of(pose: &Isometry3<f64>, camera: &Camera, inset_px: f64) -> Vec<Corner> {
    let inside = |px: &Point2<f64>| {
        let along = |at: f64, size: u32| (inset_px..f64::from(size) - 1.0 - inset_px).contains(&at);
        along(px.x, SIZE.width_px) && along(px.y, SIZE.height_px)
    };
    let mut corners: Vec<Corner> = board()
        .corners_in_board_m()
        .iter()
        .map(|point| match camera.px_from_board(pose, point).filter(inside) {
            Some(px) => Corner::isotropic(px, 0.05),
            None => Corner::unseen(Point2::new(f64::NAN, f64::NAN)),
        })
        .collect();
    expect_unseen(&board().corners_in_board_m(), &mut corners);
    corners
}

fn measured(number: u64, corners: &[Corner], lens_estimate: &LensEstimate) -> View {
    let frame = (FrameId(number), CaptureTime { nanos: 33_000_000 * number });
    measure(frame, corners, 0.8, &board(), lens_estimate).expect("a view")
}

#[test]
fn a_part_is_measured_wherever_its_unseen_corners_are_expected() {
    let (lens_estimate, [pose, _]) = at_the_edge();
    let mut corners = seen_of(&pose, &lens_estimate.camera, 10.0);
    let seen = seen_count(&corners);
    assert!((20..corners.len()).contains(&seen), "{seen} corners are seen");
    let view = measured(1, &corners, &lens_estimate);
    // Beyond the rays at 110 degrees from the axis.
    for corner in corners.iter_mut().filter(|corner| !corner.is_seen()) {
        corner.px = Point2::new(4000.0, 500.0);
    }
    assert_eq!(measured(1, &corners, &lens_estimate).line, view.line);
}

#[test]
fn the_partner_of_a_part_stands_where_its_pose_is_reflected() {
    let (lens_estimate, [pose, reflected]) = at_the_edge();
    let camera = &lens_estimate.camera;
    let one = measured(1, &seen_of(&pose, camera, 10.0), &lens_estimate);
    let params = GuidanceParams::default();
    let accepted = [one];
    let knowledge = Knowledge::new(&accepted, &board(), &lens_estimate, &params);
    let target = next_target(&accepted, &[], &board(), &knowledge, &lens_estimate, &params);
    let target = target.expect("a partner");
    for (ghost, point) in target.ghost_px.iter().zip(board().corners_in_board_m()) {
        let truth = camera.px_from_board(&reflected, &point).expect("in front");
        assert!((ghost - truth).norm() < 0.1, "{ghost} instead of {truth}");
    }
    // Less of the partner is seen.
    let other = measured(2, &seen_of(&reflected, camera, 60.0), &lens_estimate);
    let counts = [&accepted[0], &other].map(|view| seen_count(&view.corners));
    assert!(counts[0] > counts[1] + 3, "{counts:?}");
    let role = role_of(&other, &accepted, &lens_estimate, &params);
    assert_eq!(role, Ok(Role::Partner { of: 0 }));
}

#[test]
fn a_part_tells_and_covers_what_is_seen_of_it() {
    let mut scene = Scene::ordinary(77);
    scene.noise_px = 1e-3;
    let plan = scene.plan(4);
    let whole = scene.views(&plan);
    let mut parts = whole.clone();
    for view in &mut parts {
        // The two left columns of nine.
        for (index, corner) in view.iter_mut().enumerate() {
            *corner = if index % 9 < 2 { *corner } else { Corner::unseen(corner.px) };
        }
    }
    let lens_estimate = LensEstimate { camera: scene.camera, ..LensEstimate::guess(SIZE) };
    let [whole_variance, part_variance] = [&whole, &parts].map(|views| {
        let views: Vec<View> =
            (0..4).map(|i| measured(i, &views[i as usize], &lens_estimate)).collect();
        let knowledge =
            Knowledge::new(&views, &board(), &lens_estimate, &GuidanceParams::default());
        knowledge.variance()
    });
    assert!(part_variance > 3.0 * whole_variance, "{part_variance} {whole_variance}");
    let [whole, part] = [whole, parts].map(|views| {
        let params = CalibrationParams::default();
        calibrate(&views, &board(), SIZE, &params).expect("a lens").coverage
    });
    assert!(part < 0.6 * whole, "{part} {whole}");
}
