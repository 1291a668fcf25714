//! Banner over the picture: the obstacle to taking views, and its next action.

use egui::{
    Align, Button, CollapsingHeader, Color32, CornerRadius, Frame, Layout, Rect, RichText, Ui,
    UiBuilder, Vec2, pos2,
};

use super::super::{aloud, keys::UiAction, screen::Screen, theme};
use boresight_guide::session::Snapshot;
use boresight_present::text::{self, Trouble, adjust, window as words};

/// True if there is anything to show.
pub(super) fn is_needed(screen: &Screen, obstacles: &[Trouble]) -> bool {
    let set_by_hand = |snapshot: &Snapshot| !snapshot.camera.set_by_hand.is_empty();
    !obstacles.is_empty() || screen.snapshot.as_ref().is_some_and(set_by_hand)
}

pub(super) fn show(
    ui: &mut Ui,
    screen: &Screen,
    obstacles: Vec<Trouble>,
    asks: &mut Vec<UiAction>,
) {
    let larger = screen.larger();
    for Trouble { what, action, detail, .. } in obstacles {
        Frame::new().fill(theme::ALARM).inner_margin(theme::UNIT).show(ui, |ui| {
            ui.set_width(ui.available_width());
            let what = RichText::new(what).size(larger * theme::TITLE).strong();
            aloud::read_next(&ui.label(what.color(Color32::WHITE)));
            if !action.is_empty() {
                let action = RichText::new(action).size(larger * theme::BODY);
                aloud::read_next(&ui.label(action.color(Color32::WHITE)));
            }
            if !detail.is_empty() {
                let heading = RichText::new(words::DETAILS).color(Color32::WHITE);
                CollapsingHeader::new(heading).id_salt(&detail).show(ui, |ui| {
                    ui.label(RichText::new(&detail).color(Color32::WHITE));
                });
            }
        });
    }
    if !screen.is_recorded {
        undo(ui, screen, asks);
    }
}

/// Shows another board than the chosen one as a chip above the sentence at `said`, with a button to
/// use it.
pub(super) fn chip(
    ui: &mut Ui,
    said: Rect,
    screen: &Screen,
    trouble: &Trouble,
    asks: &mut Vec<UiAction>,
) {
    let larger = screen.larger();
    let page = ui.max_rect();
    let above = Rect::from_min_max(pos2(said.left(), page.top()), said.right_top());
    let above = above.with_max_x(page.right() - theme::UNIT).with_max_y(said.top() - theme::UNIT);
    let layout = Layout::bottom_up(Align::Min);
    ui.scope_builder(UiBuilder::new().max_rect(above).layout(layout), |ui| {
        Frame::new().fill(theme::SHADE).corner_radius(12.0).inner_margin(1.5 * theme::UNIT).show(
            ui,
            |ui| {
                let row = Vec2::new(ui.available_width(), 48.0);
                let layout = Layout::left_to_right(Align::Center);
                ui.allocate_ui_with_layout(row, layout, |ui| {
                    let board = trouble.board.filter(|_| !screen.is_recorded);
                    if let Some(board) = board {
                        ui.spacing_mut().button_padding.x = 2.0 * theme::UNIT;
                        let label = RichText::new(words::use_board(&board));
                        let label = label.font(theme::headline(larger * theme::TITLE));
                        let button = Button::new(label.color(theme::BAND)).fill(Color32::WHITE);
                        let button = button.corner_radius(CornerRadius::same(255));
                        if ui.add(button.min_size(Vec2::new(0.0, 48.0))).clicked() {
                            asks.push(UiAction::UseBoard(board));
                        }
                        ui.add_space(theme::UNIT);
                    }
                    ui.vertical(|ui| {
                        let what = RichText::new(&trouble.what).size(larger * theme::TITLE);
                        aloud::read_next(&ui.label(what.color(Color32::WHITE)));
                        let action = RichText::new(&trouble.action).size(larger * theme::BODY);
                        aloud::read_next(&ui.label(action.color(theme::GREY)));
                    });
                });
            },
        );
    });
}

/// Offers the way back if a control set by the person keeps views from being taken.
fn undo(ui: &mut Ui, screen: &Screen, asks: &mut Vec<UiAction>) {
    let Some(camera) = screen.snapshot.as_ref().map(|snapshot| &snapshot.camera) else { return };
    for control in &camera.set_by_hand {
        let Some(change) = camera.changed.get(control) else { continue };
        let (control, value) = (*control, change.from);
        let button = ui.button(RichText::new(adjust::set_back(control, value)).size(theme::BODY));
        if button.on_hover_text(adjust::tip(control)).clicked() {
            asks.push(UiAction::Adjust { control, value });
        }
    }
}

/// Takes another board than the chosen one out of the obstacles.
pub(super) fn take_other_board(screen: &Screen, obstacles: &mut Vec<Trouble>) -> Option<Trouble> {
    let (what, _) = words::other_board(screen.snapshot.as_ref()?)?;
    let at = obstacles.iter().position(|trouble| trouble.what == what)?;
    Some(obstacles.remove(at))
}

/// Obstacles to taking views, the most important first, and doubts without effect on taking.
pub(super) fn troubles(screen: &Screen) -> (Vec<Trouble>, Vec<Trouble>) {
    let Some(snapshot) = &screen.snapshot else { return Default::default() };
    let (doubts, mut obstacles): (Vec<_>, Vec<_>) =
        text::troubles(snapshot).into_iter().partition(|trouble| trouble.is_doubt);
    if let Some(silent) = screen.stalled_secs().filter(|_| obstacles.is_empty()) {
        obstacles.push(Trouble::plain((words::stalled(silent), words::STALLED_ACTION.into())));
    }
    (obstacles, doubts)
}
