//! Charts of the evidence behind the result.

use egui::{
    Align2, Button, CollapsingHeader, Color32, FontId, Mesh, Painter, Pos2, Rect, RichText, Sense,
    Shape, Slider, Stroke, Ui, Vec2, WidgetInfo, accesskit::Role, pos2, vec2,
};
use nalgebra::Point2;

use super::{
    super::{
        guide::overlay::ellipse_px,
        keys::UiAction,
        picture::{Dressing, Placed},
        screen::Screen,
        theme,
    },
    correlations, distance, poses, radius,
    result_page::ResultPage,
    scatter, view_bars,
};
use boresight_calibrate::{Calibration, Drift, leave_out::consecutive};
use boresight_geometry::{
    GRID_COLUMNS, GRID_ROWS, PrincipalLine, cell_centres_px, frame::ImageSize, intersect_unweighted,
};
use boresight_guide::session::{Snapshot, ViewNumber};
use boresight_present::{
    grade::Grade,
    known::Known,
    text::{
        Act,
        charts::{self as words, Chart},
        knows_sd,
        result::meets_goal,
    },
};

/// Room for the words below a chart.
const NOTE: f32 = 88.0;
/// Largest gap for words: beyond, letters would be lost.
const LOWEST: f32 = 140.0;

/// Shows the choice of charts and the chosen chart.
pub(super) fn show(ui: &mut Ui, screen: &Screen, table: &mut ResultPage, asks: &mut Vec<UiAction>) {
    let ResultPage { chart, comparison, undistorted: share, chosen, turn_rad, .. } = table;
    choose(ui, chart, &Chart::PLAIN);
    CollapsingHeader::new(words::MORE).default_open(Chart::EXPERT.contains(chart)).show(ui, |ui| {
        choose(ui, chart, &Chart::EXPERT);
    });
    let Some(snapshot) = &screen.snapshot else { return };
    let Some(calibration) = snapshot.calibration.as_deref() else { return };
    if *chart == Chart::Undistorted {
        ui.add(Slider::new(share, 0.0..=1.0).show_value(false).text(words::AFTER));
    }
    let both = (snapshot, calibration);
    let place = view_bars::place_of(*chosen, both);
    if matches!(
        chart,
        Chart::Views | Chart::Poses | Chart::Scatter | Chart::Residuals | Chart::Radius
    ) {
        choose_view(ui, chosen, (place, snapshot), asks);
    }
    let place = place.unwrap_or_default();
    let all = ui.available_rect_before_wrap();
    // Below the choice, with its words after it.
    let size = calibration.image_size;
    let high = all.width() * size.height_px as f32 / size.width_px as f32 + NOTE;
    let is_linked = *chart == Chart::Views;
    let high = if is_linked { all.height() } else { high.min(all.height()) }.max(LOWEST);
    let area = Rect::from_min_size(all.min, vec2(all.width(), high));
    let response = ui.allocate_rect(area, Sense::click_and_drag());
    let within = Rect::from_min_max(area.min + vec2(4.0, 4.0), area.max - vec2(4.0, NOTE));
    let placed = Placed::within(within, calibration.image_size, false);
    let within = if is_linked { within } else { placed.rect };
    let painter = ui.painter_at(within);
    painter.rect_filled(within, 0.0, Color32::from_gray(28));
    *turn_rad += 0.01 * response.drag_delta().x;
    let click = response.interact_pointer_pos().filter(|_| response.clicked());
    let at = (place, click);
    let mut clicked = None;
    let note = match chart {
        Chart::Views => {
            let (above, bars) = within.split_top_bottom_at_fraction(0.6);
            let (left, right) = above.split_left_right_at_fraction(0.58);
            view_bars::picture(&painter, left.shrink(6.0), screen, place, both);
            let board = poses::draw(&painter, right, *turn_rad, at, both).1;
            let (note, bar) = view_bars::draw(&painter, bars, at, both);
            clicked = board.or(bar);
            note
        }
        Chart::Poses => {
            let (note, board) = poses::draw(&painter, within, *turn_rad, at, both);
            clicked = board;
            note
        }
        Chart::Scatter => scatter::draw(&painter, within, place, both),
        Chart::Radius => {
            let (note, corner) = radius::draw(&painter, within, at, both);
            clicked = corner;
            note
        }
        Chart::Distance => distance::draw(&painter, within, calibration),
        Chart::Correlations => correlations::draw(&painter, within, calibration),
        Chart::Uncertainty => {
            let known = screen.known.borrow_mut().of(snapshot);
            uncertainty(&painter, &placed, calibration, known.as_deref())
        }
        Chart::Residuals => residuals(&painter, &placed, place, both),
        Chart::Lines => lines(&painter, &placed, snapshot, calibration),
        Chart::Skipped => skipped(&painter, &placed, snapshot, calibration),
        Chart::Undistorted => undistorted(&painter, &placed, screen, (calibration, *share)),
        Chart::Change => {
            let drift = comparison.found().and_then(|compared| compared.drift.as_deref());
            drift.map_or(words::NOT_COMPARED.into(), |drift| {
                change(&painter, &placed, calibration.image_size, drift)
            })
        }
    };
    if let Some(view) = clicked.and_then(|place| snapshot.views.get(place)) {
        *chosen = Some(view.number);
    }
    let mut at = within.left_bottom() + vec2(0.0, 0.5 * theme::UNIT);
    if *chart == Chart::Uncertainty && knows_sd(calibration) {
        let known = screen.known.borrow_mut().of(snapshot);
        at.y += legend(ui, at, calibration, known.map_or(0.0, |known| known.share()));
    }
    // What it is, and what it shows.
    let (strong, weak) = (ui.visuals().text_color(), ui.visuals().weak_text_color());
    for (text, size, color) in
        [(note.clone(), theme::BODY, strong), (chart.tip().to_owned(), theme::BODY - 2.0, weak)]
    {
        let font = FontId::proportional(size);
        let galley = ui.painter().layout(text, font, color, all.width() - theme::UNIT);
        let height = galley.size().y;
        ui.painter().galley(pos2(all.left() + 4.0, at.y), galley, color);
        at.y += height;
    }
    let described = format!("{}: {note}", chart.name());
    response.widget_info(|| WidgetInfo::labeled(Role::Image, true, &described));
    response.on_hover_text(RichText::new(chart.tip()));
}

