//! The one cause of an untrustworthy result as a picture: two outlines on a picture of the session,
//! from its own numbers. A cause that no drawing shows truthfully has none.

use nalgebra::{Point2, Vector2};

use crate::{
    chart::{escaped, push},
    grade::Grade,
    text::cause as words,
};
use boresight_calibrate::{Calibration, FindingCode, FocusMotion, Severity};
use boresight_geometry::frame::ImageSize;

/// Half of the first outline as a share of the picture: the second one fits around it.
const FIRST_SHARE: f64 = 0.3;
/// Least change of size that is seen at a glance; a smaller one is drawn enlarged.
const SEEN_CHANGE: f64 = 0.15;
/// Enlargements, all easily read.
const ENLARGEMENTS: [f64; 6] = [1.0, 2.0, 5.0, 10.0, 20.0, 50.0];

/// The same part of the room in two views of a session.
#[derive(Clone, Debug, PartialEq)]
pub struct CausePicture {
    /// Place in the calibration of the view whose picture lies below; `None` for any.
    pub place: Option<usize>,
    /// Expected and found outline: name, and corners in pixels, clockwise from
    /// the upper left.
    pub parts: [(String, [Point2<f64>; 4]); 2],
    /// What the outlines show, with their enlargement.
    pub caption: String,
}

impl CausePicture {
    /// Picture of the first bad finding on `calibration`, if that isn't trustworthy; `number` names
    /// the view at a place.
    pub fn of(calibration: &Calibration, number: &dyn Fn(usize) -> String) -> Option<Self> {
        let mut bad = calibration.findings.iter().filter(|it| it.severity == Severity::Bad);
        let code = bad.next().filter(|_| Grade::of(calibration) == Grade::NotTrustworthy)?.code;
        let view = |place: usize| words::view(&number(place));
        let last = calibration.views.len().checked_sub(1)?;
        let (place, names, change) = match code {
            FindingCode::FocusMoved { motion, relative_sd, .. } => match motion {
                FocusMotion::Jump { view: at, change } => {
                    (Some(at), [view(at.checked_sub(1)?), view(at)], change)
                }
                FocusMotion::Drift { change } => (Some(last), [view(0), view(last)], change),
                FocusMotion::Breathes { change } => (None, words::BREATHES.map(Into::into), change),
                FocusMotion::Scattered => (None, words::SCATTERED.map(Into::into), relative_sd),
            },
            FindingCode::ViewsMixed { view: at, f_ratio, .. } => {
                (Some(at), [words::OTHERS.into(), view(at)], f_ratio - 1.0)
            }
            _ => return None,
        };
        let is_enough = |times: &f64| times * change.abs() >= SEEN_CHANGE;
        let times = ENLARGEMENTS.into_iter().find(is_enough).unwrap_or(ENLARGEMENTS[5]);
        let ImageSize { width_px, height_px } = calibration.image_size;
        let ratio = (1.0 + times * change).max(0.1);
        // The larger one fits, and both keep their ratio.
        let first = FIRST_SHARE * (1.5 / ratio).min(1.0);
        let half = Vector2::new(f64::from(width_px), f64::from(height_px)) * first;
        // The picture of a lens with another focal length grows around the principal point.
        let around = |half: Vector2<f64>| {
            let corner =
                |(x, y)| calibration.camera.pp_px + half.component_mul(&Vector2::new(x, y));
            [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(corner)
        };
        let [one, other] = names;
        let parts = [(one, around(half)), (other, around(half * ratio))];
        Some(Self { place, parts, caption: words::larger(change, times) })
    }

    /// True for the smaller outline, whose name has room within.
    pub fn is_inner(&self, part: usize) -> bool {
        let top_px = |part: usize| self.parts[part].1[0].y;
        top_px(part) > top_px(1 - part)
    }

    /// Drawing for a page, over a picture of `size` behind `href`, if any.
    pub fn svg(&self, ImageSize { width_px, height_px }: ImageSize, href: Option<&str>) -> String {
        let letter = f64::from(height_px) / 22.0;
        let area = format!("width=\"{width_px}\" height=\"{height_px}\"");
        let said = escaped(&self.caption);
        let mut svg = format!(
            "<svg viewBox=\"0 0 {width_px} {height_px}\" role=\"img\" aria-label=\"{said}\"><rect {area} fill=\"#444\"/>"
        );
        if let Some(href) = href {
            push(&mut svg, format_args!("<image {area} href=\"{href}\" opacity=\".5\"/>"));
        }
        let styles = [("#fff", 0.6 * letter), ("#ff7a6b", 0.0)];
        for (part, ((name, corners_px), (colour, dash))) in
            self.parts.iter().zip(styles).enumerate()
        {
            let at = corners_px.map(|px| format!("{:.1},{:.1}", px.x + 0.5, px.y + 0.5)).join(" ");
            let down = if self.is_inner(part) { 1.1 } else { -0.35 };
            let (x, y) = (corners_px[0].x + 0.4 * letter, corners_px[0].y + down * letter);
            let (wide, name) = (letter / 5.0, escaped(name));
            push(
                &mut svg,
                format_args!(
                    "<polygon points=\"{at}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"{wide:.1}\" stroke-dasharray=\"{dash:.1}\"/><text x=\"{x:.1}\" y=\"{y:.1}\" font-size=\"{letter:.1}\" fill=\"{colour}\">{name}</text>"
                ),
            );
        }
        svg + "</svg>"
    }
}
