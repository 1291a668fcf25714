//! The board as it should be held: a card in perspective, drawn where the lens would show it.

use egui::{Color32, Mesh, Painter, Pos2, Shape};
use nalgebra::{Isometry3, Point2, Point3};

use super::{
    super::{picture::Placed, theme},
    icon::arrow,
};
use crate::{
    board::Checkerboard,
    geometry::{Camera, Corner, fit_pose},
    session::Snapshot,
};

/// White around the outer squares, in squares.
const MARGIN: f64 = 0.4;
/// Opacity of the card while the board is far from it, and on it: then the board itself is seen.
const OPACITY: [f32; 2] = [0.62, 0.06];
/// Width of the outline at the far and at the near edge, in a picture 720 points high.
const OUTLINE: [f32; 2] = [2.0, 8.0];
/// From this closeness on the brackets are in place.
const SNAP: f32 = 0.88;
/// How far outside the outermost inner corners, which are always in the picture, the brackets wait; relative.
const WAITING: f64 = 0.12;
/// Length of a bracket's arms, in squares.
const ARM: f64 = 1.0;
/// Length of the arrow, relative to the way from the middle to the edge, and how far it bends aside.
const ARROW: [f64; 2] = [0.8, 0.35];

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

/// Draws the ghost.
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

/// The card in space, in front of the lens that shows it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Card {
    cam_from_board: Isometry3<f64>,
    lens: Camera,
    square_m: f64,
    columns: usize,
    rows: usize,
    /// Half its width and height, with the white margin.
    half_m: [f64; 2],
}

impl Card {
    /// The card whose inner corners are seen at `ghost_px`. `None` if they aren't those of `board`.
    pub(super) fn new(
        ghost_px: &[Point2<f64>],
        board: &Checkerboard,
        lens: &Camera,
    ) -> Option<Self> {
        let (columns, rows, square_m) = (board.columns(), board.rows(), board.square_m());
        if ghost_px.len() != board.corner_count() {
            return None;
        }
        // The ghost is exact: four corners are enough.
        let outer = [0, columns - 1, columns * (rows - 1), columns * rows - 1];
        let in_board_m = board.corners_in_board_m();
        let points: Vec<Point2<f64>> = outer.iter().map(|at| in_board_m[*at]).collect();
        let corners: Vec<Corner> =
            outer.iter().map(|at| Corner::isotropic(ghost_px[*at], 1.0)).collect();
        let cam_from_board = fit_pose(lens, &points, &corners).ok()?.cam_from_board;
        let half = |corners: usize| (0.5 * (corners + 1) as f64 + MARGIN) * square_m;
        let half_m = [half(columns), half(rows)];
        Some(Self { cam_from_board, lens: *lens, square_m, columns, rows, half_m })
    }

    /// Where a point is seen. Beyond the radius at which the lens model folds back, as a pinhole shows it.
    fn px(&self, in_board_m: &Point3<f64>) -> Option<Point2<f64>> {
        let in_cam = self.cam_from_board * in_board_m;
        if in_cam.z <= 0.0 {
            return None;
        }
        let ideal = Point2::new(in_cam.x / in_cam.z, in_cam.y / in_cam.z);
        let r2 = ideal.coords.norm_squared();
        let distortion = &self.lens.distortion;
        let slope = 1.0
            + r2 * (3.0 * distortion.k1 + r2 * (5.0 * distortion.k2 + r2 * 7.0 * distortion.k3));
        if slope > 0.0 {
            return Some(self.lens.px_from_normalized(&ideal));
        }
        Some(self.lens.pp_px + ideal.coords.component_mul(&self.lens.f_px))
    }

    fn depth_m(&self, x_m: f64, y_m: f64) -> f64 {
        (self.cam_from_board * Point3::new(x_m, y_m, 0.0)).z
    }

