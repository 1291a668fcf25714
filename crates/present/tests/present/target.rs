//! Printed board: statements of the files in their own units, and detection in them.

use boresight_detect::{DetectorParams, detect};
use boresight_geometry::boards::Board;
use boresight_present::{
    sheet::{
        DoesNotFit, Page, Paper, Plan, Rectangle, Resolution, Sheet, Square, pdf, plan, png, sheet,
        svg,
    },
    text,
};
use image::GrayImage;
use nalgebra::Point2;

const BOARDS: [(u16, u16); 6] = [(9, 6), (6, 9), (7, 7), (4, 3), (12, 8), (11, 4)];

fn resolution(dpi: f64) -> Resolution {
    Resolution::from_dpi(dpi).expect("in range")
}

/// Every paper and a screen with every board; the squares as large as fits, then of 15 mm.
fn plans() -> Vec<Plan> {
    let mut media: Vec<Vec<Page>> = Paper::ALL.iter().map(|paper| paper.pages().to_vec()).collect();
    media.push(vec![Page::screen(1920, 1080, resolution(92.0))]);
    media.push(vec![Page::screen(800, 1280, resolution(189.3))]);
    let mut plans = Vec::new();
    for pages in &media {
        for (columns, rows) in BOARDS {
            for square in [Square::Largest, Square::Exactly { mm: 15.0 }] {
                plans.extend(plan(columns, rows, square, pages));
            }
        }
    }
    assert!(plans.len() >= 4 * 2 * BOARDS.len(), "{} plans", plans.len());
    plans
}

fn sheet_of(plan: &Plan) -> Sheet {
    sheet(plan, &text::target_lines(plan, None))
}

fn picture(sheet: &Sheet, resolution: Resolution) -> GrayImage {
    let file = png(sheet, resolution).expect("written");
    image::load_from_memory(&file).expect("a PNG").into_luma8()
}

/// Expected inner corners, `(0, 0)` at the centre of the top-left pixel.
fn corners_px(plan: &Plan, per_mm: f64) -> Vec<Point2<f64>> {
    let at = |start_mm: f64, i: u16| (start_mm + f64::from(i) * plan.square_mm) * per_mm - 0.5;
    (1..=plan.rows)
        .flat_map(|row| (1..=plan.columns).map(move |column| (column, row)))
        .map(|(column, row)| Point2::new(at(plan.left_mm, column), at(plan.top_mm, row)))
        .collect()
}

#[test]
fn the_detector_finds_every_board_where_it_was_drawn() {
    for plan in plans() {
        let resolution = plan.page.pixels.unwrap_or(resolution(100.0));
        // As through a lens: no camera delivers edges of such sharpness.
        let image = image::imageops::blur(&picture(&sheet_of(&plan), resolution), 0.7);
        let board = Board::new(plan.columns, plan.rows, plan.square_mm / 1000.0).expect("valid");
        let found = detect(&image, &board, DetectorParams::default()).expect("found").corners;
        let expected = corners_px(&plan, resolution.per_mm());
        assert_eq!(found.len(), expected.len());
        for px in &expected {
            let off =
                found.iter().map(|corner| (corner.px - px).norm()).fold(f64::INFINITY, f64::min);
            assert!(off < 0.05, "{plan:?}: {px} is off by {off} px");
        }
    }
}

