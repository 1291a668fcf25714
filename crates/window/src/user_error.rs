//! A failed start of a session: the error, the next action, and another try.

use egui::{CentralPanel, RichText, Ui};

use super::{aloud, keys::UiAction, theme};
use boresight_app::{explain::UserError, window::services::SessionRequest};
use boresight_present::text::{self, Act, window as words};

/// Shows the page.
pub fn show(ui: &mut Ui, trouble: &UserError, wish: &SessionRequest, asks: &mut Vec<UiAction>) {
    CentralPanel::default().show(ui, |ui| {
        ui.vertical_centered(|ui| {
            ui.add_space(0.12 * ui.available_height());
            ui.set_max_width(760.0);
            ui.label(RichText::new(words::NOT_STARTED).size(theme::VERDICT).strong());
            ui.add_space(16.0);
            let what = text::camera::capital(&trouble.what);
            aloud::read_next(&ui.label(RichText::new(what).size(theme::TITLE)));
            if let Some(action) = &trouble.action {
                ui.add_space(8.0);
                aloud::read_next(&ui.label(RichText::new(action).size(theme::TITLE).strong()));
            }
            ui.add_space(24.0);
            let again = RichText::new(words::TRY_AGAIN).size(theme::TITLE);
            if ui.button(again).on_hover_text(words::TRY_AGAIN_TIP).clicked() {
                asks.push(UiAction::Open(Box::new(wish.clone())));
            }
            ui.add_space(8.0);
            let other = RichText::new(words::OTHER_SOURCE).size(theme::TITLE);
            if ui.button(other).on_hover_text(Act::StartPage.words().tip).clicked() {
                asks.push(UiAction::Act(Act::StartPage));
            }
            ui.add_space(8.0);
            let simulated = RichText::new(words::SIMULATED).size(theme::TITLE);
            if ui.button(simulated).on_hover_text(words::SIMULATED_TIP).clicked() {
                let wish =
                    SessionRequest { source: "sim".into(), go_on_with: None, ..wish.clone() };
                asks.push(UiAction::Open(Box::new(wish)));
            }
        });
    });
}
