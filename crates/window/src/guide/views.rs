//! Thumbnails of the accepted views, each with a way to take back.

use egui::{Button, accesskit::Role};
use egui::{Color32, Frame, Image, RichText, ScrollArea, Sense, Stroke, Ui, Vec2, WidgetInfo};

use super::super::{keys::UiAction, screen::Screen, theme};
use boresight_present::text::window as words;

/// Height of a thumbnail.
const HIGH: f32 = 48.0;

/// Height of the row.
pub(super) const PANEL: f32 = 92.0;

/// Shows thumbnails in a row, the newest view last.
pub(super) fn show(ui: &mut Ui, screen: &Screen, asks: &mut Vec<UiAction>) {
    let Some(snapshot) = &screen.snapshot else { return };
    if snapshot.views.is_empty() {
        // Not below a request for something else.
        if screen.instruction().is_some_and(|instruction| instruction.card.is_some()) {
            ui.label(RichText::new(words::NO_VIEWS).weak());
        }
        return;
    }
    let mirrored = screen.preferences.mirrored;
    let size = snapshot.setup.image_size;
    let aspect = f64::from(size.width_px.max(1)) / f64::from(size.height_px.max(1));
    let small = Vec2::new(HIGH * aspect as f32, HIGH);
    ui.horizontal_top(|ui| {
        ScrollArea::horizontal().stick_to_right(true).auto_shrink([false, true]).show(ui, |ui| {
            ui.horizontal(|ui| {
                for view in snapshot.views.iter() {
                    let color = theme::direction(view.tilt_azimuth_rad);
                    let frame = Frame::new().stroke(Stroke::new(2.0, color)).inner_margin(2.0);
                    frame.show(ui, |ui| {
                        ui.vertical(|ui| {
                            ui.spacing_mut().item_spacing = Vec2::new(4.0, 1.0);
                            let tip = words::thumbnail_tip(view, mirrored);
                            let picture = match screen.thumbnails.get(&view.number) {
                                Some(texture) => ui.add(Image::new((texture.id(), small))),
                                None => ui.allocate_response(small, Sense::hover()),
                            };
                            picture.widget_info(|| WidgetInfo::labeled(Role::Image, true, &tip));
                            picture.on_hover_text(tip);
                            ui.horizontal(|ui| {
                                let caption = words::thumbnail(view, mirrored);
                                ui.label(RichText::new(caption).small());
                                if screen.is_recorded {
                                    return;
                                }
                                let remove = words::remove_view(view.number);
                                let cross = Button::new(RichText::new("×").color(Color32::WHITE))
                                    .fill(theme::RED.gamma_multiply(0.7))
                                    .small();
                                let response = ui.add(cross);
                                response.widget_info(|| {
                                    WidgetInfo::labeled(Role::Button, true, &remove)
                                });
                                if response.on_hover_text(words::REMOVE_TIP).clicked() {
                                    asks.push(UiAction::Remove(view.number));
                                }
                            });
                        });
                    });
                }
            });
        });
    });
}
