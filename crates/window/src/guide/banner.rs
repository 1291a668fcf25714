//! Banner over the picture: the obstacle to taking views, and its next action.

use egui::{Button, CollapsingHeader, Color32, Frame, RichText, Ui};

use super::super::{aloud, keys::UiAction, screen::Screen, theme};
use boresight_geometry::boards::BoardChoice;
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
    for Trouble { what, action, detail, board, .. } in obstacles {
        let is_board = board.is_some();
        let (fill, title) =
            if is_board { (theme::BAND, theme::AMBER) } else { (theme::ALARM, Color32::WHITE) };
        Frame::new().fill(fill).inner_margin(theme::UNIT).show(ui, |ui| {
            ui.set_width(ui.available_width());
            let what = RichText::new(what).size(larger * theme::TITLE).strong().color(title);
            aloud::read_next(&ui.label(what));
            if !action.is_empty() {
                let action = RichText::new(action).size(larger * theme::BODY);
                aloud::read_next(&ui.label(action.color(Color32::WHITE)));
            }
            let keeps_views = screen.snapshot.as_ref().is_some_and(Snapshot::keeps_views);
            if let Some(board) = board.filter(|_| !screen.is_recorded && !keeps_views) {
                use_other_board(ui, board, asks);
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

/// Offers the board in view with a button.
fn use_other_board(ui: &mut Ui, board: BoardChoice, asks: &mut Vec<UiAction>) {
    ui.add_space(0.5 * theme::UNIT);
    let label = RichText::new(words::use_board(&board)).size(theme::TITLE).color(theme::ON_ACCENT);
    let button = Button::new(label).fill(theme::ACCENT);
    if ui.add_sized([20.0 * theme::UNIT, 4.5 * theme::UNIT], button).clicked() {
        asks.push(UiAction::UseBoard(board));
    }
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
