//! The second sheet of the certificate as a PDF: who, what and where; results with their limits;
//! the numbers to paste.

use pdf_writer::{Name, Str};

use super::{
    Certificate, Report,
    certificate::{COLUMNS, ResultRow, identity, results, to_paste},
    pdf_text::{LINE, Style, lines},
    sheet_pdf::{BAD, INK, MARGIN, PAGE, QUIET, Sheet},
};
use crate::text::certificate::{self as words, name};
use boresight_formats::LensEntry;

const HEADING: Style = (14.0, true, INK);
const NAME: Style = (9.5, false, QUIET);
const VALUE: Style = (9.5, true, INK);
const HEAD: Style = (9.0, true, QUIET);
/// Left edges of the columns of results, from the margin.
const EDGES: [f32; 5] = [0.0, 185.0, 285.0, 365.0, 460.0];
/// Left edge of what is named, from the name's.
const NAMED: f32 = 106.0;
/// Type size of the numbers to paste.
const TYPED: f32 = 8.5;

impl Sheet {
    /// Draws all of the second sheet.
    pub(super) fn numbers(&mut self, report: &Report, certificate: &Certificate, lens: &LensEntry) {
        self.text(MARGIN, &report.name, HEADING);
        if !certificate.number.is_empty() {
            let right = PAGE[0] - MARGIN;
            self.text_to(right, &words::number(&certificate.number), (10.0, false, QUIET));
        }
        self.y += 26.0;
        let (top, mut lowest) = (self.y, self.y);
        let half = 0.5 * (PAGE[0] - 2.0 * MARGIN);
        let edges = [MARGIN, MARGIN + half + 8.0];
        for (rows, left) in identity(report, certificate).iter().zip(edges) {
            self.y = top;
            for (name, what) in rows {
                self.text(left, name, NAME);
                let what = if what.is_empty() { "–" } else { what };
                for line in lines(what, half - NAMED - 16.0, VALUE) {
                    self.text(left + NAMED, &line, VALUE);
                    self.y += LINE * VALUE.0;
                }
                self.y += 2.0;
            }
            lowest = lowest.max(self.y);
        }
        self.y = lowest;
        self.rule();
        for (edge, column) in EDGES.iter().zip(COLUMNS) {
            self.text(MARGIN + edge, column, HEAD);
        }
        self.y += 18.0;
        for row in results(&report.calibration, lens) {
            self.row(&row);
        }
        if let Some(code) = to_paste(lens) {
            self.rule();
            self.text(MARGIN, name::PASTE, VALUE);
            self.y += 16.0;
            code.lines().for_each(|line| self.typed(line));
        }
        self.rule();
        let note = format!("{} {}", words::UNCERTAINTY_NOTE, words::VALIDITY);
        self.paragraph(MARGIN, &note, (9.0, false, QUIET));
    }

    /// A row of results, as high as its highest cell.
    fn row(&mut self, row: &ResultRow) {
        let is_sentence = row.name == name::FAILED;
        let ink = if row.met == Some(false) { BAD } else { INK };
        let met = row.met.map_or("", |met| if met { words::IS_MET } else { words::IS_MISSED });
        let cells = [row.name, &row.result, &row.uncertainty, &row.limit, met].map(text_of);
        let (top, mut lowest) = (self.y, self.y);
        for (column, cell) in cells.iter().enumerate() {
            // A sentence, or a number without a limit, has all columns up to the mark.
            let is_wide = column == 1 && row.uncertainty.is_empty() && row.limit.is_empty();
            let end = if is_wide { EDGES.last() } else { EDGES.get(column + 1) };
            let end = end.copied().unwrap_or(PAGE[0] - 2.0 * MARGIN);
            let style = match column {
                0 => NAME,
                1 => (VALUE.0, !is_sentence, ink),
                _ => (VALUE.0, false, ink),
            };
            self.y = top;
            for line in lines(cell, end - EDGES[column] - 8.0, style) {
                self.text(MARGIN + EDGES[column], &line, style);
                self.y += LINE * style.0;
            }
            lowest = lowest.max(self.y);
        }
        self.y = lowest + 3.0;
    }

    /// A line in letters of one width, wrapped at the right margin.
    fn typed(&mut self, line: &str) {
        // Courier's letters are 0.6 of their size wide.
        let fit = ((PAGE[0] - 2.0 * MARGIN) / (0.6 * TYPED)) as usize;
        for part in line.as_bytes().chunks(fit) {
            let [r, g, b] = INK;
            self.content.begin_text().set_font(Name(b"C"), TYPED).set_fill_rgb(r, g, b);
            self.content.next_line(MARGIN, PAGE[1] - self.y).show(Str(part));
            self.content.end_text();
            self.y += LINE * TYPED;
        }
    }
}

/// Text of a cell in HTML.
fn text_of(html: &str) -> String {
    let mut text = String::new();
    let mut is_tag = false;
    for letter in html.chars() {
        match letter {
            '<' => is_tag = true,
            '>' if is_tag => is_tag = false,
            letter if !is_tag => text.push(letter),
            _ => {}
        }
    }
    let signs = [("&lt;", "<"), ("&gt;", ">"), ("&quot;", "\""), ("&#39;", "'"), ("&amp;", "&")];
    signs.into_iter().fold(text, |text, (name, sign)| text.replace(name, sign))
}
