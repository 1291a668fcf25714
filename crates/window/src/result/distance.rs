//! Error of a point's position by the camera, against distance.

use egui::{Align2, Color32, FontId, Painter, Rect, Shape, Stroke, pos2, vec2};

use super::super::theme;
use boresight_calibrate::Calibration;
use boresight_present::text::{charts as words, knows_sd};

/// Distances of the axis, metres.
const FROM_M: f64 = 0.2;
const TO_M: f64 = 20.0;

/// Draws the curves of the mean and of the worst place in the picture, and the words below.
pub(super) fn draw(painter: &Painter, area: Rect, calibration: &Calibration) -> String {
    if !knows_sd(calibration) {
        return words::TOO_FEW.into();
    }
    let sd = &calibration.projection_sd;
    let f_px = calibration.camera.f_px.mean();
    let off_m = |sd_px: f64, distance_m: f64| distance_m * sd_px / f_px;
    let inner = Rect::from_min_max(area.min + vec2(54.0, 12.0), area.max - vec2(14.0, 26.0));
    let (low, high) = (off_m(sd.mean_px, FROM_M).max(1e-12), off_m(sd.max_px, TO_M).max(1e-11));
    let across = |distance_m: f64| (distance_m / FROM_M).ln() / (TO_M / FROM_M).ln();
    let up = |aside_m: f64| (aside_m / low).ln() / (high / low).ln().max(1e-9);
    let at = |distance_m: f64, aside_m: f64| {
        pos2(
            inner.left() + across(distance_m) as f32 * inner.width(),
            inner.bottom() - up(aside_m) as f32 * inner.height(),
        )
    };
    let (grey, font) =
        (Stroke::new(1.0, Color32::from_gray(70)), FontId::proportional(theme::SMALL));
    for distance_m in [0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0] {
        let x = at(distance_m, low).x;
        painter.vline(x, inner.y_range(), grey);
        let text = format!("{distance_m} m");
        painter.text(
            pos2(x, inner.bottom() + 4.0),
            Align2::CENTER_TOP,
            text,
            font.clone(),
            Color32::WHITE,
        );
    }
    for power in -9..2 {
        let aside_m = 10_f64.powi(power);
        if (low..=high).contains(&aside_m) {
            let y = at(FROM_M, aside_m).y;
            painter.hline(inner.x_range(), y, grey);
            let text = words::millimetres(aside_m);
            painter.text(
                pos2(inner.left() - 4.0, y),
                Align2::RIGHT_CENTER,
                text,
                font.clone(),
                Color32::WHITE,
            );
        }
    }
    for (sd_px, color, name) in
        [(sd.mean_px, theme::LIVE, words::MEAN), (sd.max_px, theme::AMBER, words::WORST_PLACE)]
    {
        let ends = [FROM_M, TO_M].map(|distance_m| at(distance_m, off_m(sd_px, distance_m)));
        painter.add(Shape::line(ends.to_vec(), Stroke::new(2.5, color)));
        let place = at(2.0, off_m(sd_px, 2.0)) + vec2(0.0, -6.0);
        let font = FontId::proportional(theme::BODY);
        painter.text(place, Align2::RIGHT_BOTTOM, name, font, color);
    }
    words::at_a_distance(off_m(sd.mean_px, 1.0), off_m(sd.max_px, 1.0))
}
