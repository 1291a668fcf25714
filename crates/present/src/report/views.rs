//! Thumbnails of all views, with principal lines.

use nalgebra::Point2;

use super::{
    Report,
    line::Line,
    number::{brief, brief_data, measured, plain, text},
    section::section,
};
use crate::{
    chart::{escaped, push},
    text::report::{self as words, Section},
};
use boresight_formats::ViewEntry;

/// Maximum number of views: more would need a third sheet.
const MOST_SHOWN: usize = 60;
/// Number of views with room for only a single caption line.
const MANY: usize = 16;
/// Width and height of all views on the page, and the height beside a drift section.
const ROOM: (f64, f64) = (190.0, 86.0);
const ROOM_BESIDE_DRIFT: f64 = 42.0;
/// Height of a view's caption in the same unit.
const CAPTION: f64 = 6.5;
const COLUMNS: std::ops::RangeInclusive<usize> = 4..=15;

/// Views side by side.
pub(super) fn views(report: &Report) -> String {
    let views: Vec<(usize, &ViewEntry)> = report.calibration.used().collect();
    if views.is_empty() {
        return section(Section::Views, &format!("<p>{}</p>\n", words::TOO_FEW));
    }
    let shown = views.len().min(MOST_SHOWN);
    let (width, height) = report.calibration.size_px();
    let room = if report.check.is_some() { ROOM_BESIDE_DRIFT } else { ROOM.1 };
    let columns = columns(shown, height / width, room);
    let fit = |(_, view): &&(usize, &ViewEntry)| view.rms_px;
    let rated = views.iter().filter(|view| fit(view).is_some());
    let worst = rated.max_by(|a, b| fit(a).unwrap_or(0.0).total_cmp(&fit(b).unwrap_or(0.0)));
    let worst = worst.filter(|_| views.len() > 1).map(|(number, _)| *number);
    let mut html = format!("<div class=\"views\" style=\"--columns:{columns}\">\n");
    for (place, (number, view)) in views.iter().take(MOST_SHOWN).enumerate() {
        let caption = if shown > MANY { number.to_string() } else { caption(*number, view) };
        let mark = if worst == Some(*number) { words::FITS_WORST } else { "" };
        push(
            &mut html,
            format_args!(
                "<figure>{}<p title=\"{}\">{caption}{mark}</p></figure>\n",
                thumbnail(report, view, *number, place),
                escaped(&view.name)
            ),
        );
    }
    html += "</div>\n";
    push(&mut html, format_args!("<p class=\"note\">{}", words::views_note(shown, views.len())));
    if report.pictures.iter().all(Option::is_none) {
        push(&mut html, format_args!(" {}", words::NO_PICTURES));
    }
    html += "</p>\n";
    html += &table(&views);
    section(Section::Views, &html)
}

/// Smallest number of columns with room for all rows.
fn columns(count: usize, height_per_width: f64, room: f64) -> usize {
    let fits = |columns: &usize| {
        let row = ROOM.0 / *columns as f64 * height_per_width + CAPTION;
        count.div_ceil(*columns) as f64 * row <= room
    };
    COLUMNS.clone().find(fits).unwrap_or(*COLUMNS.end())
}

fn caption(number: usize, view: &ViewEntry) -> String {
    let degrees = |value: Option<f64>| value.map_or("–".into(), |value| text(value, 0));
    let focal = match (view.focal_px, view.focal_sigma_px) {
        (Some(value), Some(sd)) => format!(", f {}", measured(value, Some(sd))),
        _ => String::new(),
    };
    let rms = view.rms_px.map_or(String::new(), |rms| format!(", RMS {} px", brief(rms, 2)));
    format!(
        "<b>{number}</b> {}° to {}°{focal}{rms}",
        degrees(view.tilt_deg),
        degrees(view.slot_deg)
    )
}

