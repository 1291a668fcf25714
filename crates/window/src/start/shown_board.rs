//! The board in a window, for another screen.

use egui::{
    Align2, CentralPanel, Color32, Context, FontId, Frame, Key, Rect, Ui, ViewportBuilder,
    ViewportCommand, ViewportId, pos2,
};

use super::{super::theme, board::draw};
use boresight_geometry::boards::BoardChoice;
use boresight_present::text::start as words;

/// Height of the line below the board.
const LINE: f32 = 24.0;

/// Shows the window. Returns true while open.
pub fn show(ctx: &Context, board: BoardChoice) -> bool {
    let id = ViewportId::from_hash_of(words::SHOWN_TITLE);
    let window =
        ViewportBuilder::default().with_title(words::SHOWN_TITLE).with_inner_size([960.0, 720.0]);
    ctx.show_viewport_immediate(id, window, |ui, _| {
        CentralPanel::default().frame(Frame::new().fill(Color32::WHITE)).show(ui, |ui| {
            paint(ui, board);
        });
        let (closed, full) = ui.input(|input| {
            let viewport = input.viewport();
            let closed = viewport.close_requested() || input.key_pressed(Key::Escape);
            let full = viewport.fullscreen.unwrap_or(false);
            (closed, input.key_pressed(Key::F11).then_some(!full))
        });
        if let Some(full) = full {
            ui.ctx().send_viewport_cmd_to(id, ViewportCommand::Fullscreen(full));
        }
        !closed
    })
}

fn paint(ui: &Ui, board: BoardChoice) {
    let area = ui.available_rect_before_wrap();
    let line = area.bottom() - LINE;
    let above = Rect::from_min_max(area.min, pos2(area.right(), line));
    draw(ui.painter(), above, board, false);
    let font = FontId::proportional(theme::BODY);
    let at = pos2(area.center().x, line);
    ui.painter().text(at, Align2::CENTER_TOP, words::shown(board), font, Color32::DARK_GRAY);
}
