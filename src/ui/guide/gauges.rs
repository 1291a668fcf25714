//! Gauges: measurements of the newest frame against the wanted values.

use egui::{Color32, RichText, Sense, Stroke, Ui, Vec2, pos2};
use nalgebra::Point2;

use super::super::{screen::Screen, theme};
use boresight_guide::{
    guidance::{HOLD_WIDTHS_PER_SEC, direction_difference_rad},
    session::{Snapshot, lateral_offset_px},
};
use boresight_present::text::window::Gauge;

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Reading {
    /// Measured value, if there is one.
    pub(super) value: Option<f64>,
    /// Lowest and highest good value.
    pub(super) wanted: (f64, f64),
    /// Ends of the scale.
    pub(super) scale: (f64, f64),
}

/// Reads `gauge` off the snapshot.
pub(super) fn reading(gauge: Gauge, snapshot: &Snapshot) -> Reading {
    let live = snapshot.live.as_deref();
    let measured = live.and_then(|live| live.measured.as_ref());
    let target = snapshot.target.as_ref();
    let width_px = f64::from(snapshot.setup.image_size.width_px);
    let read = |value, wanted, scale| Reading { value, wanted, scale };
    match gauge {
        Gauge::Tilt => {
            let asked_rad = target.map_or(0.0, |target| target.tilt_rad);
            read(
                measured.and_then(|measured| measured.tilt_rad),
                (NEAR.0 * asked_rad, NEAR.1 * asked_rad),
                (0.0, 75_f64.to_radians()),
            )
        }
        Gauge::Direction => {
            let off = measured.zip(target).map(|(m, target)| {
                direction_difference_rad(m.tilt_azimuth_rad, target.tilt_azimuth_rad)
            });
            let limit = NEAR_DIRECTION_RAD;
            read(off, (-limit, limit), (-std::f64::consts::FRAC_PI_2, std::f64::consts::FRAC_PI_2))
        }
        Gauge::Size => {
            let asked =
                target.map_or(0.0, |target| target.span_fraction(snapshot.setup.image_size));
            read(measured.map(|m| m.span_fraction), (NEAR.0 * asked, 1.0), (0.0, 1.0))
        }
        Gauge::Across => {
            let pp = &snapshot.pp_px;
            let wanted = target.map_or(0.0, |target| {
                lateral_offset_px(target.tilt_azimuth_rad, &middle(&target.ghost_px), pp)
            });
            let limit = NEAR_PLACE_WIDTHS * width_px;
            let off = measured.map(|m| m.lateral_offset_px - wanted);
            read(off, (-limit, limit), (-4.0 * limit, 4.0 * limit))
        }
        Gauge::Still => {
            let limit = HOLD_WIDTHS_PER_SEC * width_px;
            read(live.and_then(|live| live.speed_px_per_s), (0.0, limit), (0.0, 4.0 * limit))
        }
        Gauge::Sharp => {
            let limit = SHARP_PX;
            read(live.and_then(|live| live.blur_px), (0.0, limit), (0.0, 2.0 * limit))
        }
    }
}

fn middle(points: &[Point2<f64>]) -> Point2<f64> {
    let sum = points.iter().fold(nalgebra::Vector2::zeros(), |sum, p| sum + p.coords);
    Point2::from(sum / points.len().max(1) as f64)
}

/// Shares of the tilt and the size asked for that are drawn as good. A gauge limits nothing.
const NEAR: (f64, f64) = (0.75, 1.4);
const NEAR_DIRECTION_RAD: f64 = 22.5 * std::f64::consts::PI / 180.0;
const NEAR_PLACE_WIDTHS: f64 = 0.04;
const SHARP_PX: f64 = 3.5;

pub(super) fn show(ui: &mut Ui, screen: &Screen) {
    let Some(snapshot) = &screen.snapshot else { return };
    for gauge in Gauge::ALL {
        let reading = reading(gauge, snapshot);
        let words = gauge.words(reading.value, reading.wanted);
        ui.spacing_mut().item_spacing = Vec2::new(4.0, 1.0);
        ui.horizontal(|ui| {
            ui.label(RichText::new(gauge.name()).size(theme::SMALL).strong())
                .on_hover_text(gauge.tip());
            ui.label(RichText::new(words).size(theme::SMALL)).on_hover_text(gauge.tip());
        });
        bar(ui, &reading);
        ui.add_space(3.0);
    }
}

fn bar(ui: &mut Ui, reading: &Reading) {
    let (rect, _) = ui.allocate_exact_size(Vec2::new(ui.available_width(), 6.0), Sense::hover());
    let painter = ui.painter_at(rect.expand(2.0));
    let (low, high) = reading.scale;
    let at = |value: f64| {
        let share = ((value - low) / (high - low)).clamp(0.0, 1.0) as f32;
        rect.left() + share * rect.width()
    };
    painter.rect_filled(rect, 3.0, ui.visuals().extreme_bg_color);
    let good = egui::Rect::from_min_max(
        pos2(at(reading.wanted.0), rect.top()),
        pos2(at(reading.wanted.1), rect.bottom()),
    );
    painter.rect_filled(good, 3.0, theme::GREEN.gamma_multiply(0.35));
    let Some(value) = reading.value else { return };
    let is_good = (reading.wanted.0..=reading.wanted.1).contains(&value);
    let color: Color32 = if is_good { theme::GREEN } else { theme::AMBER };
    painter.vline(
        at(value),
        rect.expand(2.0).y_range(),
        Stroke::new(6.0, ui.visuals().strong_text_color()),
    );
    painter.vline(at(value), rect.expand(1.0).y_range(), Stroke::new(4.0, color));
}
