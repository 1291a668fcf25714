//! The board as it should stand, drawn where the lens would show it.

use egui::{Color32, Painter, Pos2, Shape, Stroke};
use nalgebra::Point2;

use super::super::{picture::Placed, theme};
use crate::{board::Checkerboard, session::Snapshot};

/// How near the live corners are to the ghost's: 0 at half a board's width away or farther, 1 on it.
/// `None` without a board in the picture.
pub(super) fn closeness(
    live_px: &[Point2<f64>],
    ghost_px: &[Point2<f64>],
    board: &Checkerboard,
) -> Option<f32> {
    if live_px.len() != ghost_px.len() || ghost_px.is_empty() {
        return None;
    }
    let mean = |points: &mut dyn Iterator<Item = (&Point2<f64>, &Point2<f64>)>| {
        points.map(|(a, b)| (a - b).norm()).sum::<f64>() / ghost_px.len() as f64
    };
    let mut off_px = mean(&mut live_px.iter().zip(ghost_px));
    if board.looks_the_same_upside_down() {
        off_px = off_px.min(mean(&mut live_px.iter().rev().zip(ghost_px)));
    }
    let span_px = (ghost_px[0] - ghost_px[ghost_px.len() - 1]).norm().max(1.0);
    Some((1.0 - 2.0 * off_px / span_px).clamp(0.0, 1.0) as f32)
}

/// Draws the ghost: squares within the inner corners, and the board's rim.
pub(super) fn paint(painter: &Painter, placed: &Placed, snapshot: &Snapshot) {
    let Some(target) = &snapshot.target else { return };
    let board = &snapshot.setup.board;
    if target.ghost_px.len() != board.corner_count() {
        return;
    }
    let live = snapshot.live.as_ref().and_then(|live| live.corners_px.as_ref().ok());
    let close = live.and_then(|corners| closeness(corners, &target.ghost_px, board));
    // The last steps matter most, so that green comes late.
    let color = close.map_or(theme::GREY, |close| theme::approach(close.powi(3)));
    let columns = board.columns();
    let fill = color.gamma_multiply(0.22);
    for row in 0..board.rows() - 1 {
        for column in (row % 2..columns - 1).step_by(2) {
            let square = square(placed, &target.ghost_px, columns, (column, row));
            painter.add(Shape::convex_polygon(square, fill, Stroke::NONE));
        }
    }
    let rim = rim(&target.ghost_px, columns, board.rows());
    let rim: Vec<Pos2> = rim.iter().map(|px| placed.pos(px)).collect();
    for stroke in theme::strokes(3.0, color, 0.9) {
        painter.add(Shape::closed_line(rim.clone(), stroke));
    }
    // Which way it leans: a bar along the edge that is tipped away.
    let middle = placed.pos(&middle(&target.ghost_px));
    let (sin, cos) = target.tilt_azimuth_rad.sin_cos();
    let ahead = placed.pos(&(middle_shifted(&target.ghost_px, cos, sin)));
    arrow(painter, middle, ahead, color);
}

/// The four corners of a square, around it, among the inner corners in rows of `columns`; `column` and `row`
/// are those of its first corner and must not be the last ones.
pub(in super::super) fn square(
    placed: &Placed,
    corners_px: &[Point2<f64>],
    columns: usize,
    (column, row): (usize, usize),
) -> Vec<Pos2> {
    [(0, 0), (1, 0), (1, 1), (0, 1)]
        .map(|(right, down)| placed.pos(&corners_px[(row + down) * columns + column + right]))
        .into()
}

fn middle(points: &[Point2<f64>]) -> Point2<f64> {
    let sum = points.iter().fold(nalgebra::Vector2::zeros(), |sum, p| sum + p.coords);
    Point2::from(sum / points.len().max(1) as f64)
}

fn middle_shifted(points: &[Point2<f64>], cos: f64, sin: f64) -> Point2<f64> {
    let middle = middle(points);
    let reach = points.iter().map(|p| (p - middle).norm()).fold(0.0, f64::max) * 0.35;
    middle + nalgebra::Vector2::new(cos, sin) * reach
}

fn arrow(painter: &Painter, from: Pos2, to: Pos2, color: Color32) {
    for stroke in theme::strokes(4.0, color, 0.9) {
        painter.arrow(from, to - from, stroke);
    }
}

/// Around the board with its outer squares: one square outside the outermost inner corners.
fn rim(ghost_px: &[Point2<f64>], columns: usize, rows: usize) -> Vec<Point2<f64>> {
    let at = |column: usize, row: usize| ghost_px[row * columns + column];
    let outside = |corner: Point2<f64>, inner: Point2<f64>| corner + (corner - inner);
    let (right, bottom) = (columns - 1, rows - 1);
    let mut rim = Vec::with_capacity(2 * (columns + rows) + 4);
    let corner = |column: usize, row: usize| {
        let inner = |i: usize, last: usize| if i == 0 { 1 } else { last - 1 };
        let diagonal = at(inner(column, right), inner(row, bottom));
        outside(at(column, row), diagonal)
    };
    rim.push(corner(0, 0));
    rim.extend((1..right).map(|i| outside(at(i, 0), at(i, 1))));
    rim.push(corner(right, 0));
    rim.extend((1..bottom).map(|i| outside(at(right, i), at(right - 1, i))));
    rim.push(corner(right, bottom));
    rim.extend((1..right).rev().map(|i| outside(at(i, bottom), at(i, bottom - 1))));
    rim.push(corner(0, bottom));
    rim.extend((1..bottom).rev().map(|i| outside(at(0, i), at(1, i))));
    rim
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_board_on_the_ghost_is_as_close_as_can_be() {
        let board = Checkerboard::new(9, 6, 1.0).expect("valid");
        let ghost: Vec<Point2<f64>> = board
            .corners_in_board_m()
            .iter()
            .map(|p| Point2::new(20.0 * p.x, 20.0 * p.y))
            .collect();
        let shifted: Vec<_> = ghost.iter().map(|p| p + nalgebra::Vector2::new(30.0, 0.0)).collect();
        let far: Vec<_> = ghost.iter().map(|p| p + nalgebra::Vector2::new(300.0, 0.0)).collect();
        let close = |live: &[Point2<f64>]| closeness(live, &ghost, &board);
        assert_eq!(close(&ghost), Some(1.0));
        assert!(close(&shifted).is_some_and(|c| (0.4..0.8).contains(&c)));
        assert_eq!(close(&far), Some(0.0));
        assert_eq!(close(&ghost[1..]), None);
        assert_eq!(rim(&ghost, 9, 6).len(), 4 + 2 * (7 + 4));
    }
}
