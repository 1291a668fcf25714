//! The board as it should be held: a card in perspective, drawn where the lens would show it.

use egui::{Color32, Mesh, Painter, Pos2, Shape};
use nalgebra::{Point2, Vector2};

use super::{
    super::{picture::Placed, theme},
    icon::arrow,
};
use boresight_guide::session::Snapshot;
use boresight_present::ghost::{Card, Shade, closeness};

/// Opacity of the card while the board is far from it, and on it, where the board itself must be seen.
const OPACITY: [f32; 2] = [0.62, 0.06];
/// Width of the outline at the far and at the near edge, in a picture 720 points high.
const OUTLINE: [f32; 2] = [2.0, 8.0];
/// Closeness from which the brackets are in place.
const SNAP: f32 = 0.88;

pub(super) fn paint(painter: &Painter, placed: &Placed, snapshot: &Snapshot) {
    let Some(target) = &snapshot.target else { return };
    let board = &snapshot.setup.board;
    let Some(card) = Card::new(&target.ghost_px, board, &snapshot.lens) else { return };
    let live = snapshot.live.as_ref().and_then(|live| live.corners_px.as_ref().ok());
    let close = live.and_then(|corners| closeness(corners, &target.ghost_px, board));
    let sheet = Sheet { painter, placed, card: &card };
    sheet.surface(close.unwrap_or(0.0));
    // The last steps matter most, so that green comes late.
    let color = close.map_or(theme::GREY, |close| theme::approach(close.powi(3)));
    sheet.outline(color);
    // Once it fits, nothing has to move.
    if close.is_none_or(|close| close < SNAP) {
        sheet.over_the_edge(color);
    }
    sheet.brackets(close.unwrap_or(0.0));
}

/// The card on the screen.
struct Sheet<'a> {
    painter: &'a Painter,
    placed: &'a Placed,
    card: &'a Card,
}

impl Sheet<'_> {
    /// Width of a line that is `points` wide in a picture 720 points high.
    fn wide(&self, points: f32) -> f32 {
        points * (self.placed.rect.height() / 720.0).clamp(0.5, 2.0)
    }

    /// The white card with its dark squares, brighter where it's nearer.
    fn surface(&self, close: f32) {
        let opacity = OPACITY[0] + close * (OPACITY[1] - OPACITY[0]);
        let mut mesh = Mesh::default();
        for (shade, corners) in self.card.squares() {
            let grey = if shade == Shade::White { 225.0 } else { 30.0 };
            let first = mesh.vertices.len() as u32;
            let count = corners.len() as u32;
            let mut vertex = |px: &Point2<f64>, near: f32| {
                let light = 0.55 + 0.45 * near;
                let color = Color32::from_gray((light * grey) as u8).gamma_multiply(opacity);
                mesh.colored_vertex(self.placed.pos(px), color);
            };
            for (px, near) in &corners {
                vertex(px, *near);
            }
            if count == 4 {
                mesh.add_triangle(first, first + 1, first + 2);
                mesh.add_triangle(first, first + 2, first + 3);
                continue;
            }
            // A side that bends inwards leaves no corner from which all others are seen; the middle sees them.
            let share = 1.0 / corners.len().max(1) as f64;
            let middle = corners.iter().map(|(px, _)| px.coords * share).sum::<Vector2<f64>>();
            let near = corners.iter().map(|(_, near)| near * share as f32).sum();
            vertex(&Point2::from(middle), near);
            for i in 0..count {
                mesh.add_triangle(first + i, first + (i + 1) % count, first + count);
            }
        }
        self.painter.add(Shape::mesh(mesh));
    }

    /// The rim: thick where it's near, thin where it's far.
    fn outline(&self, color: Color32) {
        let points: Vec<Option<(Pos2, f32)>> = self
            .card
            .rim(6)
            .into_iter()
            .map(|seen| {
                let (px, near) = seen?;
                let width = self.wide(OUTLINE[0] + near * near * (OUTLINE[1] - OUTLINE[0]));
                Some((self.placed.pos(&px), width))
            })
            .collect();
        for layer in 0..2 {
            for pair in points.windows(2) {
                let [Some((from, wide)), Some((to, wide_to))] = [pair[0], pair[1]] else {
                    continue;
                };
                let stroke = theme::outline(0.5 * (wide + wide_to), color)[layer];
                self.painter.line_segment([from, to], stroke);
                self.painter.circle_filled(to, 0.5 * stroke.width, stroke.color);
            }
        }
    }

    fn over_the_edge(&self, color: Color32) {
        let path: Vec<Pos2> = self.card.arrow().iter().map(|px| self.placed.pos(px)).collect();
        if path.is_empty() {
            return;
        }
        let [below, above] = theme::outline(self.wide(9.0), color);
        arrow(self.painter, &path, above, below);
    }

    /// Brackets around the outermost inner corners; they snap onto them once the board fits.
    fn brackets(&self, close: f32) {
        let fits = close >= SNAP;
        let waiting = if fits { 0.0 } else { 1.0 - f64::from(close) };
        for (ends, near) in self.card.brackets(waiting) {
            let (color, width) = if fits {
                (theme::GREEN, 4.0 + 6.0 * near)
            } else {
                (Color32::WHITE, 2.0 + 4.0 * near)
            };
            let line = ends.map(|px| self.placed.pos(&px)).to_vec();
            for stroke in theme::outline(self.wide(width), color) {
                self.painter.add(Shape::line(line.clone(), stroke));
            }
        }
    }
}
