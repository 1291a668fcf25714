use super::{
    Plan,
    footer::{
        LEADING, LETTER_WIDTH, LINES, TICK_MM, beside, edge_mm, footer_height_mm, ruler_gap_mm,
        ruler_height_mm,
    },
};

use boresight_geometry::{
    board_code::{BoardCode, bars},
    boards::{DarkShapes, Shape},
};

const STROKE_MM: f64 = 0.2;

/// Page with contents.
#[derive(Clone, Debug, PartialEq)]
pub struct Sheet {
    /// One-line title.
    pub title: String,
    /// Width of the page.
    pub width_mm: f64,
    /// Height of the page.
    pub height_mm: f64,
    /// Dark squares, row by row; none for an invalid board.
    pub squares: Vec<Rectangle>,
    /// Dark discs of a circle grid, row by row.
    pub discs: Vec<Disc>,
    /// Black cells of markers, in rows and in columns: each is covered twice, so no seam shows
    /// between them.
    pub markers: Vec<Rectangle>,
    /// Bars of the code in the margin.
    pub code: Vec<Rectangle>,
    /// The ruler: its line, then its ticks from left to right, each centred on its position.
    pub ruler: Vec<Rectangle>,
    /// All words on the sheet.
    pub words: Vec<Words>,
}

/// A black rectangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rectangle {
    /// Left edge, from the page's left.
    pub left_mm: f64,
    /// Upper edge, from the page's top.
    pub top_mm: f64,
    /// Width of the rectangle.
    pub width_mm: f64,
    /// Height of the rectangle.
    pub height_mm: f64,
}

/// A black disc.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Disc {
    /// Centre, from the page's upper left corner.
    pub centre_mm: [f64; 2],
    /// Radius.
    pub radius_mm: f64,
}

/// One line of words in plain ASCII, available in every font.
#[derive(Clone, Debug, PartialEq)]
pub struct Words {
    /// Text of the line.
    pub text: String,
    /// Left end; with `centred`, the middle.
    pub x_mm: f64,
    /// Baseline of the letters.
    pub baseline_mm: f64,
    /// Type size.
    pub size_mm: f64,
    /// True for bold type.
    pub bold: bool,
    /// True for text centred at `x_mm`; for numbers only.
    pub centred: bool,
}

/// Draws a plan with `lines` of words beside the ruler. Non-ASCII characters become question marks.
pub fn sheet(plan: &Plan, lines: &[String; LINES]) -> Sheet {
    let page = &plan.page;
    let edge_mm = edge_mm(page);
    let top_mm = page.height_mm - page.margin_mm - footer_height_mm(page);
    let board = plan.board();
    let DarkShapes { large, fine } =
        board.map_or_else(DarkShapes::default, |board| board.target().dark_shapes());
    let mut words = ruler_words(plan, edge_mm, top_mm);
    let (x_mm, first_mm) = if beside(page) {
        (edge_mm + plan.ruler_mm + ruler_gap_mm(page), top_mm)
    } else {
        (edge_mm, top_mm + ruler_height_mm(page))
    };
    let room_mm = page.width_mm - edge_mm - x_mm;
    for (i, line) in lines.iter().enumerate() {
        let text: String = line.chars().map(|c| if c.is_ascii() { c } else { '?' }).collect();
        let fits_mm = room_mm / (text.len().max(1) as f64 * LETTER_WIDTH);
        words.push(Words {
            text,
            x_mm,
            // Lines of every size keep their spacing.
            baseline_mm: first_mm + page.text_mm * (1.0 + LEADING * i as f64),
            size_mm: page.text_mm.min(fits_mm),
            bold: i == 0,
            centred: false,
        });
    }
    Sheet {
        title: lines[0].clone(),
        width_mm: page.width_mm,
        height_mm: page.height_mm,
        discs: discs(plan, &large),
        squares: rectangles(plan, large),
        markers: rectangles(plan, fine),
        code: Vec::new(),
        ruler: ruler(plan, edge_mm, top_mm),
        words,
    }
}

