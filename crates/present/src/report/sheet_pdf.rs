//! The certificate as a PDF: drawings and selectable text, no fonts to install.

use pdf_writer::{
    Content, Filter, Finish, Name, Pdf, Rect, Ref, Str, TextStr, types::LineCapStyle,
    writers::ExtGraphicsState,
};

use super::{
    Certificate, Report,
    front::{self, Dim},
    pdf_text::{LINE, Style, encoded, lines, wide},
    warnings::told,
};
use crate::{
    known::Known,
    qr::QrCode,
    text::{
        certificate::{self as words, name},
        report as report_words, result,
    },
};
use boresight_formats::LensEntry;

/// A4, in points.
pub(super) const PAGE: [f32; 2] = [595.28, 841.89];
/// Margin at the sides, and lowest line: Letter is shorter than A4.
pub(super) const MARGIN: f32 = 50.0;
const LOWEST: f32 = 770.0;
/// Highest picture, and the lowest that still shows something.
const PICTURE: [f32; 2] = [290.0, 90.0];
/// Steps of darkness of the picture.
const STEPS: u8 = 20;
/// Distance of two lines of the hatching.
const HATCH: f32 = 6.0;
/// Side of the code.
const CODE: f32 = 76.0;
/// Left edge of the answers, from the margin.
const ANSWERS: f32 = 100.0;

pub(super) const INK: [f32; 3] = [0.067, 0.086, 0.102];
pub(super) const QUIET: [f32; 3] = [0.29, 0.337, 0.38];
const GOOD: [f32; 3] = [0.0, 0.439, 0.29];
const CARE: [f32; 3] = [0.561, 0.337, 0.0];
pub(super) const BAD: [f32; 3] = [0.702, 0.149, 0.118];

/// Reason why there is no PDF.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NoPdf {
    /// Nobody judged the calibration, or there is none.
    #[error("there is no certificate: nothing was calibrated and judged here")]
    NoCertificate,
    /// Letters beyond Western Europe's.
    #[error("the PDF can't show {0:?}. Print the HTML report to a PDF instead")]
    Letters(String),
}

/// PDF of the certificate: its front, and a sheet with the numbers. Equal reports give equal bytes.
///
/// # Errors
///
/// [`NoPdf`].
pub fn certificate_pdf(report: &Report) -> Result<Vec<u8>, NoPdf> {
    let (Some(certificate), Some(lens)) = (&report.certificate, &report.calibration.result) else {
        return Err(NoPdf::NoCertificate);
    };
    if report.calibration.is_imported() {
        return Err(NoPdf::NoCertificate);
    }
    let new = || Sheet { content: Content::new(), y: MARGIN, strange: None };
    let [mut front, mut numbers] = [new(), new()];
    let is_shown = front.front(report, certificate, lens);
    numbers.numbers(report, certificate, lens);
    if let Some(text) = front.strange.or(numbers.strange) {
        return Err(NoPdf::Letters(text));
    }
    let thumbnail = report.pictures.iter().flatten().next().filter(|_| is_shown);
    let [catalog, pages, info, picture] = [1, 2, 3, 4].map(Ref::new);
    let fonts = [(5, b"R", "Helvetica"), (6, b"B", "Helvetica-Bold"), (7, b"C", "Courier")];
    let sheets = [(8, 9, front.content), (10, 11, numbers.content)];
    let mut pdf = Pdf::new();
    pdf.catalog(catalog).pages(pages).lang(TextStr("en"));
    pdf.pages(pages).kids(sheets.iter().map(|(page, ..)| Ref::new(*page))).count(2);
    for (page, content, _) in &sheets {
        let mut page = pdf.page(Ref::new(*page));
        let size = Rect::new(0.0, 0.0, PAGE[0], PAGE[1]);
        page.media_box(size).parent(pages).contents(Ref::new(*content));
        let mut resources = page.resources();
        let mut named = resources.fonts();
        for (font, name, _) in fonts {
            named.pair(Name(name), Ref::new(font));
        }
        named.finish();
        if thumbnail.is_some() {
            resources.x_objects().pair(Name(b"P"), picture);
        }
        let mut states = resources.ext_g_states();
        for step in 1..=STEPS {
            let name = step_name(step);
            let mut state = states.insert(Name(name.as_bytes())).start::<ExtGraphicsState<'_>>();
            state.non_stroking_alpha(f32::from(step) / f32::from(STEPS));
        }
    }
    for (font, _, name) in fonts {
        let mut font = pdf.type1_font(Ref::new(font));
        font.base_font(Name(name.as_bytes())).encoding_predefined(Name(b"WinAnsiEncoding"));
    }
    if let Some(thumbnail) = thumbnail {
        let [width, height] = [thumbnail.small.width_px, thumbnail.small.height_px]
            .map(|side| i32::try_from(side).unwrap_or(i32::MAX));
        let mut image = pdf.image_xobject(picture, thumbnail.jpeg());
        image.filter(Filter::DctDecode);
        image.width(width).height(height).bits_per_component(8);
        image.color_space().device_gray();
    }
    let title = format!("{} {}", words::TITLE, certificate.number);
    pdf.document_info(info).title(TextStr(title.trim())).producer(TextStr("boresight"));
    for (_, id, content) in sheets {
        pdf.stream(Ref::new(id), &content.finish());
    }
    Ok(pdf.finish())
}

