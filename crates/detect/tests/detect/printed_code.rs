//! Code in a printed board's margin, read from pictures of the sheet of `boresight target`.

use boresight_detect::{DetectorParams, detect, read_code};
use boresight_geometry::{
    Camera, Corner, Distortion,
    board_code::{BoardCode, BoardId},
    boards::Board,
};
use boresight_present::{
    sheet::{Paper, Plan, Rectangle, Resolution, Sheet, Square, plan, png, sheet},
    text,
};
use image::{GrayImage, Luma};
use nalgebra::{
    Isometry3, Point2, Point3, Rotation3, Translation3, UnitQuaternion, Vector2, Vector3,
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

const BOARDS: [(u16, u16); 4] = [(9, 6), (7, 5), (11, 8), (6, 9)];
const SIZES: [(u32, u32); 3] = [(640, 480), (1280, 720), (1920, 1080)];
/// Pixels per millimetre of the print.
const PRINT: f64 = 6.0;
/// Samples along a pixel's side.
const SAMPLES: u32 = 3;

/// Contents of the margin.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Margin {
    Code,
    White,
    /// Random bars in place of the code.
    Chance,
    /// A code with randomly flipped cells.
    Damaged,
}

/// A printed sheet.
struct Printed {
    plan: Plan,
    board: Board,
    code: BoardCode,
    picture: GrayImage,
}

fn printed(columns: u16, rows: u16, margin: Margin, rng: &mut ChaCha8Rng) -> Printed {
    let plan = plan(columns, rows, Square::Largest, &Paper::A4.pages()).expect("fits");
    let board = Board::new(columns, rows, plan.square_mm * 1e-3).expect("a board");
    let code = BoardCode::new(&board, BoardId::from_number(rng.random())).expect("fits");
    let id = code.id().to_string();
    let mut page: Sheet = sheet(&plan, &text::target_lines(&plan, Some(&id)));
    if margin != Margin::White {
        page = page.with_code(&plan, &code);
        assert!(!page.code.is_empty(), "{columns}x{rows} has room");
    }
    if matches!(margin, Margin::Chance | Margin::Damaged) {
        let share = if margin == Margin::Chance { 0.5 } else { 0.1 };
        page.code = page.code.into_iter().flat_map(|bar| broken(bar, share, &plan, rng)).collect();
    }
    let resolution = Resolution::from_dpi(PRINT * 25.4).expect("in range");
    let file = png(&page, resolution).expect("written");
    let picture = image::load_from_memory(&file).expect("a PNG").into_luma8();
    Printed { plan, board, code, picture }
}

/// A bar in cells, some white; sometimes with a second bar beside it.
fn broken(bar: Rectangle, share: f64, plan: &Plan, rng: &mut ChaCha8Rng) -> Vec<Rectangle> {
    let flat = bar.width_mm > bar.height_mm
        || bar.top_mm < plan.top_mm
        || bar.top_mm > plan.top_mm + plan.board_height_mm();
    let cell_mm = if flat { plan.board_width_mm() } else { plan.board_height_mm() }
        / boresight_geometry::board_code::CELLS as f64;
    let (length_mm, across) = if flat { (bar.width_mm, true) } else { (bar.height_mm, false) };
    let cells = (length_mm / cell_mm).round() as u32;
    (0..=cells)
        .filter(
            |index| if *index < cells { !rng.random_bool(share) } else { rng.random_bool(share) },
        )
        .map(|index| {
            let shift_mm = f64::from(index) * cell_mm;
            if across {
                Rectangle { left_mm: bar.left_mm + shift_mm, width_mm: cell_mm, ..bar }
            } else {
                Rectangle { top_mm: bar.top_mm + shift_mm, height_mm: cell_mm, ..bar }
            }
        })
        .collect()
}

/// A picture, the narrowest cell of the strip, and the positions of the corners.
struct Shot {
    picture: GrayImage,
    cell_px: f64,
    corners_px: Vec<Point2<f64>>,
}

