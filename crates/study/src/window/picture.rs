//! Picture of the simulated camera, and an enlargement around the principal point.

use egui::{
    Align2, Color32, Painter, Pos2, Rect, Sense, Shape, Stroke, Ui, Vec2, WidgetInfo,
    accesskit::Role, pos2,
};
use nalgebra::Point2;

use crate::explore::{Board, ExploreSetup, Seen};
use boresight::ui::{Placed, guide::overlay::shaded_text, theme};
use boresight_geometry::{PrincipalLine, frame::ImageSize};
use boresight_present::text::explore as words;

/// Magnification of the enlarged part against the picture.
const ENLARGED: f32 = 8.0;

/// Shows the picture. Returns true if the board was dragged.
pub(super) fn show(ui: &mut Ui, wish: &mut ExploreSetup, seen: &Seen) -> bool {
    let area = ui.available_rect_before_wrap();
    let placed = Placed::within(area.shrink(6.0), wish.setup.image_size, false);
    let response = ui.allocate_rect(area, Sense::drag());
    response.widget_info(|| WidgetInfo::labeled(Role::Image, true, words::PICTURE));
    let painter = ui.painter_at(placed.rect);
    painter.rect_filled(placed.rect, 0.0, Color32::from_gray(120));
    for board in seen.boards.iter().rev() {
        let is_first = seen.boards.first() == Some(board);
        paint_board(&painter, &placed, wish, board, if is_first { 0.9 } else { 0.35 });
    }
    paint_lines(&painter, &placed, wish, seen);
    enlarged(&painter, &placed, wish, seen);
    let Some(pointer) = response.interact_pointer_pos().filter(|_| response.dragged()) else {
        return false;
    };
    let inside = placed.rect.shrink(4.0).clamp(pointer);
    wish.shift_m = wish.shift_to(&placed.px(inside)).map(|shift| shift.clamp(-0.6, 0.6));
    true
}

fn paint_board(
    painter: &Painter,
    placed: &Placed,
    wish: &ExploreSetup,
    board: &Board,
    opacity: f32,
) {
    let columns = wish.setup.board.columns();
    let rows = wish.setup.board.rows();
    if board.corners_px.len() != columns * rows {
        return;
    }
    let at = |column: usize, row: usize| placed.pos(&board.corners_px[row * columns + column]);
    for row in 0..rows - 1 {
        for column in 0..columns - 1 {
            let white = (row + column) % 2 == 0;
            let color = Color32::from_gray(if white { 235 } else { 25 }).gamma_multiply(opacity);
            let square = square(placed, &board.corners_px, columns, (column, row));
            painter.add(Shape::convex_polygon(square, color, Stroke::NONE));
        }
    }
    let rim = vec![at(0, 0), at(columns - 1, 0), at(columns - 1, rows - 1), at(0, rows - 1)];
    let color = theme::direction(board.slot_rad).gamma_multiply(opacity.max(0.6));
    painter.add(Shape::closed_line(rim, Stroke::new(2.0, color)));
}

fn paint_lines(painter: &Painter, placed: &Placed, wish: &ExploreSetup, seen: &Seen) {
    let pp = wish.setup.camera.pp_px;
    for (index, board) in seen.boards.iter().enumerate() {
        let Some(line) = &board.line else { continue };
        let color = if index == 0 { theme::LIVE } else { theme::direction(board.slot_rad) };
        let width = if index == 0 { 3.0 } else { 1.5 };
        let ends = ends(line, 4.0 * f64::from(wish.setup.image_size.width_px));
        for stroke in theme::strokes(width, color, 1.0) {
            painter.line_segment(ends.map(|px| placed.pos(&px)), stroke);
        }
    }
    for px in &seen.skipped_px {
        painter.circle_filled(placed.pos(px), 3.5, theme::RED);
    }
    if let Some(meet) = seen.meet_px.filter(|_| seen.boards.len() > 2) {
        painter.circle_stroke(placed.pos(&meet), 6.0, Stroke::new(2.0, theme::GREEN));
    }
    let at = placed.pos(&pp);
    for stroke in theme::strokes(2.0, theme::AMBER, 1.0) {
        painter.line_segment([at - Vec2::new(9.0, 0.0), at + Vec2::new(9.0, 0.0)], stroke);
        painter.line_segment([at - Vec2::new(0.0, 9.0), at + Vec2::new(0.0, 9.0)], stroke);
    }
}

fn ends(line: &PrincipalLine, reach_px: f64) -> [Point2<f64>; 2] {
    let foot = line.origin_px + line.normal() * line.c_px;
    [foot - line.direction() * reach_px, foot + line.direction() * reach_px]
}

/// Surroundings of the principal point, a few pixels wide.
fn enlarged(painter: &Painter, placed: &Placed, wish: &ExploreSetup, seen: &Seen) {
    let side = (0.38 * placed.rect.height()).min(260.0);
    let min = pos2(placed.rect.left() + 10.0, placed.rect.bottom() - side - 10.0);
    let rect = Rect::from_min_size(min, Vec2::splat(side));
    let inside = painter.with_clip_rect(rect);
    inside.rect_filled(rect, 4.0, Color32::from_gray(20));
    // Enlarged picture, centred in the rectangle.
    let size = wish.setup.image_size;
    let large = Vec2::new(size.width_px as f32, size.height_px as f32) * placed.scale() * ENLARGED;
    let pp = wish.setup.camera.pp_px;
    let share = Vec2::new(
        (pp.x as f32 + 0.5) / size.width_px as f32,
        (pp.y as f32 + 0.5) / size.height_px as f32,
    );
    let area = Rect::from_min_size(rect.center() - share * large, large);
    let near = Placed::within(area, ImageSize { ..size }, false);
    paint_lines(&inside, &near, wish, seen);
    painter.rect_stroke(rect, 4.0, Stroke::new(1.0, theme::GREY), egui::StrokeKind::Inside);
    shaded_text(
        painter,
        rect.left_top() + Vec2::splat(6.0),
        Align2::LEFT_TOP,
        words::ENLARGED,
        11.0,
    );
}

/// Corners of a square, in order around the square, among the inner corners in rows of `columns`;
/// `column` and `row` belong to the first corner and must not be the last ones.
fn square(
    placed: &Placed,
    corners_px: &[Point2<f64>],
    columns: usize,
    (column, row): (usize, usize),
) -> Vec<Pos2> {
    [(0, 0), (1, 0), (1, 1), (0, 1)]
        .map(|(right, down)| placed.pos(&corners_px[(row + down) * columns + column + right]))
        .into()
}
