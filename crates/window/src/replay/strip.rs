//! All decisions of a recording as a coloured strip; a click goes there.

use egui::{Color32, Rect, Sense, Stroke, Ui, Vec2, WidgetInfo, accesskit::Role, pos2};

use super::{super::theme, replayed::Replayed};
use boresight_guide::{
    guidance::Refusal,
    session::{Outcome, Snapshot},
};
use boresight_present::text::replay as words;

/// Shows the strip. Returns the clicked decision.
pub(super) fn show(ui: &mut Ui, replayed: &Replayed) -> Option<usize> {
    let size = Vec2::new(ui.available_width(), 18.0);
    let (rect, response) = ui.allocate_exact_size(size, Sense::click_and_drag());
    let painter = ui.painter_at(rect);
    let steps = replayed.steps.len();
    let at = |step: usize| rect.left() + rect.width() * step as f32 / steps as f32;
    // At most one rectangle a point: of the decisions there, the most remarkable.
    let columns = (rect.width() as usize).clamp(1, steps);
    for column in 0..columns {
        let (from, to) = (column * steps / columns, (column + 1) * steps / columns);
        let most = (from..to).map(|step| rank(replayed, step)).max().unwrap_or(0);
        let area = Rect::from_min_max(pos2(at(from), rect.top()), pos2(at(to), rect.bottom()));
        painter.rect_filled(area, 0.0, COLORS[most]);
    }
    let middle = at(replayed.at) + 0.5 * rect.width() / steps as f32;
    painter.vline(middle, rect.y_range(), Stroke::new(3.0, Color32::WHITE));
    response.widget_info(|| WidgetInfo::labeled(Role::Image, true, words::STRIP));
    let pointer = response.interact_pointer_pos()?;
    let share = ((pointer.x - rect.left()) / rect.width()).clamp(0.0, 1.0);
    response.on_hover_text(words::STRIP);
    Some((share * steps as f32) as usize)
}

const COLORS: [Color32; 5] =
    [Color32::from_gray(50), Color32::from_gray(90), theme::AMBER, theme::GREEN, theme::RED];

/// Rank: nothing, a refused board, a held one, a view taken, a difference.
fn rank(replayed: &Replayed, step: usize) -> usize {
    let snapshot: &Snapshot = &replayed.steps[step];
    match snapshot.decision.outcome {
        _ if replayed.differs[step] => 4,
        Outcome::Accepted { .. } | Outcome::Removed { .. } | Outcome::Restored { .. } => 3,
        Outcome::Refused { refusal: Refusal::Holding { .. } } => 2,
        Outcome::Refused { refusal: Refusal::NotFound } | Outcome::Noted => 0,
        Outcome::Refused { .. } => 1,
    }
}