/// Photographs the sheet: the board fills `fill` of the picture's width or height, tipped and
/// turned at random.
fn photograph(
    printed: &Printed,
    (width_px, height_px): (u32, u32),
    fill: f64,
    rng: &mut ChaCha8Rng,
) -> Shot {
    let plan = &printed.plan;
    let mut uniform = |from: f64, to: f64| from + (to - from) * rng.random::<f64>();
    let f_px = uniform(0.7, 1.1) * f64::from(width_px);
    let middle_px = Point2::new(f64::from(width_px) / 2.0, f64::from(height_px) / 2.0);
    let camera = Camera {
        distortion: Distortion { k1: uniform(-0.25, 0.02), k2: 0.04, ..Distortion::default() },
        ..Camera::pinhole(f_px, middle_px)
    };
    let (width_m, height_m) = (plan.board_width_mm() * 1e-3, plan.board_height_mm() * 1e-3);
    let distance_m = (f_px * width_m / (fill * f64::from(width_px)))
        .max(f_px * height_m / (fill * f64::from(height_px)));
    let axis = Vector3::new(uniform(-1.0, 1.0), uniform(-1.0, 1.0), 0.0).normalize();
    let tilt = Rotation3::new(axis * uniform(0.0, 0.75));
    let turn = Rotation3::new(Vector3::z() * uniform(-0.3, 0.3));
    let away = Vector3::new(uniform(-0.05, 0.05), uniform(-0.05, 0.05), 1.0) * distance_m;
    let rotation = UnitQuaternion::from_rotation_matrix(&(tilt * turn));
    let pose = Isometry3::from_parts(Translation3::from(away), rotation);
    let board_from_cam = pose.inverse();
    let (blur_px, noise) = (uniform(0.5, 1.0), uniform(1.0, 4.0));
    let (dark, light) = (uniform(20.0, 60.0), uniform(150.0, 230.0));
    // Middle of the board on the sheet.
    let middle_mm = Vector2::new(
        plan.left_mm + plan.board_width_mm() / 2.0,
        plan.top_mm + plan.board_height_mm() / 2.0,
    );
    let origin = board_from_cam * Point3::origin();
    let on_print = |x: f64, y: f64| -> Option<Vector2<f64>> {
        let ray = camera.normalized_from_px(&Point2::new(x, y))?;
        let along = board_from_cam * Vector3::new(ray.x, ray.y, 1.0);
        let on_board = origin - along * (origin.z / along.z);
        Some((on_board.coords.xy() * 1e3 + middle_mm) * PRINT)
    };
    // Rays at the pixels' corners; the print is taken as flat between them.
    let row = |y: u32| -> Vec<Option<Vector2<f64>>> {
        (0..=width_px).map(|x| on_print(f64::from(x) - 0.5, f64::from(y) - 0.5)).collect()
    };
    let (paper_width, paper_height) = printed.picture.dimensions();
    let level = |at: Vector2<f64>| {
        let inside = at.x >= 0.0
            && at.y >= 0.0
            && at.x < f64::from(paper_width)
            && at.y < f64::from(paper_height);
        if inside {
            let ink = f64::from(printed.picture.get_pixel(at.x as u32, at.y as u32).0[0]) / 255.0;
            dark + (light - dark) * ink
        } else {
            90.0
        }
    };
    let mut picture = GrayImage::new(width_px, height_px);
    let mut above = row(0);
    for y in 0..height_px {
        let below = row(y + 1);
        for x in 0..width_px as usize {
            let corners = (above[x], above[x + 1], below[x], below[x + 1]);
            let (Some(a), Some(b), Some(c), Some(d)) = corners else { continue };
            let mut sum = 0.0;
            for i in 0..SAMPLES {
                for j in 0..SAMPLES {
                    let share = |of: u32| (f64::from(of) + 0.5) / f64::from(SAMPLES);
                    let (right, down) = (share(i), share(j));
                    sum += level(
                        (a * (1.0 - right) + b * right) * (1.0 - down)
                            + (c * (1.0 - right) + d * right) * down,
                    );
                }
            }
            let mean = (sum / f64::from(SAMPLES * SAMPLES)).round() as u8;
            picture.put_pixel(x as u32, y, Luma([mean]));
        }
        above = below;
    }
    picture = image::imageops::blur(&picture, blur_px as f32);
    for pixel in picture.pixels_mut() {
        let with_noise = f64::from(pixel.0[0]) + noise * rng.sample::<f64, _>(StandardNormal);
        pixel.0[0] = with_noise.round().clamp(0.0, 255.0) as u8;
    }
    let px = |x_mm: f64, y_mm: f64| {
        let point = Vector2::new(x_mm, y_mm) - middle_mm;
        camera.project(&(pose * Point3::new(point.x * 1e-3, point.y * 1e-3, 0.0)))
    };
    let (right_mm, bottom_mm) =
        (plan.left_mm + plan.board_width_mm(), plan.top_mm + plan.board_height_mm());
    let long = if plan.columns >= plan.rows {
        [
            (plan.left_mm, plan.top_mm, right_mm, plan.top_mm),
            (plan.left_mm, bottom_mm, right_mm, bottom_mm),
        ]
    } else {
        [
            (plan.left_mm, plan.top_mm, plan.left_mm, bottom_mm),
            (right_mm, plan.top_mm, right_mm, bottom_mm),
        ]
    };
    // Either strip will do.
    let cell_px = long.map(|(x0, y0, x1, y1)| {
        let length = px(x0, y0).zip(px(x1, y1)).map_or(0.0, |(a, b)| (a - b).norm());
        length / boresight_geometry::board_code::CELLS as f64
    });
    let corners_m = printed.board.corners_in_board_m();
    let corner = |at: &Point2<f64>| camera.project(&(pose * Point3::new(at.x, at.y, 0.0)));
    let corners_px = corners_m.iter().map(|at| corner(at).expect("in front")).collect();
    Shot { picture, cell_px: cell_px[0].max(cell_px[1]), corners_px }
}

