//! View from afar: progress of the hold along the bottom edge, and the number of views.

use egui::{Align2, Color32, FontId, Painter, Pos2, Rect, Sense, Ui, Vec2};

use super::super::{screen::Screen, theme};
use boresight_present::{instruction::Instruction, text::window as words};

/// Height of the bar as a share of the window's.
const BAR: f32 = 0.035;
/// Height of the count as a share of the picture's.
const COUNT: f32 = 0.3;
/// Height of the words below the count, as a share of the picture's.
const OF_ABOUT: f32 = 0.07;
/// Width of the count's outline as a share of its height.
const OUTLINE: f32 = 0.025;

/// Progress bar of the hold, with the place kept while nothing is held.
pub(super) fn hold(ui: &mut Ui, instruction: Option<&Instruction>) {
    let high = BAR * ui.ctx().content_rect().height();
    let (rect, _) = ui.allocate_exact_size(Vec2::new(ui.available_width(), high), Sense::hover());
    theme::band(ui, rect);
    if let Some(hold) = instruction.and_then(|instruction| instruction.hold) {
        let width = rect.width() * hold as f32;
        let done = Rect::from_min_size(rect.min, Vec2::new(width, rect.height()));
        ui.painter().rect_filled(done, 0.0, theme::GREEN);
    }
}

/// Number of photos in a corner of the picture, with the expected total below.
pub(super) fn count(painter: &Painter, rect: Rect, screen: &Screen) {
    let Some(snapshot) = screen.snapshot.as_ref().filter(|snapshot| !snapshot.views.is_empty())
    else {
        return;
    };
    let taken = snapshot.views.len();
    let mut at = rect.right_bottom() - Vec2::splat(2.0 * theme::UNIT);
    if let Some(to_go) = snapshot.views_to_go.filter(|to_go| *to_go > 0) {
        let size = OF_ABOUT * rect.height();
        outlined(painter, at, &words::of_about(taken + to_go), size);
        at.y -= size;
    }
    outlined(painter, at, &taken.to_string(), COUNT * rect.height());
}

/// Outlined text with the bottom right corner at `at`, visible on any picture.
fn outlined(painter: &Painter, at: Pos2, text: &str, size: f32) {
    let font = FontId::proportional(size);
    let wide = (OUTLINE * size).max(2.0);
    for step in 0..8 {
        let aside = wide * Vec2::angled(step as f32 * std::f32::consts::TAU / 8.0);
        painter.text(at + aside, Align2::RIGHT_BOTTOM, text, font.clone(), Color32::BLACK);
    }
    painter.text(at, Align2::RIGHT_BOTTOM, text, font, Color32::WHITE);
}
