//! The card with the cameras and all other sources of pictures.

use egui::{
    Align2, Button, ComboBox, FontId, Image, Rect, RichText, Sense, Stroke, StrokeKind, TextEdit,
    Ui, Vec2, WidgetInfo, accesskit::Role, pos2,
};

use super::{
    super::{keys::UiAction, theme},
    start_page::{Choices, StartPage},
};
use boresight_app::window::services::CameraView;
use boresight_present::text::{Act, start as words};

/// Height of a picture as a share of the width.
const ASPECT: f32 = 0.5625;

pub(super) fn show(ui: &mut Ui, page: &mut StartPage, choices: &Choices, asks: &mut Vec<UiAction>) {
    // A single large picture, or two beside each other.
    let across = if choices.cameras.len() > 1 { 2 } else { 1 };
    let gap = ui.spacing().item_spacing.x;
    let width = ui.available_width();
    let wide = ((width - gap * (across - 1) as f32) / across as f32).floor();
    for row in choices.cameras.chunks(across) {
        ui.horizontal(|ui| {
            for camera in row {
                tile(ui, page, camera, wide);
            }
        });
    }
    if choices.cameras.len() > 1 {
        let mut is_rig = page.rig.is_some();
        if ui.checkbox(&mut is_rig, words::RIG).on_hover_text(words::RIG_TIP).changed() {
            page.choose_rig(choices, is_rig);
        }
    }
    if let Some(camera) = page.camera(choices).filter(|_| page.rig.is_none()) {
        if let Some(trouble) = &camera.trouble {
            let color = theme::palette(ui.visuals()).bad;
            ui.label(RichText::new(&trouble.what).color(color));
            ui.label(trouble.action.as_deref().unwrap_or_default());
        }
        modes(ui, page, choices);
    }
    mirror(ui, choices, asks);
    ui.separator();
    ui.horizontal_wrapped(|ui| {
        let simulation = ui.button(words::SIMULATION).on_hover_text(words::SIMULATION_TIP);
        if simulation.clicked() {
            asks.push(page.simulation());
        }
        if ui.button(words::RECORDINGS).on_hover_text(words::RECORDINGS_TIP).clicked() {
            asks.push(UiAction::Act(Act::ReplayPage));
        }
    });
    for stream in &choices.streams {
        let chosen = page.draft.source == *stream;
        let button = ui.add(Button::new(stream.as_str()).selected(chosen).truncate());
        if button.on_hover_text(words::RECENT_TIP).clicked() {
            page.choose(stream);
            page.typed.clone_from(stream);
        }
    }
    let name = ui.label(words::OTHER).on_hover_text(words::OTHER_TIP);
    let field = TextEdit::singleline(&mut page.typed)
        .hint_text(words::OTHER_HINT)
        .desired_width(f32::INFINITY);
    let field = ui.add(field).labelled_by(name.id).on_hover_text(words::OTHER_TIP);
    if field.changed() {
        page.draft.source.clone_from(&page.typed);
    }
}

/// A camera's picture, name and mode; chosen by a click.
fn tile(ui: &mut Ui, page: &mut StartPage, camera: &CameraView, wide: f32) {
    let size = Vec2::new(wide, (ASPECT * wide).floor() + 4.5 * theme::UNIT);
    let (rect, response) = ui.allocate_exact_size(size, Sense::click());
    let chosen = page.has_chosen(camera);
    let picture = Rect::from_min_size(rect.min, Vec2::new(wide, (ASPECT * wide).floor()));
    ui.painter().rect_filled(picture, 4.0, theme::BAND);
    let ctx = ui.ctx().clone();
    match page.texture(&ctx, camera) {
        Some(texture) => {
            let own = texture.size_vec2();
            let scale = (picture.width() / own.x).min(picture.height() / own.y);
            let shown = Rect::from_center_size(picture.center(), own * scale);
            Image::new((texture.id(), shown.size())).paint_at(ui, shown);
        }
        None => {
            let words = camera.trouble.as_ref().map_or(words::WAITING, |trouble| &trouble.what);
            let font = FontId::proportional(theme::BODY);
            let galley = ui.painter().layout(words.into(), font, theme::GREY, wide - 16.0);
            let at = Align2::CENTER_CENTER.anchor_size(picture.center(), galley.size());
            ui.painter().galley(at.min, galley, theme::GREY);
        }
    }
    if chosen || response.hovered() || response.has_focus() {
        let stroke = Stroke::new(if chosen { 4.0 } else { 2.0 }, theme::ACCENT);
        ui.painter().rect_stroke(picture, 4.0, stroke, StrokeKind::Inside);
    }
    let visuals = ui.visuals();
    for (line, words, color, size) in [
        (0.0, &camera.name, visuals.text_color(), theme::BODY),
        (1.0, &camera.mode, visuals.weak_text_color(), theme::SMALL),
    ] {
        let font = FontId::proportional(size);
        let mut job = egui::text::LayoutJob::simple_singleline(words.clone(), font, color);
        job.wrap = egui::text::TextWrapping::truncate_at_width(wide);
        let galley = ui.painter().layout_job(job);
        let at = pos2(rect.left(), picture.bottom() + 4.0 + line * 2.25 * theme::UNIT);
        ui.painter().galley(at, galley, color);
    }
    let label = words::camera(&camera.name, &camera.mode);
    response.widget_info(|| WidgetInfo::selected(Role::Button, true, chosen, &label));
    if response.on_hover_text(&camera.source).clicked() {
        page.click(camera);
    }
}

fn modes(ui: &mut Ui, page: &mut StartPage, choices: &Choices) {
    if choices.modes.is_empty() {
        return;
    }
    ui.horizontal(|ui| {
        let name = ui.label(words::MODE);
        let shown = |mode: &str| {
            if mode == "auto" { words::BEST_MODE.to_owned() } else { mode.to_owned() }
        };
        let list = ComboBox::from_id_salt("mode")
            .selected_text(shown(&page.draft.mode))
            .truncate()
            .width(ui.available_width());
        let list = list.show_ui(ui, |ui| {
            for mode in std::iter::once("auto").chain(choices.modes.iter().map(String::as_str)) {
                ui.selectable_value(&mut page.draft.mode, mode.to_owned(), shown(mode));
            }
        });
        list.response.labelled_by(name.id);
    });
}

/// Question about the mirror, asked once, where the person can see the camera's direction.
fn mirror(ui: &mut Ui, choices: &Choices, asks: &mut Vec<UiAction>) {
    if choices.mirrored.is_some() || choices.cameras.is_empty() {
        return;
    }
    ui.add_space(0.5 * theme::UNIT);
    ui.label(RichText::new(words::MIRROR).strong()).on_hover_text(words::MIRROR_TIP);
    ui.horizontal(|ui| {
        for (answer, mirrored) in [(words::YES, true), (words::NO, false)] {
            if ui.button(answer).on_hover_text(words::MIRROR_TIP).clicked() {
                asks.push(UiAction::Mirror(mirrored));
            }
        }
    });
}
