//! Maps over the picture: boards, and residuals of their corners.

use nalgebra::{Point2, Vector2};

use super::{
    Report,
    number::{brief, plain},
    projection_map::cells,
    section::{figure, missing},
};
use crate::{
    chart::{COLOURS, Canvas, Stroke},
    text::report::{self as words, Section},
};
use boresight_formats::CalibrationFile;
use boresight_geometry::{BoardOutline, frame::ImageSize};

/// Maximum number of labels: more would hide the outlines or lines.
pub(super) const LABELS: usize = 24;
/// Maximum number of arrows: more can't be told apart.
pub(super) const MOST_ARROWS: usize = 1200;
/// Length of a typical arrow as share of the picture's width.
const ARROW: f64 = 0.02;

/// Outlines of all boards; uncovered area is hatched.
pub(super) fn coverage(calibration: &CalibrationFile) -> String {
    let outlines: Vec<(usize, [Point2<f64>; 4])> =
        calibration.used().filter_map(|(number, view)| Some((number, view.outline()?))).collect();
    if outlines.is_empty() {
        return figure(Section::Coverage, &missing(words::TOO_FEW), "");
    }
    let [width_px, height_px] = calibration.image_size;
    let size = ImageSize { width_px: width_px.max(1), height_px: height_px.max(1) };
    let mut canvas = Canvas::picture(calibration.size_px(), Section::Coverage.heading());
    let shapes: Vec<BoardOutline> =
        outlines.iter().filter_map(|(_, corners)| BoardOutline::around(*corners)).collect();
    for (centre, cell) in cells(size) {
        if !shapes.iter().any(|outline| outline.covers(&centre)) {
            canvas.hatch(&cell);
        }
    }
    // Many layers of even the faintest blue would hide the outlines below.
    let fill = if outlines.len() <= LABELS { "#0072b20d" } else { "none" };
    for (number, corners) in &outlines {
        let stroke = Stroke { colour: COLOURS[number % COLOURS.len()], width: 1.1, dash: *number };
        canvas.area(corners, fill, stroke);
    }
    if outlines.len() <= LABELS {
        for (index, (number, corners)) in outlines.iter().enumerate() {
            // Overlapping boards have their numbers at different corners.
            let corner = corners[index % 4];
            let middle = corners.iter().fold(Vector2::zeros(), |sum, c| sum + c.coords) / 4.0;
            let place = corner + (Point2::from(middle) - corner) * 0.12;
            canvas.label(place, (0.0, 4.0), &number.to_string());
        }
    }
    let covered = |share: f64| format!(" {}", words::covered(&plain(100.0 * share, 0)));
    let share = calibration.coverage.map_or(String::new(), covered);
    figure(Section::Coverage, &canvas.svg(), &format!("{}{share}", words::COVERAGE_NOTE))
}

/// Residual of every corner, magnified.
pub(super) fn residuals(report: &Report) -> String {
    let calibration = &report.calibration;
    let arrows = arrows(report);
    let (Some(lens), false) = (&calibration.result, arrows.is_empty()) else {
        let why =
            if calibration.result.is_none() { words::NO_CALIBRATION } else { words::NEEDS_CORNERS };
        return figure(Section::Residuals, &missing(why), "");
    };
    let squares: f64 = arrows.iter().map(|(_, off)| off.norm_squared()).sum();
    let typical_px = (squares / arrows.len() as f64).sqrt().max(1e-9);
    let times = round_down(ARROW * calibration.size_px().0 / typical_px);
    let mut canvas = Canvas::picture(calibration.size_px(), Section::Residuals.heading());
    let step = arrows.len().div_ceil(MOST_ARROWS).max(1);
    let mut shown = 0;
    for (px, off) in arrows.iter().step_by(step) {
        shown += 1;
        canvas.curve(&[*px, px + off * times], Stroke { colour: COLOURS[1], width: 0.9, dash: 0 });
        canvas.dot(*px, 0.9);
    }
    canvas.cross(lens.pp_px.into(), 6.0);
    let times = brief(times, 1);
    figure(Section::Residuals, &canvas.svg(), &words::residuals_note(&times, shown, arrows.len()))
}

/// Every corner with the offset from the predicted position.
pub(super) fn arrows(report: &Report) -> Vec<(Point2<f64>, Vector2<f64>)> {
    let calibration = &report.calibration;
    let (Some(lens), Some(board_m)) = (&calibration.result, calibration.board_m()) else {
        return Vec::new();
    };
    let mut arrows = Vec::new();
    for ((_, view), corners) in calibration.used().zip(&report.corners) {
        let Some(pose) = view.pose() else { continue };
        let camera = view.camera(lens);
        for (corner, point_m) in corners.iter().zip(&board_m).filter(|(c, _)| c.is_seen()) {
            if let Some(predicted) = camera.project(&(pose * point_m)) {
                arrows.push((corner.px, corner.px - predicted));
            }
        }
    }
    arrows
}

/// Largest of 1, 2 or 5 times a power of ten up to `value`; at least 1.
pub(super) fn round_down(value: f64) -> f64 {
    let power = libm::pow(10.0, libm::log10(value.max(1.0)).floor());
    let digit = [5.0, 2.0, 1.0].into_iter().find(|digit| digit * power <= value).unwrap_or(1.0);
    digit * power
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn magnifications_are_round() {
        for (value, round) in [(0.3, 1.0), (1.0, 1.0), (4.9, 2.0), (6.0, 5.0), (250.0, 200.0)] {
            assert!((round_down(value) - round).abs() < 1e-9, "{value}");
        }
    }
}
