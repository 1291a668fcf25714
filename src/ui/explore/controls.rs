//! Sliders and choices.

use std::{f64::consts::TAU, ops::RangeInclusive};

use egui::{Button, RichText, Slider, Ui};

use super::{super::theme, explored::Explored};
use crate::{
    study::explore::{Boards, ExploreSetup},
    text::explore as words,
};

/// Shows them. Returns whether anything was changed.
pub(super) fn show(ui: &mut Ui, wish: &mut ExploreSetup) -> bool {
    let mut changed = false;
    ui.label(RichText::new(words::INTRODUCTION).size(theme::BODY));
    ui.add_space(4.0);
    let choices = [Boards::One, Boards::Pair, Boards::TwoPairs, Boards::Eight];
    ui.horizontal_wrapped(|ui| {
        for (boards, (name, tip)) in choices.into_iter().zip(words::BOARDS) {
            let button = Button::selectable(wish.boards == boards, name);
            if ui.add(button).on_hover_text(tip).clicked() {
                wish.boards = boards;
                changed = true;
            }
        }
    });
    ui.add_space(4.0);
    let [direction, across, along, k1, k2, tilt, distance] = words::SLIDERS;
    let distortion = &mut wish.setup.camera.distortion;
    changed |= angle(ui, &mut wish.slot_rad, 0.0..=TAU, direction);
    changed |= length(ui, &mut wish.shift_m.x, -0.6..=0.6, across);
    changed |= length(ui, &mut wish.shift_m.y, -0.6..=0.6, along);
    changed |= number(ui, &mut distortion.k1, -0.4..=0.2, k1);
    changed |= number(ui, &mut distortion.k2, -0.1..=0.2, k2);
    changed |= angle(ui, &mut wish.setup.tilt_rad, 0.0..=1.2, tilt);
    changed |= length(ui, &mut wish.setup.distance_m, 1.2..=6.0, distance);
    if wish.boards == Boards::Eight {
        let (name, tip) = words::SKIPPED;
        let slider = Slider::new(&mut wish.skipped, 0..=5).text(name);
        changed |= ui.add(slider).on_hover_text(tip).changed();
    }
    let (name, tip) = words::RESET;
    if ui.button(name).on_hover_text(tip).clicked() {
        *wish = Explored::default().wish;
        changed = true;
    }
    changed
}

type Words = (&'static str, &'static str);

fn angle(ui: &mut Ui, value: &mut f64, range: RangeInclusive<f64>, (name, tip): Words) -> bool {
    let slider = Slider::new(value, range)
        .text(name)
        .custom_formatter(|value, _| words::degrees(value))
        .custom_parser(words::parsed_degrees);
    ui.add(slider).on_hover_text(tip).changed()
}

fn length(ui: &mut Ui, value: &mut f64, range: RangeInclusive<f64>, (name, tip): Words) -> bool {
    let slider = Slider::new(value, range)
        .text(name)
        .custom_formatter(|value, _| words::millimetres(value))
        .custom_parser(words::parsed_millimetres);
    ui.add(slider).on_hover_text(tip).changed()
}

fn number(ui: &mut Ui, value: &mut f64, range: RangeInclusive<f64>, (name, tip): Words) -> bool {
    let slider = Slider::new(value, range).text(name).fixed_decimals(3);
    ui.add(slider).on_hover_text(tip).changed()
}