fn choose(ui: &mut Ui, chart: &mut Chart, charts: &[Chart]) {
    ui.horizontal_wrapped(|ui| {
        for other in charts {
            let button = Button::selectable(chart == other, other.name());
            if ui.add(button).on_hover_text(other.tip()).clicked() {
                *chart = *other;
            }
        }
    });
}

/// Buttons to choose a view, to calibrate without it, and to put back the one left out last.
fn choose_view(
    ui: &mut Ui,
    chosen: &mut Option<ViewNumber>,
    (place, snapshot): (Option<usize>, &Snapshot),
    asks: &mut Vec<UiAction>,
) {
    ui.horizontal_wrapped(|ui| {
        let number = |place: usize| snapshot.views.get(place).map(|view| view.number);
        for (name, to) in [
            (words::PREVIOUS, place.and_then(|place| number(place.checked_sub(1)?))),
            (words::NEXT, place.and_then(|place| number(place + 1))),
        ] {
            if ui.add_enabled(to.is_some(), Button::new(name)).clicked() {
                *chosen = to;
            }
        }
        if let Some(number) = place.and_then(number) {
            let button = ui.button(words::leave_out(number));
            if button.on_hover_text(words::LEAVE_OUT_TIP).clicked() {
                asks.push(UiAction::Remove(number));
            }
        }
        put_back(ui, snapshot, asks);
    });
}

/// Button to put back the view left out last, if any.
pub(super) fn put_back(ui: &mut Ui, snapshot: &Snapshot, asks: &mut Vec<UiAction>) {
    if let Some(number) = snapshot.removed
        && ui.button(words::put_back(number)).clicked()
    {
        asks.push(UiAction::Act(Act::Restore));
    }
}

/// Colours of the cells within the goal and beyond. Returns the height of the legend.
fn legend(ui: &Ui, at: Pos2, calibration: &Calibration, share: f64) -> f32 {
    let color = ui.visuals().text_color();
    let mut x = at.x;
    let [met, missed] = colors(calibration);
    for (fill, words) in [(met, meets_goal(share)), (missed, words::BEYOND_GOAL.to_owned())] {
        let font = FontId::proportional(theme::BODY - 1.0);
        let galley = ui.painter().layout_no_wrap(words, font, color);
        let square = Rect::from_min_size(pos2(x, at.y + 3.0), Vec2::splat(11.0));
        ui.painter().rect_filled(square, 2.0, fill);
        x = square.right() + 5.0;
        let wide = galley.size().x;
        ui.painter().galley(pos2(x, at.y), galley, color);
        x += wide + 2.0 * theme::UNIT;
    }
    20.0
}

/// Colours of a cell within the goal, and beyond: grey for a result that isn't trustworthy.
fn colors(calibration: &Calibration) -> [Color32; 2] {
    match Grade::of(calibration) {
        Grade::NotTrustworthy => [Color32::from_gray(150), Color32::from_gray(90)],
        Grade::Good | Grade::Care | Grade::Unfinished => [theme::GREEN, theme::AMBER],
    }
}