impl Sheet {
    /// Adds `code` to those margins of `plan`'s board with room for it; unchanged if there are
    /// none.
    #[must_use]
    pub fn with_code(mut self, plan: &Plan, code: &BoardCode) -> Self {
        let size = (usize::from(plan.columns), usize::from(plan.rows));
        for edge in plan.edges_with_room() {
            for [from, to] in bars(edge, size, &code.cells()) {
                self.code.push(Rectangle {
                    left_mm: plan.left_mm + from.0 * plan.square_mm,
                    top_mm: plan.top_mm + from.1 * plan.square_mm,
                    width_mm: (to.0 - from.0) * plan.square_mm,
                    height_mm: (to.1 - from.1) * plan.square_mm,
                });
            }
        }
        self
    }
}

/// Centre of `plan`'s board on the page.
fn middle_mm(plan: &Plan) -> [f64; 2] {
    [plan.left_mm + 0.5 * plan.board_width_mm(), plan.top_mm + 0.5 * plan.board_height_mm()]
}

/// Rectangles of `plan`'s board on the page.
fn rectangles(plan: &Plan, shapes: Vec<Shape>) -> Vec<Rectangle> {
    let middle_mm = middle_mm(plan);
    let on_page = |shape| match shape {
        Shape::Rectangle { low_m, high_m } => Some(Rectangle {
            left_mm: middle_mm[0] + 1e3 * low_m[0],
            top_mm: middle_mm[1] + 1e3 * low_m[1],
            width_mm: 1e3 * (high_m[0] - low_m[0]),
            height_mm: 1e3 * (high_m[1] - low_m[1]),
        }),
        Shape::Disc { .. } => None,
    };
    shapes.into_iter().filter_map(on_page).collect()
}

/// Discs of `plan`'s board on the page.
fn discs(plan: &Plan, shapes: &[Shape]) -> Vec<Disc> {
    let middle_mm = middle_mm(plan);
    let on_page = |shape: &Shape| match *shape {
        Shape::Disc { centre_m, radius_m } => Some(Disc {
            centre_mm: std::array::from_fn(|axis| middle_mm[axis] + 1e3 * centre_m[axis]),
            radius_mm: 1e3 * radius_m,
        }),
        Shape::Rectangle { .. } => None,
    };
    shapes.iter().filter_map(on_page).collect()
}

fn ruler(plan: &Plan, left_mm: f64, top_mm: f64) -> Vec<Rectangle> {
    let [_, _, longest_mm] = TICK_MM;
    let line = Rectangle {
        left_mm,
        top_mm: top_mm + longest_mm - STROKE_MM,
        width_mm: plan.ruler_mm,
        height_mm: STROKE_MM,
    };
    // A ruler has at most 100 mm.
    let ticks = (0..=plan.ruler_mm as u32).map(|mm| {
        let [every, fifth, tenth] = TICK_MM;
        let height_mm = match mm {
            mm if mm % 10 == 0 => tenth,
            mm if mm % 5 == 0 => fifth,
            _ => every,
        };
        Rectangle {
            left_mm: left_mm + f64::from(mm) - STROKE_MM / 2.0,
            top_mm: top_mm + longest_mm - height_mm,
            width_mm: STROKE_MM,
            height_mm,
        }
    });
    std::iter::once(line).chain(ticks).collect()
}

fn ruler_words(plan: &Plan, left_mm: f64, top_mm: f64) -> Vec<Words> {
    let size_mm = plan.page.text_mm;
    let baseline_mm = top_mm + TICK_MM[2] + 1.05 * size_mm;
    let words = |text: String, at_mm: f64, centred| Words {
        text,
        x_mm: left_mm + at_mm,
        baseline_mm,
        size_mm,
        bold: false,
        centred,
    };
    // Numbers at every centimetre if there is room.
    let step = if 3.0 * size_mm * LETTER_WIDTH < 8.0 { 10 } else { 50 };
    let ends_mm = plan.ruler_mm as u32;
    let numbers = (0..=ends_mm).filter(|mm| mm % step == 0 || *mm == ends_mm);
    let mut all: Vec<Words> = numbers.map(|mm| words(mm.to_string(), mm.into(), true)).collect();
    all.push(words("mm".into(), plan.ruler_mm + 1.2 * size_mm, false));
    all
}