#[test]
fn a_png_states_its_resolution() {
    let plan = plan(9, 6, Square::Exactly { mm: 25.0 }, &Paper::A4.pages()).expect("fits");
    let file = png(&sheet_of(&plan), resolution(300.0)).expect("written");
    let decoder = png::Decoder::new(std::io::Cursor::new(&file));
    let reader = decoder.read_info().expect("a PNG");
    let info = reader.info();
    // 297 mm x 210 mm at 11,811 pixels per metre.
    assert_eq!((info.width, info.height), (3508, 2480));
    let dims = info.pixel_dims.expect("pHYs");
    assert_eq!((dims.xppu, dims.yppu, dims.unit), (11_811, 11_811, png::Unit::Meter));
    let fine = png(&sheet_of(&plan), resolution(1200.0)).expect("written");
    let fine = png::Decoder::new(std::io::Cursor::new(&fine)).read_info().expect("a PNG");
    assert_eq!((fine.info().width, fine.info().height), (14_031, 9_921));
    let wall = Page::screen(60_000, 60_000, resolution(100.0));
    let wall = plan_of(9, 6, wall);
    assert!(png(&sheet_of(&wall), resolution(100.0)).is_err());
}

fn plan_of(columns: u16, rows: u16, page: Page) -> Plan {
    plan(columns, rows, Square::Largest, &[page]).expect("fits")
}

/// Contents of a PDF: the page in points, and the rectangles in points from the lower left.
struct Drawn {
    page_pt: [f64; 2],
    rectangles_pt: Vec<[f64; 4]>,
    text: String,
}

fn drawn(file: &[u8]) -> Drawn {
    let text = String::from_utf8_lossy(file).into_owned();
    let between = |start: &str, end: &str| {
        let (_, rest) = text.split_once(start).expect("there");
        rest.split_once(end).expect("ends").0.to_owned()
    };
    let numbers = |text: &str| -> Vec<f64> {
        text.split_whitespace().filter_map(|word| word.parse().ok()).collect()
    };
    let page = numbers(&between("/MediaBox [", "]"));
    let mut matrix = Vec::new();
    let mut rectangles_pt = Vec::new();
    let content = between("stream\n", "endstream");
    for line in content.lines() {
        let values = numbers(line);
        if line.ends_with(" cm") {
            matrix = values;
        } else if line.ends_with(" re") {
            let [a, b, c, d, e, f] = *matrix.first_chunk().expect("a matrix before it");
            assert!(b == 0.0 && c == 0.0);
            rectangles_pt.push([
                a * values[0] + e,
                d * values[1] + f,
                a * values[2],
                d * values[3],
            ]);
        }
    }
    Drawn { page_pt: [page[2], page[3]], rectangles_pt, text }
}

#[test]
fn a_pdf_has_the_sizes_in_its_own_units() {
    const POINTS_PER_MM: f64 = 72.0 / 25.4;
    // A thousandth of a micrometre would be 3e-6 points; single precision over a page is 3e-5.
    const CLOSE_PT: f64 = 1e-4;
    let near = |found: f64, wanted: f64| {
        assert!((found - wanted).abs() < CLOSE_PT, "{found} pt for {wanted} pt");
    };
    for plan in plans() {
        let drawn = drawn(&pdf(&sheet_of(&plan)));
        near(drawn.page_pt[0], plan.page.width_mm * POINTS_PER_MM);
        near(drawn.page_pt[1], plan.page.height_mm * POINTS_PER_MM);
        let all = usize::from(plan.columns + 1) * usize::from(plan.rows + 1);
        let (squares, ruler) = drawn.rectangles_pt.split_at(all.div_ceil(2));
        let side_pt = plan.square_mm / 1000.0 / 0.0254 * 72.0;
        for [left, top, width, height] in squares {
            near(*width, side_pt);
            near(-*height, side_pt);
            // Each begins a whole number of squares from the first.
            let from_first = [left - squares[0][0], squares[0][1] - top].map(|pt| pt / side_pt);
            assert!(from_first.iter().all(|n| (n - n.round()).abs() < CLOSE_PT), "{from_first:?}");
        }
        // Line and ticks: 100 mm, and a millimetre from tick to tick.
        near(ruler[0][2], plan.ruler_mm * POINTS_PER_MM);
        let ticks: Vec<f64> =
            ruler[1..].iter().map(|[left, _, width, _]| left + width / 2.0).collect();
        near(ticks[ticks.len() - 1] - ticks[0], plan.ruler_mm * POINTS_PER_MM);
        for pair in ticks.windows(2) {
            near(pair[1] - pair[0], POINTS_PER_MM);
        }
        let name = format!("(Checkerboard {}x{} \\(inner corners\\)", plan.columns, plan.rows);
        assert!(drawn.text.contains(&name) || drawn.text.contains(&name.replace('\\', "")));
        assert!(drawn.text.contains("/PrintScaling /None"));
    }
}

