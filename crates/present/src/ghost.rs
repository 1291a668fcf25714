//! The requested pose of the board as a card in space: pixels of its parts, and closeness of the
//! live board.

use nalgebra::{Isometry3, Matrix3, Point2, Point3, Vector2};

use boresight_geometry::{Camera, Corner, Homography, boards::Board, fit_pose};

/// White margin around the outer squares, in squares.
const MARGIN: f64 = 0.4;
/// Points per side of the card; a lens bends its sides, a fisheye lens most.
const RIM_STEPS: usize = 4;
const FISHEYE_RIM_STEPS: usize = 12;
/// Distance of a rim's corner, through a lens and straight on from the inner corners, beyond which
/// the lens is too little known there, as a share of the board's longest diagonal.
const ASTRAY: f64 = 0.25;
/// Length of the arrow relative to the distance from centre to edge, and its sideways bend.
const ARROW: [f64; 2] = [0.8, 0.35];

/// Closeness of the live corners to the ghost's: 0 from half a board's width away, 1 on it. `None`
/// unless both are all corners of `board`.
pub fn closeness(live_px: &[Point2<f64>], ghost_px: &[Point2<f64>], board: &Board) -> Option<f32> {
    if [live_px.len(), ghost_px.len()] != [board.corner_count(); 2] {
        return None;
    }
    let mean = |points: &mut dyn Iterator<Item = (&Point2<f64>, &Point2<f64>)>| {
        points.map(|(a, b)| (a - b).norm()).sum::<f64>() / ghost_px.len() as f64
    };
    let mut off_px = mean(&mut live_px.iter().zip(ghost_px));
    if board.looks_the_same_upside_down() {
        let turn = |index| board.target().half_turn(index);
        let turned = (0..live_px.len()).filter_map(turn).map(|index| &live_px[index]);
        off_px = off_px.min(mean(&mut turned.zip(ghost_px)));
    }
    let span_px = (ghost_px[0] - ghost_px[ghost_px.len() - 1]).norm().max(1.0);
    Some((1.0 - 2.0 * off_px / span_px).clamp(0.0, 1.0) as f32)
}

/// Card in space, in front of the lens that shows it.
#[derive(Clone, Copy, Debug)]
pub struct Card {
    cam_from_board: Isometry3<f64>,
    lens: Camera,
    /// Half width and half height, with the white margin.
    half_m: [f64; 2],
    /// Half width and half height of the inner corners.
    inner_half_m: [f64; 2],
    /// Map from the board to pixels without distortion, in place of a lens that leads astray.
    flat: Option<Matrix3<f64>>,
    /// Points around a board that is seen; `None` to draw them through the lens.
    rim_px: Option<[Point2<f64>; 4 * FISHEYE_RIM_STEPS]>,
}

impl Card {
    /// Card with its inner corners at `corners_px`. `None` if their number isn't the board's, or no
    /// pose fits.
    pub fn new(corners_px: &[Point2<f64>], board: &Board, lens: &Camera) -> Option<Self> {
        if corners_px.len() != board.corner_count() {
            return None;
        }
        // Four corners are accurate enough for a drawing.
        let outer = board.target().rim();
        if !outer.iter().all(|at| corners_px[*at].iter().all(|px| px.is_finite())) {
            return None;
        }
        let in_board_m = board.corners_in_board_m();
        let points = outer.map(|at| in_board_m[at]);
        let corners = outer.map(|at| Corner::isotropic(corners_px[at], 1.0));
        let cam_from_board = fit_pose(lens, &points, &corners).ok()?.cam_from_board;
        let half_m = board.target().size_m().map(|side_m| 0.5 * side_m + MARGIN * board.square_m());
        let inner_half_m = points[2].coords.into();
        let (lens, flat, rim_px) = (*lens, None, None);
        let card = Self { cam_from_board, lens, half_m, inner_half_m, flat, rim_px };
        Some(Self { flat: card.straight_on(&points, &corners), ..card })
    }

