//! Which recording is to be seen.

use std::path::PathBuf;

use egui::{Button, CentralPanel, Grid, Key, RichText, ScrollArea, TextEdit, Ui};

use super::super::{keys::UiAction, theme};
use crate::{
    app::{host::UserError, recordings::Recording},
    text::replay as words,
};

/// What the person does where no recording is open.
#[derive(Clone, Debug, Default)]
pub struct Picker {
    /// The folder, as it is typed.
    pub path: String,
    /// Recordings that are near at hand, newest first.
    pub recordings: Vec<Recording>,
    /// The one that is being opened.
    pub opening: Option<PathBuf>,
    /// Why the last one could not be opened.
    pub trouble: Option<UserError>,
}

/// Shows the page.
pub fn pick(ui: &mut Ui, picker: &mut Picker, asks: &mut Vec<UiAction>) {
    CentralPanel::default().show(ui, |ui| {
        ScrollArea::vertical().auto_shrink([false, false]).show(ui, |ui| {
            ui.label(RichText::new(words::PICK).size(theme::VERDICT).strong());
            ui.add_space(6.0);
            path(ui, picker, asks);
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
            ui.add_space(12.0);
            ui.label(RichText::new(words::RECENT).size(theme::TITLE).strong());
            if picker.recordings.is_empty() {
                ui.label(words::NO_RECORDINGS);
            }
            Grid::new("recordings").num_columns(2).spacing([24.0, 8.0]).show(ui, |ui| {
                for recording in &picker.recordings {
                    let folder = recording.folder.display().to_string();
                    let button = Button::new(&folder);
                    let button = ui.add_enabled(picker.opening.is_none(), button);
                    if button.on_hover_text(words::open_tip(&recording.folder)).clicked() {
                        asks.push(UiAction::Replay(recording.folder.clone()));
                    }
                    ui.label(&recording.what);
                    ui.end_row();
                }
            });
        });
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
