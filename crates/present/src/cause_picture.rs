//! The one cause of an untrustworthy result as a picture: lines on a picture of the session, from
//! the session's own numbers. A cause that no drawing shows truthfully has none.

use nalgebra::{Point2, Vector2};

use crate::{
    chart::{escaped, push},
    grade::Grade,
    text::cause as words,
};
use boresight_calibrate::{Calibration, Finding, FindingCode, FocusMotion, Severity};
use boresight_geometry::frame::ImageSize;

/// Half of the first outline as a share of the picture: the second one fits around it.
const FIRST_SHARE: f64 = 0.3;
/// Least change of size that is seen at a glance; a smaller one is drawn enlarged.
const SEEN_CHANGE: f64 = 0.15;
/// Enlargements, all easily read.
const ENLARGEMENTS: [f64; 6] = [1.0, 2.0, 5.0, 10.0, 20.0, 50.0];

/// Lines that show a cause.
#[derive(Clone, Debug, PartialEq)]
pub struct CausePicture {
    /// Place in the calibration of the view whose picture lies below; `None` for any.
    pub place: Option<usize>,
    /// The outline or point as it should be, then as it is.
    pub parts: [Part; 2],
    /// What the lines show, with their enlargement.
    pub caption: String,
}

/// Outline, or a point, on the picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    /// Corners in pixels, clockwise from the upper left; all the same for a point.
    pub corners_px: [Point2<f64>; 4],
    /// Name.
    pub name: String,
}

impl Part {
    fn around(middle: Point2<f64>, half: Vector2<f64>, name: String) -> Self {
        let signs = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
        let corner = |(x, y)| middle + Vector2::new(x * half.x, y * half.y);
        Self { corners_px: signs.map(corner), name }
    }

    /// Position, if it's a point.
    pub fn point(&self) -> Option<Point2<f64>> {
        let [first, .., last] = self.corners_px;
        (first == last).then_some(first)
    }
}

impl CausePicture {
    /// Picture of the first bad finding on `calibration`, if that isn't trustworthy; `number` names
    /// the view at a place.
    pub fn of(calibration: &Calibration, number: &dyn Fn(usize) -> String) -> Option<Self> {
        if Grade::of(calibration) != Grade::NotTrustworthy {
            return None;
        }
        let is_bad = |finding: &&Finding| finding.severity == Severity::Bad;
        let finding = calibration.findings.iter().find(is_bad)?;
        let scaled = |place, names, change: f64, caption: String| {
            Self::scaled(calibration, (place, names), change, caption)
        };
        match finding.code {
            FindingCode::FocusMoved { motion, relative_sd, .. } => match motion {
                FocusMotion::Jump { view, change } => {
                    let names =
                        [words::view(&number(view.checked_sub(1)?)), words::view(&number(view))];
                    scaled(Some(view), names, change, words::larger(change))
                }
                FocusMotion::Drift { change } => {
                    let last = calibration.views.len().checked_sub(1)?;
                    let names = [0, last].map(|place| words::view(&number(place)));
                    scaled(Some(last), names, change, words::larger(change))
                }
                FocusMotion::Breathes { change } => {
                    let names = words::BREATHES.map(Into::into);
                    scaled(None, names, change, words::larger(change))
                }
                FocusMotion::Scattered => {
                    let names = words::SCATTERED.map(Into::into);
                    scaled(None, names, 2.0 * relative_sd, words::scatters(relative_sd))
                }
            },
            FindingCode::ViewsMixed { view, f_ratio, .. } => {
                let names = [words::OTHERS.into(), words::view(&number(view))];
                scaled(Some(view), names, f_ratio - 1.0, words::larger(f_ratio - 1.0))
            }
            FindingCode::PrincipalPointFar { distance_px, .. } => {
                let middle = calibration.image_size.centre_px();
                let at = |point, name: &str| Part::around(point, Vector2::zeros(), name.into());
                let parts =
                    [at(middle, words::MIDDLE), at(calibration.camera.pp_px, words::PRINCIPAL)];
                Some(Self { place: None, parts, caption: words::apart(distance_px) })
            }
            _ => None,
        }
    }

    /// The same part of the room in two photos: from the first to the second it grows by `change`
    /// around the principal point.
    fn scaled(
        calibration: &Calibration,
        (place, names): (Option<usize>, [String; 2]),
        change: f64,
        caption: String,
    ) -> Option<Self> {
        let most = *ENLARGEMENTS.last()?;
        let is_enough = |times: &f64| times * change.abs() >= SEEN_CHANGE;
        let times = ENLARGEMENTS.into_iter().find(is_enough).unwrap_or(most);
        let ImageSize { width_px, height_px } = calibration.image_size;
        let first = FIRST_SHARE * Vector2::new(f64::from(width_px), f64::from(height_px));
        let second = first * (1.0 + times * change).max(0.1);
        // The larger one fits, and both keep their ratio.
        let fits = (1.5 * first.x / second.x).min(1.0);
        let middle = calibration.camera.pp_px;
        let [one, other] = names;
        let parts =
            [Part::around(middle, first * fits, one), Part::around(middle, second * fits, other)];
        Some(Self { place, parts, caption: words::drawn(&caption, times) })
    }

    /// Drawing for a page, over a picture of `size` behind `href`, if any.
    pub fn svg(&self, size: ImageSize, href: Option<&str>) -> String {
        let ImageSize { width_px, height_px } = size;
        let letter = f64::from(height_px) / 22.0;
        let mut svg = format!(
            "<svg viewBox=\"0 0 {width_px} {height_px}\" role=\"img\" aria-label=\"{}\"><rect width=\"{width_px}\" height=\"{height_px}\" fill=\"#444\"/>",
            escaped(&self.caption)
        );
        if let Some(href) = href {
            push(
                &mut svg,
                format_args!(
                    "<image width=\"{width_px}\" height=\"{height_px}\" href=\"{href}\" opacity=\".5\"/>"
                ),
            );
        }
        for (part, (colour, dash)) in self.parts.iter().zip([("#fff", 0.6), ("#ff7a6b", 0.0)]) {
            let at = part.corners_px.map(|px| format!("{:.1},{:.1}", px.x + 0.5, px.y + 0.5));
            let name = escaped(&part.name);
            let [left, ..] = part.corners_px;
            let (width, dash) = (letter / 5.0, dash * letter);
            match part.point() {
                Some(point) => push(
                    &mut svg,
                    format_args!(
                        "<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"{width:.1}\" fill=\"{colour}\"/>",
                        point.x + 0.5,
                        point.y + 0.5
                    ),
                ),
                None => push(
                    &mut svg,
                    format_args!(
                        "<polygon points=\"{}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"{width:.1}\" stroke-dasharray=\"{dash:.1}\"/>",
                        at.join(" ")
                    ),
                ),
            }
            push(
                &mut svg,
                format_args!(
                    "<text x=\"{:.1}\" y=\"{:.1}\" font-size=\"{letter:.1}\" fill=\"{colour}\">{name}</text>",
                    left.x + 0.4 * letter,
                    left.y - 0.35 * letter
                ),
            );
        }
        svg + "</svg>"
    }
}