/// Cells of the picture by standard deviation of projection: green where the goal is met.
fn uncertainty(
    painter: &Painter,
    placed: &Placed,
    calibration: &Calibration,
    known: Option<&Known>,
) -> String {
    if !knows_sd(calibration) {
        return words::TOO_FEW.into();
    }
    let sd = &calibration.projection_sd;
    let cell =
        vec2(placed.rect.width() / GRID_COLUMNS as f32, placed.rect.height() / GRID_ROWS as f32);
    let [met, missed] = colors(calibration);
    for place in &sd.grid {
        let is_met = known.is_some_and(|it| it.is_met(calibration.image_size, &place.px));
        let fill = if is_met { met } else { missed };
        // The brighter, the surer.
        let share = 1.0 - 0.3 * (place.sd_px / sd.max_px.max(1e-12)) as f32;
        let rect = Rect::from_center_size(placed.pos(&place.px), cell);
        painter.rect_filled(
            rect.shrink(0.5),
            0.0,
            Color32::from_gray(20).lerp_to_gamma(fill, share),
        );
        let number = if place.sd_px < 0.095 {
            format!("{:.3}", place.sd_px)
        } else {
            format!("{:.2}", place.sd_px)
        };
        let font = FontId::proportional((0.28 * rect.height()).clamp(8.0, 14.0));
        painter.text(rect.center(), Align2::CENTER_CENTER, number, font, Color32::BLACK);
    }
    words::uncertainty_scale(sd.mean_px, sd.max_px)
}

/// Arrows from the expected to the seen position of each corner.
fn residuals(
    painter: &Painter,
    placed: &Placed,
    chosen: usize,
    (snapshot, calibration): (&Snapshot, &Calibration),
) -> String {
    let wide_px = f64::from(calibration.image_size.width_px);
    // A typical residual becomes an arrow of a hundredth of the picture's width.
    let times = (0.01 * wide_px / calibration.rms_px.max(1e-6)).clamp(1.0, 1e5);
    for (index, view) in snapshot.views.iter().enumerate() {
        let color = view_bars::lit(index == chosen, theme::direction(view.tilt_azimuth_rad));
        for (expected, off) in scatter::residuals_of(index, snapshot, calibration) {
            let from = placed.pos(&expected);
            let to = placed.pos(&(expected + off * times));
            painter.line_segment([from, to], Stroke::new(1.2, color));
            painter.circle_filled(from, 1.5, color);
        }
    }
    words::residual_scale(times, calibration.rms_px)
}

/// Displacement of each ray's image since the older calibration: direction and length.
fn change(painter: &Painter, placed: &Placed, image_size: ImageSize, drift: &Drift) -> String {
    let cell =
        vec2(placed.rect.width() / GRID_COLUMNS as f32, placed.rect.height() / GRID_ROWS as f32);
    // The longest arrow spans a cell.
    let longest_px = f64::from(cell.x / placed.scale().max(1e-6));
    let times = longest_px / drift.shift.px.max(1e-9);
    for px in cell_centres_px(image_size) {
        let moved = drift.displacement_at(&px);
        let share = (moved.norm() / drift.matters_px).min(1.0) as f32;
        let color = Color32::from_gray(30).lerp_to_gamma(theme::AMBER, 0.5 * share);
        let rect = Rect::from_center_size(placed.pos(&px), cell);
        painter.rect_filled(rect.shrink(0.5), 0.0, color);
        let half = moved * (0.5 * times);
        let (from, to) = (placed.pos(&(px - half)), placed.pos(&(px + half)));
        painter.arrow(from, to - from, Stroke::new(2.0, Color32::WHITE));
    }
    words::change_scale(times, drift.shift.px, drift.matters_px)
}

/// Window of `width_px` around the principal point, as large as the area allows.
fn around(placed: &Placed, pp: &Point2<f64>, width_px: f64) -> Placed {
    // Enlarges the picture until the requested part fills the area, with the point in the middle.
    let scale = f64::from(placed.rect.width()) / width_px;
    let size = ImageSize { width_px: 1, height_px: 1 };
    let side = scale as f32;
    let min =
        placed.rect.center() - vec2(((pp.x + 0.5) * scale) as f32, ((pp.y + 0.5) * scale) as f32);
    Placed::within(Rect::from_min_size(min, Vec2::splat(side)), size, false)
}

