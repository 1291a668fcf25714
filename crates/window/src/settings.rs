//! Settings of the window's looks and sounds.

use egui::{
    CentralPanel, ComboBox, DragValue, Grid, RichText, ScrollArea, Slider, SliderClamping,
    TextEdit, Ui,
};

use super::{
    keys::{UiAction, button, toggle},
    screen::Preferences,
    theme,
};
use boresight_app::window::services::Memory;
use boresight_calibrate::{AcceptanceGoal, BOARD_SCALE_SD, LensFamily};
use boresight_present::text::{Act, certificate::name, settings as words, start};

/// Largest width of both columns.
const MOST: f32 = 1200.0;
/// Width of a field for text.
const FIELD: f32 = 260.0;
/// Maximum letters of a text field, as in the settings file.
const MOST_LETTERS: usize = 200;
/// Spacing between the rows and columns of fields.
const SPACING: [f32; 2] = [2.0 * theme::UNIT, 0.5 * theme::UNIT];

/// Shows the page. `zoom` is the person's scale, `no_voice` the reason for silence; `memory`
/// receives the choices for new sessions.
pub fn show(
    ui: &mut Ui,
    (preferences, zoom): (&Preferences, f32),
    no_voice: Option<&str>,
    memory: &mut Memory,
    asks: &mut Vec<UiAction>,
) {
    CentralPanel::default().show(ui, |ui| {
        ScrollArea::vertical().auto_shrink([false, false]).show(ui, |ui| {
            ui.set_max_width(ui.available_width().min(MOST));
            ui.columns_const(|[looks, new]| {
                window(looks, (preferences, zoom), no_voice, asks);
                card(new, words::NEW_SESSIONS, &mut |ui| sessions(ui, memory));
                card(new, words::CERTIFICATE, &mut |ui| certificate(ui, memory));
            });
        });
    });
}

fn card(ui: &mut Ui, heading: &str, contents: &mut dyn FnMut(&mut Ui)) {
    theme::card(ui.visuals()).show(ui, |ui| {
        ui.set_width(ui.available_width());
        ui.label(RichText::new(heading).size(theme::TITLE).strong());
        ui.add_space(0.5 * theme::UNIT);
        contents(ui);
    });
    ui.add_space(theme::UNIT);
}

/// Looks and sounds of the window.
fn window(
    ui: &mut Ui,
    (preferences, zoom): (&Preferences, f32),
    no_voice: Option<&str>,
    asks: &mut Vec<UiAction>,
) {
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
        size(ui, zoom, asks);
    });
    ui.label(RichText::new(words::NEXT).weak());
    ui.horizontal(|ui| button(ui, Act::StartPage, asks));
}

/// Folder, goal, lens and board of new sessions.
fn sessions(ui: &mut Ui, memory: &mut Memory) {
    Grid::new("sessions").num_columns(2).spacing(SPACING).show(ui, |ui| {
        text(ui, words::FOLDER, words::FOLDER_HINT, &mut memory.folder);
        text(ui, words::GOAL, words::GOAL_HINT, &mut memory.goal);
        let name = ui.label(words::LENS.0).on_hover_text(words::LENS.1);
        let chosen = memory.lens.clone().unwrap_or_else(|| words::ANY_LENS.into());
        let list = ComboBox::from_id_salt("lens").selected_text(&chosen);
        let list = list.show_ui(ui, |ui| {
            let families = LensFamily::ALL.into_iter().map(LensFamily::code);
            for lens in std::iter::once(words::ANY_LENS).chain(families) {
                if ui.selectable_label(lens == chosen, lens).clicked() {
                    memory.lens = (lens != words::ANY_LENS).then(|| lens.to_owned());
                }
            }
        });
        list.response.labelled_by(name.id);
        ui.end_row();
        let name = ui.label(words::BOARD_ERROR.0).on_hover_text(words::BOARD_ERROR.1);
        let usual = 100.0 * BOARD_SCALE_SD;
        let mut percent = memory.board_error_percent.unwrap_or(usual);
        let value = DragValue::new(&mut percent).range(0.0..=10.0).speed(0.005).suffix(" %");
        if ui.add(value).labelled_by(name.id).changed() {
            memory.board_error_percent = Some(percent).filter(|it| (it - usual).abs() > 1e-9);
        }
        ui.end_row();
    });
    let goal = memory.goal.trim();
    if !goal.is_empty() && goal.parse::<AcceptanceGoal>().is_err() {
        let color = theme::palette(ui.visuals()).bad;
        ui.label(RichText::new(words::NO_GOAL).color(color));
    }
}

/// Statements of the certificate.
fn certificate(ui: &mut Ui, memory: &mut Memory) {
    let certificate = &mut memory.certificate;
    ui.label(RichText::new(words::CERTIFICATE_TIP).weak());
    Grid::new("certificate").num_columns(2).spacing(SPACING).show(ui, |ui| {
        for (what, value) in [
            (name::COMPANY, &mut certificate.company),
            (name::OPERATOR, &mut certificate.operator),
            (name::CUSTOMER, &mut certificate.customer),
            (name::SITE, &mut certificate.site),
            (name::MAKE, &mut certificate.camera_make),
            (name::MODEL, &mut certificate.camera_model),
            (name::SERIAL, &mut certificate.camera_serial),
            (name::LENS, &mut certificate.lens),
            (name::MEASURED, &mut certificate.square_measured),
        ] {
            text(ui, (what, ""), "", value);
        }
    });
}

/// A row with a field for text.
fn text(ui: &mut Ui, (name, tip): (&str, &str), hint: &str, value: &mut String) {
    let name = ui.label(name);
    let field = TextEdit::singleline(value).desired_width(FIELD).char_limit(MOST_LETTERS);
    let field = field.hint_text(hint);
    let field = ui.add(field).labelled_by(name.id);
    if !tip.is_empty() {
        name.on_hover_text(tip);
        field.on_hover_text(tip);
    }
    ui.end_row();
}

fn size(ui: &mut Ui, mut zoom: f32, asks: &mut Vec<UiAction>) {
    // Values set by keys between the steps stay until the slider is moved.
    let slider = Slider::new(&mut zoom, 0.5..=3.0).step_by(0.25).text(words::ZOOM);
    let slider = slider.clamping(SliderClamping::Edits);
    let response = ui.add(slider).on_hover_text(words::ZOOM_TIP);
    // While dragging, a new size would move the slider away from the pointer.
    if response.changed() && !response.dragged() || response.drag_stopped() {
        asks.push(UiAction::Zoom(zoom));
    }
}
