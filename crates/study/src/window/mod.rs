//! The explore page: play with the effect of lens distortion on principal lines.

mod controls;
mod explored;
mod picture;

pub use explored::Explored;

use egui::{CentralPanel, CollapsingHeader, Frame, Panel, RichText, ScrollArea, Ui};

use crate::explore::{Boards, ExploreSetup, Seen};
use boresight::ui::theme;
use boresight_present::text::explore as words;

/// Shows the page.
pub fn show(ui: &mut Ui, explored: &mut Explored) {
    let mut wish = explored.wish.clone();
    let mut changed = false;
    Panel::right("explore").resizable(false).exact_size(PANEL).show(ui, |ui| {
        ScrollArea::vertical().auto_shrink([false, false]).show(ui, |ui| {
            changed |= controls::show(ui, &mut wish);
            ui.add_space(theme::UNIT);
            theme::card(ui.visuals()).show(ui, |ui| {
                ui.set_width(ui.available_width());
                let heading = RichText::new(words::NUMBERS).strong();
                CollapsingHeader::new(heading).default_open(true).show(ui, |ui| {
                    numbers(ui, &explored.seen, &wish);
                });
            });
        });
    });
    CentralPanel::no_frame().frame(Frame::new().fill(theme::BAND)).show(ui, |ui| {
        changed |= picture::show(ui, &mut wish, &explored.seen);
    });
    if changed {
        explored.change(|now| *now = wish);
        ui.ctx().request_repaint();
    }
}

/// Width of the controls.
const PANEL: f32 = 360.0;

fn numbers(ui: &mut Ui, seen: &Seen, wish: &ExploreSetup) {
    let mut lines = Vec::new();
    match &seen.deflection {
        Some(row) => lines.extend(words::deflection(row.offset_px, row.angle_rad)),
        None => lines.push(words::no_line()),
    }
    if let Some((sum_px, angle_rad)) = seen.pair_sum_px.zip(seen.pair_angle_rad) {
        lines.extend(words::pair(sum_px, angle_rad));
    }
    if let (Some(meet), Boards::TwoPairs | Boards::Eight) = (&seen.meet_px, wish.boards) {
        lines.push(words::meet((meet - wish.setup.camera.pp_px).norm()));
    }
    if let Some(rms_px) = seen.skipped_rms_px.filter(|_| wish.skipped > 0) {
        lines.push(words::skipped(seen.skipped_px.len(), rms_px));
    }
    for (name, value, tip) in lines {
        ui.label(RichText::new(name).weak()).on_hover_text(tip);
        ui.label(RichText::new(value).size(theme::TITLE).strong()).on_hover_text(tip);
    }
}