/// Attempts with slightly wrong corners, for each picture.
const SHAKEN: usize = 3;

/// Class limits of the width of a cell: below 2, 2.5, 3, 4 pixels, and above.
const STEPS: [f64; 5] = [2.0, 2.5, 3.0, 4.0, f64::INFINITY];

#[derive(Debug, Default)]
struct Survey {
    /// Boards found and codes read, with a code in the margin.
    by_cell: [(usize, usize); STEPS.len()],
    /// Boards found with anything else in the margin.
    others: usize,
    /// Attempts to read, including shaken corners among them.
    reads: usize,
    wrong: usize,
}

fn survey(pictures: u64, seed: u64) -> Survey {
    let mut survey = Survey::default();
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let margins = [Margin::Code, Margin::White, Margin::Chance, Margin::Damaged];
    let mut print = None;
    for at in 0..pictures {
        // Twelve pictures of each print: eight of 640x480, three of 1280x720, one of 1920x1080.
        let (of, shot) = (at / 12, at % 12);
        let margin = margins[of as usize % margins.len()];
        let size = SIZES[usize::from(shot >= 8) + usize::from(shot >= 11)];
        if shot == 0 {
            let (columns, rows) = BOARDS[of as usize / margins.len() % BOARDS.len()];
            print = Some(printed(columns, rows, margin, &mut rng));
        }
        let Some(printed) = &print else { continue };
        // Far ones, too.
        let fill = 0.25 + 0.6 * rng.random::<f64>();
        let shot = photograph(printed, size, fill, &mut rng);
        let Ok(seen) = detect(&shot.picture, &printed.board, DetectorParams::default()) else {
            continue;
        };
        let says = |corners: &[Corner]| read_code(&shot.picture, &printed.board, corners);
        let is_wrong = |read: Option<BoardCode>| {
            let has_code = matches!(margin, Margin::Code | Margin::Damaged);
            read.is_some_and(|read| read != printed.code || !has_code)
        };
        let read = says(&seen.corners);
        survey.wrong += usize::from(is_wrong(read));
        // Corners of a worse detector: other places are sampled.
        for _ in 0..SHAKEN {
            let mut shaken = seen.corners.clone();
            for corner in &mut shaken {
                corner.px += Vector2::from_fn(|_, _| 0.4 * rng.sample::<f64, _>(StandardNormal));
            }
            survey.wrong += usize::from(is_wrong(says(&shaken)));
        }
        survey.reads += 1 + SHAKEN;
        if margin == Margin::Code {
            let step = STEPS.iter().position(|most| shot.cell_px < *most).expect("below infinity");
            survey.by_cell[step].0 += 1;
            survey.by_cell[step].1 += usize::from(read.is_some());
        } else {
            survey.others += 1;
        }
    }
    survey
}

