//! One sentence, as large as the width allows.

use egui::{Align2, Color32, FontId, Response, Sense, Ui, Vec2, WidgetInfo, accesskit::Role};

use super::super::{screen::Screen, theme};
use crate::{guidance::Advice, guidance::Progress, session::Snapshot, text};

/// Sizes of the letters. A few sizes only, so that few letters are redrawn when a number changes.
const SIZES: [f32; 8] = [84.0, 72.0, 62.0, 54.0, 46.0, 40.0, 34.0, 28.0];
/// How long "Taken" stands.
const TAKEN_SECS: f64 = 1.2;

/// What is to be read, and its colour.
pub(in super::super) fn words(screen: &Screen) -> (String, Color32) {
    let Some(snapshot) = &screen.snapshot else {
        return (text::window::STARTING.into(), theme::GREY);
    };
    let over = snapshot.decision.progress != Progress::Collecting;
    let just_taken = screen.since_taken_secs().is_some_and(|since| since < TAKEN_SECS);
    if just_taken && !over && snapshot.failures.is_empty() && snapshot.camera.may_take() {
        return (text::window::taken(snapshot.views.len(), snapshot.views_to_go), theme::GREEN);
    }
    let sentence = text::window::sentence(snapshot, screen.preferences.mirrored);
    (sentence, color(snapshot))
}

fn color(snapshot: &Snapshot) -> Color32 {
    if !snapshot.failures.is_empty() || !snapshot.camera.may_take() {
        return theme::RED;
    }
    match (snapshot.decision.progress, snapshot.decision.advice) {
        (Progress::Complete, _) | (_, Advice::Holding { .. } | Advice::HoldStill { .. }) => {
            theme::GREEN
        }
        (Progress::Exhausted, _) | (_, Advice::Mend { .. }) => theme::AMBER,
        _ => Color32::WHITE,
    }
}

/// Shows it over the full width.
pub(super) fn show(ui: &mut Ui, screen: &Screen) -> Response {
    let (words, color) = words(screen);
    let width = ui.available_width();
    let high = (ui.ctx().content_rect().height() * 0.14).clamp(64.0, 130.0);
    let (rect, response) = ui.allocate_exact_size(Vec2::new(width, high), Sense::hover());
    let painter = ui.painter_at(rect);
    painter.rect_filled(rect, 0.0, Color32::from_gray(18));
    let room = rect.shrink2(Vec2::new(16.0, 2.0)).size();
    let fitting = SIZES
        .iter()
        .map(|size| painter.layout(words.clone(), FontId::proportional(*size), color, room.x));
    // The largest in which it fits; letters of one line read best from afar.
    let mut galley = None;
    for next in fitting {
        let fits = next.size().y <= room.y && next.size().x <= room.x;
        galley = Some(next);
        if fits {
            break;
        }
    }
    if let Some(galley) = galley {
        let at = Align2::CENTER_CENTER.anchor_size(rect.center(), galley.size());
        painter.galley(at.min, galley, color);
    }
    response.widget_info(|| WidgetInfo::labeled(Role::Status, true, &words));
    response
}