/// Lines without distortion, and the principal point with an ellipse.
fn lines(
    painter: &Painter,
    placed: &Placed,
    snapshot: &Snapshot,
    calibration: &Calibration,
) -> String {
    let pp = calibration.camera.pp_px;
    let covariance = calibration.pp_covariance_px2();
    let farthest = snapshot.views.iter().map(|v| v.pl_residual_px.abs()).fold(0.0, f64::max);
    let sd_px = covariance[(0, 0)].max(covariance[(1, 1)]).max(0.0).sqrt();
    let width_px = (6.0 * farthest.max(sd_px)).max(1e-3);
    let near = around(placed, &pp, width_px);
    for view in snapshot.views.iter() {
        let foot = view.line.origin_px + view.line.normal() * view.line.c_px;
        let along = view.line.direction();
        let middle = foot + along * along.dot(&(pp - foot));
        let ends = [middle - along * width_px, middle + along * width_px];
        let color = theme::direction(view.tilt_azimuth_rad);
        painter.line_segment(ends.map(|px| near.pos(&px)), Stroke::new(2.0, color));
    }
    if knows_sd(calibration) {
        let outline = ellipse_px(&pp, &covariance, 2.0).iter().map(|px| near.pos(px)).collect();
        painter.add(Shape::closed_line(outline, Stroke::new(2.0, theme::AMBER)));
    }
    painter.circle_filled(near.pos(&pp), 4.0, theme::AMBER);
    words::width(width_px)
}

/// Intersections of the lines with one, two or three neighbours in direction left out.
fn skipped(
    painter: &Painter,
    placed: &Placed,
    snapshot: &Snapshot,
    calibration: &Calibration,
) -> String {
    let mut by_direction: Vec<&PrincipalLine> = snapshot.views.iter().map(|v| &v.line).collect();
    by_direction.sort_by(|a, b| a.tilt_azimuth_rad.total_cmp(&b.tilt_azimuth_rad));
    let pp = calibration.camera.pp_px;
    let clouds = [1, 2, 3].map(|left_out| -> Vec<Point2<f64>> {
        if by_direction.len() < left_out + 3 {
            return Vec::new();
        }
        consecutive(by_direction.len(), left_out)
            .iter()
            .filter_map(|kept| {
                let lines: Vec<PrincipalLine> =
                    kept.iter().map(|i| by_direction[*i].clone()).collect();
                intersect_unweighted(&lines).ok().map(|point| point.px)
            })
            .collect()
    });
    let farthest = clouds.iter().flatten().map(|px| (px - pp).norm()).fold(0.0, f64::max);
    if farthest == 0.0 {
        return words::TOO_FEW.into();
    }
    let width_px = 3.0 * farthest;
    let near = around(placed, &pp, width_px);
    let covariance = calibration.pp_covariance_px2();
    let outline = ellipse_px(&pp, &covariance, 2.0).iter().map(|px| near.pos(px)).collect();
    painter.add(Shape::closed_line(outline, Stroke::new(2.0, theme::AMBER)));
    painter.circle_filled(near.pos(&pp), 4.0, theme::AMBER);
    let colors = [theme::LIVE, theme::GREEN, theme::RED];
    for (cloud, color) in clouds.iter().zip(colors) {
        for px in cloud {
            painter.circle_filled(near.pos(px), 4.0, color);
        }
    }
    words::skipped_scale(width_px, clouds.map(|cloud| cloud.len()))
}

/// Newest picture through the lens model's inverse, as a grid of pieces; `share` goes from the
/// original picture, 0, to the undistorted one, 1.
fn undistorted(
    painter: &Painter,
    placed: &Placed,
    screen: &Screen,
    (calibration, share): (&Calibration, f32),
) -> String {
    let Some(texture) = screen.picture.texture(painter.ctx(), &Dressing::default()) else {
        return words::NO_PICTURE.into();
    };
    const ACROSS: u32 = 48;
    const DOWN: u32 = 30;
    let after = share;
    let ImageSize { width_px, height_px } = calibration.image_size;
    let camera = &calibration.camera;
    let mut mesh = Mesh::with_texture(texture);
    for row in 0..=DOWN {
        for column in 0..=ACROSS {
            let share = |i: u32, n: u32, size: u32| f64::from(i) / f64::from(n) * f64::from(size);
            let px = Point2::new(
                share(column, ACROSS, width_px) - 0.5,
                share(row, DOWN, height_px) - 0.5,
            );
            let ideal = Point2::from((px - camera.pp_px).component_div(&camera.f_px));
            let seen = px + f64::from(after) * (camera.px_from_normalized(&ideal) - px);
            let uv = pos2(
                ((seen.x + 0.5) / f64::from(width_px)) as f32,
                ((seen.y + 0.5) / f64::from(height_px)) as f32,
            );
            mesh.vertices.push(egui::epaint::Vertex {
                pos: placed.pos(&px),
                uv,
                color: Color32::WHITE,
            });
        }
    }
    for row in 0..DOWN {
        for column in 0..ACROSS {
            let corner = row * (ACROSS + 1) + column;
            let below = corner + ACROSS + 1;
            mesh.add_triangle(corner, corner + 1, below);
            mesh.add_triangle(corner + 1, below + 1, below);
        }
    }
    painter.add(Shape::mesh(mesh));
    calibration.model.code().into()
}
