//! Buttons to step through a recording, with the signs of a player.

use egui::{Painter, Rect, Sense, Shape, Stroke, Ui, Vec2, WidgetInfo, accesskit::Role, pos2};

use super::super::theme;
use boresight_present::text::replay::Step;

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Sign {
    /// Triangles to the left, after a bar.
    ToViewBefore,
    /// A triangle to the left, before a bar.
    Back,
    /// A triangle to the right.
    Play,
    /// Two bars.
    Stop,
    /// A triangle to the right, after a bar.
    On,
    /// Triangles to the right, before a bar.
    ToNextView,
}

/// Shows the button for `step`. Returns true if pressed.
pub(super) fn button(ui: &mut Ui, sign: Sign, (label, key, tip): Step) -> bool {
    let (rect, response) =
        ui.allocate_exact_size(Vec2::new(5.0, 4.0) * theme::UNIT, Sense::click());
    let visuals = ui.style().interact(&response);
    let painter = ui.painter_at(rect.expand(2.0));
    painter.rect(
        rect,
        0.5 * theme::UNIT,
        visuals.weak_bg_fill,
        visuals.bg_stroke,
        egui::StrokeKind::Inside,
    );
    paint(&painter, rect, sign, visuals.fg_stroke);
    response.widget_info(|| WidgetInfo::labeled(Role::Button, true, label));
    response.on_hover_text(format!("{label}. {tip} ({key})")).clicked()
}

fn paint(painter: &Painter, rect: Rect, sign: Sign, stroke: Stroke) {
    let (middle, half) = (rect.center(), 0.8 * theme::UNIT);
    let stroke = Stroke::new(2.0, stroke.color);
    let bar = |x: f32| {
        let (from, to) = (middle.y - half, middle.y + half);
        painter.vline(middle.x + x, from..=to, stroke);
    };
    // The triangle's point is at `x`, in half heights, towards the sign of `way`.
    let triangle = |x: f32, way: f32| {
        let point = pos2(middle.x + x * half, middle.y);
        let base = point.x - 1.2 * way * half;
        let corners = vec![point, pos2(base, middle.y - half), pos2(base, middle.y + half)];
        painter.add(Shape::convex_polygon(corners, stroke.color, Stroke::NONE));
    };
    match sign {
        Sign::ToViewBefore => {
            bar(-1.3 * half);
            triangle(-1.0, -1.0);
            triangle(0.2, -1.0);
        }
        Sign::Back => {
            triangle(-0.8, -1.0);
            bar(0.8 * half);
        }
        Sign::Play => triangle(0.8, 1.0),
        Sign::Stop => {
            bar(-0.4 * half);
            bar(0.4 * half);
        }
        Sign::On => {
            bar(-0.8 * half);
            triangle(0.8, 1.0);
        }
        Sign::ToNextView => {
            triangle(-0.2, 1.0);
            triangle(1.0, 1.0);
            bar(1.3 * half);
        }
    }
}