fn step_name(step: u8) -> String {
    format!("A{step}")
}

/// A page being drawn, from the top down to `y`, in points.
pub(super) struct Sheet {
    pub(super) content: Content,
    pub(super) y: f32,
    /// A text with letters that the fonts lack.
    strange: Option<String>,
}

impl Sheet {
    /// Draws all of the front. True if the picture is on it.
    fn front(&mut self, report: &Report, certificate: &Certificate, lens: &LensEntry) -> bool {
        let calibration = &report.calibration;
        let certifies = calibration.is_usable() && !report.camera.simulated;
        let right = PAGE[0] - MARGIN;
        if !certificate.company.is_empty() {
            self.text(MARGIN, &certificate.company, (12.0, true, INK));
        }
        if !certificate.number.is_empty() {
            self.text_to(right, &words::number(&certificate.number), (10.0, false, QUIET));
        }
        self.y += 42.0;
        let title = if certifies { words::TITLE } else { words::NO_CERTIFICATE };
        self.text(MARGIN, title, (24.0, true, INK));
        self.y += 20.0;
        let identity = front::identity(report, certificate);
        self.paragraph(MARGIN, &identity, (10.5, false, QUIET));
        if report.camera.simulated {
            self.paragraph(MARGIN, report_words::SIMULATED, (14.0, true, BAD));
        }
        let known = Known::of_file(calibration).filter(|_| calibration.is_usable());
        let [first, others] = told(calibration);
        let others =
            if others.is_empty() { others } else { format!("{} {others}", words::WARNINGS) };
        let warnings = [first, others];
        let answers = front::answers(report, certificate, lens, known.as_ref());
        let answers = if calibration.is_usable() { answers.as_slice() } else { &[] };
        let checksum = certificate.file.as_ref().map(|(file, hash)| words::checksum(file, hash));
        if let Some(known) = &known {
            let high = |text: &str, left: f32, style: Style| {
                lines(text, right - left, style).len() as f32 * LINE * style.0
            };
            let texts = warnings.iter().map(|text| high(text, MARGIN, WARNING)).sum::<f32>()
                + answers
                    .iter()
                    .map(|(_, it)| high(it, MARGIN + ANSWERS, ANSWER) + 7.0)
                    .sum::<f32>();
            // Legend, grade, rules, code and signatures.
            let room = LOWEST - self.y - texts - 24.0 - 70.0 - 40.0 - CODE - 70.0;
            self.picture(report, known, room.clamp(PICTURE[1], PICTURE[0]));
        }
        self.grade(report);
        for text in warnings.iter().filter(|text| !text.is_empty()) {
            self.paragraph(MARGIN, text, WARNING);
        }
        self.rule();
        for (name, answer) in answers {
            self.text(MARGIN, name, (10.5, true, INK));
            self.paragraph(MARGIN + ANSWERS, answer, ANSWER);
            self.y += 7.0;
        }
        if let Some(checksum) = &checksum {
            self.rule();
            self.code(checksum);
        }
        if certifies {
            self.signatures(&certificate.operator, &certificate.date);
        }
        known.is_some()
    }

