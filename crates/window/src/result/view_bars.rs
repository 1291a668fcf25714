//! Residual of each view as a bar, the largest marked and shown in the picture.

use egui::{Align2, Color32, FontId, Painter, Rect, Stroke, pos2, vec2};

use super::super::{screen::Screen, theme};
use boresight_calibrate::Calibration;
use boresight_guide::session::Snapshot;
use boresight_present::text::charts as words;

/// Share of the width for the picture of the worst view.
const PICTURE: f32 = 0.4;

/// Draws the bars, and the words below.
pub(super) fn draw(
    painter: &Painter,
    area: Rect,
    screen: &Screen,
    (snapshot, calibration): (&Snapshot, &Calibration),
) -> String {
    let rms_px: Vec<f64> = calibration.views.iter().map(|view| view.residual_rms_px).collect();
    let Some(worst) = (0..rms_px.len()).max_by(|a, b| rms_px[*a].total_cmp(&rms_px[*b])) else {
        return words::TOO_FEW.into();
    };
    let (bars, picture) = area.split_left_right_at_fraction(1.0 - PICTURE);
    let bars = bars.shrink2(vec2(8.0, 6.0));
    let high = (bars.height() / rms_px.len() as f32).min(30.0);
    let font = FontId::proportional((0.6 * high).clamp(9.0, theme::BODY));
    let room = 5.2 * font.size;
    let longest = (bars.width() - 2.0 * room).max(1.0);
    for (index, rms) in rms_px.iter().enumerate() {
        let y = bars.top() + (index as f32 + 0.5) * high;
        let color = if index == worst { theme::AMBER } else { theme::LIVE };
        let name = snapshot.views.get(index).map(|view| view.number.to_string());
        let name = words::view(&name.unwrap_or_default());
        painter.text(pos2(bars.left(), y), Align2::LEFT_CENTER, name, font.clone(), Color32::WHITE);
        let long = longest * (rms / rms_px[worst].max(1e-12)) as f32;
        let from = pos2(bars.left() + room, y - 0.32 * high);
        painter.rect_filled(Rect::from_min_size(from, vec2(long, 0.64 * high)), 2.0, color);
        let at = pos2(from.x + long + 4.0, y);
        let number = format!("{rms:.3}");
        painter.text(at, Align2::LEFT_CENTER, number, font.clone(), Color32::WHITE);
    }
    let view = snapshot.views.get(worst);
    if let Some(texture) = view.and_then(|view| screen.thumbnails.get(&view.number)) {
        let room = picture.shrink(6.0);
        let size = texture.size_vec2();
        let scale = (room.width() / size.x.max(1.0)).min(room.height() / size.y.max(1.0));
        let shown = Rect::from_min_size(room.min, size * scale);
        let whole = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
        painter.image(texture.id(), shown, whole, Color32::WHITE);
        residuals(painter, shown, worst, (snapshot, calibration));
        let number = view.map(|view| view.number.to_string()).unwrap_or_default();
        let at = shown.left_bottom() + vec2(0.0, 4.0);
        let text = words::worst(&words::view(&number));
        painter.text(at, Align2::LEFT_TOP, text, FontId::proportional(theme::BODY), theme::AMBER);
    }
    words::per_view(rms_px[worst] / calibration.rms_px.max(1e-12))
}

/// The residuals of a view in the picture, enlarged.
fn residuals(
    painter: &Painter,
    shown: Rect,
    index: usize,
    (snapshot, calibration): (&Snapshot, &Calibration),
) {
    let size = calibration.image_size;
    let scale = vec2(
        shown.width() / size.width_px.max(1) as f32,
        shown.height() / size.height_px.max(1) as f32,
    );
    // A typical residual becomes an arrow of a fortieth of the picture's width.
    let times = f64::from(size.width_px) / 40.0 / calibration.rms_px.max(1e-6);
    let at =
        |x: f64, y: f64| shown.min + vec2((x as f32 + 0.5) * scale.x, (y as f32 + 0.5) * scale.y);
    for (seen, off) in super::scatter::residuals_of(index, snapshot, calibration) {
        let to = seen + off * times;
        let ends = [at(seen.x, seen.y), at(to.x, to.y)];
        painter.line_segment(ends, Stroke::new(1.2, theme::AMBER));
    }
}
