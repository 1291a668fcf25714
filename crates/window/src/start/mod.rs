//! The start page: the live picture, the board in view, and a sheet with all choices.

mod board;
mod camera;
mod live;
mod markers;
mod shown_board;
mod start_page;

use egui::{CentralPanel, Panel, RichText, ScrollArea, Ui};

pub use start_page::{Choices, StartPage};

pub use shown_board::show as show_board;

use super::{
    keys::{UiAction, button},
    theme,
};
use boresight_guide::guidance::Plan;
use boresight_present::text::{Act, start as words, window};

/// Width of the sheet.
const SHEET: f32 = 400.0;

/// Shows the page.
pub fn show(ui: &mut Ui, page: &mut StartPage, choices: &Choices, asks: &mut Vec<UiAction>) {
    if page.is_changing {
        Panel::right("change").resizable(false).exact_size(SHEET).show(ui, |ui| {
            ScrollArea::vertical().auto_shrink([false, false]).show(ui, |ui| {
                ui.spacing_mut().item_spacing.y = 0.75 * theme::UNIT;
                heading(ui, words::BOARD);
                board::show(ui, page, choices, asks);
                heading(ui, words::PLAN);
                plan(ui, page, choices, asks);
                heading(ui, words::CAMERA);
                camera::show(ui, page, choices, asks);
            });
        });
    }
    CentralPanel::no_frame().show(ui, |ui| live::show(ui, page, choices, asks));
}

fn heading(ui: &mut Ui, words: &str) {
    ui.add_space(theme::UNIT);
    ui.label(RichText::new(words).size(theme::TITLE).strong());
}

/// Shows the page during a session: its camera isn't free.
pub fn show_running(ui: &mut Ui, asks: &mut Vec<UiAction>) {
    CentralPanel::default().show(ui, |ui| {
        theme::card(ui.visuals()).show(ui, |ui| {
            ui.set_width(ui.available_width());
            ui.label(RichText::new(words::RUNNING).size(theme::TITLE).strong());
            ui.label(words::RUNNING_ACTION);
            ui.add_space(theme::UNIT);
            ui.horizontal(|ui| {
                if ui.button(words::BACK).clicked() {
                    asks.push(UiAction::Act(Act::GuidePage));
                }
                button(ui, Act::Finish, asks);
            });
        });
    });
}

fn plan(ui: &mut Ui, page: &mut StartPage, choices: &Choices, asks: &mut Vec<UiAction>) {
    for plan in [Plan::Quick, Plan::Adaptive, Plan::Full] {
        let (name, tip) = window::plan(plan);
        let label = format!("{name}, {}", words::duration(plan));
        ui.radio_value(&mut page.draft.plan, plan, label).on_hover_text(tip);
        ui.label(RichText::new(tip).small().weak());
    }
    let mut full = choices.full_screen;
    if ui.checkbox(&mut full, words::FULL_SCREEN).on_hover_text(words::FULL_SCREEN_TIP).clicked() {
        asks.push(UiAction::FullScreenAfar(full));
    }
}
