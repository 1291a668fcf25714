//! The page of a rig: pictures as nodes, links between them, one sentence, and the result.

use egui::{
    Align, Align2, Color32, FontId, Id, Image, Layout, Rect, RichText, Sense, Stroke, StrokeKind,
    Ui, UiBuilder, Vec2, WidgetInfo, accesskit::Role, vec2,
};

use super::{RigCamera, RigScreen, links};
use crate::{
    aloud,
    guide::{ghost, sentence},
    keys::{UiAction, button},
    known_map,
    picture::{Dressing, Placed},
    result, theme,
};
use boresight_geometry::frame::ImageSize;
use boresight_guide::{
    rig::RigPrompt,
    session::{Gravity, Snapshot},
};
use boresight_present::{
    instruction::{Instruction, Movement},
    text::{Act, rig as rig_words, window as words},
};

/// Share of the height below the pictures: sentence, or result.
const BELOW: [f32; 2] = [0.24, 0.42];
/// Space between two pictures, for a link's label, in a page 720 points high.
const GAP: Vec2 = vec2(120.0, 56.0);
/// Size of the sentence's letters beside those over a single picture.
const LETTERS: f32 = 0.8;

/// Shows the page.
pub fn show(ui: &mut Ui, screen: &RigScreen, asks: &mut Vec<UiAction>) {
    let area = ui.available_rect_before_wrap();
    theme::band(ui, area);
    let margin = 2.0 * theme::UNIT;
    let below = BELOW[usize::from(screen.ended.is_some())] * area.height();
    let (above, below) = area.split_top_bottom_at_y(area.bottom() - below);
    let sizes = screen.cameras.iter().map(|camera| {
        camera.snapshot.as_ref().map_or(ImageSize { width_px: 16, height_px: 9 }, image_size)
    });
    let placed = arranged(above.shrink(margin), &sizes.collect::<Vec<_>>(), false);
    let pictures: Vec<Rect> = placed.iter().map(|placed| placed.rect).collect();
    let labels = links::lines(ui, &pictures, &screen.links);
    for (camera, placed) in screen.cameras.iter().zip(&placed) {
        picture(ui, (camera, placed), screen.prompt.filter(|_| screen.ended.is_none()));
    }
    let names: Vec<&str> = screen.cameras.iter().map(|camera| camera.name.as_str()).collect();
    links::labels(ui, &labels, &screen.links, &names);
    match &screen.ended {
        Some(_) => ending(ui, below.shrink2(vec2(3.0 * margin, 0.0)), screen),
        None => {
            let (words, sign) = said(screen);
            sentence::say(ui, area.with_max_y(below.bottom() - margin), (&words, sign), LETTERS);
        }
    }
    let buttons = Rect::from_min_max(below.left_bottom() - vec2(0.0, 3.5 * margin), below.max);
    ui.scope_builder(UiBuilder::new().max_rect(buttons.shrink(margin)), |ui| {
        ui.with_layout(Layout::right_to_left(Align::Max), |ui| {
            if screen.ended.is_none() {
                ui.add_enabled_ui(!screen.is_ending, |ui| button(ui, Act::Finish, asks));
                let has_places = screen.places > 0 && !screen.is_ending;
                ui.add_enabled_ui(has_places, |ui| button(ui, Act::Undo, asks));
            } else if ui.button(rig_words::CLOSE).clicked() {
                asks.push(UiAction::Act(Act::Finish));
            }
            ui.label(RichText::new(rig_words::places(screen.places)).weak());
        });
    });
}

fn image_size(snapshot: &Snapshot) -> ImageSize {
    snapshot.setup.image_size
}

/// Pictures in rows, in the arrangement that shows the most of them.
pub(crate) fn arranged(area: Rect, sizes: &[ImageSize], is_mirrored: bool) -> Vec<Placed> {
    let gap = GAP * (area.height() / 540.0).clamp(0.6, 2.0);
    let in_columns = |columns: usize| -> Vec<Placed> {
        let rows = sizes.len().div_ceil(columns);
        let count = vec2(columns as f32, rows as f32);
        let cell = ((area.size() - gap * (count - Vec2::splat(1.0))) / count).max(Vec2::ZERO);
        let of = |(index, size): (usize, &ImageSize)| {
            let at = vec2((index % columns) as f32, (index / columns) as f32);
            let cell = Rect::from_min_size(area.min + at * (cell + gap), cell);
            Placed::within(cell, *size, is_mirrored)
        };
        sizes.iter().enumerate().map(of).collect()
    };
    let shown = |placed: &[Placed]| placed.iter().map(|it| it.rect.area()).sum::<f32>();
    let all = (1..=sizes.len()).map(in_columns);
    all.max_by(|a, b| shown(a).total_cmp(&shown(b))).unwrap_or_default()
}

