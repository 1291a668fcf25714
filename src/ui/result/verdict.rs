//! The verdict in words, with the findings and the numbers.

use egui::{Grid, RichText, Sense, Ui, Vec2};

use super::{
    super::{screen::Screen, theme},
    comparison::{self, Comparison},
};
use crate::{
    calibration::{Severity, Verdict},
    text::{self, window as words},
};

/// Shows them, and what a comparison found.
pub(super) fn show(ui: &mut Ui, screen: &Screen, compared: &Comparison) {
    let snapshot = screen.snapshot.as_ref();
    let shown = snapshot.and_then(|snapshot| Some((snapshot, snapshot.calibration.as_ref()?)));
    let Some((snapshot, calibration)) = shown else {
        ui.label(RichText::new(words::NO_RESULT).size(22.0));
        return;
    };
    let color = match calibration.verdict {
        Verdict::Good => theme::GREEN,
        Verdict::Care => theme::AMBER,
        Verdict::Untrustworthy => theme::RED,
    };
    ui.label(RichText::new(text::verdict(calibration.verdict)).size(28.0).strong().color(color));
    ui.add_space(6.0);
    for finding in &calibration.findings {
        let (what, action) = text::finding_in_session(finding, &snapshot.views);
        let mark = match finding.severity {
            Severity::Info => theme::GREY,
            Severity::Care => theme::AMBER,
            Severity::Bad => theme::RED,
        };
        ui.horizontal_wrapped(|ui| {
            let (dot, _) = ui.allocate_exact_size(Vec2::splat(16.0), Sense::hover());
            ui.painter().circle_filled(dot.center(), 5.0, mark);
            ui.label(RichText::new(format!("{what}.")).size(16.0))
                .on_hover_text(finding.code.code());
            ui.label(RichText::new(action).size(16.0).strong());
        });
    }
    if calibration.findings.is_empty() {
        ui.label(words::NO_FINDINGS);
    }
    comparison::show(ui, compared);
    ui.add_space(8.0);
    Grid::new("result").num_columns(2).spacing([24.0, 4.0]).show(ui, |ui| {
        for (name, value) in words::result_lines(calibration) {
            ui.label(RichText::new(name).weak());
            ui.label(value);
            ui.end_row();
        }
    });
    ui.add_space(8.0);
    ui.label(RichText::new(words::METHODS).strong()).on_hover_text(words::METHODS_TIP);
    Grid::new("methods").num_columns(2).spacing([24.0, 4.0]).show(ui, |ui| {
        for (name, value, tip) in words::method_lines(&calibration.principal_point) {
            ui.label(RichText::new(name).weak()).on_hover_text(tip);
            ui.label(value);
            ui.end_row();
        }
    });
}
