//! Signs of the movements that a sentence asks for: turn, shift, nearer or farther. One at a time.

use std::f32::consts::{FRAC_PI_4, PI};

use egui::{Color32, Painter, Pos2, Rect, Shape, Stroke, Vec2};

use boresight_guide::session::{Edge, Prompt};

/// A movement, with its direction on the screen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Movement {
    /// Tip the edge at this angle, clockwise from the right, away from the camera.
    Tip { towards_rad: f32 },
    /// Shift towards this angle, clockwise from the right.
    Shift { towards_rad: f32 },
    /// Towards the camera.
    Nearer,
    /// Away from the camera.
    Farther,
}

/// The movement that `prompt` asks for, if it's one.
pub(super) fn of(prompt: Prompt) -> Option<Movement> {
    match prompt {
        Prompt::Tip(edge) | Prompt::TipInstead(edge) | Prompt::TipFurther(edge) => {
            Some(Movement::Tip { towards_rad: angle_rad(edge) })
        }
        Prompt::Closer => Some(Movement::Nearer),
        Prompt::Farther => Some(Movement::Farther),
        _ => prompt.shift().map(|[right, down]| Movement::Shift {
            towards_rad: f32::atan2(f32::from(down), f32::from(right)),
        }),
    }
}

fn angle_rad(edge: Edge) -> f32 {
    let eighths = match edge {
        Edge::Right => 0.0,
        Edge::BottomRight => 1.0,
        Edge::Bottom => 2.0,
        Edge::BottomLeft => 3.0,
        Edge::Left => 4.0,
        Edge::TopLeft => 5.0,
        Edge::Top => 6.0,
        Edge::TopRight => 7.0,
    };
    eighths * FRAC_PI_4
}

/// Paints `movement` into `rect`, a square.
pub(super) fn paint(painter: &Painter, rect: Rect, movement: Movement, color: Color32) {
    let (middle, half) = (rect.center(), 0.5 * rect.width());
    let stroke = Stroke::new((0.14 * half).max(2.0), color);
    let at = |angle_rad: f32, reach: f32| middle + reach * half * Vec2::angled(angle_rad);
    match movement {
        Movement::Tip { towards_rad } => {
            // A card seen from the front whose far edge is short, and the way of that edge.
            let (along, across) =
                (Vec2::angled(towards_rad) * half, Vec2::angled(towards_rad + 0.5 * PI) * half);
            let card = vec![
                middle - 0.9 * along - 0.85 * across,
                middle + 0.25 * along - 0.5 * across,
                middle + 0.25 * along + 0.5 * across,
                middle - 0.9 * along + 0.85 * across,
            ];
            painter.add(Shape::convex_polygon(card, color.gamma_multiply(0.25), stroke));
            arrow(painter, &[middle - 0.35 * along, middle + along], stroke, stroke);
        }
        Movement::Shift { towards_rad } => {
            arrow(painter, &[at(towards_rad + PI, 0.9), at(towards_rad, 0.95)], stroke, stroke);
        }
        Movement::Nearer | Movement::Farther => {
            let small = Rect::from_center_size(middle, Vec2::splat(0.5 * half));
            painter.rect_stroke(small, 0.0, stroke, egui::StrokeKind::Middle);
            for i in 0..4 {
                let angle_rad = FRAC_PI_4 + 0.5 * PI * i as f32;
                let (inner, outer) = (at(angle_rad, 0.5), at(angle_rad, 1.2));
                let way =
                    if movement == Movement::Nearer { [inner, outer] } else { [outer, inner] };
                arrow(painter, &way, stroke, stroke);
            }
        }
    }
}

/// A line with a filled head at its last point; `below` is a wider line that shows around it.
pub(super) fn arrow(painter: &Painter, path: &[Pos2], above: Stroke, below: Stroke) {
    let [.., before, tip] = path else { return };
    let along = (*tip - *before).normalized();
    let (head, across) = (3.2 * above.width, along.rot90() * 1.9 * above.width);
    let base = *tip - head * along;
    // The head stands in place of the last part of the line.
    let last = path.iter().rposition(|at| (*at - *tip).length() > head);
    let mut shaft = path[..last.map_or(0, |last| last + 1)].to_vec();
    shaft.push(base);
    let triangle = vec![*tip, base + across, base - across];
    let rim = Stroke::new(below.width - above.width, below.color);
    if below.width > above.width {
        painter.add(Shape::line(shaft.clone(), below));
        painter.add(Shape::closed_line(triangle.clone(), rim));
    }
    painter.add(Shape::line(shaft, above));
    painter.add(Shape::convex_polygon(triangle, above.color, Stroke::NONE));
}

#[cfg(test)]
mod tests {
    use super::*;
    use boresight_guide::session::Across;

    #[test]
    fn one_movement_is_shown_at_a_time() {
        let left = of(Prompt::Shift(Some(Across::Left), None));
        let Some(Movement::Shift { towards_rad }) = left else { unreachable!("a shift") };
        assert!((towards_rad.abs() - PI).abs() < 1e-6);
        assert_eq!(of(Prompt::Tip(Edge::Right)), Some(Movement::Tip { towards_rad: 0.0 }));
        assert_eq!(of(Prompt::Closer), Some(Movement::Nearer));
        assert_eq!(of(Prompt::HoldStill), None);
    }
}