/// The sentence with its colour, and the sign of a movement.
fn said(screen: &RigScreen) -> ((String, Color32), Option<Movement>) {
    if screen.is_ending {
        return ((rig_words::CALIBRATING.into(), theme::GREY), None);
    }
    let of_camera = match screen.prompt {
        Some(RigPrompt::OfCamera { camera }) => screen.cameras[camera].snapshot.as_ref(),
        _ => None,
    };
    let instruction = of_camera.map(Instruction::of);
    let Some(prompt) = screen.prompt else {
        return ((words::STARTING.into(), theme::GREY), None);
    };
    let of_camera = |_| instruction.as_ref().map_or(Gravity::Plain, Instruction::gravity);
    let gravity = prompt.gravity(of_camera);
    let sign = instruction.as_ref().and_then(|instruction| instruction.movement(false));
    ((screen.sentence.clone(), sentence::color(gravity)), sign)
}

/// Picture of a camera, as far as its own lens is known, with the requested board and the live one.
fn picture(ui: &Ui, (camera, placed): (&RigCamera, &Placed), prompt: Option<RigPrompt>) {
    let response = ui.interact(placed.rect, Id::unique(&camera.name), Sense::hover());
    let painter = ui.painter_at(placed.rect.expand(4.0));
    let Some(snapshot) = &camera.snapshot else {
        painter.rect_filled(placed.rect, 0.0, Color32::from_gray(24));
        name(ui, camera, placed);
        return;
    };
    let size = image_size(snapshot);
    let mut instruction = Instruction::of(snapshot);
    if let Some(RigPrompt::Resting { progress }) = prompt {
        (instruction.hold, instruction.card) = (Some(progress), None);
    }
    let dressing = Dressing {
        known: camera.known.borrow_mut().of(snapshot),
        is_shaded: false,
        lit: instruction.board.as_ref().and_then(|board| ghost::part_of(board, size)),
    };
    if let Some(texture) = camera.picture.texture(ui.ctx(), &dressing) {
        Image::new((texture, placed.rect.size())).uv(placed.uv()).paint_at(ui, placed.rect);
    }
    if let Some(known) = &dressing.known {
        let board = dressing.lit.iter().flat_map(|part| &part.rim_px);
        let board: Vec<_> = board.map(|px| placed.pos(px)).collect();
        known_map::border(&ui.painter_at(placed.rect), placed, known, &board);
    }
    if prompt.is_some() {
        ghost::paint(&ui.painter_at(placed.rect), placed, &instruction);
    }
    if prompt == Some(RigPrompt::Taken) {
        let rim = Stroke::new(6.0, theme::GREEN);
        painter.rect_stroke(placed.rect, 0.0, rim, StrokeKind::Middle);
    }
    name(ui, camera, placed);
    response.widget_info(|| WidgetInfo::labeled(Role::Image, true, &camera.name));
}

/// The camera's name in the picture's corner.
fn name(ui: &Ui, camera: &RigCamera, placed: &Placed) {
    let font = FontId::proportional(theme::BODY);
    let galley = ui.painter().layout_no_wrap(camera.name.clone(), font, Color32::WHITE);
    let size = galley.size() + vec2(2.0, 1.0) * theme::UNIT;
    let plate = Align2::LEFT_BOTTOM.align_size_within_rect(size, placed.rect.shrink(theme::UNIT));
    ui.painter().rect_filled(plate, 0.5 * plate.height(), theme::SHADE);
    ui.painter().galley(plate.min + vec2(1.0, 0.5) * theme::UNIT, galley, Color32::WHITE);
}

/// Sign of the grade, and the verdict in words.
fn ending(ui: &mut Ui, area: Rect, screen: &RigScreen) {
    let Some(ended) = &screen.ended else { return };
    ui.scope_builder(UiBuilder::new().max_rect(area), |ui| {
        ui.horizontal(|ui| {
            if let Some(grade) = ended.grade {
                let (rect, _) = ui.allocate_exact_size(Vec2::splat(36.0), Sense::hover());
                let color = result::color(ui, grade);
                result::sign(ui.painter(), rect, grade, color, theme::BAND);
            }
            let verdict = ended.lines.first().map_or("", String::as_str);
            let said = RichText::new(verdict).font(theme::headline(theme::VERDICT));
            aloud::read_next(&ui.label(said.color(Color32::WHITE)));
        });
        egui::ScrollArea::vertical().max_height(area.height() - 120.0).show(ui, |ui| {
            for line in ended.lines.iter().skip(1) {
                ui.label(RichText::new(line.trim_start()).color(Color32::WHITE));
            }
        });
    });
}
