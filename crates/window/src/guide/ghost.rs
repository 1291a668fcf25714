//! The target card and the board's outline, drawn through the lens.

use egui::{Color32, Mesh, Painter, Pos2, Rect, Shape, Stroke, Vec2};
use nalgebra::Point2;

use super::super::{
    picture::{Part, Placed},
    theme,
};
use boresight_geometry::frame::ImageSize;
use boresight_present::{
    ghost::Card,
    instruction::{Instruction, Moment},
};

/// Width of the rim at the far and at the near edge, in a picture 720 points high.
const RIM: [f32; 2] = [3.0, 12.0];
/// Width of the board's outline, and of its part that the hold has traced.
const OUTLINE: f32 = 3.0;
const TRACE: f32 = 10.0;
/// Offset of the shadow to the right and down.
const SHADOW: f32 = 14.0;

pub(crate) fn paint(painter: &Painter, placed: &Placed, instruction: &Instruction) {
    let canvas = Canvas { painter, placed };
    let color = color(instruction);
    let corners = |card: &Option<Card>| canvas.points(card.as_ref()?);
    let (wanted, now) = (corners(&instruction.card), corners(&instruction.board));
    if let Some(rim) = &wanted {
        canvas.around(rim, color);
    }
    if let Some(rim) = &now {
        let line: Vec<Pos2> = rim.iter().map(|(at, _)| *at).collect();
        for stroke in theme::outline(canvas.wide(OUTLINE), Color32::WHITE) {
            painter.add(Shape::closed_line(line.clone(), stroke));
        }
        if let Some(hold) = instruction.hold {
            let trace = traced(&inside(line, placed.rect.shrink(canvas.wide(TRACE))), hold as f32);
            for stroke in theme::outline(canvas.wide(TRACE), theme::GREEN) {
                painter.add(Shape::line(trace.clone(), stroke));
            }
        }
    }
}

/// Part of the picture inside a card.
pub(crate) fn part_of(card: &Card, image_size: ImageSize) -> Option<Part> {
    Some(Part { rim_px: card.rim()?.into_iter().map(|(px, _)| px).collect(), image_size })
}

/// Closeness of the board to the card. The last steps matter most: green comes late.
fn closeness(instruction: &Instruction) -> f32 {
    instruction.close.unwrap_or(0.0).powi(3)
}

/// Colour of the card, green only once all deviations are small.
fn color(instruction: &Instruction) -> Color32 {
    if instruction.moment == Moment::Match {
        theme::approach(closeness(instruction))
    } else {
        theme::AMBER
    }
}

/// Part of a polygon inside `rect`: along the rectangle's sides where the polygon lies outside.
/// Sutherland and Hodgman 1974.
fn inside(polygon: Vec<Pos2>, rect: Rect) -> Vec<Pos2> {
    let sides: [(Vec2, f32); 4] = [
        (Vec2::RIGHT, -rect.left()),
        (Vec2::LEFT, rect.right()),
        (Vec2::DOWN, -rect.top()),
        (Vec2::UP, rect.bottom()),
    ];
    sides.into_iter().fold(polygon, |polygon, (inwards, offset)| {
        let depth = |at: Pos2| at.to_vec2().dot(inwards) + offset;
        let ends = polygon.iter().cycle().skip(1);
        let cut = polygon.iter().zip(ends).flat_map(|(from, to)| {
            let (a, b) = (depth(*from), depth(*to));
            let crossing = ((a < 0.0) != (b < 0.0)).then(|| *from + (*to - *from) * (a / (a - b)));
            crossing.into_iter().chain((b >= 0.0).then_some(*to))
        });
        cut.collect()
    })
}

/// First part of a closed line, clockwise from its point nearest to the upper left.
fn traced(line: &[Pos2], share: f32) -> Vec<Pos2> {
    let count = line.len();
    let from_top_left = |i: &usize| line[*i].x + line[*i].y;
    let first = (0..count).min_by(|a, b| from_top_left(a).total_cmp(&from_top_left(b)));
    let Some(first) = first else { return Vec::new() };
    let cross = |i: usize| {
        let (a, b) = (line[i].to_vec2(), line[(i + 1) % count].to_vec2());
        a.x * b.y - a.y * b.x
    };
    let is_clockwise = (0..count).map(cross).sum::<f32>() > 0.0;
    let at = |step: usize| {
        line[(first + if is_clockwise { step } else { count - step % count }) % count]
    };
    let length = |step: usize| (at(step + 1) - at(step)).length();
    let mut left = share.clamp(0.02, 1.0) * (0..count).map(length).sum::<f32>();
    let mut trace = vec![at(0)];
    for step in 0..count {
        let part = (left / length(step).max(1e-3)).min(1.0);
        trace.push(at(step) + part * (at(step + 1) - at(step)));
        left -= length(step);
        if left <= 0.0 {
            break;
        }
    }
    trace
}

