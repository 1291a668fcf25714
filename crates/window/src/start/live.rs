//! The live picture with the board in view: what a session starts with, and the way to start it.

use egui::{
    Align, Button, Color32, CornerRadius, Image, Key, Layout, Link, Mesh, Painter, Pos2, Rect,
    RichText, Sense, Shape, TextureHandle, Ui, UiBuilder, Vec2, WidgetInfo, accesskit::Role, pos2,
};

use super::{
    super::{aloud, keys::UiAction, rig::arranged, screen::FACES, theme},
    start_page::{Choices, StartPage},
};
use boresight_app::window::services::CameraView;
use boresight_geometry::frame::ImageSize;
use boresight_present::text::start as words;

/// Height of a page with everything in its usual size.
const HIGH: f32 = 720.0;
/// Margin of the page.
const MARGIN: f32 = 40.0;
/// Size of the main button.
const GO: Vec2 = Vec2::new(232.0, 72.0);
/// Share of the page that is dark behind the words, growing from its upper end.
const SHADED: f32 = 0.4;
/// Distance of the brackets from the board, as a share of its size, and length of their legs, as a
/// share of a side.
const BRACKETS: [f32; 2] = [0.05, 0.16];

pub(super) fn show(ui: &mut Ui, page: &mut StartPage, choices: &Choices, asks: &mut Vec<UiAction>) {
    let area = ui.available_rect_before_wrap();
    let k = (area.height() / HIGH).min(area.width() / (1.25 * HIGH));
    theme::band(ui, area);
    picture(ui, area, k, page, choices);
    let inside = area.shrink(MARGIN * k);
    source(ui, inside, page, choices);
    let starts = start(ui, inside, k, page, choices);
    sentence(ui, inside.with_max_x(inside.right() - 1.6 * GO.x * k), k, page, choices, asks);
    if starts {
        asks.push(page.start(choices));
    }
}

/// Pictures of the chosen cameras, with brackets around a whole board.
fn picture(ui: &mut Ui, area: Rect, k: f32, page: &mut StartPage, choices: &Choices) {
    let ctx = ui.ctx().clone();
    let response = ui.allocate_rect(area, Sense::hover());
    let with_pictures: Vec<(&CameraView, TextureHandle)> = page
        .chosen(choices)
        .into_iter()
        .filter_map(|camera| Some((camera, page.texture(&ctx, camera)?.clone())))
        .collect();
    if with_pictures.is_empty() {
        return;
    }
    let sizes = with_pictures.iter().map(|(_, texture)| {
        let [width_px, height_px] = texture.size().map(|side| u32::try_from(side).unwrap_or(1));
        ImageSize { width_px, height_px }
    });
    let placed = arranged(area, &sizes.collect::<Vec<_>>(), choices.mirrored.unwrap_or(FACES));
    for ((_, texture), placed) in with_pictures.iter().zip(&placed) {
        Image::new((texture.id(), placed.rect.size())).uv(placed.uv()).paint_at(ui, placed.rect);
    }
    shade(ui.painter(), area);
    for ((camera, _), placed) in with_pictures.iter().zip(&placed) {
        if let Some(rim) = camera.rim {
            let color = if camera.board.is_some() { theme::GREEN } else { Color32::WHITE };
            brackets(ui.painter(), rim.map(|at| placed.pos_of_share(at)), k, color);
        }
    }
    response.widget_info(|| WidgetInfo::labeled(Role::Image, true, words::LIVE));
}

/// Darkens the lower part, behind the words.
fn shade(painter: &Painter, area: Rect) {
    let top = area.bottom() - SHADED * area.height();
    let mut mesh = Mesh::default();
    for (y, alpha) in [(top, 0), (0.5 * (top + area.bottom()), 190), (area.bottom(), 235)] {
        for x in [area.left(), area.right()] {
            mesh.colored_vertex(pos2(x, y), Color32::from_black_alpha(alpha));
        }
    }
    for row in [0, 2] {
        mesh.add_triangle(row, row + 1, row + 2);
        mesh.add_triangle(row + 1, row + 2, row + 3);
    }
    painter.add(Shape::mesh(mesh));
}