    /// The first picture, dark where the goal is missed, hatched where no board was.
    fn picture(&mut self, report: &Report, known: &Known, highest: f32) {
        let size = front::image_size(&report.calibration);
        let [width_px, height_px] = [size.width_px, size.height_px].map(|side| side as f32);
        let k = ((PAGE[0] - 2.0 * MARGIN) / width_px).min(highest / height_px);
        let (width, height) = (k * width_px, k * height_px);
        let bottom = PAGE[1] - self.y - height;
        let content = &mut self.content;
        content.save_state().rect(MARGIN, bottom, width, height).clip_nonzero().end_path();
        content.set_fill_gray(0.6).rect(MARGIN, bottom, width, height).fill_nonzero();
        if report.pictures.iter().flatten().next().is_some() {
            content.save_state().transform([width, 0.0, 0.0, height, MARGIN, bottom]);
            content.x_object(Name(b"P")).restore_state();
        }
        content.set_fill_gray(0.0).set_stroke_gray(0.75).set_line_width(0.6);
        for Dim { at, side, dark, is_seen } in front::dimmed(size, known) {
            let [left, wide, high] =
                [at.x as f32 + 0.5, side.x as f32, side.y as f32].map(|px| k * px);
            let (left, low) = (MARGIN + left, bottom + height - k * (at.y as f32 + 0.5) - high);
            let step = ((dark * f32::from(STEPS)).round() as u8).clamp(1, STEPS);
            content.save_state().set_parameters(Name(step_name(step).as_bytes()));
            content.rect(left, low, wide, high).fill_nonzero().restore_state();
            if !is_seen {
                hatch(content, [left, low], [left + wide, low + high]);
            }
        }
        // Border of the part that meets the goal.
        let [r, g, b] = [0.24, 0.86, 0.59];
        content.set_stroke_rgb(r, g, b).set_line_width(1.2);
        for [from, to] in known.border() {
            content.move_to(MARGIN + width * from[0], bottom + height * (1.0 - from[1]));
            content.line_to(MARGIN + width * to[0], bottom + height * (1.0 - to[1])).stroke();
        }
        content.restore_state();
        self.y += height + 16.0;
        let legend = [result::meets_goal(known.share()), result::NO_BOARD_HERE.to_owned()];
        let mut left = MARGIN;
        for (number, text) in legend.iter().enumerate() {
            let low = PAGE[1] - self.y - 1.0;
            let content = &mut self.content;
            content.save_state().rect(left, low, 14.0, 9.0).clip_nonzero().end_path();
            content.set_fill_gray(if number == 0 { 0.75 } else { 0.3 });
            content.rect(left, low, 14.0, 9.0).fill_nonzero();
            if number == 0 {
                content.set_stroke_rgb(GOOD[0], GOOD[1], GOOD[2]).set_line_width(3.0);
                content.rect(left, low, 14.0, 9.0).stroke();
            } else {
                content.set_stroke_gray(0.9).set_line_width(0.6);
                hatch(content, [left, low], [left + 14.0, low + 9.0]);
            }
            content.restore_state();
            self.text(left + 20.0, text, (10.0, false, QUIET));
            left += 20.0 + wide(text, (10.0, false, QUIET)) + 28.0;
        }
        self.y += 8.0;
    }

    /// Grade with its sign, and the error at the right.
    fn grade(&mut self, report: &Report) {
        let calibration = &report.calibration;
        self.y += 40.0;
        self.sign([MARGIN + 16.0, PAGE[1] - self.y + 10.0], &calibration.verdict);
        self.text(MARGIN + 42.0, front::grade_said(calibration), (28.0, true, INK));
        let (number, below) = front::error(report);
        if let Some(number) = number.filter(|_| calibration.is_usable()) {
            let right = PAGE[0] - MARGIN;
            self.text_to(right, &number, (30.0, true, INK));
            self.y += 15.0;
            self.text_to(right, &below, (10.0, false, QUIET));
        }
        self.y += 20.0;
    }

    /// A disc with a tick, a triangle, or an octagon with a cross.
    fn sign(&mut self, [x, y]: [f32; 2], verdict: &str) {
        use std::f32::consts::{FRAC_PI_2, FRAC_PI_8, TAU};
        type Strokes = [[[f32; 2]; 2]; 2];
        const TICK: Strokes = [[[-7.0, 0.0], [-2.0, -6.0]], [[-2.0, -6.0], [7.0, 6.0]]];
        const MARK: Strokes = [[[0.0, 8.0], [0.0, 0.0]], [[0.0, -4.5], [0.0, -4.6]]];
        const CROSS: Strokes = [[[-6.0, -6.0], [6.0, 6.0]], [[-6.0, 6.0], [6.0, -6.0]]];
        let ([r, g, b], sides, turn, strokes) = match verdict {
            "good" => (GOOD, 48_u16, 0.0, TICK),
            "care" => (CARE, 3, FRAC_PI_2, MARK),
            _ => (BAD, 8, FRAC_PI_8, CROSS),
        };
        let content = &mut self.content;
        content.save_state().set_fill_rgb(r, g, b);
        for side in 0..sides {
            let angle = turn + TAU * f32::from(side) / f32::from(sides);
            let (at_x, at_y) = (x + 16.0 * libm::cosf(angle), y + 16.0 * libm::sinf(angle));
            if side == 0 {
                content.move_to(at_x, at_y);
            } else {
                content.line_to(at_x, at_y);
            }
        }
        content.close_path().fill_nonzero().set_stroke_gray(1.0).set_line_width(3.0);
        content.set_line_cap(LineCapStyle::RoundCap);
        for [from, to] in strokes {
            content.move_to(x + from[0], y + from[1]).line_to(x + to[0], y + to[1]).stroke();
        }
        content.restore_state();
    }

