//! Settings of the next session, and how the window looks and sounds.

use egui::{CentralPanel, ComboBox, DragValue, Grid, RichText, ScrollArea, Slider, TextEdit, Ui};

use super::{
    keys::{UiAction, button, toggle},
    screen::Preferences,
};
use crate::{
    app::host::SessionRequest,
    guidance::Plan,
    text::{Act, explore, settings as words, window},
};

/// What can be chosen.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Offered {
    /// Sources: a name, and what it is.
    pub sources: Vec<(String, String)>,
    /// Modes of the source that is named.
    pub modes: Vec<String>,
}

/// Shows the page; `draft` is what the next session will be about.
pub fn show(
    ui: &mut Ui,
    draft: &mut SessionRequest,
    offered: &Offered,
    preferences: &Preferences,
    asks: &mut Vec<UiAction>,
) {
    CentralPanel::default().show(ui, |ui| {
        ScrollArea::vertical().auto_shrink([false, false]).show(ui, |ui| {
            ui.label(RichText::new(words::NEXT).size(24.0).strong());
            Grid::new("next session").num_columns(2).spacing([24.0, 10.0]).show(ui, |ui| {
                source(ui, draft, offered);
                board(ui, draft);
                plan(ui, draft);
            });
            ui.add_space(10.0);
            let start = RichText::new(words::START).size(20.0);
            if ui.button(start).on_hover_text(words::START_TIP).clicked() {
                let wish = SessionRequest { go_on_with: None, first: None, ..draft.clone() };
                asks.push(UiAction::Open(Box::new(wish)));
            }
            ui.add_space(20.0);
            ui.label(RichText::new(words::WINDOW).size(24.0).strong());
            ui.horizontal_wrapped(|ui| {
                toggle(ui, Act::Mirror, preferences.mirrored, asks);
                toggle(ui, Act::Tone, preferences.tone, asks);
                toggle(ui, Act::Speech, preferences.speech, asks);
                toggle(ui, Act::Panels, preferences.panels, asks);
                button(ui, Act::Theme, asks);
                button(ui, Act::FullScreen, asks);
                button(ui, Act::Help, asks);
            });
            let mut zoom = ui.ctx().zoom_factor();
            let slider = Slider::new(&mut zoom, 0.5..=3.0).step_by(0.25).text(words::ZOOM);
            let response = ui.add(slider).on_hover_text(words::ZOOM_TIP);
            // While it is dragged, a new size would move the slider away from the pointer.
            if response.changed() && !response.dragged() || response.drag_stopped() {
                ui.ctx().set_zoom_factor(zoom);
            }
        });
    });
}

fn source(ui: &mut Ui, draft: &mut SessionRequest, offered: &Offered) {
    let name = ui.label(words::SOURCE).on_hover_text(words::SOURCE_TIP);
    ui.horizontal(|ui| {
        let list = ComboBox::from_id_salt("source").selected_text(words::CHOOSE);
        let list = list.show_ui(ui, |ui| {
            for (name, what) in &offered.sources {
                ui.selectable_value(&mut draft.source, name.clone(), format!("{what} ({name})"));
            }
        });
        list.response.labelled_by(name.id).on_hover_text(words::SOURCE_TIP);
        let field = TextEdit::singleline(&mut draft.source).desired_width(420.0);
        ui.add(field).labelled_by(name.id).on_hover_text(words::SOURCE_TIP);
    });
    ui.end_row();
    let name = ui.label(words::MODE).on_hover_text(words::MODE_TIP);
    ui.horizontal(|ui| {
        if !offered.modes.is_empty() {
            let list = ComboBox::from_id_salt("mode").selected_text(words::CHOOSE);
            let list = list.show_ui(ui, |ui| {
                for mode in std::iter::once("auto").chain(offered.modes.iter().map(String::as_str))
                {
                    ui.selectable_value(&mut draft.mode, mode.to_owned(), mode);
                }
            });
            list.response.labelled_by(name.id).on_hover_text(words::MODE_TIP);
        }
        let field = TextEdit::singleline(&mut draft.mode).desired_width(180.0);
        ui.add(field).labelled_by(name.id).on_hover_text(words::MODE_TIP);
        ui.label(RichText::new(words::MODE_WHEN).weak());
    });
    ui.end_row();
}

fn board(ui: &mut Ui, draft: &mut SessionRequest) {
    let name = ui.label(words::BOARD).on_hover_text(words::BOARD_TIP);
    ui.horizontal(|ui| {
        for (corners, word) in draft.board.iter_mut().zip(words::CORNERS) {
            ui.add(DragValue::new(corners).range(3..=99).suffix(word))
                .labelled_by(name.id)
                .on_hover_text(words::BOARD_TIP);
        }
    });
    ui.end_row();
    let name = ui.label(words::SQUARE).on_hover_text(words::SQUARE_TIP);
    let square = DragValue::new(&mut draft.square_m)
        .range(0.0001..=9.9)
        .speed(0.0005)
        .custom_formatter(|length_m, _| explore::millimetres(length_m))
        .custom_parser(explore::parsed_millimetres);
    ui.add(square).labelled_by(name.id).on_hover_text(words::SQUARE_TIP);
    ui.end_row();
}

fn plan(ui: &mut Ui, draft: &mut SessionRequest) {
    ui.label(words::PLAN).on_hover_text(words::PLAN_TIP);
    ui.horizontal(|ui| {
        for plan in [Plan::Quick, Plan::Full, Plan::Adaptive] {
            let (name, tip) = window::plan(plan);
            ui.radio_value(&mut draft.plan, plan, name).on_hover_text(tip);
        }
    });
    ui.end_row();
}
