use super::{Page, Plan};

/// Lines of words beside the ruler; the first is in bold type.
pub const LINES: usize = 5;

/// White between the board's surroundings and what is below.
pub(super) const FOOTER_GAP_MM: f64 = 2.0;

/// Letters in a line that stays in its normal size.
const LETTERS: f64 = 52.0;
/// Width of a letter as a share of its size: that of typewriter type, the widest that is used.
const LETTER_WIDTH: f64 = 0.6;
/// Distance of lines as a multiple of their size.
const LEADING: f64 = 1.25;
const TICK_MM: [f64; 3] = [1.6, 2.6, 4.0];
const STROKE_MM: f64 = 0.2;

/// A page with everything that is on it.
#[derive(Clone, Debug, PartialEq)]
pub struct Sheet {
    /// What it is, in one line.
    pub title: String,
    /// Width of the page.
    pub width_mm: f64,
    /// Height of the page.
    pub height_mm: f64,
    /// The dark squares, row by row.
    pub squares: Vec<Rectangle>,
    /// The ruler: its line, then its ticks from left to right, each centred on its place.
    pub ruler: Vec<Rectangle>,
    /// All words.
    pub words: Vec<Words>,
}

/// A black rectangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rectangle {
    /// Left edge.
    pub left_mm: f64,
    /// Upper edge.
    pub top_mm: f64,
    /// Width.
    pub width_mm: f64,
    /// Height.
    pub height_mm: f64,
}

/// Words on one line. Plain ASCII, so that every font has them.
#[derive(Clone, Debug, PartialEq)]
pub struct Words {
    /// The words.
    pub text: String,
    /// Where they begin; with `centred`, their middle.
    pub x_mm: f64,
    /// The line that the letters stand on.
    pub baseline_mm: f64,
    /// Size of the type.
    pub size_mm: f64,
    /// In bold type.
    pub bold: bool,
    /// Around `x_mm`; for numbers only.
    pub centred: bool,
}

/// Draws a plan with `lines` of words beside its ruler. What is not ASCII in them becomes a question mark.
pub fn sheet(plan: &Plan, lines: &[String; LINES]) -> Sheet {
    let page = &plan.page;
    let edge_mm = edge_mm(page);
    let top_mm = page.height_mm - page.margin_mm - footer_height_mm(page);
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
            // Lines keep their distance, whatever their size.
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
        squares: squares(plan),
        ruler: ruler(plan, edge_mm, top_mm),
        words,
    }
}

/// The dark squares: that in the top-left corner is one.
fn squares(plan: &Plan) -> Vec<Rectangle> {
    let places =
        (0..=plan.rows).flat_map(|row| (0..=plan.columns).map(move |column| (column, row)));
    places
        .filter(|(column, row)| (column + row) % 2 == 0)
        .map(|(column, row)| Rectangle {
            left_mm: plan.left_mm + f64::from(column) * plan.square_mm,
            top_mm: plan.top_mm + f64::from(row) * plan.square_mm,
            width_mm: plan.square_mm,
            height_mm: plan.square_mm,
        })
        .collect()
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
    // Numbers at every centimetre where there is room for them.
    let step = if 3.0 * size_mm * LETTER_WIDTH < 8.0 { 10 } else { 50 };
    let ends_mm = plan.ruler_mm as u32;
    let numbers = (0..=ends_mm).filter(|mm| mm % step == 0 || *mm == ends_mm);
    let mut all: Vec<Words> = numbers.map(|mm| words(mm.to_string(), mm.into(), true)).collect();
    all.push(words("mm".into(), plan.ruler_mm + 1.2 * size_mm, false));
    all
}

/// The longest ruler for the page's width. `None` if there is none of 10 mm.
pub(super) fn ruler_mm(page: &Page) -> Option<f64> {
    let room_mm = page.width_mm - 2.0 * edge_mm(page) - 3.0 * page.text_mm;
    [100.0, 50.0, 20.0, 10.0].into_iter().find(|length_mm| *length_mm <= room_mm)
}

/// Height of ruler and words.
pub(super) fn footer_height_mm(page: &Page) -> f64 {
    let lines_mm = page.text_mm * (1.3 + LEADING * (LINES - 1) as f64);
    if beside(page) {
        lines_mm.max(ruler_height_mm(page))
    } else {
        ruler_height_mm(page) + lines_mm
    }
}

fn ruler_height_mm(page: &Page) -> f64 {
    TICK_MM[2] + 2.0 * page.text_mm
}

/// Room for the ruler's last number and the unit behind it.
fn ruler_gap_mm(page: &Page) -> f64 {
    4.0 * page.text_mm
}

/// Whether the words stand beside the ruler, or else below it.
fn beside(page: &Page) -> bool {
    let words_mm = LETTERS * LETTER_WIDTH * page.text_mm;
    page.width_mm - 2.0 * edge_mm(page) >= 100.0 + ruler_gap_mm(page) + words_mm
}

/// Where ruler and words begin.
fn edge_mm(page: &Page) -> f64 {
    page.margin_mm + page.text_mm
}
