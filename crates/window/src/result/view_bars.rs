//! Error of each view as a bar, and the chosen view with its residuals.

use egui::{Align2, Color32, FontId, Painter, Pos2, Rect, Shape, Stroke, pos2, vec2};

use super::super::{screen::Screen, theme};
use boresight_calibrate::Calibration;
use boresight_guide::session::{Snapshot, ViewNumber};
use boresight_present::text::charts as words;

/// Place in the calibration of `chosen`, or of the view that fits worst; `None` without views.
pub(super) fn place_of(
    chosen: Option<ViewNumber>,
    (snapshot, calibration): (&Snapshot, &Calibration),
) -> Option<usize> {
    let place = chosen
        .and_then(|number| snapshot.views.iter().position(|view| view.number == number))
        .filter(|place| *place < calibration.views.len());
    place.or_else(|| {
        let rms_px = |place: &usize| calibration.views[*place].residual_rms_px;
        (0..calibration.views.len()).max_by(|a, b| rms_px(a).total_cmp(&rms_px(b)))
    })
}

/// Colour of a view's marks: those of the chosen one are white, the others keep `color`, dimmed.
pub(super) fn lit(is_chosen: bool, color: Color32) -> Color32 {
    if is_chosen { Color32::WHITE } else { color.gamma_multiply(0.6) }
}

/// Draws the bars with a line at the error of all views. Returns the words below, and the place of
/// a view clicked at `click`.
pub(super) fn draw(
    painter: &Painter,
    area: Rect,
    (chosen, click): (usize, Option<Pos2>),
    (snapshot, calibration): (&Snapshot, &Calibration),
) -> (String, Option<usize>) {
    let rms_px: Vec<f64> = calibration.views.iter().map(|view| view.residual_rms_px).collect();
    let most_px = rms_px.iter().copied().fold(1e-12, f64::max);
    let font = FontId::proportional(theme::SMALL);
    let inner = Rect::from_min_max(area.min + vec2(8.0, 18.0), area.max - vec2(8.0, 18.0));
    let wide = (inner.width() / rms_px.len().max(1) as f32).min(64.0);
    let up = |px: f64| inner.bottom() - inner.height() * (px / most_px) as f32;
    let mut clicked = None;
    for (index, rms) in rms_px.iter().enumerate() {
        let x = inner.left() + (index as f32 + 0.5) * wide;
        let column = Rect::from_x_y_ranges(x - 0.5 * wide..=x + 0.5 * wide, area.y_range());
        if click.is_some_and(|at| column.contains(at)) {
            clicked = Some(index);
        }
        let is_chosen = index == chosen;
        let bar =
            Rect::from_x_y_ranges(x - 0.38 * wide..=x + 0.38 * wide, up(*rms)..=inner.bottom());
        painter.rect_filled(bar, 2.0, lit(is_chosen, theme::LIVE));
        let name = snapshot.views.get(index).map_or(String::new(), |view| view.number.to_string());
        let ink = lit(is_chosen, Color32::WHITE);
        let (below, above) = (pos2(x, inner.bottom() + 2.0), pos2(x, bar.top() - 2.0));
        painter.text(below, Align2::CENTER_TOP, name, font.clone(), ink);
        if is_chosen {
            let number = format!("{rms:.3} px");
            painter.text(above, Align2::CENTER_BOTTOM, number, font.clone(), ink);
        }
    }
    let y = up(calibration.rms_px.min(most_px));
    let ends = [pos2(inner.left(), y), pos2(inner.right(), y)];
    painter.extend(Shape::dashed_line(&ends, Stroke::new(1.5, theme::AMBER), 6.0, 4.0));
    let all = words::all_views(calibration.rms_px);
    painter.text(ends[1] - vec2(0.0, 3.0), Align2::RIGHT_BOTTOM, all, font, theme::AMBER);
    let said = words::per_view(most_px / calibration.rms_px.max(1e-12));
    (format!("{said}; {}", words::CLICK), clicked)
}

/// Draws the picture of the view at `place` with its residuals, enlarged.
pub(super) fn picture(
    painter: &Painter,
    area: Rect,
    screen: &Screen,
    place: usize,
    (snapshot, calibration): (&Snapshot, &Calibration),
) {
    let Some(view) = snapshot.views.get(place) else { return };
    let size = calibration.image_size;
    let room = Rect::from_min_max(area.min, area.max - vec2(0.0, 2.5 * theme::UNIT));
    let shown = super::super::picture::Placed::within(room, size, false).rect;
    if let Some(texture) = screen.thumbnails.get(&view.number) {
        let whole = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
        painter.image(texture.id(), shown, whole, Color32::from_gray(150));
    }
    let scale = shown.width() / size.width_px.max(1) as f32;
    // A typical residual becomes an arrow of a fortieth of the picture's width.
    let times = f64::from(size.width_px) / 40.0 / calibration.rms_px.max(1e-6);
    let at = |x: f64, y: f64| shown.min + vec2(x as f32 + 0.5, y as f32 + 0.5) * scale;
    for (seen, off) in super::scatter::residuals_of(place, snapshot, calibration) {
        let to = seen + off * times;
        let (from, to) = (at(seen.x, seen.y), at(to.x, to.y));
        painter.arrow(from, to - from, Stroke::new(1.2, theme::LIVE));
        painter.circle_filled(from, 1.5, Color32::WHITE);
    }
    let text = words::arrows(&words::view(&view.number.to_string()), times);
    let font = FontId::proportional(theme::BODY);
    painter.text(shown.left_bottom(), Align2::LEFT_TOP, text, font, Color32::WHITE);
}
