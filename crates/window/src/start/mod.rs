//! The start page: camera, board and plan on one screen, before anything runs.

mod board;
mod camera;
mod markers;
mod shown_board;
mod start_page;

use egui::{
    Align, Align2, Button, CentralPanel, Direction, Layout, RichText, ScrollArea, Ui, UiBuilder,
    Vec2,
};

pub use start_page::{Choices, StartPage};

pub use shown_board::show as show_board;

use super::{
    keys::{UiAction, button},
    theme,
};
use boresight_guide::guidance::Plan;
use boresight_present::text::{Act, start as words, window};

/// Maximum size of the cards.
const LARGEST: Vec2 = Vec2::new(1320.0, 720.0);
/// Height of a card's heading.
const HEADING: f32 = 40.0;
/// Height of the start button.
const GO: f32 = 64.0;

/// Shows the page.
pub fn show(ui: &mut Ui, page: &mut StartPage, choices: &Choices, asks: &mut Vec<UiAction>) {
    CentralPanel::default().show(ui, |ui| {
        // On a large screen the cards stay together.
        let all = ui.available_rect_before_wrap();
        let size = all.size().min(LARGEST);
        let at = Align2::CENTER_CENTER.anchor_size(all.center(), size);
        let mut ui = ui.new_child(UiBuilder::new().max_rect(at));
        ui.spacing_mut().item_spacing.x = 2.0 * theme::UNIT;
        // Without the margins of a card.
        let high = ui.available_height() - 4.0 * theme::UNIT;
        ui.columns_const(|[left, middle, right]| {
            card(left, words::CAMERA, high, |ui| camera::show(ui, page, choices, asks));
            card(middle, words::BOARD, high, |ui| board::show(ui, page, choices, asks));
            card(right, words::START, high, |ui| start(ui, page, choices, asks));
        });
    });
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

fn card(ui: &mut Ui, heading: &str, high: f32, contents: impl FnOnce(&mut Ui)) {
    theme::card(ui.visuals()).show(ui, |ui| {
        // Columns stretch their contents; words and buttons keep their own width.
        ui.with_layout(Layout::top_down(Align::Min), |ui| {
            ui.set_width(ui.available_width());
            ui.spacing_mut().item_spacing = Vec2::new(theme::UNIT, 0.75 * theme::UNIT);
            ui.label(RichText::new(heading).size(theme::VERDICT).strong());
            ScrollArea::vertical()
                .id_salt(heading)
                .auto_shrink([false, false])
                .max_height(high - HEADING)
                .show(ui, contents);
        });
    });
}

fn start(ui: &mut Ui, page: &mut StartPage, choices: &Choices, asks: &mut Vec<UiAction>) {
    ui.label(RichText::new(words::PLAN).strong());
    for plan in [Plan::Quick, Plan::Adaptive, Plan::Full] {
        let (name, tip) = window::plan(plan);
        let label = format!("{name}, {}", words::duration(plan));
        ui.radio_value(&mut page.draft.plan, plan, label).on_hover_text(tip);
        ui.label(RichText::new(tip).small().weak());
    }
    ui.add_space(theme::UNIT);
    let mut full = choices.full_screen;
    if ui.checkbox(&mut full, words::FULL_SCREEN).on_hover_text(words::FULL_SCREEN_TIP).clicked() {
        asks.push(UiAction::FullScreenAfar(full));
    }
    ui.add_space(2.0 * theme::UNIT);
    for (number, step) in words::STEPS.iter().enumerate() {
        ui.label(format!("{}. {step}", number + 1));
    }
    let has_source = page.has_source(choices);
    let can = has_source && page.board_trouble().is_none();
    let missing = if has_source { words::NO_BOARD } else { words::NO_SOURCE };
    let label = RichText::new(words::GO).size(theme::VERDICT).strong().color(theme::ON_ACCENT);
    let size = Vec2::new(ui.available_width(), GO);
    // At the bottom, in the same place on every visit.
    ui.add_space((ui.available_height() - GO - 4.0 * theme::UNIT).max(theme::UNIT));
    let big = Button::new(label).fill(theme::ACCENT).min_size(size);
    let centred = Layout::centered_and_justified(Direction::LeftToRight);
    let response = ui.allocate_ui_with_layout(size, centred, |ui| ui.add_enabled(can, big));
    let response = response.inner.on_hover_text(words::GO_TIP);
    if response.on_disabled_hover_text(missing).clicked() {
        asks.push(UiAction::Start(Box::new(page.wish())));
    }
    if !can {
        ui.label(RichText::new(missing).strong());
    }
}