    /// Homography through the inner corners, if the lens leads the rim's corners astray: a lens of
    /// few views is a guess beyond them.
    fn straight_on(&self, points_m: &[Point2<f64>], inner: &[Corner; 4]) -> Option<Matrix3<f64>> {
        let flat = *Homography::fit(points_m, inner).ok()?.image_from_board();
        let [x, y] = self.half_m;
        let rim = [(-x, -y), (x, -y), (x, y), (-x, y)];
        let span_px = (inner[0].px - inner[2].px).norm().max((inner[1].px - inner[3].px).norm());
        let mut astray = false;
        for (x, y) in rim {
            let straight = mapped(&flat, x, y)?;
            let seen = self.seen_px(x, y);
            astray |= seen.is_none_or(|px| (px - straight).norm() > ASTRAY * span_px);
        }
        astray.then_some(flat)
    }

    /// Card of the board that is seen with its inner corners at `corners_px`. Its rim follows their
    /// rows and columns, so it lies on the board before the lens is known.
    pub fn seen(corners_px: &[Point2<f64>], board: &Board, lens: &Camera) -> Option<Self> {
        let card = Self::new(corners_px, board, lens)?;
        Some(Self { rim_px: card.continued(corners_px, board), ..card })
    }

    /// Points around the card through the lens, moved by the corners' residuals: parabolas
    /// through the three nearest rows and columns. `None` if a corner is covered, or the corners
    /// aren't evenly spaced.
    fn continued(
        &self,
        corners_px: &[Point2<f64>],
        board: &Board,
    ) -> Option<[Point2<f64>; 4 * FISHEYE_RIM_STEPS]> {
        let ([columns, rows], in_board_m) =
            ([board.columns(), board.rows()], board.corners_in_board_m());
        if columns.min(rows) < 3 {
            return None;
        }
        let first_m = in_board_m[0];
        let step_m = in_board_m[columns + 1] - first_m;
        let is_even = |(index, at): (usize, &Point2<f64>)| {
            let place = Vector2::new((index % columns) as f64, (index / columns) as f64);
            (first_m + step_m.component_mul(&place) - at).norm() < 1e-6 * step_m.norm()
        };
        if !in_board_m.iter().enumerate().all(is_even) {
            return None;
        }
        let off_px: Vec<Vector2<f64>> = corners_px
            .iter()
            .zip(&in_board_m)
            .map(|(px, at)| Some(px - self.seen_px(at.x, at.y)?))
            .collect::<Option<_>>()?;
        let at_px = |x_m: f64, y_m: f64| {
            let at = (Point2::new(x_m, y_m) - first_m).component_div(&step_m);
            let ((left, across), (top, down)) = (parabola(at.x, columns), parabola(at.y, rows));
            let mut off = Vector2::zeros();
            for (row, of_row) in down.iter().enumerate() {
                for (column, of_column) in across.iter().enumerate() {
                    off += of_row * of_column * off_px[(top + row) * columns + left + column];
                }
            }
            Some(self.seen_px(x_m, y_m)? + off)
        };
        let [x, y] = self.half_m;
        let mut rim_px = [Point2::origin(); 4 * FISHEYE_RIM_STEPS];
        for (px, [x_m, y_m]) in rim_px.iter_mut().zip(around([-x, -y], [x, y], FISHEYE_RIM_STEPS)) {
            *px = at_px(x_m, y_m)?;
        }
        rim_px.iter().all(|px| px.iter().all(|at| at.is_finite())).then_some(rim_px)
    }

    /// Pixel of a point on the board; without distortion beyond the radius at which the lens model
    /// folds.
    fn px(&self, in_board_m: &Point3<f64>) -> Option<Point2<f64>> {
        let in_cam = self.cam_from_board * in_board_m;
        if !self.lens.distortion.kind.keeps_lines() {
            return self.lens.project(&in_cam);
        }
        if in_cam.z <= 0.0 {
            return None;
        }
        let ideal = Point2::new(in_cam.x / in_cam.z, in_cam.y / in_cam.z);
        let outwards = Point2::new(ideal.coords.norm(), 0.0);
        if self.lens.distortion.derivative(&outwards)[(0, 0)] > 0.0 {
            return self.lens.project(&in_cam);
        }
        Some(self.lens.pp_px + ideal.coords.component_mul(&self.lens.f_px))
    }

    fn depth_m(&self, x_m: f64, y_m: f64) -> f64 {
        (self.cam_from_board * Point3::new(x_m, y_m, 0.0)).z
    }

    /// Nearness of a point of the card to the camera: 0 for the farthest point, 1 for the nearest.
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

