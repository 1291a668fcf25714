//! Correlations between the parameters of the lens.

use egui::{Align2, Color32, FontId, Painter, Rect, pos2, vec2};

use super::super::theme;
use boresight_calibrate::Calibration;
use boresight_geometry::LensParameter;
use boresight_present::text::{charts as words, knows_sd};

/// Draws the matrix, and the words below.
pub(super) fn draw(painter: &Painter, area: Rect, calibration: &Calibration) -> String {
    let sd = calibration.sd();
    let mut used: Vec<LensParameter> =
        LensParameter::ALL.into_iter().filter(|parameter| sd[parameter.index()] > 0.0).collect();
    let correlation = |a: LensParameter, b: LensParameter| {
        let (i, j) = (a.index(), b.index());
        calibration.covariance[(i, j)] / (sd[i] * sd[j])
    };
    // With square pixels, fx and fy are one parameter.
    if used.contains(&LensParameter::Fy)
        && used.contains(&LensParameter::Fx)
        && correlation(LensParameter::Fx, LensParameter::Fy) > 1.0 - 1e-9
    {
        used.retain(|parameter| *parameter != LensParameter::Fy);
    }
    if used.len() < 2 || !knows_sd(calibration) {
        return words::TOO_FEW.into();
    }
    let count = used.len() as f32 + 1.0;
    let cell = vec2(area.width() / count, area.height() / count);
    let font = FontId::proportional((0.4 * cell.y).clamp(8.0, theme::BODY));
    let middle = |column: usize, row: usize| {
        pos2(area.left() + (column as f32 + 0.5) * cell.x, area.top() + (row as f32 + 0.5) * cell.y)
    };
    let mut strongest = (0.0_f64, used[0], used[1]);
    for (i, a) in used.iter().enumerate() {
        for at in [middle(i + 1, 0), middle(0, i + 1)] {
            painter.text(at, Align2::CENTER_CENTER, a.name(), font.clone(), Color32::WHITE);
        }
        for (j, b) in used.iter().enumerate() {
            let value = correlation(*a, *b).clamp(-1.0, 1.0);
            let hue = if value < 0.0 { theme::AMBER } else { theme::LIVE };
            let color = Color32::from_gray(34).lerp_to_gamma(hue, value.abs() as f32);
            let rect = Rect::from_center_size(middle(j + 1, i + 1), cell).shrink(0.5);
            painter.rect_filled(rect, 0.0, color);
            let ink = if value.abs() > 0.5 { Color32::BLACK } else { Color32::WHITE };
            let text = format!("{value:.2}");
            painter.text(rect.center(), Align2::CENTER_CENTER, text, font.clone(), ink);
            if i < j && value.abs() > strongest.0.abs() {
                strongest = (value, *a, *b);
            }
        }
    }
    let (value, a, b) = strongest;
    words::strongest(a.name(), b.name(), value)
}