/// Points around a card on the screen, with nearness.
type Rim = [(Pos2, f32)];

/// The picture on the screen.
struct Canvas<'a> {
    painter: &'a Painter,
    placed: &'a Placed,
}

impl Canvas<'_> {
    /// Width of a line that is `points` wide in a picture 720 points high.
    fn wide(&self, points: f32) -> f32 {
        points * (self.placed.rect.height() / 720.0).clamp(0.5, 2.0)
    }

    fn points(&self, card: &Card) -> Option<Vec<(Pos2, f32)>> {
        let on_screen = |(px, near): (Point2<f64>, f32)| (self.placed.pos(&px), near);
        Some(card.rim()?.into_iter().map(on_screen).collect())
    }

    /// Draws the shadow of a card, and its rim, thick at the near side. Its face is clear.
    fn around(&self, rim: &Rim, color: Color32) {
        self.shadow(rim);
        let width = |near: f32| self.wide(RIM[0] + near * near * (RIM[1] - RIM[0]));
        let [below, _] = theme::outline(0.0, color);
        edge(self.painter, rim, |near| width(near) + below.width, below.color);
        edge(self.painter, rim, width, color);
    }

    /// Draws the shadow beside the card, not below the card, where the board must be seen.
    fn shadow(&self, rim: &Rim) {
        let middle = middle(rim);
        let aside = Vec2::splat(self.wide(SHADOW));
        let mut cast = Mesh::default();
        for (i, (from, _)) in rim.iter().enumerate() {
            let (to, _) = rim[(i + 1) % rim.len()];
            let outwards = (*from + (to - *from) * 0.5) - middle;
            let across = (to - *from).rot90();
            let across = if across.dot(outwards) < 0.0 { -across } else { across };
            if across.dot(aside) > 0.0 {
                let first = cast.vertices.len() as u32;
                for at in [*from, to, to + aside, *from + aside] {
                    cast.colored_vertex(at, Color32::from_black_alpha(90));
                }
                cast.add_triangle(first, first + 1, first + 2);
                cast.add_triangle(first, first + 2, first + 3);
            }
        }
        self.painter.add(Shape::mesh(cast));
    }
}

fn middle(rim: &Rim) -> Pos2 {
    let sum = rim.iter().fold(Vec2::ZERO, |sum, (at, _)| sum + at.to_vec2());
    (sum / rim.len().max(1) as f32).to_pos2()
}

/// Line around a rim, with a `width` by nearness.
fn edge(painter: &Painter, rim: &Rim, width: impl Fn(f32) -> f32, color: Color32) {
    for (i, (from, near)) in rim.iter().enumerate() {
        let (to, near_to) = rim[(i + 1) % rim.len()];
        let across = (to - *from).normalized().rot90() * 0.5;
        let (at, at_to) = (across * width(*near), across * width(near_to));
        let side = vec![*from + at, to + at_to, to - at_to, *from - at];
        painter.add(Shape::convex_polygon(side, color, Stroke::NONE));
        painter.circle_filled(to, 0.5 * width(near_to), color);
    }
}

#[cfg(test)]
mod tests {
    use egui::pos2;

    use super::*;

    #[test]
    fn a_hold_is_traced_where_it_is_seen() {
        let picture = Rect::from_min_max(pos2(0.0, 0.0), pos2(100.0, 60.0));
        // A board that reaches beyond the picture at the left and at the top.
        let board = [[-50.0, -20.0], [80.0, -20.0], [80.0, 40.0], [-50.0, 40.0]];
        for turned in [false, true] {
            let mut rim: Vec<Pos2> = board.map(|[x, y]| pos2(x, y)).into();
            if turned {
                rim.reverse();
            }
            let seen = inside(rim, picture);
            let half = traced(&seen, 0.5);
            assert_eq!((half[0], half[1]), (pos2(0.0, 0.0), pos2(80.0, 0.0)), "clockwise");
            let length: f32 = half.windows(2).map(|ends| (ends[1] - ends[0]).length()).sum();
            assert!((length - 120.0).abs() < 1e-3, "{length}");
            let whole = traced(&seen, 1.0);
            assert!((*whole.last().expect("points") - pos2(0.0, 0.0)).length() < 1e-3);
        }
        assert!(traced(&inside(vec![pos2(200.0, 0.0), pos2(300.0, 9.0)], picture), 0.5).is_empty());
    }
}