#[test]
fn the_code_is_read_from_pictures_and_never_misread() {
    let survey = survey(96, 1);
    assert_eq!(survey.wrong, 0, "{survey:?}");
    // From near by, the margin may be outside of the picture.
    let found: usize = survey.by_cell.iter().map(|(found, _)| found).sum();
    let read: usize = survey.by_cell.iter().map(|(_, read)| read).sum();
    assert!(found >= 20 && 4 * read >= 3 * found, "{survey:?}");
    assert!(survey.others > 30, "{survey:?}");
}

/// Parts of boards left by a hand or the edge of the picture.
#[derive(Debug, Default)]
struct Parts {
    /// Pictures of boards found whole before.
    pictures: usize,
    parts: usize,
    /// Parts with the code read again from the measured corners.
    read: usize,
    corners: usize,
    wrong: usize,
    worst_px: f64,
}

fn parts(pictures: u64, seed: u64, margin: Margin) -> Parts {
    let mut found = Parts::default();
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut print = None;
    for at in 0..pictures {
        if at % 8 == 0 {
            let (columns, rows) = BOARDS[(at / 8) as usize % BOARDS.len()];
            print = Some(printed(columns, rows, margin, &mut rng));
        }
        let Some(printed) = &print else { continue };
        let fill = 0.5 + 0.35 * rng.random::<f64>();
        let Shot { picture, corners_px, .. } = photograph(printed, (1280, 720), fill, &mut rng);
        let detect =
            |picture: &GrayImage| detect(picture, &printed.board, DetectorParams::default());
        if detect(&picture).is_err() {
            continue;
        }
        found.pictures += 1;
        let low = corners_px.iter().fold(Point2::new(f64::MAX, f64::MAX), |low, px| low.inf(px));
        let high = corners_px.iter().fold(Point2::new(f64::MIN, f64::MIN), |high, px| high.sup(px));
        let share = 0.15 + 0.45 * rng.random::<f64>();
        let at_px = low + share * (high - low);
        let from_end_px = high - share * (high - low);
        // The picture ends within the board, or a hand lies on it.
        let (width, height) = picture.dimensions();
        let mut off_px = Vector2::zeros();
        let mut crop = |left: u32, top: u32, right: u32, bottom: u32| {
            off_px = Vector2::new(f64::from(left), f64::from(top));
            image::imageops::crop_imm(&picture, left, top, right - left, bottom - top).to_image()
        };
        let cut = match rng.random_range(0..6) {
            0 => crop(at_px.x as u32, 0, width, height),
            1 => crop(0, at_px.y as u32, width, height),
            2 => crop(0, 0, from_end_px.x as u32, height),
            3 => crop(0, 0, width, from_end_px.y as u32),
            _ => {
                let mut picture = picture.clone();
                let middle_px = corners_px[rng.random_range(0..corners_px.len())];
                let reach_px = 0.35 * (high - low).min();
                for (x, y, pixel) in picture.enumerate_pixels_mut() {
                    let off = Point2::new(f64::from(x), f64::from(y)) - middle_px;
                    if off.norm() < reach_px {
                        pixel.0[0] = (130.0 + 15.0 * (off.x / 9.0).sin()) as u8;
                    }
                }
                picture
            }
        };
        let Ok(seen) = detect(&cut) else { continue };
        if seen.corners.iter().all(Corner::is_seen) {
            continue;
        }
        found.parts += 1;
        let read = read_code(&cut, &printed.board, &seen.corners);
        assert!(read.is_none_or(|read| read == printed.code), "picture {at}: {read:?}");
        found.read += usize::from(read.is_some());
        for (corner, truth_px) in seen.corners.iter().zip(&corners_px) {
            if corner.is_seen() {
                let error_px = (corner.px + off_px - truth_px).norm();
                found.corners += 1;
                found.wrong += usize::from(error_px > 1.5);
                found.worst_px = found.worst_px.max(error_px);
            }
        }
    }
    found
}

