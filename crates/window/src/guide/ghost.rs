//! The target card and the board's outline, drawn through the lens; and both side by side, where
//! most of the card lies outside the picture.

use egui::{Align2, Color32, FontId, Mesh, Painter, Pos2, Rect, Shape, Stroke, Vec2};
use nalgebra::Point2;

use super::super::{
    picture::{Placed, Tint},
    theme,
};
use boresight_geometry::frame::ImageSize;
use boresight_present::{
    ghost::Card,
    instruction::{Instruction, Moment},
    text::window as words,
};

/// Opacity of the card while the board is far away, and on the board, where the board itself must
/// be seen.
const OPACITY: [f32; 2] = [0.45, 0.12];
/// Width of the rim at the far and at the near edge, in a picture 720 points high.
const RIM: [f32; 2] = [3.0, 12.0];
/// Width of the board's outline.
const OUTLINE: f32 = 3.0;
/// Offset of the shadow to the right and down.
const SHADOW: f32 = 14.0;
/// Size of both cards side by side, as a share of the picture's height, with a minimum in points.
const INSET: (f32, f32) = (0.2, 96.0);

pub(super) fn paint(
    painter: &Painter,
    placed: &Placed,
    (instruction, image_size): (&Instruction, ImageSize),
) {
    let canvas = Canvas { painter, placed };
    let color = color(instruction);
    let corners = |card: &Option<Card>| canvas.points(card.as_ref()?);
    let (wanted, now) = (corners(&instruction.card), corners(&instruction.board));
    if let Some(rim) = &wanted {
        canvas.around(rim, color);
    }
    if let Some(rim) = &now {
        let holds = instruction.moment == Moment::Hold;
        let (color, width) =
            if holds { (theme::GREEN, 2.0 * OUTLINE) } else { (Color32::WHITE, OUTLINE) };
        let line: Vec<Pos2> = rim.iter().map(|(at, _)| *at).collect();
        for stroke in theme::outline(canvas.wide(width), color) {
            painter.add(Shape::closed_line(line.clone(), stroke));
        }
    }
    if let (Some(card), Some(wanted)) = (&instruction.card, &wanted)
        && card.lies_outside(image_size)
    {
        canvas.inset(now.as_deref(), wanted, color);
    }
}

/// Face of the target card, as a tint of the picture.
pub(super) fn face_of(instruction: &Instruction, image_size: ImageSize) -> Option<Tint> {
    let rim = instruction.card.as_ref()?.rim()?;
    let opacity = OPACITY[0] + closeness(instruction) * (OPACITY[1] - OPACITY[0]);
    let color = color(instruction).gamma_multiply(opacity);
    Some(Tint { rim_px: rim.into_iter().map(|(px, _)| px).collect(), image_size, color })
}

/// Paints the face without a picture to tint.
pub(super) fn paint_face(painter: &Painter, placed: &Placed, tint: &Tint) {
    let rim: Vec<(Pos2, f32)> = tint.rim_px.iter().map(|px| (placed.pos(px), 0.0)).collect();
    face(painter, &rim, tint.color);
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

    /// Draws around a card's face: its shadow, and its rim, thick at the near side.
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

    /// Both cards, small and whole, side by side: the present board and the target.
    fn inset(&self, now: Option<&Rim>, wanted: &Rim, color: Color32) {
        let picture = self.placed.rect;
        let side = (INSET.0 * picture.height()).max(INSET.1).min(0.4 * picture.width());
        let size = Vec2::new(if now.is_some() { 2.2 * side } else { 1.2 * side }, 1.15 * side);
        let gap = 1.5 * theme::UNIT;
        let place = Rect::from_min_size(picture.right_top() + Vec2::new(-gap - size.x, gap), size);
        self.painter.rect_filled(place, theme::UNIT, Color32::from_black_alpha(215));
        let reach = |rim: &Rim| {
            let bounds = Rect::from_points(&rim.iter().map(|(at, _)| *at).collect::<Vec<_>>());
            bounds.width().max(bounds.height()).max(1.0)
        };
        let largest = now.map_or(0.0, reach).max(reach(wanted));
        let scale = 0.8 * side / largest;
        let small = |rim: &Rim, at: Pos2| -> Vec<(Pos2, f32)> {
            let middle =
                Rect::from_points(&rim.iter().map(|(p, _)| *p).collect::<Vec<_>>()).center();
            // So small, only its corners count.
            let corners = rim.iter().step_by((rim.len() / 4).max(1));
            corners.map(|(p, near)| (at + (*p - middle) * scale, *near)).collect()
        };
        let cells = if now.is_some() { 2.0 } else { 1.0 };
        let cell = |number: f32| {
            Pos2::new(
                place.left() + place.width() * (number + 0.5) / cells,
                place.top() + 0.5 * side,
            )
        };
        let label = FontId::proportional((0.13 * side).max(theme::SMALL));
        let one = |rim: &Rim, at: Pos2, color: Color32, words: &str| {
            let rim = small(rim, at);
            face(self.painter, &rim, color.gamma_multiply(0.55));
            edge(self.painter, &rim, |near| 1.0 + 4.0 * near * near, color);
            let below = Pos2::new(at.x, place.bottom() - 0.4 * theme::UNIT);
            self.painter.text(below, Align2::CENTER_BOTTOM, words, label.clone(), Color32::WHITE);
        };
        if let Some(now) = now {
            one(now, cell(0.0), Color32::WHITE, words::NOW);
            one(wanted, cell(1.0), color, words::WANTED);
        } else {
            one(wanted, cell(0.0), color, words::WANTED);
        }
    }
}

fn middle(rim: &Rim) -> Pos2 {
    let sum = rim.iter().fold(Vec2::ZERO, |sum, (at, _)| sum + at.to_vec2());
    (sum / rim.len().max(1) as f32).to_pos2()
}

/// Face inside a rim.
fn face(painter: &Painter, rim: &Rim, color: Color32) {
    // With a side bent inwards, no corner sees all others, but the middle does.
    let mut mesh = Mesh::default();
    mesh.colored_vertex(middle(rim), color);
    for (at, _) in rim {
        mesh.colored_vertex(*at, color);
    }
    let count = rim.len() as u32;
    for i in 0..count {
        mesh.add_triangle(0, 1 + i, 1 + (i + 1) % count);
    }
    painter.add(Shape::mesh(mesh));
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
