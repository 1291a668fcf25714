//! A lost camera: dims the last picture, to tell it from a live one.

use egui::{Align2, Color32, FontId, Painter, Rect, Shape, Stroke, StrokeKind, Vec2};

use super::super::theme;
use boresight_present::text::window as words;

/// Paints over the last picture; the camera has been lost for `secs`.
pub(super) fn paint(painter: &Painter, rect: Rect, secs: f64) {
    painter.rect_filled(rect, 0.0, Color32::from_black_alpha(190));
    let side = 0.22 * rect.height();
    let (middle, stroke) = (rect.center(), Stroke::new(0.06 * side, theme::GREY));
    let body = Rect::from_center_size(middle, Vec2::new(1.4 * side, 0.9 * side));
    painter.rect_stroke(body, 0.12 * side, stroke, StrokeKind::Middle);
    painter.circle_stroke(middle, 0.26 * side, stroke);
    for (width, color) in [(0.16 * side, Color32::BLACK), (0.08 * side, theme::RED)] {
        let cross = vec![middle - Vec2::splat(0.75 * side), middle + Vec2::splat(0.75 * side)];
        painter.add(Shape::line(cross, Stroke::new(width, color)));
    }
    let below = middle + Vec2::new(0.0, side);
    let font = FontId::proportional(0.3 * side);
    painter.text(below, Align2::CENTER_TOP, words::lost_for(secs), font, Color32::WHITE);
}