/// More pictures, to measure: `BORESIGHT_PICTURES=2000`.
#[test]
fn the_code_says_which_part_of_a_board_is_seen() {
    let pictures = boresight_testkit::asked_for("BORESIGHT_PICTURES").unwrap_or(48);
    let coded = parts(pictures, 3, Margin::Code);
    println!("{coded:?}");
    assert_eq!(coded.wrong, 0, "{coded:?}");
    assert!(coded.parts * 5 > coded.pictures, "{coded:?}");
    assert!(coded.read * 10 > coded.parts * 9, "{coded:?}");
    for margin in [Margin::White, Margin::Chance, Margin::Damaged] {
        let other = parts(pictures / 4, 4, margin);
        println!("{margin:?}: {other:?}");
        assert_eq!(other.parts, 0, "{margin:?}: {other:?}");
    }
}

/// Table of the documentation: `cargo test -p boresight-detect printed_code -- --ignored
/// --nocapture`.
#[test]
#[ignore = "takes minutes: make long-tests"]
fn long_ten_thousand_pictures() {
    let mut total = Survey::default();
    let surveys = std::thread::scope(|scope| {
        let halves = [100, 101].map(|seed| scope.spawn(move || survey(1_800, seed)));
        halves.map(|half| half.join().expect("no panic"))
    });
    for survey in surveys {
        for (sum, part) in total.by_cell.iter_mut().zip(survey.by_cell) {
            *sum = (sum.0 + part.0, sum.1 + part.1);
        }
        total.others += survey.others;
        total.reads += survey.reads;
        total.wrong += survey.wrong;
    }
    println!(
        "cells below {STEPS:?} px: {:?}; others {}, reads {}, wrong {}",
        total.by_cell, total.others, total.reads, total.wrong
    );
    assert_eq!(total.wrong, 0);
}

#[test]
fn the_code_does_not_move_a_corner() {
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    for (columns, rows) in BOARDS {
        let corners = [Margin::White, Margin::Code].map(|margin| {
            let mut chance = rng.clone();
            let printed = printed(columns, rows, margin, &mut chance);
            let shot = photograph(&printed, (1280, 720), 0.7, &mut ChaCha8Rng::seed_from_u64(11));
            let seen = detect(&shot.picture, &printed.board, DetectorParams::default());
            seen.expect("found").corners
        });
        rng.random::<u64>();
        for (without, with) in corners[0].iter().zip(&corners[1]) {
            assert!((without.px - with.px).norm() < 0.02, "{columns}x{rows}: {without:?} {with:?}");
        }
    }
}

#[test]
fn boards_without_room_have_no_code() {
    let pages = Paper::A4.pages();
    let tight = plan(9, 6, Square::Exactly { mm: 28.0 }, &pages);
    for plan in tight.into_iter() {
        assert!(plan.edges_with_room().is_empty());
    }
    let side = plan(9, 6, Square::Exactly { mm: 25.0 }, &pages).expect("fits");
    assert_eq!(side.edges_with_room().len(), 2, "beside the short edges");
    let code = BoardCode::new(&Board::new(9, 6, 0.025).expect("a board"), BoardId::from_number(5));
    let drawn =
        sheet(&side, &text::target_lines(&side, None)).with_code(&side, &code.expect("fits"));
    for bar in &drawn.code {
        let is_beside = bar.left_mm + bar.width_mm < side.left_mm
            || bar.left_mm > side.left_mm + side.board_width_mm();
        assert!(is_beside && bar.left_mm > side.page.margin_mm, "{bar:?}");
    }
}
