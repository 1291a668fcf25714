//! Residuals of all corners as a cloud, and the distribution of sizes.

use egui::{Align2, Color32, FontId, Painter, Rect, Shape, Stroke, pos2, vec2};
use nalgebra::{Point2, Vector2};

use super::{super::theme, view_bars::lit};
use boresight_calibrate::Calibration;
use boresight_guide::session::Snapshot;
use boresight_present::{
    reading::fit::{BARS, Histogram, SPAN},
    text::charts as words,
};

/// Expected corners of view `index`, and residuals, px.
pub(super) fn residuals_of(
    index: usize,
    snapshot: &Snapshot,
    calibration: &Calibration,
) -> Vec<(Point2<f64>, Vector2<f64>)> {
    let (Some(view), Some(fitted)) = (snapshot.views.get(index), calibration.views.get(index))
    else {
        return Vec::new();
    };
    let camera = calibration.camera_of(index);
    calibration
        .board_m
        .iter()
        .zip(view.corners_px.iter())
        .zip(&fitted.is_seen)
        .filter(|(_, is_seen)| **is_seen)
        .filter_map(|((corner, seen), _)| {
            let expected = camera.project(&(fitted.cam_from_board * corner))?;
            Some((expected, seen - expected))
        })
        .collect()
}

/// Draws cloud and distribution, and the words below.
pub(super) fn draw(
    painter: &Painter,
    area: Rect,
    chosen: usize,
    (snapshot, calibration): (&Snapshot, &Calibration),
) -> String {
    let views: Vec<_> = (0..calibration.views.len())
        .map(|index| residuals_of(index, snapshot, calibration))
        .collect();
    let offs: Vec<Vector2<f64>> = views.iter().flatten().map(|(_, off)| *off).collect();
    let rms_px = calibration.rms_px.max(1e-9);
    if offs.is_empty() {
        return words::TOO_FEW.into();
    }
    let (cloud, histogram) = area.split_left_right_at_fraction(0.5);
    let side = cloud.width().min(cloud.height()) - 12.0;
    let cloud = Rect::from_center_size(cloud.center(), vec2(side, side));
    let scale = f64::from(side) / (2.0 * SPAN * rms_px);
    let at =
        |off: &Vector2<f64>| cloud.center() + vec2((off.x * scale) as f32, (off.y * scale) as f32);
    let grey = Stroke::new(1.0, Color32::from_gray(90));
    painter.hline(cloud.x_range(), cloud.center().y, grey);
    painter.vline(cloud.center().x, cloud.y_range(), grey);
    for sds in [1.0, 2.0] {
        painter.circle_stroke(cloud.center(), (sds * rms_px * scale) as f32, grey);
    }
    // The chosen view's last, on top.
    let mut order: Vec<usize> = (0..views.len()).collect();
    order.sort_by_key(|place| *place == chosen);
    for place in order {
        let azimuth = snapshot.views.get(place).map_or(0.0, |view| view.tilt_azimuth_rad);
        let color = lit(place == chosen, theme::direction(azimuth));
        for (_, off) in &views[place] {
            let pos = at(off);
            if cloud.contains(pos) {
                painter.circle_filled(pos, 1.8, color);
            }
        }
    }
    bars(painter, histogram.shrink2(vec2(12.0, 18.0)), &offs, rms_px);
    words::scatter(offs.len(), rms_px)
}

/// Distribution of the residuals' components, beside the normal distribution.
fn bars(painter: &Painter, area: Rect, offs: &[Vector2<f64>], rms_px: f64) {
    let histogram = Histogram::of(offs, rms_px);
    let most = histogram.most();
    let wide = area.width() / BARS as f32;
    let up = |count: f64| area.bottom() - area.height() * (count / most) as f32;
    for (index, count) in histogram.counts.iter().enumerate() {
        let left = area.left() + index as f32 * wide;
        let bar =
            Rect::from_min_max(pos2(left, up(f64::from(*count))), pos2(left + wide, area.bottom()));
        painter.rect_filled(bar.shrink2(vec2(0.5, 0.0)), 0.0, theme::LIVE);
    }
    let curve = (0..=80).map(|i| {
        let sds = SPAN * (f64::from(i) / 40.0 - 1.0);
        pos2(area.center().x + (sds / SPAN) as f32 * 0.5 * area.width(), up(histogram.normal(sds)))
    });
    painter.add(Shape::line(curve.collect(), Stroke::new(1.5, theme::AMBER)));
    let font = FontId::proportional(theme::SMALL);
    for sds in [-2.0, 0.0, 2.0] {
        let x = area.center().x + (sds / SPAN) as f32 * 0.5 * area.width();
        let text = format!("{:.2} px", sds * rms_px);
        painter.text(
            pos2(x, area.bottom() + 2.0),
            Align2::CENTER_TOP,
            text,
            font.clone(),
            Color32::WHITE,
        );
    }
}