#[test]
fn papers_have_their_sizes_and_hundred_millimetres_of_ruler() {
    for (paper, short_mm, long_mm) in
        [(Paper::A4, 210.0, 297.0), (Paper::Letter, 215.9, 279.4), (Paper::A3, 297.0, 420.0)]
    {
        for page in paper.pages() {
            let plan = plan_of(9, 6, page);
            let sheet = sheet_of(&plan);
            let (width_mm, height_mm) = (sheet.width_mm, sheet.height_mm);
            assert_eq!(
                (width_mm.min(height_mm), width_mm.max(height_mm)),
                (short_mm, long_mm),
                "{paper:?}"
            );
            assert_eq!(sheet.ruler[0].width_mm, 100.0);
            assert_eq!(sheet.ruler.len(), 1 + 101);
        }
    }
    // A4 in points, as in viewers.
    let drawn = drawn(&pdf(&sheet_of(&plan_of(9, 6, Paper::A4.pages()[0]))));
    assert!(
        (drawn.page_pt[0] - 841.889_8).abs() < 1e-4 && (drawn.page_pt[1] - 595.275_6).abs() < 1e-4
    );
}

#[test]
fn an_svg_is_in_millimetres() {
    for plan in plans() {
        let sheet = sheet_of(&plan);
        let svg = svg(&sheet);
        let value = |element: &str, name: &str| -> String {
            let (_, rest) = element.split_once(&format!(" {name}=\"")).expect("there");
            rest.split_once('"').expect("ends").0.to_owned()
        };
        let number = |element: &str, name: &str| -> f64 {
            value(element, name).trim_end_matches("mm").parse().expect("a number")
        };
        let (width, height) = (value(&svg, "width"), value(&svg, "height"));
        assert!(width.ends_with("mm") && height.ends_with("mm"));
        assert_eq!(
            value(&svg, "viewBox"),
            format!("0 0 {} {}", width.replace("mm", ""), height.replace("mm", ""))
        );
        assert!((number(&svg, "width") - plan.page.width_mm).abs() < 1e-6);
        let elements: Vec<&str> = svg.lines().filter(|line| line.starts_with("<rect")).collect();
        // The first is the white page.
        assert_eq!(elements.len(), 1 + sheet.squares.len() + sheet.ruler.len());
        for (element, wanted) in elements[1..].iter().zip(sheet.squares.iter().chain(&sheet.ruler))
        {
            let Rectangle { left_mm, top_mm, width_mm, height_mm } = *wanted;
            for (name, mm) in
                [("x", left_mm), ("y", top_mm), ("width", width_mm), ("height", height_mm)]
            {
                assert!((number(element, name) - mm).abs() < 1e-6, "{element}: {name}");
            }
        }
    }
}

