//! The guide page: the live picture, the next action, and the progress.

pub mod air;
mod banner;
mod controls;
mod gauges;
pub(super) mod ghost;
pub mod icon;
mod lost;
mod numbers;
pub mod overlay;
pub(super) mod sentence;
mod views;
mod wheel;

use egui::{
    CentralPanel, Image, Label, Panel, Pos2, Rect, RichText, ScrollArea, Sense, Ui, UiBuilder,
    WidgetInfo, accesskit::Role, style::ScrollStyle,
};

use super::{
    keys::{UiAction, button, toggle},
    known_map,
    picture::{Dressing, Placed},
    screen::Screen,
    theme,
};
use boresight_present::{
    instruction::Instruction,
    text::{Act, Trouble, window as words},
};

/// Shows the page.
pub fn show(ui: &mut Ui, screen: &Screen, asks: &mut Vec<UiAction>) {
    let instruction = screen.instruction();
    let instruction = instruction.as_ref();
    let (mut obstacles, doubts) = banner::troubles(screen);
    let other_board = banner::take_other_board(screen, &mut obstacles);
    if screen.preferences.panels && !screen.distance {
        Panel::bottom("status").show_separator_line(false).show(ui, |ui| status(ui, screen));
        Panel::right("numbers").resizable(false).exact_size(252.0).show(ui, |ui| {
            // Always show the scroll bar: a camera's controls may not fit.
            ui.spacing_mut().scroll = ScrollStyle::solid();
            ui.spacing_mut().scroll.bar_width = 6.0;
            let high = ui.available_height();
            ScrollArea::vertical().auto_shrink([false, false]).show(ui, |ui| {
                wheel::show(ui, screen, high);
                gauges::show(ui, screen, instruction);
                ui.separator();
                numbers::show(ui, screen);
                numbers::camera(ui, screen, &doubts);
                controls::show(ui, screen, asks);
            });
        });
        // Keep the space for views before the first one: the picture never jumps.
        Panel::bottom("views").resizable(false).exact_size(views::PANEL).show(ui, |ui| {
            views::show(ui, screen, asks);
        });
    }
    CentralPanel::no_frame().show(ui, |ui| {
        let area = ui.available_rect_before_wrap();
        picture(ui, screen, instruction, &doubts);
        if let Some((snapshot, instruction)) = screen.snapshot.as_ref().zip(instruction) {
            let size = snapshot.setup.image_size;
            let placed = Placed::within(area, size, screen.preferences.mirrored);
            air::paint(ui.painter(), (area, &placed), (screen, snapshot), instruction);
        }
        let said = sentence::show(ui, area, screen, instruction);
        match &other_board {
            Some(other) => banner::chip(ui, said, screen, other, asks),
            None => overlay::hints_above(ui.painter(), said, screen, instruction),
        }
        // Over the picture, which keeps its place.
        if banner::is_needed(screen, &obstacles) {
            ui.scope_builder(UiBuilder::new().max_rect(area), |ui| {
                banner::show(ui, screen, obstacles, asks);
            });
        }
    });
}

fn picture(ui: &mut Ui, screen: &Screen, instruction: Option<&Instruction>, doubts: &[Trouble]) {
    let area = ui.available_rect_before_wrap();
    let Some(snapshot) = &screen.snapshot else {
        theme::band(ui, area);
        return;
    };
    let size = snapshot.setup.image_size;
    let placed = Placed::within(area, size, screen.preferences.mirrored);
    let response = ui.allocate_rect(area, Sense::hover());
    let dressing = Dressing {
        known: screen.known.borrow_mut().of(snapshot),
        is_shaded: true,
        lit: instruction.and_then(|it| ghost::part_of(it.board.as_ref()?, size)),
    };
    let texture = screen.picture.texture(ui.ctx(), &dressing);
    let around = if texture.is_some() { placed.bars(area) } else { [area, Rect::NOTHING] };
    for bar in around {
        theme::band(ui, bar);
    }
    let painter = ui.painter_at(placed.rect);
    if let Some(texture) = texture {
        Image::new((texture, placed.rect.size())).uv(placed.uv()).paint_at(ui, placed.rect);
    }
    if let Some(known) = &dressing.known {
        let board = dressing.lit.iter().flat_map(|part| &part.rim_px);
        let board: Vec<Pos2> = board.map(|px| placed.pos(px)).collect();
        known_map::border(&painter, &placed, known, &board);
    }
    overlay::paint(&painter, &placed, screen, (instruction, doubts));
    if let Some(secs) = screen.lost_secs() {
        lost::paint(&painter, placed.rect, secs);
    }
    response.widget_info(|| WidgetInfo::labeled(Role::Image, true, words::PICTURE));
    if let Some(instruction) = instruction {
        let told = overlay::told(screen, instruction, doubts);
        ui.ctx().accesskit_node_builder(response.id, |node| node.set_description(told));
    }
}

/// Buttons for use during a session.
pub(super) fn buttons(ui: &mut Ui, screen: &Screen, asks: &mut Vec<UiAction>) {
    let snapshot = screen.snapshot.as_ref();
    let paused = snapshot.is_some_and(|snapshot| snapshot.paused);
    let has_views = snapshot.is_some_and(|snapshot| !snapshot.views.is_empty());
    let removed = snapshot.is_some_and(|snapshot| snapshot.removed.is_some());
    button(ui, Act::Force, asks);
    toggle(ui, Act::Pause, paused, asks);
    ui.add_enabled_ui(has_views, |ui| button(ui, Act::Undo, asks));
    ui.add_enabled_ui(removed, |ui| button(ui, Act::Restore, asks));
    button(ui, Act::Finish, asks);
}

fn status(ui: &mut Ui, screen: &Screen) {
    ui.horizontal(|ui| {
        // A picture without a running source comes from a recording.
        let is_recording = screen.picture.grey().is_some() && screen.picture.came_secs.is_none();
        if !is_recording {
            let rate = screen.picture.per_sec().filter(|_| screen.lost_secs().is_none());
            let frames = words::frames(rate, screen.frames_replaced);
            ui.label(RichText::new(frames).small()).on_hover_text(words::FRAMES_TIP);
        }
        ui.label(RichText::new(&screen.source).small().weak());
        if let Some(folder) = &screen.folder {
            let folder = RichText::new(words::stored_in(folder)).small().weak();
            ui.add(Label::new(folder).truncate());
        }
    });
}
