//! Choice of the recording to open.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use egui::{
    Button, CentralPanel, Color32, Key, Label, Rect, RichText, ScrollArea, Sense, TextEdit,
    TextureHandle, Ui, Vec2, pos2, vec2,
};

use super::super::{
    keys::{UiAction, button},
    theme,
};
use boresight_app::{explain::UserError, window::recordings::Recording};
use boresight_calibrate::Verdict;
use boresight_present::text::{Act, replay as words, sessions};

/// Size of a session's picture.
const PICTURE: Vec2 = vec2(128.0, 80.0);
/// Largest height of the list of folders.
const FOLDERS: f32 = 160.0;

/// State of the page without an open recording.
#[derive(Clone, Default)]
pub struct Picker {
    /// Typed folder.
    pub path: String,
    /// Folders in the typed one, true for a session; `None` before somebody browses.
    pub inside: Option<Vec<(PathBuf, bool)>>,
    /// Recordings nearby, newest first.
    pub recordings: Vec<Recording>,
    /// Thumbnails of the recordings.
    pub pictures: BTreeMap<PathBuf, TextureHandle>,
    /// Names of the formats for export, of a camera and of several.
    pub formats: [Vec<&'static str>; 2],
    /// True while a session runs, protected from the page.
    pub busy: bool,
    /// Folder of the recording being opened.
    pub opening: Option<PathBuf>,
    /// Reason for the last failure to open a recording.
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
                inside(ui, picker, asks);
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

/// Recording being opened, or the reason for a failure.
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
    for (index, recording) in picker.recordings.iter().enumerate() {
        if index > 0 {
            ui.separator();
        }
        ui.push_id(&recording.folder, |ui| session(ui, picker, recording, asks));
    }
}

/// A session: picture, time, camera, verdict, views, and possible actions.
fn session(ui: &mut Ui, picker: &Picker, recording: &Recording, asks: &mut Vec<UiAction>) {
    ui.horizontal(|ui| {
        let (rect, _) = ui.allocate_exact_size(PICTURE, Sense::hover());
        ui.painter().rect_filled(rect, 4.0, ui.visuals().extreme_bg_color);
        if let Some(texture) = picker.pictures.get(&recording.folder) {
            let size = texture.size_vec2();
            let scale = (PICTURE.x / size.x.max(1.0)).min(PICTURE.y / size.y.max(1.0));
            let inner = Rect::from_center_size(rect.center(), size * scale);
            let whole = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
            ui.painter().image(texture.id(), inner, whole, Color32::WHITE);
        }
        ui.vertical(|ui| {
            ui.label(RichText::new(&recording.when).size(theme::BODY).strong());
            ui.add(Label::new(RichText::new(&recording.camera).weak()).truncate());
            ui.horizontal_wrapped(|ui| {
                let palette = theme::palette(ui.visuals());
                let color = match recording.judged {
                    Some(Verdict::Good) => palette.good,
                    Some(Verdict::Care) => palette.care,
                    Some(Verdict::Untrustworthy) => palette.bad,
                    None => ui.visuals().weak_text_color(),
                };
                ui.label(RichText::new(&recording.verdict).strong().color(color));
                if recording.views.is_some() {
                    ui.label(RichText::new(sessions::views(recording.views)).weak());
                }
            });
            ui.horizontal_wrapped(|ui| actions(ui, picker, recording, asks));
        });
    })
    .response
    .on_hover_text(recording.folder.display().to_string());
}

fn actions(ui: &mut Ui, picker: &Picker, recording: &Recording, asks: &mut Vec<UiAction>) {
    let folder = &recording.folder;
    let is_free = picker.opening.is_none();
    let mut button = |ui: &mut Ui, (label, tip): (&str, &str), can: bool, ask: UiAction| {
        let response = ui.add_enabled(can && is_free, Button::new(label)).on_hover_text(tip);
        let why = if picker.busy { sessions::FINISH_FIRST } else { tip };
        if response.on_disabled_hover_text(why).clicked() {
            asks.push(ask);
        }
    };
    let idle = !picker.busy;
    let is_of_one = !recording.is_rig;
    if is_of_one {
        button(ui, sessions::RESULT, idle, UiAction::ShowResult(folder.clone()));
        button(ui, sessions::GO_ON, idle, UiAction::GoOnWith(folder.clone()));
    } else {
        button(ui, sessions::GO_ON, idle, UiAction::GoOnWithRig(folder.clone()));
    }
    if let Some(report) = &recording.report {
        button(ui, sessions::REPORT, true, UiAction::Show(report.clone()));
    }
    if is_of_one {
        button(ui, sessions::REPLAY, true, UiAction::Replay(folder.clone()));
    }
    let mut exported = None;
    if recording.judged.is_some() {
        let (label, tip) = sessions::EXPORT;
        ui.menu_button(label, |ui| {
            let formats = &picker.formats[usize::from(recording.is_rig)];
            for (format, name) in formats.iter().enumerate() {
                if ui.button(*name).clicked() {
                    exported = Some(UiAction::ExportOf(folder.clone(), format));
                    ui.close();
                }
            }
        })
        .response
        .on_hover_text(tip);
    }
    button(ui, sessions::DELETE, idle, UiAction::Delete(folder.clone()));
    asks.extend(exported);
}

fn path(ui: &mut Ui, picker: &mut Picker, asks: &mut Vec<UiAction>) {
    ui.horizontal(|ui| {
        let name = ui.label(words::FOLDER).on_hover_text(words::FOLDER_TIP);
        let field = TextEdit::singleline(&mut picker.path)
            .hint_text(words::FOLDER_HINT)
            .desired_width(480.0);
        let field = ui.add(field).labelled_by(name.id).on_hover_text(words::FOLDER_TIP);
        let enter = field.lost_focus() && ui.input(|input| input.key_pressed(Key::Enter));
        let can = picker.opening.is_none() && !picker.path.trim().is_empty();
        let button = ui.add_enabled(can, Button::new(words::OPEN));
        if button.on_hover_text(words::FOLDER_TIP).clicked() || (enter && can) {
            asks.push(UiAction::Replay(picker.path.trim().into()));
        }
        if ui.button(words::BROWSE).on_hover_text(words::BROWSE_TIP).clicked() {
            // Where sessions are, if nobody names a folder.
            let newest = picker.recordings.first().and_then(|it| it.folder.parent());
            let typed = Some(picker.path.trim()).filter(|path| !path.is_empty());
            let from = typed.map(Path::new).or(newest).unwrap_or(Path::new("."));
            asks.push(UiAction::Browse(from.to_path_buf()));
        }
    });
}

/// Folders to look into, and sessions to open.
fn inside(ui: &mut Ui, picker: &Picker, asks: &mut Vec<UiAction>) {
    let Some(inside) = &picker.inside else { return };
    let can_open = picker.opening.is_none();
    ScrollArea::vertical().id_salt("inside").max_height(FOLDERS).show(ui, |ui| {
        ui.horizontal_wrapped(|ui| {
            if let Some(above) = Path::new(&picker.path).parent()
                && ui.button(words::UP).clicked()
            {
                asks.push(UiAction::Browse(above.to_path_buf()));
            }
            for (folder, is_session) in inside {
                let name = folder.file_name().unwrap_or_default().to_string_lossy();
                let name = RichText::new(name);
                let name = if *is_session { name.strong() } else { name.weak() };
                let button = ui.add_enabled(can_open || !is_session, Button::new(name));
                if button.on_hover_text(words::folder_tip(folder, *is_session)).clicked() {
                    let folder = folder.clone();
                    let ask = if *is_session { UiAction::Replay } else { UiAction::Browse };
                    asks.push(ask(folder));
                }
            }
        });
    });
}