    /// How near a point of the card is to the camera: 0 for its farthest point, 1 for its nearest.
    fn nearness(&self, x_m: f64, y_m: f64) -> f32 {
        let [half_x, half_y] = self.half_m;
        let depths_m = [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)]
            .map(|(x, y)| self.depth_m(x * half_x, y * half_y));
        let near_m = depths_m.into_iter().fold(f64::INFINITY, f64::min);
        let far_m = depths_m.into_iter().fold(0.0, f64::max);
        let range_m = far_m - near_m;
        if range_m < 1e-3 * near_m {
            return 0.5;
        }
        ((far_m - self.depth_m(x_m, y_m)) / range_m) as f32
    }

    /// Points along the rim, closed, `steps` on each side.
    fn rim_m(&self, steps: usize) -> Vec<[f64; 2]> {
        let [x, y] = self.half_m;
        let around = [[-x, -y], [x, -y], [x, y], [-x, y], [-x, -y]];
        let mut rim: Vec<[f64; 2]> = around
            .windows(2)
            .flat_map(|side| {
                let ([from_x, from_y], [to_x, to_y]) = (side[0], side[1]);
                (0..steps).map(move |i| {
                    let share = i as f64 / steps as f64;
                    [from_x + share * (to_x - from_x), from_y + share * (to_y - from_y)]
                })
            })
            .collect();
        rim.push(around[0]);
        rim
    }

    /// Half the width and height of the inner corners.
    fn inner_half_m(&self) -> [f64; 2] {
        [self.columns, self.rows].map(|corners| 0.5 * (corners - 1) as f64 * self.square_m)
    }

    /// Direction on the board towards its far edge. `None` if it faces the camera.
    fn away_m(&self) -> Option<[f64; 2]> {
        let rotation = self.cam_from_board.rotation.to_rotation_matrix();
        let (x, y) = (rotation[(2, 0)], rotation[(2, 1)]);
        let norm = x.hypot(y);
        if norm < 0.05 {
            return None;
        }
        Some([x / norm, y / norm])
    }
}

/// The card on the screen.
struct Sheet<'a> {
    painter: &'a Painter,
    placed: &'a Placed,
    card: &'a Card,
}

