//! Gauges: measurements of the newest frame beside those of the target. Only the subject of the
//! sentence is amber.

use egui::{Color32, RichText, Sense, Stroke, Ui, Vec2, pos2};

use super::super::{screen::Screen, theme};
use boresight_present::{
    instruction::{Instruction, Moment},
    reading::{Reading, reading},
    text::window::Gauge,
};

pub(super) fn show(ui: &mut Ui, screen: &Screen, instruction: Option<&Instruction>) {
    // Without a request there is nothing to aim for.
    let snapshot = screen.snapshot.as_ref().filter(|snapshot| snapshot.target.is_some());
    let Some(snapshot) = snapshot else { return };
    for gauge in Gauge::ALL {
        let reading = reading(gauge, snapshot);
        let words = gauge.words(reading.value, reading.aim);
        ui.spacing_mut().item_spacing = Vec2::new(4.0, 1.0);
        ui.horizontal(|ui| {
            ui.label(RichText::new(gauge.name()).size(theme::SMALL).strong())
                .on_hover_text(gauge.tip());
            ui.label(RichText::new(words).size(theme::SMALL)).on_hover_text(gauge.tip());
        });
        bar(ui, &reading, color(gauge, instruction, ui.visuals().weak_text_color()));
        ui.add_space(3.0);
    }
}

/// Colour of a gauge: amber for the subject of the sentence; good throughout a hold.
fn color(gauge: Gauge, instruction: Option<&Instruction>, plain: Color32) -> Color32 {
    match instruction {
        Some(instruction) if instruction.lacks == Some(gauge) => theme::AMBER,
        Some(instruction) if instruction.moment == Moment::Hold => theme::GREEN,
        _ => plain,
    }
}

fn bar(ui: &mut Ui, reading: &Reading, color: Color32) {
    let (rect, _) = ui.allocate_exact_size(Vec2::new(ui.available_width(), 6.0), Sense::hover());
    let painter = ui.painter_at(rect.expand(2.0));
    let (low, high) = reading.scale;
    let at = |value: f64| {
        let share = ((value - low) / (high - low)).clamp(0.0, 1.0) as f32;
        rect.left() + share * rect.width()
    };
    painter.rect_filled(rect, 3.0, ui.visuals().extreme_bg_color);
    let good = egui::Rect::from_min_max(
        pos2(at(reading.good.0), rect.top()),
        pos2(at(reading.good.1), rect.bottom()),
    );
    painter.rect_filled(good, 3.0, theme::GREEN.gamma_multiply(0.35));
    let Some(value) = reading.value else { return };
    painter.vline(
        at(value),
        rect.expand(2.0).y_range(),
        Stroke::new(6.0, ui.visuals().strong_text_color()),
    );
    painter.vline(at(value), rect.expand(1.0).y_range(), Stroke::new(4.0, color));
}
