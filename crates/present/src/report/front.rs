//! The front of the first sheet: the picture with its valid part, grade, error, and three answers
//! for the customer: how exact, where, until when.

use super::{Certificate, Report, Thumbnail, projection_map::cells, warnings::warnings};
use crate::{
    chart::{escaped, push},
    goal::Goal,
    known::Known,
    qr::QrCode,
    text::{acceptance::small, certificate as words, report as report_words, result},
};
use boresight_formats::{CalibrationFile, LensEntry};
use boresight_geometry::frame::ImageSize;
use nalgebra::{Point2, Vector2};

/// Parts of a cell of the map along each side.
const FINER: usize = 3;
/// Distance at which the error is stated in millimetres.
const AT_M: f64 = 2.0;

/// The customer's part of the sheet, for a result that may be used.
pub(super) fn front(report: &Report, certificate: &Certificate, lens: &LensEntry) -> String {
    let known = Known::of_file(&report.calibration);
    let mut body = identity_line(report, certificate);
    if let Some(known) = &known {
        body += &picture(report, known);
    }
    body += &grade(report);
    body += &warnings(&report.calibration);
    body + &table(answers(report, certificate, lens, known.as_ref()))
}

/// The three answers as a table.
pub(super) fn table(answers: [(&str, String); 3]) -> String {
    let row = |(name, answer): (&str, String)| {
        format!("<tr><th scope=\"row\">{name}</th><td>{}</td></tr>\n", escaped(&answer))
    };
    let rows = answers.map(row).concat();
    format!("<table class=\"answers\"><tbody>\n{rows}</tbody></table>\n")
}

/// The customer's three questions, each with its answer.
pub(super) fn answers(
    report: &Report,
    certificate: &Certificate,
    lens: &LensEntry,
    known: Option<&Known>,
) -> [(&'static str, String); 3] {
    let place = known.map_or(words::NOT_KNOWN.into(), |known| words::where_valid(known.share()));
    [
        (words::HOW_EXACT, how_exact(report, lens)),
        (words::WHERE, place),
        (words::UNTIL_WHEN, words::until_when(certificate.check_due.as_deref())),
    ]
}

fn identity_line(report: &Report, c: &Certificate) -> String {
    format!("<p class=\"identity\">{}</p>\n", escaped(&identity(report, c)))
}

/// Camera, mode and customer in one line.
pub(super) fn identity(report: &Report, c: &Certificate) -> String {
    let make = [c.camera_make.as_str(), c.camera_model.as_str()].join(" ");
    let size = report_words::picture(report.calibration.image_size);
    let parts =
        [c.site.as_str(), make.trim(), c.camera_serial.as_str(), &size, c.customer.as_str()];
    parts.into_iter().filter(|part| !part.is_empty()).collect::<Vec<_>>().join(" · ")
}

pub(super) fn image_size(calibration: &CalibrationFile) -> ImageSize {
    let [width_px, height_px] = calibration.image_size.map(|side| side.max(1));
    ImageSize { width_px, height_px }
}

/// A darkened rectangle of the picture.
pub(super) struct Dim {
    /// Top left corner, in pixels.
    pub at: Point2<f64>,
    pub side: Vector2<f64>,
    /// 0 leaves the picture as it is, 1 is black.
    pub dark: f32,
    pub is_seen: bool,
}

/// Parts of the picture that aren't bright.
pub(super) fn dimmed(size: ImageSize, known: &Known) -> Vec<Dim> {
    let mut dimmed = Vec::new();
    for (_, corners) in cells(size) {
        let side = (corners[2] - corners[0]) / FINER as f64;
        for part in 0..FINER * FINER {
            let (column, row) = ((part % FINER) as f64, (part / FINER) as f64);
            let at = corners[0] + Vector2::new(column * side.x, row * side.y);
            let px = at + 0.5 * side;
            let middle =
                [(px.x + 0.5) / f64::from(size.width_px), (px.y + 0.5) / f64::from(size.height_px)]
                    .map(|share| share as f32);
            let dark = 1.0 - known.brightness(middle);
            if dark >= 0.02 {
                dimmed.push(Dim { at, side, dark, is_seen: known.is_seen(middle) });
            }
        }
    }
    dimmed
}

/// The first picture, bright where the goal is met, hatched where no board was.
fn picture(report: &Report, known: &Known) -> String {
    let [width, height] = report.calibration.image_size;
    let mut svg = format!(
        "<figure class=\"hero\"><svg viewBox=\"0 0 {width} {height}\" role=\"img\" aria-label=\"{}\"><defs><pattern id=\"unseen\" width=\"{step}\" height=\"{step}\" patternUnits=\"userSpaceOnUse\" patternTransform=\"rotate(45)\"><line x1=\"0\" y1=\"0\" x2=\"0\" y2=\"{step}\" stroke=\"#fff\" stroke-opacity=\".45\" stroke-width=\"{line}\"/></pattern></defs><rect width=\"{width}\" height=\"{height}\" fill=\"#999\"/>",
        words::PICTURE,
        step = width / 90,
        line = width / 500,
    );
    if let Some(picture) = report.pictures.iter().flatten().next() {
        push(
            &mut svg,
            format_args!(
                "<image width=\"{width}\" height=\"{height}\" href=\"{}\"/>",
                picture.data_uri()
            ),
        );
    }
    for Dim { at, side, dark, is_seen } in dimmed(image_size(&report.calibration), known) {
        let mut rect = |fill: &str, opacity: f32| {
            push(
                &mut svg,
                format_args!(
                    "<rect x=\"{:.1}\" y=\"{:.1}\" width=\"{:.1}\" height=\"{:.1}\" fill=\"{fill}\" fill-opacity=\"{opacity:.2}\" shape-rendering=\"crispEdges\"/>",
                    at.x + 0.5,
                    at.y + 0.5,
                    side.x,
                    side.y
                ),
            );
        };
        rect("#000", dark);
        if !is_seen {
            rect("url(#unseen)", 1.0);
        }
    }
    let legend = [result::meets_goal(known.share()), result::NO_BOARD_HERE.to_owned()];
    format!(
        "{svg}</svg><figcaption><i class=\"met\"></i> {} <i class=\"unseen\"></i> {}</figcaption></figure>\n",
        legend[0], legend[1]
    )
}

/// The cause of an untrustworthy result on the picture of its view; empty without one.
pub(super) fn cause(report: &Report) -> String {
    let Some(cause) = &report.cause else { return String::new() };
    let view = cause.place.and_then(|place| report.pictures.get(place)?.as_ref());
    let picture = view.or_else(|| report.pictures.iter().flatten().next());
    let href = picture.map(Thumbnail::data_uri);
    format!(
        "<figure class=\"hero\">{}<figcaption>{}</figcaption></figure>\n",
        cause.svg(image_size(&report.calibration), href.as_deref()),
        escaped(&cause.caption)
    )
}

/// Grade in words.
pub(super) fn grade_said(calibration: &CalibrationFile) -> &'static str {
    let said = report_words::verdict_of(calibration);
    said.split(':').next().unwrap_or(said)
}