#[test]
fn everything_is_on_the_page_and_nothing_touches() {
    for plan in plans() {
        let sheet = sheet_of(&plan);
        let margin_mm = plan.page.margin_mm - 1e-6;
        for black in sheet.squares.iter().chain(&sheet.ruler) {
            assert!(black.left_mm >= margin_mm && black.top_mm >= margin_mm);
            assert!(black.left_mm + black.width_mm <= sheet.width_mm - margin_mm);
            assert!(black.top_mm + black.height_mm <= sheet.height_mm - margin_mm);
        }
        let board_end_mm = plan.top_mm + plan.board_height_mm();
        let ruler_end_mm = sheet.ruler[0].left_mm + plan.ruler_mm;
        for words in &sheet.words {
            // Typewriter type is the widest in use.
            let width_mm = 0.6 * words.size_mm * words.text.len() as f64;
            let left_mm = if words.centred { words.x_mm - width_mm / 2.0 } else { words.x_mm };
            assert!(left_mm > 0.0 && left_mm + width_mm <= sheet.width_mm, "{words:?}");
            assert!(words.baseline_mm + 0.25 * words.size_mm <= sheet.height_mm, "{words:?}");
            // The white around the board is at least the margin, or a square if there is room.
            let white_mm = plan.white_mm().min(plan.square_mm);
            assert!(
                words.baseline_mm - words.size_mm >= board_end_mm + white_mm - 1e-6,
                "{plan:?}"
            );
            let beside = left_mm > ruler_end_mm;
            let below = words.baseline_mm - 0.75 * words.size_mm > sheet.ruler[0].top_mm;
            assert!(beside || below, "{words:?} on the ruler");
        }
    }
}

#[test]
fn the_largest_square_is_the_largest() {
    for paper in Paper::ALL {
        let pages = paper.pages();
        for (columns, rows) in BOARDS {
            let largest = plan(columns, rows, Square::Largest, &pages).expect("fits");
            assert_eq!(largest.square_mm.fract(), 0.0);
            assert!(largest.white_mm() >= largest.square_mm - 1e-9, "{largest:?}");
            let more = plan(columns, rows, Square::Exactly { mm: largest.square_mm + 1.0 }, &pages);
            assert!(more.is_err() || more.is_ok_and(|plan| plan.white_mm() < plan.square_mm));
            // Asked for too much, the error names the largest possible square, and it does fit.
            let asked_mm = 500.0;
            let refused = plan(columns, rows, Square::Exactly { mm: asked_mm }, &pages);
            let Err(DoesNotFit::TooLarge { largest_mm: Some(mm), paper: None, .. }) = refused
            else {
                panic!("{refused:?}")
            };
            let named = plan(columns, rows, Square::Exactly { mm }, &pages).expect("fits");
            assert_eq!(named.square_mm, mm);
            assert!(plan(columns, rows, Square::Exactly { mm: mm + 1.0 }, &pages).is_err());
        }
    }
    let refused = plan(9, 6, Square::Exactly { mm: 30.0 }, &Paper::A4.pages());
    let Err(DoesNotFit::TooLarge { largest_mm, paper, .. }) = refused else {
        panic!("{refused:?}")
    };
    assert_eq!((largest_mm, paper), (Some(25.0), Some(Paper::A3)));
    let tiny = plan(9, 6, Square::Exactly { mm: 0.01 }, &Paper::A4.pages());
    assert!(matches!(tiny, Err(DoesNotFit::TooSmall { .. })), "{tiny:?}");
    let no_room = plan(99, 99, Square::Largest, &[Page::screen(320, 240, resolution(96.0))]);
    assert!(matches!(no_room, Err(DoesNotFit::TooLarge { largest_mm: None, .. })), "{no_room:?}");
}

#[test]
fn on_a_screen_squares_are_whole_pixels() {
    let page = Page::screen(1920, 1080, resolution(92.0));
    let plan = plan(9, 6, Square::Exactly { mm: 25.0 }, &[page]).expect("fits");
    let per_mm = resolution(92.0).per_mm();
    // 25 mm are 90.55 pixels.
    assert!((plan.square_mm * per_mm - 91.0).abs() < 1e-9);
    let image = picture(&sheet_of(&plan), resolution(92.0));
    let end_px = ((plan.top_mm + plan.board_height_mm()) * per_mm).round() as u32;
    let board = image.enumerate_pixels().filter(|(_, y, _)| *y < end_px);
    let dark = board.map(|(_, _, pixel)| pixel.0[0]).inspect(|v| assert!([0, 255].contains(v)));
    assert_eq!(dark.filter(|value| *value == 0).count(), 35 * 91 * 91);
}