    /// QR code of the checksum, and the checksum.
    fn code(&mut self, checksum: &str) {
        let Some(code) = QrCode::on_paper(checksum) else { return };
        let module = CODE / code.side() as f32;
        let top = PAGE[1] - self.y + 9.0;
        self.content.set_fill_gray(0.0);
        for [x, y] in code.dark() {
            let (left, low) = (MARGIN + x as f32 * module, top - (y + 1) as f32 * module);
            self.content.rect(left, low, module, module);
        }
        self.content.fill_nonzero();
        let (left, began) = (MARGIN + CODE + 18.0, self.y);
        self.text(left, words::SCAN, (10.5, true, INK));
        self.y += 16.0;
        self.paragraph(left, checksum, (10.0, false, QUIET));
        self.y = self.y.max(began + CODE);
    }

    fn signatures(&mut self, operator: &str, date: &str) {
        self.y += 32.0;
        let half = 0.5 * PAGE[0];
        for (left, who, by) in [(MARGIN, name::SIGNED, operator), (half + 8.0, name::APPROVED, "")]
        {
            self.text(left, format!("{who} {by}").trim(), (10.0, true, INK));
            let low = PAGE[1] - self.y - 24.0;
            self.content.set_stroke_gray(0.4).set_line_width(0.6);
            self.content.move_to(left, low).line_to(left + half - MARGIN - 16.0, low).stroke();
            self.y += 36.0;
            let below = if by.is_empty() {
                name::SIGNATURE.to_owned()
            } else {
                format!("{}, {date}", name::SIGNATURE)
            };
            self.text(left, &below, (10.0, false, QUIET));
            self.y -= 36.0;
        }
    }

    pub(super) fn rule(&mut self) {
        self.y += 4.0;
        self.content.set_stroke_gray(0.83).set_line_width(0.8);
        let y = PAGE[1] - self.y;
        self.content.move_to(MARGIN, y).line_to(PAGE[0] - MARGIN, y).stroke();
        self.y += 20.0;
    }

    /// A line of text with its baseline at `y`.
    pub(super) fn text(&mut self, left: f32, text: &str, (size, bold, [r, g, b]): Style) {
        let Some(bytes) = encoded(text) else {
            self.strange = Some(text.into());
            return;
        };
        let content = &mut self.content;
        content.begin_text().set_font(Name(if bold { b"B" } else { b"R" }), size);
        content.set_fill_rgb(r, g, b).next_line(left, PAGE[1] - self.y).show(Str(&bytes));
        content.end_text();
    }

    pub(super) fn text_to(&mut self, right: f32, text: &str, style: Style) {
        self.text(right - wide(text, style), text, style);
    }

    /// Lines of text up to the right margin.
    pub(super) fn paragraph(&mut self, left: f32, text: &str, style: Style) {
        for line in lines(text, PAGE[0] - MARGIN - left, style) {
            self.text(left, &line, style);
            self.y += LINE * style.0;
        }
    }
}

const WARNING: Style = (10.0, false, INK);
const ANSWER: Style = (10.5, false, INK);

/// Lines at 45° inside a rectangle.
fn hatch(content: &mut Content, [left, low]: [f32; 2], [right, high]: [f32; 2]) {
    let first = ((left + low) / HATCH).ceil() as i32;
    for line in first..=((right + high) / HATCH).floor() as i32 {
        let sum = line as f32 * HATCH;
        let (from, to) = (left.max(sum - high), right.min(sum - low));
        content.move_to(from, sum - from).line_to(to, sum - to).stroke();
    }
}
