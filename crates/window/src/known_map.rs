//! What is known of the picture: a line around the part that meets the goal, and a hatching where
//! no board was.

use egui::{Color32, Painter, Pos2, Rect, Stroke, pos2, vec2};

use super::{picture::Placed, theme};
use boresight_geometry::{GRID_COLUMNS, GRID_ROWS};
use boresight_present::known::Known;

/// Cells of the hatching for each cell of the map, along a side.
const FINER: u32 = 4;
/// Distance of two lines of the hatching, in points.
const HATCH: f32 = 9.0;

/// Draws the line around the part where the goal is met, but not inside `lit`.
pub(super) fn border(painter: &Painter, placed: &Placed, known: &Known, lit: &[Pos2]) {
    let (wide, color) = (1.5 * (placed.rect.height() / 720.0).clamp(0.7, 2.0), theme::GREEN);
    let strokes = theme::strokes(wide, color, 1.0);
    for ends in known.border() {
        let line = ends.map(|at| placed.pos_of_share(at));
        if !is_inside(lit, line[0] + 0.5 * (line[1] - line[0])) {
            for stroke in strokes {
                painter.line_segment(line, stroke);
            }
        }
    }
}

/// True if `at` is inside the polygon.
fn is_inside(polygon: &[Pos2], at: Pos2) -> bool {
    let ends = polygon.iter().cycle().skip(1);
    let crossed = polygon.iter().zip(ends).filter(|(a, b)| {
        (a.y <= at.y) != (b.y <= at.y) && at.x < a.x + (b.x - a.x) * (at.y - a.y) / (b.y - a.y)
    });
    crossed.count() % 2 == 1
}

/// Hatches the part where no board was.
pub(super) fn hatch(painter: &Painter, placed: &Placed, known: &Known) {
    let [columns, rows] = [GRID_COLUMNS, GRID_ROWS].map(|count| count * FINER);
    let cell = vec2(placed.rect.width() / columns as f32, placed.rect.height() / rows as f32);
    for row in 0..rows {
        for column in 0..columns {
            let at = [(column as f32 + 0.5) / columns as f32, (row as f32 + 0.5) / rows as f32];
            if !known.is_seen(at) {
                let cell = Rect::from_center_size(placed.pos_of_share(at), cell);
                hatch_rect(painter, cell, Color32::from_white_alpha(60));
            }
        }
    }
}

/// Lines at 45° that go on in the next rectangle.
pub(super) fn hatch_rect(painter: &Painter, rect: Rect, color: Color32) {
    let stroke = Stroke::new(1.0, color);
    let first = ((rect.left() + rect.top()) / HATCH).ceil() as i32;
    let last = ((rect.right() + rect.bottom()) / HATCH).floor() as i32;
    for line in first..=last {
        let sum = line as f32 * HATCH;
        let left = rect.left().max(sum - rect.bottom());
        let right = rect.right().min(sum - rect.top());
        painter.line_segment([pos2(left, sum - left), pos2(right, sum - right)], stroke);
    }
}
