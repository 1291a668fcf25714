//! Eight directions around a circle, partners opposite each other.

use std::f64::consts::PI;

use egui::{Align2, Color32, FontId, Sense, Stroke, Ui, Vec2, WidgetInfo, accesskit::Role};

use super::super::{screen::Screen, theme};
use boresight_present::text::window::{WHEEL, WHEEL_TIP, slot_state};

/// Height of the area below the wheel.
const BELOW: f32 = 366.0;

/// Shows the wheel, as large as a panel of height `high` allows.
pub(super) fn show(ui: &mut Ui, screen: &Screen, high: f32) {
    let Some(snapshot) = &screen.snapshot else { return };
    let mirrored = screen.preferences.mirrored;
    let side = (high - BELOW).clamp(110.0, 190.0);
    let (rect, response) =
        ui.allocate_exact_size(Vec2::new(ui.available_width(), side), Sense::hover());
    let painter = ui.painter_at(rect);
    let (centre, radius) = (rect.center(), 0.5 * side - 18.0);
    let towards = |direction_rad: f64| {
        let across = if mirrored { PI - direction_rad } else { direction_rad };
        Vec2::angled(across as f32)
    };
    let line = ui.visuals().weak_text_color();
    painter.circle_stroke(centre, radius, Stroke::new(1.0, line.gamma_multiply(0.5)));
    for pair in snapshot.pairs.iter() {
        let ends = [pair.first, pair.second]
            .map(|view| centre + radius * towards(snapshot.views[view].tilt_azimuth_rad));
        let color = theme::direction(snapshot.views[pair.first].tilt_azimuth_rad);
        painter.line_segment(ends, Stroke::new(3.0, color));
    }
    let slots = snapshot.wheel();
    for slot in slots {
        let at = centre + radius * towards(slot.slot_rad);
        match slot.view {
            Some(view) => {
                painter.circle_filled(
                    at,
                    11.0,
                    theme::direction(snapshot.views[view].tilt_azimuth_rad),
                );
                let number = snapshot.views[view].number.to_string();
                let font = FontId::proportional(12.0);
                painter.text(at, Align2::CENTER_CENTER, number, font, Color32::BLACK);
            }
            None => {
                painter.circle_filled(at, 9.0, ui.visuals().extreme_bg_color);
                painter.circle_stroke(at, 9.0, Stroke::new(1.0, line));
            }
        }
        if slot.wanted {
            painter.circle_stroke(at, 14.0, Stroke::new(3.0, theme::AMBER));
        }
    }
    if let Some(measured) = snapshot.live.as_ref().and_then(|live| live.measured.as_ref()) {
        let tip = 0.72 * radius * towards(measured.tilt_azimuth_rad);
        painter.arrow(centre, tip, Stroke::new(3.0, theme::LIVE));
    }
    let states = slots.map(|slot| {
        let taken = slot.view.map(|view| snapshot.views[view].number);
        slot_state(slot.slot_rad, taken, slot.wanted, mirrored)
    });
    response.widget_info(|| {
        WidgetInfo::labeled(Role::Image, true, format!("{WHEEL}: {}", states.join("; ")))
    });
    response.on_hover_text(format!("{WHEEL_TIP}\n\n{}", states.join("\n")));
}
