//! What a check against an older calibration found.

use nalgebra::{Matrix2, Point2};

use super::{
    estimates::SDS,
    number::{Measured, brief_data, row},
    page::section,
};
use crate::{
    calibration::DriftVerdict,
    chart::{Axes, COLOURS, Canvas, Stroke, escaped},
    text::report::{self as words, Section},
};

/// The change of a camera since an older calibration.
#[derive(Clone, Debug, PartialEq)]
pub struct DriftSection {
    /// Name of the older calibration.
    pub old_file: String,
    /// What the check says.
    pub verdict: DriftVerdict,
    /// What to do, in a sentence.
    pub action: String,
    /// New less old focal length, with its standard deviation.
    pub focal_px: Measured,
    /// New less old principal point, with its standard deviations.
    pub pp_px: [Measured; 2],
    /// Smallest change of the focal length that the check would have seen.
    pub smallest_focal_px: Option<f64>,
    /// Smallest change of the principal point that the check would have seen.
    pub smallest_pp_px: Option<f64>,
    /// What weakens the check, in sentences.
    pub notes: Vec<String>,
}

impl DriftSection {
    pub(super) fn html(&self) -> String {
        let [x, y] = self.pp_px;
        let mut rows = row(words::drift::OLD, &[escaped(&self.old_file)]);
        rows += &row(words::drift::CHANGE_F, &[format!("{} px", self.focal_px.html())]);
        rows += &row(words::drift::CHANGE_PP, &[format!("{}, {} px", x.html(), y.html())]);
        for (name, smallest) in [
            (words::drift::SMALLEST_F, self.smallest_focal_px),
            (words::drift::SMALLEST_PP, self.smallest_pp_px),
        ] {
            if let Some(smallest_px) = smallest {
                rows += &row(name, &[format!("{} px", brief_data(smallest_px, 2))]);
            }
        }
        let notes: String =
            self.notes.iter().map(|note| format!("<p>{}</p>\n", escaped(note))).collect();
        let body = format!(
            "<div class=\"two narrow\"><div><p class=\"next\" data-verdict=\"{}\"><strong>{}</strong></p>\n<p>{}</p>\n{notes}<table><tbody>\n{rows}</tbody></table></div>\n<figure>{}<p class=\"note\">{}</p></figure></div>\n",
            self.verdict.code(),
            words::drift_verdict(self.verdict.code()),
            escaped(&self.action),
            self.drawing(),
            words::drift::NOTE
        );
        section(Section::Drift, &body)
    }

    /// The change of the principal point beside what is uncertain, and what would have been seen.
    fn drawing(&self) -> String {
        let [x, y] = self.pp_px;
        let change = Point2::new(x.value, y.value);
        let covariance = Matrix2::new(x.sd * x.sd, 0.0, 0.0, y.sd * y.sd);
        let ellipse = Canvas::ellipse_points(change, &covariance, SDS);
        let seen = self.smallest_pp_px.map_or_else(Vec::new, |smallest_px| {
            Canvas::ellipse_points(Point2::origin(), &Matrix2::identity(), smallest_px)
        });
        let mut points = vec![Point2::origin(), change];
        points.extend(ellipse.iter().chain(&seen));
        let axes = Axes { x: words::drift::X, y: words::drift::Y, pixels: true };
        let mut canvas = Canvas::chart(&points, axes, Section::Drift.heading());
        canvas.area(&seen, "none", Stroke { colour: "#444", width: 1.0, dash: 2 });
        canvas.area(&ellipse, "none", Stroke { colour: COLOURS[0], width: 1.4, dash: 0 });
        canvas.cross(Point2::origin(), 9.0);
        canvas.mark(0, change, COLOURS[0]);
        canvas.svg()
    }
}