fn brackets(painter: &Painter, rim: [Pos2; 4], k: f32, color: Color32) {
    let middle = rim.iter().fold(Vec2::ZERO, |sum, at| sum + 0.25 * at.to_vec2()).to_pos2();
    let rim = rim.map(|at| middle + (1.0 + BRACKETS[0]) * (at - middle));
    for (i, at) in rim.iter().enumerate() {
        let leg = |to: Pos2| *at + BRACKETS[1] * (to - *at);
        let line = vec![leg(rim[(i + 3) % 4]), *at, leg(rim[(i + 1) % 4])];
        for stroke in theme::outline(3.0 * k, color) {
            painter.add(Shape::line(line.clone(), stroke));
        }
    }
}

/// Name of the source; a click opens the choice.
fn source(ui: &mut Ui, inside: Rect, page: &mut StartPage, choices: &Choices) {
    let Some(name) = page.source_name(choices) else { return };
    ui.scope_builder(UiBuilder::new().max_rect(inside), |ui| {
        let name = RichText::new(name).size(theme::BODY).color(Color32::WHITE);
        let pill = Button::new(name).fill(theme::SHADE).corner_radius(CornerRadius::same(255));
        if ui.add(pill.min_size(Vec2::new(0.0, 32.0))).on_hover_text(words::CHANGE).clicked() {
            page.is_changing ^= true;
        }
    });
}

/// The main button, and the way to change something. Returns true to start.
fn start(ui: &mut Ui, inside: Rect, k: f32, page: &mut StartPage, choices: &Choices) -> bool {
    let can = page.trouble(choices).is_none();
    let layout = Layout::right_to_left(Align::Center);
    let bottom = inside.with_min_y(inside.bottom() - GO.y * k);
    ui.scope_builder(UiBuilder::new().max_rect(bottom).layout(layout), |ui| {
        let go = RichText::new(words::GO).font(theme::headline(26.0 * k)).color(theme::BAND);
        let go = Button::new(go).fill(Color32::WHITE).corner_radius(CornerRadius::same(255));
        let go = ui.add_enabled(can, go.min_size(GO * k)).on_hover_text(words::GO_TIP);
        ui.add_space(2.0 * theme::UNIT);
        let change = RichText::new(words::CHANGE).size(18.0 * k).color(Color32::WHITE);
        let change = Button::new(change).fill(Color32::TRANSPARENT).stroke(egui::Stroke::NONE);
        if ui.add(change.min_size(Vec2::new(0.0, GO.y * k))).clicked() {
            page.is_changing ^= true;
        }
        let is_free = ui.memory(|memory| memory.focused().is_none());
        let keys = [Key::Enter, Key::Space];
        let pressed = ui.input(|input| keys.iter().any(|key| input.key_pressed(*key)));
        go.clicked() || (can && is_free && pressed)
    })
    .inner
}

/// What is seen, or what to do, with a line below.
fn sentence(
    ui: &mut Ui,
    inside: Rect,
    k: f32,
    page: &mut StartPage,
    choices: &Choices,
    asks: &mut Vec<UiAction>,
) {
    let (said, line) = page.said(choices);
    let layout = Layout::bottom_up(Align::Min);
    ui.scope_builder(UiBuilder::new().max_rect(inside).layout(layout), |ui| {
        let quiet = |text: &str| RichText::new(text).size(18.0 * k).color(theme::GREY);
        let link = |text: &str| Link::new(quiet(text).color(Color32::WHITE).underline());
        ui.horizontal(|ui| {
            ui.label(quiet(&line));
            let other = page.other(choices).cloned();
            if let Some(other) = other {
                if ui.add(link(words::TAKE_OTHER)).clicked() {
                    // Its points must be counted by the person, unless they are known.
                    page.is_changing |= other.board.is_none();
                    page.take(other);
                }
            } else if page.asks_for_board(choices) {
                let print = ui.add(link(words::PRINT_ONE)).on_hover_text(words::PRINT_TIP);
                if print.clicked() {
                    // The steps for the person at the printer are there.
                    page.is_changing = true;
                    asks.push(UiAction::Print { board: page.in_squares(), paper: page.paper });
                }
            } else if !page.has_source(choices) && !page.is_changing {
                let simulation = ui.add(link(words::SIMULATION));
                if simulation.on_hover_text(words::SIMULATION_TIP).clicked() {
                    asks.push(page.simulation());
                }
            }
        });
        ui.add_space(0.5 * theme::UNIT);
        let said = RichText::new(said).font(theme::headline(44.0 * k)).color(Color32::WHITE);
        aloud::read_next(&ui.label(said));
    });
}
