//! Numbers of the calibration so far.

use egui::{Grid, RichText, Ui};

use super::super::{screen::Screen, theme};
use boresight_present::text::{Trouble, window as words};

/// Maximum letters of a value in the usual size.
const LONG: usize = 24;

pub(super) fn show(ui: &mut Ui, screen: &Screen) {
    let Some(snapshot) = &screen.snapshot else { return };
    let values = [
        Some(words::principal_point(snapshot)),
        Some(words::focal_length(snapshot)),
        words::precision(snapshot),
        words::precision_over_picture(snapshot),
        Some(words::views(snapshot)),
        Some(words::pair_balance(snapshot)),
        Some(words::coverage(snapshot)),
        Some(words::newest_focal(&snapshot.views)),
        words::predicted(snapshot),
        words::measured_noise(snapshot),
    ];
    Grid::new("numbers").num_columns(2).min_row_height(16.0).spacing([8.0, 1.0]).show(ui, |ui| {
        for ((name, tip), value) in words::NUMBERS.into_iter().zip(values) {
            let Some(value) = value else { continue };
            ui.label(RichText::new(name).size(theme::SMALL).weak()).on_hover_text(tip);
            // Long values in a row are small: those of a large picture fit, too.
            let size = if value.chars().count() > LONG { theme::SMALL } else { theme::BODY };
            ui.label(RichText::new(value).size(size).strong()).on_hover_text(tip);
            ui.end_row();
        }
    });
}

/// State of a live camera's controls, and doubts about the camera.
pub(super) fn camera(ui: &mut Ui, screen: &Screen, doubts: &[Trouble]) {
    let Some(snapshot) = &screen.snapshot else { return };
    let lines = words::camera_lines(&snapshot.camera, &screen.adjustables);
    if lines.is_empty() {
        return;
    }
    ui.separator();
    ui.label(RichText::new(words::CAMERA).strong()).on_hover_text(words::CAMERA_TIP);
    Grid::new("camera").num_columns(2).show(ui, |ui| {
        for (name, state) in lines {
            ui.label(RichText::new(name).small());
            ui.label(RichText::new(state).small());
            ui.end_row();
        }
    });
    for Trouble { what, action, detail, .. } in doubts {
        let tip = if detail.is_empty() { action.clone() } else { format!("{action}\n{detail}") };
        ui.label(RichText::new(what).small().color(theme::AMBER)).on_hover_text(tip);
    }
}
