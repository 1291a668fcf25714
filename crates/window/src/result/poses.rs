//! The boards as held before the camera, and the camera's field of view.

use egui::{Color32, Painter, Pos2, Rect, Shape, Stroke, vec2};
use nalgebra::{Point3, Vector3};

use super::{super::theme, view_bars::lit};
use boresight_calibrate::Calibration;
use boresight_guide::session::Snapshot;
use boresight_present::{
    reading::fit::{field, from_aside},
    text::charts as words,
};

/// Room around the drawing, in points.
const MARGIN: f32 = 14.0;
/// Draws the scene as seen from `turn_rad` to the side. Returns the words below, and the place of a
/// view clicked at `click`.
pub(super) fn draw(
    painter: &Painter,
    area: Rect,
    turn_rad: f32,
    (chosen, click): (usize, Option<Pos2>),
    (snapshot, calibration): (&Snapshot, &Calibration),
) -> (String, Option<usize>) {
    let board = &snapshot.setup.board;
    let corners_m = board.corners_in_board_m();
    let rim = board.target().rim();
    let boards: Vec<Vec<Point3<f64>>> = calibration
        .views
        .iter()
        .map(|view| {
            let corner = |index: usize| {
                let at = corners_m[index];
                view.cam_from_board * Point3::new(at.x, at.y, 0.0)
            };
            rim.map(corner).to_vec()
        })
        .collect();
    let away_m = || boards.iter().flatten().map(|point| point.coords.norm());
    let farthest_m = away_m().fold(0.0, f64::max);
    let nearest_m = away_m().fold(f64::INFINITY, f64::min);
    if farthest_m <= 0.0 {
        return (words::TOO_FEW.into(), None);
    }
    let size = calibration.image_size;
    let size_px = (f64::from(size.width_px), f64::from(size.height_px));
    let field = field(&calibration.camera, size_px, farthest_m);
    let turn = from_aside(f64::from(turn_rad));
    // Seen from far away: parallel projection keeps sizes comparable.
    let seen = |point: &Point3<f64>| {
        let at = turn * (point - Vector3::new(0.0, 0.0, 0.5 * farthest_m));
        (at.x, at.y, at.z)
    };
    let camera = Point3::origin();
    let all = boards.iter().flatten().chain(&field).chain(std::iter::once(&camera));
    let (mut low, mut high) = ([f64::MAX; 2], [f64::MIN; 2]);
    for (x, y, _) in all.map(seen) {
        (low, high) = ([low[0].min(x), low[1].min(y)], [high[0].max(x), high[1].max(y)]);
    }
    let room = area.shrink(MARGIN);
    let scale = (f64::from(room.width()) / (high[0] - low[0]).max(1e-9))
        .min(f64::from(room.height()) / (high[1] - low[1]).max(1e-9));
    let middle = [0.5 * (low[0] + high[0]), 0.5 * (low[1] + high[1])];
    let pos = |point: &Point3<f64>| -> Pos2 {
        let (x, y, _) = seen(point);
        room.center() + vec2(((x - middle[0]) * scale) as f32, ((y - middle[1]) * scale) as f32)
    };
    let grey = Stroke::new(1.0, Color32::from_gray(120));
    for edge in &field {
        painter.line_segment([pos(&Point3::origin()), pos(edge)], grey);
    }
    painter.add(Shape::closed_line(field.iter().map(pos).collect(), grey));
    painter.circle_filled(pos(&Point3::origin()), 4.0, Color32::WHITE);
    // The farthest first.
    let mut order: Vec<usize> = (0..boards.len()).collect();
    let depth = |index: usize| boards[index].iter().map(|point| seen(point).2).sum::<f64>();
    order.sort_by(|a, b| depth(*b).total_cmp(&depth(*a)));
    let mut hit = Vec::new();
    for index in order {
        let azimuth = snapshot.views.get(index).map_or(0.0, |view| view.tilt_azimuth_rad);
        let color = lit(index == chosen, theme::direction(azimuth));
        let points: Vec<Pos2> = boards[index].iter().map(pos).collect();
        if click.is_some_and(|at| is_within(at, &points)) {
            hit.push(index);
        }
        let face = color.gamma_multiply(0.25);
        painter.add(Shape::convex_polygon(points.clone(), face, Stroke::NONE));
        painter.add(Shape::closed_line(points, Stroke::new(1.5, color)));
    }
    let said = words::poses(boards.len(), nearest_m, farthest_m);
    // The nearest one, then those behind it.
    let before = hit.iter().position(|index| *index == chosen).filter(|at| *at > 0);
    let clicked = before.map_or(hit.last().copied(), |at| hit.get(at - 1).copied());
    (format!("{said}; {}", words::DRAG), clicked)
}

/// True if `at` is within the convex polygon `points`.
fn is_within(at: Pos2, points: &[Pos2]) -> bool {
    let next = points.iter().cycle().skip(1);
    let sides = points.iter().zip(next).map(|(a, b)| {
        let (side, off) = (*b - *a, at - *a);
        side.x * off.y - side.y * off.x
    });
    let (mut least, mut most) = (f32::INFINITY, f32::NEG_INFINITY);
    sides.for_each(|side| (least, most) = (least.min(side), most.max(side)));
    least >= 0.0 || most <= 0.0
}