impl Sheet<'_> {
    fn pos(&self, x_m: f64, y_m: f64) -> Option<Pos2> {
        self.card.px(&Point3::new(x_m, y_m, 0.0)).map(|px| self.placed.pos(&px))
    }

    /// Width of a line that is `points` wide in a picture 720 points high.
    fn wide(&self, points: f32) -> f32 {
        points * (self.placed.rect.height() / 720.0).clamp(0.5, 2.0)
    }

    /// The white card with its dark squares, brighter where it's nearer.
    fn surface(&self, close: f32) {
        let opacity = OPACITY[0] + close * (OPACITY[1] - OPACITY[0]);
        let Card { square_m, columns, rows, half_m, .. } = *self.card;
        let mut mesh = Mesh::default();
        let [half_x, half_y] = half_m;
        self.quad(&mut mesh, [-half_x, -half_y], [half_x, half_y], (225.0, opacity));
        let left = -0.5 * (columns + 1) as f64 * square_m;
        let top = -0.5 * (rows + 1) as f64 * square_m;
        for row in 0..=rows {
            for column in (row % 2..=columns).step_by(2) {
                let at = [left + column as f64 * square_m, top + row as f64 * square_m];
                let to = [at[0] + square_m, at[1] + square_m];
                self.quad(&mut mesh, at, to, (30.0, opacity));
            }
        }
        self.painter.add(Shape::mesh(mesh));
    }

    fn quad(&self, mesh: &mut Mesh, at: [f64; 2], to: [f64; 2], (grey, opacity): (f32, f32)) {
        let corners = [[at[0], at[1]], [to[0], at[1]], [to[0], to[1]], [at[0], to[1]]];
        let first = mesh.vertices.len() as u32;
        for [x, y] in corners {
            let Some(pos) = self.pos(x, y) else {
                mesh.vertices.truncate(first as usize);
                return;
            };
            let light = 0.55 + 0.45 * self.card.nearness(x, y);
            let color = Color32::from_gray((light * grey) as u8).gamma_multiply(opacity);
            mesh.colored_vertex(pos, color);
        }
        mesh.add_triangle(first, first + 1, first + 2);
        mesh.add_triangle(first, first + 2, first + 3);
    }

    /// The rim: thick where it's near, thin where it's far.
    fn outline(&self, color: Color32) {
        let rim = self.card.rim_m(6);
        let points: Vec<Option<(Pos2, f32)>> = rim
            .iter()
            .map(|[x, y]| {
                let near = self.card.nearness(*x, *y);
                let width = self.wide(OUTLINE[0] + near * near * (OUTLINE[1] - OUTLINE[0]));
                Some((self.pos(*x, *y)?, width))
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

    /// A curved arrow to the edge that is to go away from the camera. It ends at the outermost inner corners, which
    /// are in the picture; its bend keeps it from reading as a shift.
    fn over_the_edge(&self, color: Color32) {
        let Some([x, y]) = self.card.away_m() else { return };
        let [half_x, half_y] = self.card.inner_half_m();
        let reach_m = (half_x / x.abs().max(1e-9)).min(half_y / y.abs().max(1e-9));
        let (length_m, bend_m) = (ARROW[0] * reach_m, ARROW[1] * reach_m);
        let path: Vec<Pos2> = (0..=16)
            .filter_map(|i| {
                let share = f64::from(i) / 16.0;
                let along_m = reach_m - length_m * (1.0 - share);
                // It arrives at a right angle.
                let aside_m = bend_m * (1.0 - share) * (1.0 - share);
                self.pos(x * along_m - y * aside_m, y * along_m + x * aside_m)
            })
            .collect();
        let [below, above] = theme::outline(self.wide(9.0), color);
        arrow(self.painter, &path, above, below);
    }

    /// Brackets around the outermost inner corners; they snap onto them once the board fits.
    fn brackets(&self, close: f32) {
        let fits = close >= SNAP;
        let scale = if fits { 1.0 } else { 1.0 + WAITING * (1.0 - f64::from(close)) };
        let [half_x, half_y] = self.card.inner_half_m();
        let arm_m = ARM * self.card.square_m;
        for (x, y) in [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)] {
            let (corner_x, corner_y) = (x * half_x * scale, y * half_y * scale);
            let ends = [
                self.pos(corner_x - x * arm_m, corner_y),
                self.pos(corner_x, corner_y),
                self.pos(corner_x, corner_y - y * arm_m),
            ];
            let [Some(from), Some(corner), Some(to)] = ends else { continue };
            let near = self.card.nearness(corner_x, corner_y);
            let (color, width) = if fits {
                (theme::GREEN, 4.0 + 6.0 * near)
            } else {
                (Color32::WHITE, 2.0 + 4.0 * near)
            };
            for stroke in theme::outline(self.wide(width), color) {
                self.painter.add(Shape::line(vec![from, corner, to], stroke));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{UnitQuaternion, Vector2, Vector3};

    use super::*;

    #[test]
    fn a_board_on_the_ghost_is_as_close_as_can_be() {
        let board = Checkerboard::new(9, 6, 1.0).expect("valid");
        let ghost: Vec<Point2<f64>> = board
            .corners_in_board_m()
            .iter()
            .map(|p| Point2::new(20.0 * p.x, 20.0 * p.y))
            .collect();
        let shifted: Vec<_> = ghost.iter().map(|p| p + Vector2::new(30.0, 0.0)).collect();
        let far: Vec<_> = ghost.iter().map(|p| p + Vector2::new(300.0, 0.0)).collect();
        let close = |live: &[Point2<f64>]| closeness(live, &ghost, &board);
        assert_eq!(close(&ghost), Some(1.0));
        assert!(close(&shifted).is_some_and(|c| (0.4..0.8).contains(&c)));
        assert_eq!(close(&far), Some(0.0));
        assert_eq!(close(&ghost[1..]), None);
    }

    #[test]
    fn the_card_is_the_whole_board_in_perspective() {
        let board = Checkerboard::new(9, 6, 0.025).expect("valid");
        let lens = Camera::pinhole(980.0, Point2::new(640.0, 360.0));
        // The right edge is away from the camera.
        let turn = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), -0.7);
        let pose = Isometry3::from_parts(Vector3::new(0.0, 0.0, 0.4).into(), turn);
        let ghost: Vec<Point2<f64>> = board
            .corners_in_board_m()
            .iter()
            .map(|point| lens.px_from_board(&pose, point).expect("in front"))
            .collect();
        let card = Card::new(&ghost, &board, &lens).expect("a board");
        for (point, px) in board.corners_in_board_m().iter().zip(&ghost) {
            let seen = card.px(&Point3::new(point.x, point.y, 0.0)).expect("in front");
            assert!((seen - px).norm() < 1e-3);
        }
        let [x, y] = card.away_m().expect("it is tipped");
        assert!(x > 0.99 && y.abs() < 0.1, "{x} {y}");
        assert!(card.nearness(-card.half_m[0], 0.0) > 0.95);
        assert!(card.nearness(card.half_m[0], 0.0) < 0.05);
        let outermost = ghost.iter().map(|px| px.x).fold(f64::INFINITY, f64::min);
        let rim = card.px(&Point3::new(-card.half_m[0], 0.0, 0.0)).expect("in front");
        assert!(rim.x < outermost - 30.0, "squares and margin lie outside the inner corners");
    }
}
