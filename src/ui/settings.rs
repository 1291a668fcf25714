//! Settings of the window's looks and sounds.

use egui::{CentralPanel, RichText, ScrollArea, Slider, Ui};

use super::{
    keys::{UiAction, button, toggle},
    screen::Preferences,
    theme,
};
use boresight_present::text::{Act, settings as words, start};

/// Largest width of the cards.
const MOST: f32 = 720.0;

/// Shows the page. `no_voice` says why nothing can be heard.
pub fn show(
    ui: &mut Ui,
    preferences: &Preferences,
    no_voice: Option<&str>,
    asks: &mut Vec<UiAction>,
) {
    CentralPanel::default().show(ui, |ui| {
        ScrollArea::vertical().auto_shrink([false, false]).show(ui, |ui| {
            ui.set_max_width(MOST);
            let card = |ui: &mut Ui, heading: &str, contents: &mut dyn FnMut(&mut Ui)| {
                theme::card(ui.visuals()).show(ui, |ui| {
                    ui.set_width(ui.available_width());
                    ui.label(RichText::new(heading).size(theme::TITLE).strong());
                    ui.add_space(0.5 * theme::UNIT);
                    contents(ui);
                });
                ui.add_space(theme::UNIT);
            };
            card(ui, words::SESSION, &mut |ui| {
                ui.horizontal_wrapped(|ui| {
                    toggle(ui, Act::Mirror, preferences.mirrored, asks);
                    toggle(ui, Act::Panels, preferences.panels, asks);
                    toggle(ui, Act::Lines, preferences.lines, asks);
                });
                let mut full = preferences.full_screen;
                let response = ui.checkbox(&mut full, start::FULL_SCREEN);
                if response.on_hover_text(start::FULL_SCREEN_TIP).clicked() {
                    asks.push(UiAction::FullScreenAfar(full));
                }
            });
            card(ui, words::SOUND, &mut |ui| {
                ui.horizontal_wrapped(|ui| {
                    toggle(ui, Act::Tone, preferences.tone, asks);
                    toggle(ui, Act::Speech, preferences.speech, asks);
                    let test = ui.button(words::TEST_VOICE).on_hover_text(words::TEST_VOICE_TIP);
                    if test.clicked() {
                        asks.push(UiAction::TestVoice);
                    }
                });
                if let Some(why) = no_voice {
                    let color = theme::palette(ui.visuals()).bad;
                    ui.label(RichText::new(why).size(theme::BODY).color(color));
                }
            });
            card(ui, words::WINDOW, &mut |ui| {
                ui.horizontal_wrapped(|ui| {
                    button(ui, Act::Theme, asks);
                    button(ui, Act::FullScreen, asks);
                    button(ui, Act::Help, asks);
                });
                zoom(ui);
            });
            ui.label(RichText::new(words::NEXT).weak());
            button(ui, Act::StartPage, asks);
        });
    });
}

fn zoom(ui: &mut Ui) {
    let mut zoom = ui.ctx().zoom_factor();
    let slider = Slider::new(&mut zoom, 0.5..=3.0).step_by(0.25).text(words::ZOOM);
    let response = ui.add(slider).on_hover_text(words::ZOOM_TIP);
    // While it is dragged, a new size would move the slider away from the pointer.
    if response.changed() && !response.dragged() || response.drag_stopped() {
        ui.ctx().set_zoom_factor(zoom);
    }
}