/// Thumbnail of the view at `place` among the used ones, in the picture's own pixels: picture,
/// outline or corners of the board, and principal line.
fn thumbnail(report: &Report, view: &ViewEntry, number: usize, place: usize) -> String {
    let (width, height) = report.calibration.size_px();
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"-0.5 -0.5 {width} {height}\" role=\"img\" aria-label=\"{number}: {}\">\n",
        escaped(&view.name)
    );
    push(
        &mut svg,
        format_args!(
            "<rect x=\"-0.5\" y=\"-0.5\" width=\"{width}\" height=\"{height}\" class=\"paper\"/>\n"
        ),
    );
    match report.pictures.get(place).and_then(Option::as_ref) {
        Some(picture) => push(
            &mut svg,
            format_args!(
                "<image x=\"-0.5\" y=\"-0.5\" width=\"{width}\" height=\"{height}\" preserveAspectRatio=\"none\" href=\"{}\"/>\n",
                picture.data_uri()
            ),
        ),
        None => {
            let radius = 0.004 * width;
            for corner in report.corners.get(place).into_iter().flatten() {
                push(
                    &mut svg,
                    format_args!(
                        "<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"{radius:.1}\"/>\n",
                        corner.px.x, corner.px.y
                    ),
                );
            }
        }
    }
    if let Some(outline) = view.outline() {
        let places: Vec<String> =
            outline.iter().map(|px| format!("{:.1},{:.1}", px.x, px.y)).collect();
        push(
            &mut svg,
            format_args!("<polygon points=\"{}\" class=\"board\"/>\n", places.join(" ")),
        );
    }
    if let Some(line) = view.pl.map(Line::from) {
        let reach = width + height;
        let middle = Point2::new(0.5 * width, 0.5 * height);
        let nearest = line.through_px + line.along * line.along.dot(&(middle - line.through_px));
        let (from, to) = (nearest - line.along * reach, nearest + line.along * reach);
        for class in ["edge", "pl"] {
            push(
                &mut svg,
                format_args!(
                    "<line x1=\"{:.1}\" y1=\"{:.1}\" x2=\"{:.1}\" y2=\"{:.1}\" class=\"{class}\"/>\n",
                    from.x, from.y, to.x, to.y
                ),
            );
        }
    }
    svg + "</svg>"
}

/// Table of all numbers of all views, for screens.
fn table(views: &[(usize, &ViewEntry)]) -> String {
    let heads: String = words::VIEW_COLUMNS.iter().map(|head| format!("<th>{head}</th>")).collect();
    let mut html = format!(
        "<details class=\"screen\"><summary>{}</summary><table id=\"view-table\"><thead><tr>{heads}</tr></thead><tbody>\n",
        words::VIEW_TABLE
    );
    let number = |value: Option<f64>, decimals: usize| {
        value.map_or("–".into(), |value| plain(value, decimals))
    };
    for (count, view) in views {
        let focal = match (view.focal_px, view.focal_sigma_px) {
            (Some(value), Some(sd)) => measured(value, Some(sd)),
            _ => "–".into(),
        };
        let rms = view.rms_px.map_or("–".into(), |rms| brief_data(rms, 3));
        push(
            &mut html,
            format_args!(
                "<tr><th scope=\"row\">{count}</th><td>{}</td><td class=\"n\">{}</td><td class=\"n\">{}</td><td class=\"n\">{}</td><td class=\"n\">{focal}</td><td class=\"n\">{rms}</td></tr>\n",
                escaped(&view.name),
                number(view.tilt_deg, 1),
                number(view.slot_deg, 1),
                number(view.pl_residual_px, 2)
            ),
        );
    }
    html + "</tbody></table></details>\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn more_views_stand_closer() {
        let columns = |count, height| super::columns(count, height, ROOM.1);
        assert_eq!(columns(4, 0.75), 4);
        assert!(columns(16, 0.75) > columns(8, 0.75));
        assert!(columns(60, 0.5625) <= 15);
        assert_eq!(columns(60, 2.0), 15);
        assert!(super::columns(8, 0.75, ROOM_BESIDE_DRIFT) > columns(8, 0.75));
    }
}
