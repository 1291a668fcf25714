//! Principal lines in the picture, and the principal point by every method.

use nalgebra::Point2;

use super::{
    line::Line,
    number::{brief_data, measured, row},
    picture_maps::LABELS,
    section::{figure, missing},
};
use crate::{
    chart::{Axes, COLOURS, Canvas, Stroke, escaped},
    text::report::{self as words, Section},
};
use boresight_formats::{CalibrationFile, EstimateEntry, LensEntry};

/// Standard deviations covered by an ellipse.
pub(super) const SDS: f64 = 2.0;

/// Stable name and mark of each method, and true if the method models the lens.
const METHODS: [(&str, bool); 6] = [
    ("pl_unweighted", false),
    ("pl_weighted", false),
    ("pl_ring", false),
    ("free_homography", true),
    ("bundle", true),
    ("zhang", true),
];

/// Index, stable name and estimate of each method.
fn estimates(calibration: &CalibrationFile) -> Vec<(usize, &'static str, EstimateEntry)> {
    let Some(points) = &calibration.principal_point else { return Vec::new() };
    let by_method = [
        points.pl_unweighted,
        points.pl_weighted,
        points.pl_ring,
        points.free_homography,
        points.bundle,
        points.zhang,
    ];
    METHODS
        .iter()
        .zip(by_method)
        .enumerate()
        .filter_map(|(i, ((code, _), estimate))| Some((i, *code, estimate?)))
        .collect()
}

/// Principal lines of all views across the picture.
pub(super) fn fan(calibration: &CalibrationFile) -> String {
    let lines: Vec<(usize, Line, f64)> = calibration
        .used()
        .filter_map(|(number, view)| {
            Some((number, Line::from(view.pl?), view.slot_deg.unwrap_or_default().to_radians()))
        })
        .collect();
    let Some(lens) = calibration.result.as_ref().filter(|_| !lines.is_empty()) else {
        return figure(Section::Fan, &missing(words::TOO_FEW), "");
    };
    let mut canvas = Canvas::picture(calibration.size_px(), Section::Fan.heading());
    let pp_px = Point2::from(lens.pp_px);
    for (_, line, slot_rad) in &lines {
        let eighth = (slot_rad / std::f64::consts::FRAC_PI_4).round().rem_euclid(4.0);
        // A whole number from 0 to 3.
        let direction = eighth as usize;
        let stroke = Stroke { colour: COLOURS[direction], width: 1.1, dash: direction };
        canvas.line(line.through_px, line.along, stroke);
    }
    if lines.len() <= LABELS {
        for (number, line, slot_rad) in &lines {
            let end = towards(line, pp_px, *slot_rad, calibration.size_px());
            canvas.label(end, (0.0, 4.0), &number.to_string());
        }
    }
    if let Some(covariance) = estimates(calibration)
        .iter()
        .find(|(_, code, _)| *code == result_method(calibration))
        .and_then(|(_, _, estimate)| estimate.covariance_px2())
    {
        let ellipse = Canvas::ellipse_points(pp_px, &covariance, SDS);
        canvas.area(&ellipse, "none", Stroke { colour: "#000", width: 1.5, dash: 0 });
    }
    canvas.cross(pp_px, 6.0);
    figure(Section::Fan, &canvas.svg(), words::FAN_NOTE)
}

/// Point slightly inside the picture's edge, on the side of the receding board edge.
fn towards(
    line: &Line,
    near: Point2<f64>,
    slot_rad: f64,
    (width, height): (f64, f64),
) -> Point2<f64> {
    let (sin, cos) = libm::sincos(slot_rad);
    let side = if line.along.x * cos + line.along.y * sin < 0.0 { -1.0 } else { 1.0 };
    let along = line.along * side;
    let from = line.through_px + line.along * line.along.dot(&(near - line.through_px));
    let reach = |from: f64, along: f64, size: f64| {
        let edge = if along > 0.0 { size - 0.05 * size } else { 0.05 * size };
        if along.abs() < 1e-9 { f64::INFINITY } else { (edge - from) / along }
    };
    let length = reach(from.x, along.x, width).min(reach(from.y, along.y, height));
    from + along * length.clamp(-1e6, 1e6)
}

/// Name of the method behind the resulting principal point.
fn result_method(calibration: &CalibrationFile) -> &'static str {
    let varies = calibration.result.as_ref().is_some_and(LensEntry::focal_varies);
    if varies { "free_homography" } else { "bundle" }
}

/// All methods, and a close-up of the methods with a lens model.
pub(super) fn drawings(calibration: &CalibrationFile) -> String {
    let all = estimates(calibration);
    let near: Vec<_> = all.iter().filter(|(i, _, _)| METHODS[*i].1).copied().collect();
    drawing(Section::Estimates, &all, words::ESTIMATES_NOTE)
        + &drawing(Section::EstimatesNear, &near, words::ESTIMATES_NEAR_NOTE)
}

fn drawing(
    section: Section,
    estimates: &[(usize, &'static str, EstimateEntry)],
    note: &str,
) -> String {
    if estimates.is_empty() {
        return figure(section, &missing(words::TOO_FEW), "");
    }
    let ellipses: Vec<Vec<Point2<f64>>> = estimates
        .iter()
        .map(|(_, _, estimate)| {
            estimate.covariance_px2().map_or_else(Vec::new, |covariance| {
                Canvas::ellipse_points(Point2::from(estimate.px), &covariance, SDS)
            })
        })
        .collect();
    let mut points: Vec<Point2<f64>> =
        estimates.iter().map(|(_, _, estimate)| Point2::from(estimate.px)).collect();
    points.extend(ellipses.iter().flatten());
    let axes = Axes { x: words::name::X, y: words::name::Y, pixels: true };
    let mut canvas = Canvas::chart(&points, axes, section.heading());
    let mut legend = Vec::new();
    for ((i, code, estimate), ellipse) in estimates.iter().zip(&ellipses) {
        let colour = COLOURS[i % COLOURS.len()];
        canvas.area(ellipse, "none", Stroke { colour, width: 1.3, dash: *i });
        canvas.mark(*i, Point2::from(estimate.px), colour);
        legend.push((*i, colour, words::method(code).to_owned()));
    }
    canvas.legend(&legend);
    figure(section, &canvas.svg(), note)
}

/// Table of every method's principal point with standard deviations.
pub(super) fn table(calibration: &CalibrationFile) -> String {
    let Some(lens) = &calibration.result else { return String::new() };
    let [name, x, y, from] = words::METHOD_COLUMNS;
    // Only for readers who know the methods.
    let heading = crate::text::result::METHODS;
    let mut html = format!(
        "<details class=\"screen\"><summary>{heading}</summary><table id=\"methods\"><thead><tr><th>{name}</th><th>{x}</th><th>{y}</th><th>{from}</th></tr></thead><tbody>\n"
    );
    for (_, code, estimate) in estimates(calibration) {
        let coordinate =
            |k: usize| measured(estimate.px[k], estimate.sigma_px.map(|sigma| sigma[k]));
        let off_px = (Point2::from(estimate.px) - Point2::from(lens.pp_px)).norm();
        let from = if code == result_method(calibration) {
            escaped(words::THE_RESULT)
        } else {
            brief_data(off_px, 2)
        };
        html += &row(words::method(code), &[coordinate(0), coordinate(1), from]);
    }
    html + "</tbody></table></details>\n"
}