    fn seen_px(&self, x_m: f64, y_m: f64) -> Option<Point2<f64>> {
        match &self.flat {
            Some(flat) => mapped(flat, x_m, y_m),
            None => self.px(&Point3::new(x_m, y_m, 0.0)),
        }
    }

    /// Points around the card, clockwise from its first corner, equally many per side: pixel and
    /// nearness. `None` if a point is behind the camera.
    pub fn rim(&self) -> Option<Vec<(Point2<f64>, f32)>> {
        if let Some(rim_px) = &self.rim_px {
            let [x, y] = self.half_m;
            let places = around([-x, -y], [x, y], FISHEYE_RIM_STEPS);
            let near = |(px, [x, y]): (&Point2<f64>, [f64; 2])| (*px, self.nearness(x, y));
            return Some(rim_px.iter().zip(places).map(near).collect());
        }
        let steps =
            if self.lens.distortion.kind.keeps_lines() { RIM_STEPS } else { FISHEYE_RIM_STEPS };
        let [x, y] = self.half_m;
        let near = |[x, y]: [f64; 2]| Some((self.seen_px(x, y)?, self.nearness(x, y)));
        around([-x, -y], [x, y], steps).map(near).collect()
    }

    /// The card's four corners, clockwise: pixel and nearness. `None` if a corner is behind the
    /// camera.
    pub fn corners(&self) -> Option<[(Point2<f64>, f32); 4]> {
        let rim = self.rim()?;
        let side = rim.len() / 4;
        Some([rim[0], rim[side], rim[2 * side], rim[3 * side]])
    }

    /// Curved arrow to the edge to tip away from the camera, for programs that draw their own
    /// guide. The arrow ends at the outermost inner corners; its bend keeps it from reading as a
    /// shift. Empty if the card faces the camera.
    pub fn arrow(&self) -> Vec<Point2<f64>> {
        let rotation = self.cam_from_board.rotation.to_rotation_matrix();
        let (x, y) = (rotation[(2, 0)], rotation[(2, 1)]);
        let norm = libm::hypot(x, y);
        if norm < 0.05 {
            return Vec::new();
        }
        let (x, y) = (x / norm, y / norm);
        let [half_x, half_y] = self.inner_half_m;
        let reach_m = (half_x / x.abs().max(1e-9)).min(half_y / y.abs().max(1e-9));
        let (length_m, bend_m) = (ARROW[0] * reach_m, ARROW[1] * reach_m);
        (0..=16)
            .filter_map(|i| {
                let share = f64::from(i) / 16.0;
                let along_m = reach_m - length_m * (1.0 - share);
                // Arrives at a right angle.
                let aside_m = bend_m * (1.0 - share) * (1.0 - share);
                self.seen_px(x * along_m - y * aside_m, y * along_m + x * aside_m)
            })
            .collect()
    }
}

/// Pixel of a point on the board by a homography; `None` behind the camera.
fn mapped(image_from_board: &Matrix3<f64>, x_m: f64, y_m: f64) -> Option<Point2<f64>> {
    let at = image_from_board * Point2::new(x_m, y_m).to_homogeneous();
    (at.z > 0.0).then(|| Point2::from(at.xy() / at.z))
}

/// First of three of `count` nodes near `at`, and the weights of a parabola through them there.
fn parabola(at: f64, count: usize) -> (usize, [f64; 3]) {
    let first = (at.round() - 1.0).clamp(0.0, (count - 3) as f64);
    let t = at - first;
    (first as usize, [0.5 * (t - 1.0) * (t - 2.0), t * (2.0 - t), 0.5 * t * (t - 1.0)])
}

/// Points around a rectangle from the corner `at`, `steps` on each side.
fn around(at: [f64; 2], to: [f64; 2], steps: usize) -> impl Iterator<Item = [f64; 2]> {
    let corners = [at, [to[0], at[1]], to, [at[0], to[1]]];
    (0..4).flat_map(move |side| {
        let (from, next) = (corners[side], corners[(side + 1) % 4]);
        (0..steps).map(move |i| {
            let share = i as f64 / steps as f64;
            [from[0] + share * (next[0] - from[0]), from[1] + share * (next[1] - from[1])]
        })
    })
}

#[cfg(test)]
mod tests {
    use boresight_geometry::{Distortion, LensKind};
    use nalgebra::{UnitQuaternion, Vector3};

