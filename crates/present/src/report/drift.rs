//! Section about a check against an older calibration.

use nalgebra::{Matrix2, Point2};

use super::{
    estimates::SDS,
    number::{brief_data, measured, row},
    section::section,
};
use crate::{
    chart::{Axes, COLOURS, Canvas, Stroke, escaped},
    text::{
        self,
        report::{self as words, Section},
    },
};
use boresight_formats::{ChangeEntry, CheckFile, VisibleEntry};

/// Section about a check: old calibration, change, and the smallest detectable change.
pub(super) fn html(check: &CheckFile) -> String {
    let mut rows = row(words::drift::OLD, &[escaped(&check.against)]);
    if let Some(change) = &check.change {
        let f = measured(change.f_px, Some(change.sigma.f_px));
        let [x, y] = [0, 1].map(|k| measured(change.pp_px[k], Some(change.sigma.pp_px[k])));
        rows += &row(words::drift::CHANGE_F, &[format!("{f} px")]);
        rows += &row(words::drift::CHANGE_PP, &[format!("{x}, {y} px")]);
    }
    if let Some(visible) = &check.visible {
        let smallest = |px| [format!("{} px", brief_data(px, 2))];
        rows += &row(words::drift::SMALLEST_F, &smallest(visible.f_px));
        rows += &row(words::drift::SMALLEST_PP, &smallest(visible.pp_px));
    }
    let weak = match check.uncertainty_of_old.as_deref() {
        Some("assumed") => format!("<p>{}.</p>\n", text::drift_is_weak()),
        _ => String::new(),
    };
    let body = format!(
        "<div class=\"two narrow\"><div><p><strong>{}</strong></p>\n<p>{}</p>\n{weak}<table><tbody>\n{rows}</tbody></table></div>\n{}</div>\n",
        escaped(&check.message),
        escaped(&check.action),
        check.change.map_or(String::new(), |change| drawing(&change, check.visible)),
    );
    section(Section::Drift, &body)
}

/// Change of the principal point with uncertainty, and a circle of the smallest visible change.
fn drawing(change: &ChangeEntry, visible: Option<VisibleEntry>) -> String {
    let moved = Point2::from(change.pp_px);
    let [x, y] = change.sigma.pp_px;
    let covariance = Matrix2::new(x * x, 0.0, 0.0, y * y);
    let ellipse = Canvas::ellipse_points(moved, &covariance, SDS);
    let seen = visible.map_or_else(Vec::new, |visible| {
        Canvas::ellipse_points(Point2::origin(), &Matrix2::identity(), visible.pp_px)
    });
    let mut points = vec![Point2::origin(), moved];
    points.extend(ellipse.iter().chain(&seen));
    let axes = Axes { x: words::drift::X, y: words::drift::Y, pixels: true };
    let mut canvas = Canvas::chart(&points, axes, Section::Drift.heading());
    canvas.area(&seen, "none", Stroke { colour: "#444", width: 1.0, dash: 2 });
    canvas.area(&ellipse, "none", Stroke { colour: COLOURS[0], width: 1.4, dash: 0 });
    canvas.cross(Point2::origin(), 9.0);
    canvas.mark(0, moved, COLOURS[0]);
    format!("<figure>{}<p class=\"note\">{}</p></figure>", canvas.svg(), words::drift::NOTE)
}
