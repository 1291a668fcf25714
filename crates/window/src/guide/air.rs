//! The board in the air: a lit board that swings from its present pose to the requested one, in a
//! ring of the eight directions.

use std::f64::consts::PI;

use egui::{Align2, Color32, FontId, Mesh, Painter, Pos2, Rect, Shape, Stroke, Vec2, pos2, vec2};

use super::super::{picture::Placed, screen::Screen, theme};
use boresight_guide::session::Snapshot;
use boresight_present::{
    ghost::Card,
    instruction::Instruction,
    text::window::{Gauge, WANTED},
};

/// Radius of the disc as a share of the page's height.
const RADIUS: f32 = 165.0 / 720.0;
/// Longest side of a board, as a share of the radius.
const REACH: f32 = 1.5;
/// Largest distance of a board's corner from the middle, as a share of the radius.
const INSIDE: f32 = 0.93;
/// Seconds of the swing, at the end of it, and back.
const SWING: [f64; 3] = [0.9, 1.1, 0.3];
/// Smallest size of the present board beside the requested one.
const SMALLEST: f32 = 0.45;
/// Smallest width of a board as a share of the radius: a steeper one is drawn as wide.
const NARROWEST: f32 = 60.0 / 165.0;
/// Angle of a slot's arc.
const ARC: f32 = 36.0 * std::f32::consts::PI / 180.0;
/// Light of the far edge.
const FAR_LIGHT: f32 = 0.54;
const WHITE: Color32 = Color32::from_rgb(244, 246, 248);
const BLACK: Color32 = Color32::from_rgb(17, 22, 26);

/// Four corners with nearness.
type Quad = [(Vec2, f32); 4];

/// Place of the disc on the page.
pub fn disc(page: Rect) -> (Pos2, f32) {
    let radius = RADIUS * page.height().min(page.width() * 0.62);
    let gap = 0.12 * radius;
    (page.right_top() + vec2(-radius - gap, radius + gap), radius)
}

/// Draws the disc while a pose is asked for.
pub(super) fn paint(
    painter: &Painter,
    (page, placed): (Rect, &Placed),
    (screen, snapshot): (&Screen, &Snapshot),
    instruction: &Instruction,
) {
    let quad = |card: &Option<Card>| quad(card.as_ref()?, placed);
    let Some(wanted) = quad(&instruction.card) else { return };
    let (middle, radius) = disc(page);
    painter.circle_filled(middle, 1.06 * radius, Color32::from_black_alpha(215));
    ring(painter, (middle, radius), screen, snapshot);
    let grid = snapshot.setup.board.target().grid().map(|count| count + 1);
    let now = quad(&instruction.board);
    // Else only the attitudes are compared, at one size.
    let smaller = now.filter(|_| instruction.lacks == Some(Gauge::Size));
    let share = smaller.map_or(1.0, |now| (longest(&now) / longest(&wanted)).clamp(SMALLEST, 1.0));
    let drawn = |quad: &Quad, share: f32| widened(sized(quad, radius, share), radius);
    let now = now.map(|now| drawn(&now, share));
    let wanted = drawn(&wanted, 1.0);
    let is_still = painter.ctx().style_of(painter.ctx().theme()).animation_time == 0.0;
    let share = if is_still || now.is_none() { 1.0 } else { swing(screen.now_secs) };
    let shown = now.map_or(wanted, |now| between(&now, &wanted, share));
    board(painter, middle, &shown, grid);
    rim(painter, middle, &shown, (3.0 * radius / 165.0, theme::AMBER));
    if let Some(now) = now {
        rim(painter, middle, &now, (1.5 * radius / 165.0, Color32::from_white_alpha(150)));
    }
    let font = FontId::proportional((0.1 * radius).max(theme::SMALL));
    let below = middle + vec2(0.0, 0.86 * radius);
    painter.text(below, Align2::CENTER_CENTER, WANTED, font, Color32::from_gray(190));
}

/// Share of the way from now, 0, to the requested pose, 1, at a time.
fn swing(secs: f64) -> f64 {
    let [there, stay, back] = SWING;
    let at = secs.rem_euclid(there + stay + back);
    let ease = |share: f64| share * share * (3.0 - 2.0 * share);
    if at < there {
        ease(at / there)
    } else if at < there + stay {
        1.0
    } else {
        1.0 - ease((at - there - stay) / back)
    }
}

