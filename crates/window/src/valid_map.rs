//! Cells of the picture by the uncertainty of projection: green where the goal is met, amber
//! elsewhere.

use egui::{Color32, Painter, Rect, RichText, Sense, Ui, Vec2, WidgetInfo, accesskit::Role, vec2};

use super::{picture::Placed, screen::Screen, theme};
use boresight_calibrate::{Calibration, GridSd};
use boresight_geometry::{GRID_COLUMNS, GRID_ROWS};
use boresight_present::{
    reading::valid_up_to_px,
    text::{charts as words, knows_sd},
};

/// Paints the cells, and calls `each` with every cell's value and place.
pub(super) fn cells(
    painter: &Painter,
    placed: &Placed,
    calibration: &Calibration,
    mut each: impl FnMut(&GridSd, Rect),
) {
    let sd = &calibration.projection_sd;
    let cell =
        vec2(placed.rect.width() / GRID_COLUMNS as f32, placed.rect.height() / GRID_ROWS as f32);
    let sds_px = sd.grid.iter().map(|place| place.sd_px);
    let valid_px = valid_up_to_px(sds_px, calibration.valid_area.share);
    for place in &sd.grid {
        let fill = if place.sd_px <= valid_px { theme::GREEN } else { theme::AMBER };
        // The brighter, the surer.
        let share = 1.0 - 0.3 * (place.sd_px / sd.max_px.max(1e-12)) as f32;
        let color = Color32::from_gray(20).lerp_to_gamma(fill, share);
        let rect = Rect::from_center_size(placed.pos(&place.px), cell);
        painter.rect_filled(rect.shrink(0.5), 0.0, color);
        each(place, rect);
    }
}

/// Map of the calibration so far, `high` points high, with the share of the picture within the
/// goal: fills as photos are taken.
pub(super) fn so_far(ui: &mut Ui, screen: &Screen, high: f32) {
    let Some(snapshot) = &screen.snapshot else { return };
    let size = snapshot.setup.image_size;
    let wide = high * size.width_px as f32 / size.height_px.max(1) as f32;
    let known = snapshot.calibration.as_deref().filter(|calibration| knows_sd(calibration));
    ui.vertical(|ui| {
        ui.spacing_mut().item_spacing.y = 1.0;
        let (rect, response) = ui.allocate_exact_size(Vec2::new(wide, high), Sense::hover());
        let painter = ui.painter_at(rect);
        painter.rect_filled(rect, 2.0, ui.visuals().extreme_bg_color);
        if let Some(calibration) = known {
            let placed = Placed::within(rect, size, screen.preferences.mirrored);
            cells(&painter, &placed, calibration, |_, _| {});
        }
        let caption = words::valid_so_far(known.map(|calibration| calibration.valid_area.share));
        ui.label(RichText::new(&caption).small());
        let tip = words::valid_tip(known.map(|calibration| calibration.valid_area.goal_px));
        response.widget_info(|| WidgetInfo::labeled(Role::Image, true, &caption));
        response.on_hover_text(tip);
    });
}