/// Error, if known, and the line below.
pub(super) fn error(report: &Report) -> (Option<String>, String) {
    let Some(goal) = Goal::of_file(&report.calibration) else { return (None, String::new()) };
    let number = goal.reached.map(|reached| format!("±{} {}", small(reached), goal.unit));
    (number, words::of_goal(goal.is_bound, &goal.said()))
}

/// Grade and error beside each other.
fn grade(report: &Report) -> String {
    let calibration = &report.calibration;
    graded(report_words::sign_of(calibration), grade_said(calibration), error(report))
}

/// Sign and words of a grade, beside the error, if known, and the line below it.
pub(super) fn graded(sign: &str, said: &str, (number, below): (Option<String>, String)) -> String {
    let number = number.map_or(String::new(), |number| {
        format!(
            "<p class=\"number\"><b>{}</b><br/><small>{}</small></p>",
            escaped(&number),
            escaped(&below)
        )
    });
    format!(
        "<div class=\"grade\"><p><span class=\"sign\">{sign}</span> <strong>{said}</strong></p>{number}</div>\n"
    )
}

fn how_exact(report: &Report, lens: &LensEntry) -> String {
    match (&report.calibration.acceptance, &report.calibration.projection_sd_px) {
        (Some(judged), _) => judged.message.clone(),
        (None, Some(projection)) => {
            let mm = 1e3 * projection.mean * AT_M / lens.f_px[0];
            words::how_exact(&small(projection.mean), &small(mm), AT_M)
        }
        (None, None) => words::NOT_KNOWN.into(),
    }
}

/// QR code of `text` as a drawing; empty for a text that's too long.
pub(super) fn qr_code(text: &str) -> String {
    let Some(code) = QrCode::on_paper(text) else { return String::new() };
    let mut path = String::new();
    for [x, y] in code.dark() {
        push(&mut path, format_args!("M{x},{y}h1v1h-1z"));
    }
    format!(
        "<svg class=\"qr\" viewBox=\"0 0 {0} {0}\" shape-rendering=\"crispEdges\" role=\"img\" aria-label=\"QR\"><path d=\"{path}\"/></svg>",
        code.side()
    )
}
