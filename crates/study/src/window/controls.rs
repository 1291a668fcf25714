//! Sliders and choices.

use std::{f64::consts::TAU, ops::RangeInclusive};

use egui::{Button, Grid, RichText, Slider, Ui, Vec2};

use super::explored::Explored;
use crate::explore::{Boards, ExploreSetup};
use boresight::ui::theme;
use boresight_present::text::explore as words;

/// Shows the controls. Returns true if anything was changed.
pub(super) fn show(ui: &mut Ui, wish: &mut ExploreSetup) -> bool {
    let mut changed = false;
    let card = theme::card(ui.visuals());
    card.show(ui, |ui| {
        ui.set_width(ui.available_width());
        ui.label(words::INTRODUCTION);
        ui.add_space(0.5 * theme::UNIT);
        changed |= boards(ui, wish);
    });
    ui.add_space(theme::UNIT);
    card.show(ui, |ui| {
        ui.set_width(ui.available_width());
        ui.label(RichText::new(words::CAMERA_AND_BOARD).size(theme::TITLE).strong());
        let spacing = Vec2::new(theme::UNIT, 0.75 * theme::UNIT);
        Grid::new("sliders").num_columns(2).spacing(spacing).show(ui, |ui| {
            changed |= sliders(ui, wish);
        });
        let (name, tip) = words::RESET;
        if ui.button(name).on_hover_text(tip).clicked() {
            *wish = Explored::default().wish;
            changed = true;
        }
    });
    changed
}

/// Choice of the boards shown: two choices side by side.
fn boards(ui: &mut Ui, wish: &mut ExploreSetup) -> bool {
    let mut changed = false;
    let choices = [Boards::One, Boards::Pair, Boards::TwoPairs, Boards::Eight];
    let wide = 0.5 * (ui.available_width() - theme::UNIT);
    for row in [0, 2] {
        ui.horizontal(|ui| {
            for (boards, (name, tip)) in choices.into_iter().zip(words::BOARDS).skip(row).take(2) {
                let button = Button::new(name).selected(wish.boards == boards);
                let button = ui.add_sized([wide, 3.0 * theme::UNIT], button);
                if button.on_hover_text(tip).clicked() {
                    wish.boards = boards;
                    changed = true;
                }
            }
        });
    }
    changed
}

fn sliders(ui: &mut Ui, wish: &mut ExploreSetup) -> bool {
    let mut changed = false;
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
        changed |= row(ui, words::SKIPPED, Slider::new(&mut wish.skipped, 0..=5));
    }
    changed
}

type Words = (&'static str, &'static str);

/// Slider with a name in front.
fn row(ui: &mut Ui, (name, tip): Words, slider: Slider<'_>) -> bool {
    let name = ui.label(RichText::new(name).weak()).on_hover_text(tip);
    let changed = ui.add(slider).labelled_by(name.id).on_hover_text(tip).changed();
    ui.end_row();
    changed
}

fn angle(ui: &mut Ui, value: &mut f64, range: RangeInclusive<f64>, named: Words) -> bool {
    let slider = Slider::new(value, range)
        .custom_formatter(|value, _| words::degrees(value))
        .custom_parser(words::parsed_degrees);
    row(ui, named, slider)
}

fn length(ui: &mut Ui, value: &mut f64, range: RangeInclusive<f64>, named: Words) -> bool {
    let slider = Slider::new(value, range)
        .custom_formatter(|value, _| words::millimetres(value))
        .custom_parser(words::parsed_millimetres);
    row(ui, named, slider)
}

fn number(ui: &mut Ui, value: &mut f64, range: RangeInclusive<f64>, named: Words) -> bool {
    row(ui, named, Slider::new(value, range).fixed_decimals(3))
}
