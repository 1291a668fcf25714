//! Choice of the recording to open.

use std::path::PathBuf;

use egui::{Button, CentralPanel, Grid, Key, RichText, ScrollArea, TextEdit, Ui, Vec2};

use super::super::{
    keys::{UiAction, button},
    theme,
};
use boresight_app::{host::UserError, recordings::Recording};
use boresight_present::text::{Act, replay as words};

/// State of the page that stands while no recording is open.
#[derive(Clone, Debug, Default)]
pub struct Picker {
    /// The folder, as it is typed.
    pub path: String,
    /// Recordings that are near at hand, newest first.
    pub recordings: Vec<Recording>,
    /// Folder of the recording that is being opened.
    pub opening: Option<PathBuf>,
    /// Why the last one could not be opened.
    pub trouble: Option<UserError>,
}

/// Shows the page.
pub fn pick(ui: &mut Ui, picker: &mut Picker, asks: &mut Vec<UiAction>) {
    CentralPanel::default().show(ui, |ui| {
        ScrollArea::vertical().auto_shrink([false, false]).show(ui, |ui| {
            let card = theme::card(ui.visuals());
            card.show(ui, |ui| {
                ui.set_width(ui.available_width());
                ui.label(RichText::new(words::PICK).size(theme::VERDICT).strong());
                ui.add_space(0.5 * theme::UNIT);
                path(ui, picker, asks);
                opening(ui, picker);
            });
            ui.add_space(theme::UNIT);
            card.show(ui, |ui| {
                ui.set_width(ui.available_width());
                ui.label(RichText::new(words::RECENT).size(theme::TITLE).strong());
                ui.add_space(0.5 * theme::UNIT);
                recent(ui, picker, asks);
            });
        });
    });
}

/// The recording that is being opened, or the reason why it couldn't be.
fn opening(ui: &mut Ui, picker: &Picker) {
    if let Some(folder) = &picker.opening {
        ui.horizontal(|ui| {
            ui.spinner();
            ui.label(words::opening(folder));
        });
    }
    if let Some(trouble) = &picker.trouble {
        let bad = theme::palette(ui.visuals()).bad;
        ui.colored_label(bad, RichText::new(&trouble.what).size(theme::TITLE));
        if let Some(action) = &trouble.action {
            ui.label(RichText::new(action).size(theme::BODY));
        }
    }
}

fn recent(ui: &mut Ui, picker: &Picker, asks: &mut Vec<UiAction>) {
    if picker.recordings.is_empty() {
        ui.label(words::NO_RECORDINGS);
        ui.add_space(0.5 * theme::UNIT);
        button(ui, Act::StartPage, asks);
        return;
    }
    let spacing = Vec2::new(3.0, 1.0) * theme::UNIT;
    Grid::new("recordings").num_columns(2).striped(true).spacing(spacing).show(ui, |ui| {
        for recording in &picker.recordings {
            let folder = recording.folder.display().to_string();
            let open = ui.add_enabled(picker.opening.is_none(), Button::new(&folder));
            if open.on_hover_text(words::open_tip(&recording.folder)).clicked() {
                asks.push(UiAction::Replay(recording.folder.clone()));
            }
            ui.label(RichText::new(&recording.what).weak());
            ui.end_row();
        }
    });
}

fn path(ui: &mut Ui, picker: &mut Picker, asks: &mut Vec<UiAction>) {
    ui.horizontal(|ui| {
        let name = ui.label(words::FOLDER).on_hover_text(words::FOLDER_TIP);
        let field = TextEdit::singleline(&mut picker.path).desired_width(480.0);
        let field = ui.add(field).labelled_by(name.id).on_hover_text(words::FOLDER_TIP);
        let enter = field.lost_focus() && ui.input(|input| input.key_pressed(Key::Enter));
        let can = picker.opening.is_none() && !picker.path.trim().is_empty();
        let button = ui.add_enabled(can, Button::new(words::OPEN));
        if button.on_hover_text(words::FOLDER_TIP).clicked() || (enter && can) {
            asks.push(UiAction::Replay(picker.path.trim().into()));
        }
    });
}
