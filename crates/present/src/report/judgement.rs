//! Page about a judged calibration: answer, causes, and the difference over the picture.

use nalgebra::{Point2, Vector2};

use super::{
    number::{brief, brief_data},
    page::STYLE,
    picture_maps::round_down,
    projection_map::{MET, NOT_MET, cells, shade},
    section::{figure, section_with},
};
use crate::{
    chart::{Canvas, Stroke, escaped},
    text::report::{self as words, Section},
};
use boresight_formats::{CalibrationFile, JudgementFile};
use boresight_geometry::{BoardOutline, GRID_COLUMNS, frame::ImageSize};

/// Length of the longest arrow as share of the picture's width: a cell's.
const LONGEST: f64 = 0.08;

/// Page about `judged`, held to the lens in `fresh`: one self-contained HTML file, and well-formed
/// XML.
pub fn judgement_page(judged: &JudgementFile, fresh: Option<&CalibrationFile>) -> String {
    let title = escaped(&words::title_of_judgement(&judged.file));
    let reasons: String =
        judged.doubts.iter().map(|reason| format!("<li>{}.</li>\n", escaped(reason))).collect();
    let reasons = if reasons.is_empty() { reasons } else { format!("<ul>\n{reasons}</ul>\n") };
    let answer = format!(
        "<p class=\"lead\"><span class=\"sign\">{}</span> <strong>{}.</strong></p>\n<p class=\"next\"><b>{}</b> {}</p>\n{reasons}",
        words::verdict_sign(&judged.answer),
        escaped(&judged.message),
        words::NEXT,
        escaped(&judged.action)
    );
    let answer = section_with(Section::Verdict, "box", &answer);
    let map = fresh.map_or_else(String::new, |fresh| map(judged, fresh));
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"/><meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/><title>{title}</title><style>\n{STYLE}</style></head><body>\n<h1>{title}</h1>\n{answer}{map}</body></html>\n"
    )
}

/// Shades of the difference, with an arrow in every third cell.
fn map(judged: &JudgementFile, fresh: &CalibrationFile) -> String {
    let per_axis = |[x, y, by_x, by_y]: &[f64; 4]| {
        (Point2::new(*x, *y), Vector2::new(*by_x, *by_y), libm::hypot(*by_x, *by_y) / 2_f64.sqrt())
    };
    let displaced: Vec<_> = judged.displaced_px.iter().map(per_axis).collect();
    let (Some(goal_px), false) = (judged.goal_px, displaced.is_empty()) else {
        return String::new();
    };
    let range =
        displaced.iter().fold([f64::INFINITY, 0.0], |[least, most]: [f64; 2], (.., off)| {
            [least.min(*off), most.max(*off)]
        });
    let [width_px, height_px] = fresh.image_size.map(|side| side.max(1));
    let outlines: Vec<BoardOutline> =
        fresh.used().filter_map(|(_, view)| BoardOutline::around(view.outline()?)).collect();
    let mut canvas = Canvas::large_picture(fresh.size_px(), Section::Difference.heading());
    let times = round_down(LONGEST * fresh.size_px().0 / range[1].max(1e-9));
    let mut arrows = Vec::new();
    for (index, (centre, corners)) in cells(ImageSize { width_px, height_px }).enumerate() {
        let Some((px, by, off_px)) = displaced.iter().find(|(px, ..)| (px - centre).norm() < 0.25)
        else {
            canvas.hatch(&corners);
            continue;
        };
        let shades = if *off_px <= goal_px { &MET } else { &NOT_MET };
        canvas.area(&corners, shade(*off_px, shades, range), Stroke::thin("#fff"));
        let covered = outlines.iter().any(|outline| outline.covers(px));
        let colour = if covered { "#111" } else { "#666" };
        // Below the start of an arrow.
        let below = centre + 0.3 * (corners[2] - corners[1]);
        canvas.number(below, colour, brief(*off_px, 2).trim_start_matches('0'));
        let [row, column] = [index / GRID_COLUMNS as usize, index % GRID_COLUMNS as usize];
        if (row + column).is_multiple_of(3) {
            arrows.push(([*px, px + by * times], colour));
        }
    }
    for (arrow, colour) in arrows {
        canvas.curve(&arrow, Stroke { colour, width: 1.3, dash: 0 });
        canvas.dot(arrow[0], 1.8);
    }
    let note = words::difference_note(&brief(times, 1), &brief_data(goal_px, 2));
    figure(Section::Difference, &canvas.svg(), &note)
}
