//! What a check against an older calibration found.

use nalgebra::{Matrix2, Point2};
use serde::Deserialize;

use super::{
    estimates::SDS,
    number::{Measured, brief_data, row},
    page::section,
};
use crate::{
    chart::{Axes, COLOURS, Canvas, Stroke, escaped},
    text::{
        self,
        report::{self as words, Section},
    },
};

/// `boresight.check/1`, as far as the page shows it: the page has the numbers of the file.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct DriftSection {
    /// Name of the older calibration.
    pub against: String,
    /// Stable name of the verdict; `None` if there is none.
    pub verdict: Option<String>,
    /// The verdict in words, or why there is none.
    pub message: String,
    /// What to do.
    pub action: String,
    /// New less old.
    pub change: Option<Change>,
    /// The smallest change that would have been seen.
    pub visible: Option<Visible>,
    /// Whether the older file states its uncertainty: `stated` or `assumed`.
    pub uncertainty_of_old: Option<String>,
}

/// New less old calibration.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
pub struct Change {
    /// Of the focal length.
    pub f_px: f64,
    /// Of the principal point.
    pub pp_px: [f64; 2],
    /// Standard deviations.
    pub sigma: ChangeSigma,
}

/// Standard deviations of a [`Change`].
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
pub struct ChangeSigma {
    /// Of the focal length.
    pub f_px: f64,
    /// Of the principal point.
    pub pp_px: [f64; 2],
}

/// The smallest changes that a check would have seen.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
pub struct Visible {
    /// Of the principal point.
    pub pp_px: f64,
    /// Of the focal length.
    pub f_px: f64,
}

impl Change {
    fn focal(&self) -> Measured {
        Measured { value: self.f_px, sd: self.sigma.f_px }
    }

    fn principal_point(&self) -> [Measured; 2] {
        [0, 1].map(|k| Measured { value: self.pp_px[k], sd: self.sigma.pp_px[k] })
    }
}

impl DriftSection {
    /// Reads it from JSON.
    ///
    /// # Errors
    ///
    /// If fields are missing or of another type.
    pub fn read(check: &serde_json::Value) -> Result<Self, serde_json::Error> {
        Self::deserialize(check)
    }

    pub(super) fn html(&self) -> String {
        let mut rows = row(words::drift::OLD, &[escaped(&self.against)]);
        if let Some(change) = &self.change {
            let [x, y] = change.principal_point().map(|measured| measured.html());
            rows += &row(words::drift::CHANGE_F, &[format!("{} px", change.focal().html())]);
            rows += &row(words::drift::CHANGE_PP, &[format!("{x}, {y} px")]);
        }
        if let Some(visible) = &self.visible {
            let smallest = |px| [format!("{} px", brief_data(px, 2))];
            rows += &row(words::drift::SMALLEST_F, &smallest(visible.f_px));
            rows += &row(words::drift::SMALLEST_PP, &smallest(visible.pp_px));
        }
        let weak = match self.uncertainty_of_old.as_deref() {
            Some("assumed") => format!("<p>{}.</p>\n", text::drift_is_weak()),
            _ => String::new(),
        };
        let body = format!(
            "<div class=\"two narrow\"><div><p><strong>{}</strong></p>\n<p>{}</p>\n{weak}<table><tbody>\n{rows}</tbody></table></div>\n{}</div>\n",
            escaped(&self.message),
            escaped(&self.action),
            self.change.map_or(String::new(), |change| self.drawing(&change)),
        );
        section(Section::Drift, &body)
    }

    /// The change of the principal point beside what is uncertain, and what would have been seen.
    fn drawing(&self, change: &Change) -> String {
        let moved = Point2::from(change.pp_px);
        let [x, y] = change.sigma.pp_px;
        let covariance = Matrix2::new(x * x, 0.0, 0.0, y * y);
        let ellipse = Canvas::ellipse_points(moved, &covariance, SDS);
        let seen = self.visible.map_or_else(Vec::new, |visible| {
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
}
