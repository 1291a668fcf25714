//! Space for the ruler and the words below the board.

use super::Page;

/// Lines of words beside the ruler; the first is in bold type.
pub const LINES: usize = 5;

/// White gap between the board's surroundings and the footer.
pub(super) const FOOTER_GAP_MM: f64 = 2.0;

/// Number of letters in a line of normal size.
pub(super) const LETTERS: f64 = 52.0;
/// Width of a letter as a share of the type size, for typewriter type, the widest in use.
pub(super) const LETTER_WIDTH: f64 = 0.6;
/// Line spacing as a multiple of the type size.
pub(super) const LEADING: f64 = 1.25;
pub(super) const TICK_MM: [f64; 3] = [1.6, 2.6, 4.0];

/// Longest ruler for the page's width. `None` if not even 10 mm fit.
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

pub(super) fn ruler_height_mm(page: &Page) -> f64 {
    TICK_MM[2] + 2.0 * page.text_mm
}

/// Room for the ruler's last number and the unit behind it.
pub(super) fn ruler_gap_mm(page: &Page) -> f64 {
    4.0 * page.text_mm
}

/// True if the words are beside the ruler, false if below.
pub(super) fn beside(page: &Page) -> bool {
    let words_mm = LETTERS * LETTER_WIDTH * page.text_mm;
    page.width_mm - 2.0 * edge_mm(page) >= 100.0 + ruler_gap_mm(page) + words_mm
}

/// Left edge of ruler and words.
pub(super) fn edge_mm(page: &Page) -> f64 {
    page.margin_mm + page.text_mm
}