    use super::*;

    #[test]
    fn a_board_on_the_ghost_is_as_close_as_can_be() {
        let board = Board::new(9, 6, 1.0).expect("valid");
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
    fn the_rim_of_a_seen_board_lies_on_it_before_the_lens_is_known() {
        let board = Board::new(9, 6, 0.025).expect("valid");
        let lens = |f_px: f64, kind: LensKind, k1: f64| Camera {
            distortion: Distortion { kind, k1, ..Distortion::default() },
            ..Camera::pinhole(f_px, Point2::new(640.0, 480.0))
        };
        let guess = lens(900.0, LensKind::Perspective, 0.0);
        let turn = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), -0.6);
        let pose = Isometry3::from_parts(Vector3::new(0.12, 0.05, 0.2).into(), turn);
        let fisheye = lens(420.0, LensKind::Fisheye, -0.02);
        let wide = lens(650.0, LensKind::Perspective, -0.1);
        let narrow = lens(1200.0, LensKind::Perspective, 0.0);
        for truth in [fisheye, wide, narrow] {
            let corners: Vec<Point2<f64>> = board
                .corners_in_board_m()
                .iter()
                .map(|point| truth.px_from_board(&pose, point).expect("in front"))
                .collect();
            let sides = |card: fn(&[Point2<f64>], &Board, &Camera) -> Option<Card>,
                         lens: &Camera| {
                card(&corners, &board, lens).expect("a board").corners().expect("in front")
            };
            let true_px = sides(Card::new, &truth);
            let off_px = |card| {
                let off = sides(card, &guess);
                let off = off.iter().zip(&true_px).map(|((px, _), (there, _))| (px - there).norm());
                off.fold(0.0, f64::max)
            };
            let [seen, through_guess] = [off_px(Card::seen), off_px(Card::new)];
            let square_px = (corners[0] - corners[1]).norm();
            assert!(seen < 0.35 * square_px, "{seen} of {square_px} px");
            assert!(through_guess > 3.0 * seen, "{through_guess} {seen}");
        }
    }

    /// A fisheye lens after two views, taken for a perspective one, and the pose asked for then.
    #[test]
    fn a_lens_of_two_views_does_not_lead_the_rim_astray() {
        let board = Board::new(9, 6, 0.025).expect("valid");
        let lens = Camera {
            distortion: Distortion { k1: -0.21493, k2: 0.03098, ..Distortion::default() },
            ..Camera::pinhole(469.59, Point2::new(665.08, 481.58))
        };
        let rim_px = [(91.0, 543.0), (1239.0, 543.0), (928.0, 699.0), (402.0, 699.0)];
        let in_board_m = board.corners_in_board_m();
        let points = board.target().rim().map(|at| in_board_m[at]);
        let corners = rim_px.map(|(x, y)| Corner::isotropic(Point2::new(x, y), 1.0));
        let flat = Homography::fit(&points, &corners).expect("a square");
        let ghost: Vec<_> = in_board_m.iter().map(|at| flat.map(at).expect("in front")).collect();
        for card in [Card::new, Card::seen] {
            let card = card(&ghost, &board, &lens).expect("a board");
            for (px, _) in card.corners().expect("in front") {
                let off_px = ghost.iter().map(|at| (at - px).norm()).fold(f64::MAX, f64::min);
                assert!(off_px < 1000.0, "{px}: {off_px}");
            }
        }
    }

    #[test]
    fn the_card_is_the_whole_board_in_perspective() {
        let board = Board::new(9, 6, 0.025).expect("valid");
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
        let corners = card.corners().expect("in front");
        let [left, right] = [(0, 3), (1, 2)].map(|(a, b)| (corners[a].0 - corners[b].0).norm());
        assert!(left > 1.3 * right, "the far edge is short: {left} {right}");
        assert!(card.nearness(-card.half_m[0], 0.0) > 0.95);
        assert!(card.nearness(card.half_m[0], 0.0) < 0.05);
        let outermost = ghost.iter().map(|px| px.x).fold(f64::INFINITY, f64::min);
        let rim = card.px(&Point3::new(-card.half_m[0], 0.0, 0.0)).expect("in front");
        assert!(rim.x < outermost - 30.0, "squares and margin lie outside the inner corners");
    }
}
