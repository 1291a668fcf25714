//! Signs of the movements in a sentence: turn, shift, nearer or farther. One at a time.

use std::f32::consts::{FRAC_PI_4, PI};

use egui::{Color32, Painter, Pos2, Rect, Shape, Stroke, Vec2};

use boresight_present::instruction::Movement;

/// Paints `movement` into `rect`, a square.
pub fn paint(painter: &Painter, rect: Rect, movement: Movement, color: Color32) {
    let (middle, half) = (rect.center(), 0.5 * rect.width());
    let stroke = Stroke::new((0.14 * half).max(2.0), color);
    let at = |angle_rad: f32, reach: f32| middle + reach * half * Vec2::angled(angle_rad);
    match movement {
        Movement::Tip { towards_rad } => {
            // A card seen from the front with a short far edge, and the direction of its edge.
            let (along, across) =
                (Vec2::angled(towards_rad) * half, Vec2::angled(towards_rad + 0.5 * PI) * half);
            let card = vec![
                middle - 0.9 * along - 0.85 * across,
                middle + 0.25 * along - 0.5 * across,
                middle + 0.25 * along + 0.5 * across,
                middle - 0.9 * along + 0.85 * across,
            ];
            painter.add(Shape::convex_polygon(card, color.gamma_multiply(0.25), stroke));
            arrow(painter, [middle - 0.35 * along, middle + along], stroke);
        }
        Movement::Shift { towards_rad } => {
            arrow(painter, [at(towards_rad + PI, 0.9), at(towards_rad, 0.95)], stroke);
        }
        Movement::Nearer | Movement::Farther => {
            let small = Rect::from_center_size(middle, Vec2::splat(0.5 * half));
            painter.rect_stroke(small, 0.0, stroke, egui::StrokeKind::Middle);
            for i in 0..4 {
                let angle_rad = FRAC_PI_4 + 0.5 * PI * i as f32;
                let (inner, outer) = (at(angle_rad, 0.5), at(angle_rad, 1.2));
                let way =
                    if movement == Movement::Nearer { [inner, outer] } else { [outer, inner] };
                arrow(painter, way, stroke);
            }
        }
    }
}

/// Paints a turn about the axis of sight into `rect`, a square.
pub fn paint_roll(painter: &Painter, rect: Rect, clockwise: bool, color: Color32) {
    const STEPS: u8 = 24;
    let (middle, half) = (rect.center(), 0.5 * rect.width());
    let stroke = Stroke::new((0.14 * half).max(2.0), color);
    let side = if clockwise { 1.0 } else { -1.0 };
    let at = |step: u8| {
        let turned_rad = FRAC_PI_4 + 1.5 * PI * f32::from(step) / f32::from(STEPS);
        let way = Vec2::angled(FRAC_PI_4 + turned_rad);
        middle + 0.75 * half * Vec2::new(side * way.x, way.y)
    };
    painter.line((0..STEPS - 3).map(at).collect(), stroke);
    arrow(painter, [at(STEPS - 4), at(STEPS)], stroke);
}

/// Line with a filled head at the last point.
fn arrow(painter: &Painter, path: [Pos2; 2], stroke: Stroke) {
    let [from, tip] = path;
    let along = (tip - from).normalized();
    let (head, across) = (3.2 * stroke.width, along.rot90() * 1.9 * stroke.width);
    // The head replaces the last part of the line.
    let base = tip - head * along;
    painter.line_segment([from, base], stroke);
    let triangle = vec![tip, base + across, base - across];
    painter.add(Shape::convex_polygon(triangle, stroke.color, Stroke::NONE));
}