/// Corners of a card on the screen.
fn quad(card: &Card, placed: &Placed) -> Option<Quad> {
    let quad = card.corners()?.map(|(px, near)| (placed.pos(&px).to_vec2(), near));
    quad.iter().all(|(at, _)| at.x.is_finite() && at.y.is_finite()).then_some(quad)
}

fn longest(quad: &Quad) -> f32 {
    let bounds = Rect::from_points(&quad.map(|(at, _)| at.to_pos2()));
    bounds.width().max(bounds.height()).max(1e-3)
}

/// `quad` around the origin, as large as fits into the ring, or a share of that.
fn sized(quad: &Quad, radius: f32, share: f32) -> Quad {
    let middle = Rect::from_points(&quad.map(|(at, _)| at.to_pos2())).center().to_vec2();
    let farthest = quad.iter().map(|(at, _)| (*at - middle).length()).fold(1e-3, f32::max);
    let scale = share * radius * (REACH / longest(quad)).min(INSIDE / farthest);
    quad.map(|(at, near)| ((at - middle) * scale, near))
}

/// `quad` around the origin, stretched across its narrowest direction to [`NARROWEST`].
fn widened(quad: Quad, radius: f32) -> Quad {
    let extent = |across: Vec2| {
        let along = quad.map(|(at, _)| at.dot(across));
        along.into_iter().fold(f32::MIN, f32::max) - along.into_iter().fold(f32::MAX, f32::min)
    };
    // The narrowest direction is across a side or a diagonal.
    let ways = (0..4).flat_map(|i| (i + 1..4).map(move |k| (quad[k].0 - quad[i].0).rot90()));
    let across = ways.map(Vec2::normalized).min_by(|a, b| extent(*a).total_cmp(&extent(*b)));
    let across = across.unwrap_or(Vec2::ZERO);
    let more = (NARROWEST * radius / extent(across).max(1e-3) - 1.0).max(0.0);
    quad.map(|(at, near)| (at + more * at.dot(across) * across, near))
}

fn between(from: &Quad, to: &Quad, share: f64) -> Quad {
    let share = share as f32;
    std::array::from_fn(|i| {
        let ((a, near_a), (b, near_b)) = (from[i], to[i]);
        (a + share * (b - a), near_a + share * (near_b - near_a))
    })
}

/// Draws the squares of a board of `columns` × `rows` squares, lit more where it's nearer.
fn board(painter: &Painter, middle: Pos2, quad: &Quad, [columns, rows]: [usize; 2]) {
    let mut mesh = Mesh::default();
    let to = projection(quad.map(|(at, _)| at));
    let light = |x: f32, y: f32| {
        let [a, b, c, d] = quad.map(|(_, near)| near);
        let near = (a + x * (b - a)) * (1.0 - y) + (d + x * (c - d)) * y;
        FAR_LIGHT + (1.0 - FAR_LIGHT) * near.clamp(0.0, 1.0)
    };
    let mut patch = |[left, right]: [f32; 2], [top, bottom]: [f32; 2], color: Color32| {
        let first = mesh.vertices.len() as u32;
        for (x, y) in [(left, top), (right, top), (right, bottom), (left, bottom)] {
            let light = light(x, y);
            let [r, g, b, _] = color.to_array().map(|level| (f32::from(level) * light) as u8);
            mesh.colored_vertex(middle + to(x, y), Color32::from_rgb(r, g, b));
        }
        mesh.add_triangle(first, first + 1, first + 2);
        mesh.add_triangle(first, first + 2, first + 3);
    };
    patch([0.0, 1.0], [0.0, 1.0], WHITE);
    // A margin of 0.4 squares lies around the squares.
    let side = |index: usize, count: usize| (index as f32 + 0.4) / (count as f32 + 0.8);
    for row in 0..rows {
        for column in (0..columns).filter(|column| (row + column).is_multiple_of(2)) {
            let across = [side(column, columns), side(column + 1, columns)];
            patch(across, [side(row, rows), side(row + 1, rows)], BLACK);
        }
    }
    painter.add(Shape::mesh(mesh));
}

