//! Residuals of all corners against the distance from the principal point.

use egui::{Align2, Color32, FontId, Painter, Pos2, Rect, Shape, Stroke, pos2, vec2};

use super::{super::theme, scatter::residuals_of, view_bars::lit};
use boresight_calibrate::Calibration;
use boresight_guide::session::Snapshot;
use boresight_present::{
    reading::fit::{SPAN, outwards, rings},
    text::charts as words,
};

/// Largest distance of a click from a corner's dot.
const REACH: f32 = 8.0;

/// Draws a dot for each corner, and mean and RMS of each ring. Returns the words below, and the
/// place of a view clicked at `click`.
pub(super) fn draw(
    painter: &Painter,
    area: Rect,
    (chosen, click): (usize, Option<Pos2>),
    (snapshot, calibration): (&Snapshot, &Calibration),
) -> (String, Option<usize>) {
    let pp = calibration.camera.pp_px;
    let outwards = |index| {
        let corners = residuals_of(index, snapshot, calibration).into_iter();
        corners.map(|(at, off)| outwards(&pp, &at, &off)).collect::<Vec<_>>()
    };
    let views: Vec<Vec<[f64; 2]>> = (0..calibration.views.len()).map(outwards).collect();
    let rings = rings(views.concat());
    let Some(last) = rings.last() else { return (words::TOO_FEW.into(), None) };
    let span_px = SPAN * calibration.rms_px.max(1e-9);
    let inner = Rect::from_min_max(area.min + vec2(54.0, 12.0), area.max - vec2(14.0, 26.0));
    let at = |[from_pp_px, off_px]: [f64; 2]| {
        let up = (off_px / span_px).clamp(-1.0, 1.0) as f32;
        let across = (from_pp_px / last.to_px) as f32;
        pos2(inner.left() + across * inner.width(), inner.center().y - 0.5 * up * inner.height())
    };
    let font = FontId::proportional(theme::SMALL);
    let write = |place: Pos2, align, text: String| {
        painter.text(place, align, text, font.clone(), Color32::WHITE);
    };
    for share in [-1.0, -0.5, 0.0, 0.5, 1.0] {
        let y = at([0.0, share * span_px]).y;
        painter.hline(inner.x_range(), y, Stroke::new(1.0, Color32::from_gray(70)));
        let place = pos2(inner.left() - 4.0, y);
        write(place, Align2::RIGHT_CENTER, format!("{:.2} px", share * span_px));
    }
    // The chosen view's last, on top.
    let mut order: Vec<usize> = (0..views.len()).collect();
    order.sort_by_key(|place| *place == chosen);
    let mut nearest: Option<(f32, usize)> = None;
    for place in order {
        let azimuth = snapshot.views.get(place).map_or(0.0, |view| view.tilt_azimuth_rad);
        let color = lit(place == chosen, theme::direction(azimuth));
        for pos in views[place].iter().map(|corner| at(*corner)) {
            painter.circle_filled(pos, 1.8, color);
            let off = click.map_or(f32::MAX, |click| click.distance(pos));
            if off < nearest.map_or(REACH, |(off, _)| off) {
                nearest = Some((off, place));
            }
        }
    }
    for ring in &rings {
        for (off_px, dash) in
            [(ring.mean_px, None), (ring.rms_px, Some(4.0)), (-ring.rms_px, Some(4.0))]
        {
            let ends = [at([ring.from_px, off_px]), at([ring.to_px, off_px])];
            for stroke in theme::outline(2.0, theme::AMBER) {
                match dash {
                    Some(gap) => painter.extend(Shape::dashed_line(&ends, stroke, 6.0, gap)),
                    None => _ = painter.line_segment(ends, stroke),
                }
            }
        }
    }
    for share in [0.25, 0.5, 0.75, 1.0] {
        let from_pp_px = share * last.to_px;
        let place = pos2(at([from_pp_px, 0.0]).x, inner.bottom() + 4.0);
        write(
            place,
            if share < 1.0 { Align2::CENTER_TOP } else { Align2::RIGHT_TOP },
            format!("{from_pp_px:.0} px"),
        );
    }
    (words::by_radius(&rings), nearest.map(|(_, place)| place))
}