/// Map from the unit square to a quadrilateral, as a camera does. Heckbert 1989, section 2.2.3.
fn projection([p0, p1, p2, p3]: [Vec2; 4]) -> impl Fn(f32, f32) -> Vec2 {
    let (sum, d1, d2) = (p0 - p1 + p2 - p3, p1 - p2, p3 - p2);
    let determinant = d1.x * d2.y - d2.x * d1.y;
    let cross = |a: Vec2, b: Vec2| a.x * b.y - b.x * a.y;
    let (g, h) = if determinant.abs() < 1e-6 {
        (0.0, 0.0)
    } else {
        (cross(sum, d2) / determinant, cross(d1, sum) / determinant)
    };
    let (x, y) = (p1 - p0 + g * p1, p3 - p0 + h * p3);
    move |u, v| (p0 + u * x + v * y) / (1.0 + g * u + h * v)
}

fn rim(painter: &Painter, middle: Pos2, quad: &Quad, (width, color): (f32, Color32)) {
    let line = quad.map(|(at, _)| middle + at).to_vec();
    painter.add(Shape::closed_line(line, Stroke::new(width, color)));
}

/// Eight arcs: grey to do, amber asked for, green taken; a line joins two opposed ones.
fn ring(painter: &Painter, (middle, radius): (Pos2, f32), screen: &Screen, snapshot: &Snapshot) {
    let towards = |direction_rad: f64| {
        let mirrored = screen.preferences.mirrored;
        (if mirrored { PI - direction_rad } else { direction_rad }) as f32
    };
    let wide = radius / 165.0;
    for pair in snapshot.pairs.iter() {
        let ends = [pair.first, pair.second].map(|view| {
            let turn = towards(snapshot.views[view].tilt_azimuth_rad);
            middle + 0.95 * radius * Vec2::angled(turn)
        });
        painter.line_segment(ends, Stroke::new(1.5 * wide, theme::GREEN));
    }
    for slot in snapshot.wheel() {
        let (width, color) = match (slot.wanted, slot.view) {
            (true, _) => (8.0, theme::AMBER),
            (false, Some(_)) => (5.0, theme::GREEN),
            (false, None) => (2.5, Color32::from_gray(120)),
        };
        let turn = towards(slot.slot_rad);
        let at = |i: usize| {
            let turn = turn + ARC * (i as f32 / 12.0 - 0.5);
            pos2(middle.x + radius * turn.cos(), middle.y + radius * turn.sin())
        };
        painter.add(Shape::line((0..=12).map(at).collect(), Stroke::new(width * wide, color)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_steep_board_is_no_sliver_and_none_reaches_the_ring() {
        const RADIUS: f32 = 165.0;
        for (degrees, share) in (0..86).flat_map(|it| [(it, 1.0), (it, SMALLEST)]) {
            for eighth in 0..8 {
                // A board of 10 × 7 squares, 12.5 squares away, tipped around an axis.
                let (sin, cos) = (degrees as f32).to_radians().sin_cos();
                let axis = Vec2::angled(eighth as f32 * std::f32::consts::FRAC_PI_4);
                let corner = |x: f32, y: f32| {
                    let at = vec2(5.4 * x, 3.9 * y);
                    let (along, aside) = (at.dot(axis), at.dot(axis.rot90()));
                    let depth = 12.5 + aside * sin;
                    ((along * axis + aside * cos * axis.rot90()) / depth, -depth)
                };
                let seen =
                    [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
                let board = widened(sized(&seen, RADIUS, share), RADIUS);
                let narrowest = (0..180).map(|turn| {
                    let across = Vec2::angled((turn as f32).to_radians());
                    let along = board.map(|(at, _)| at.dot(across));
                    along.into_iter().fold(f32::MIN, f32::max)
                        - along.into_iter().fold(f32::MAX, f32::min)
                });
                let narrowest = narrowest.fold(f32::MAX, f32::min);
                assert!(narrowest > 59.5, "{degrees}° {eighth} {share}: {narrowest}");
                let reach = board.map(|(at, _)| at.length()).into_iter().fold(0.0, f32::max);
                assert!(reach < 0.97 * RADIUS, "{degrees}° {eighth} {share}: {reach}");
            }
        }
    }
}
