//! Comparison with an older calibration.

use std::path::{Path, PathBuf};

use egui::{ComboBox, RichText, TextEdit, Ui};

use super::super::{keys::UiAction, theme};
use super::error_lines::error_lines;
use boresight_app::{
    explain::UserError,
    session::comparison::Compared,
    window::services::{Comparing, Services, Wake},
};
use boresight_calibrate::DriftVerdict;
use boresight_present::text::{self, result as words};

/// A comparison with an older calibration.
#[derive(Debug, Default)]
pub struct Comparison {
    /// Typed file name.
    pub path: String,
    /// Candidate files.
    pub older: Vec<PathBuf>,
    /// Outcome of the comparison.
    pub outcome: Outcome,
}

/// Outcome of a comparison.
#[derive(Debug, Default)]
pub enum Outcome {
    /// No comparison.
    #[default]
    Nothing,
    /// The comparison is under way.
    Working(Comparing),
    /// Comparison, or the reason for failure.
    Done(Result<Compared, UserError>),
}

impl Comparison {
    /// Comparison of a session with a calibration from `older`.
    pub(in super::super) fn with(older: Vec<PathBuf>) -> Self {
        Self { older, ..Self::default() }
    }

    /// True while a comparison is under way.
    pub(in super::super) fn is_working(&self) -> bool {
        matches!(self.outcome, Outcome::Working(_))
    }

    /// Starts comparing the session in `folder` with the calibration in `old`, unless a comparison
    /// is under way.
    pub(in super::super) fn begin(
        &mut self,
        services: &mut dyn Services,
        (folder, old): (&Path, &Path),
        wake: Wake,
    ) {
        if self.is_working() {
            return;
        }
        self.path = old.display().to_string();
        self.outcome = match services.compare(folder, old, wake) {
            Ok(comparing) => Outcome::Working(comparing),
            Err(trouble) => Outcome::Done(Err(trouble)),
        };
    }

    /// Takes the result, if ready. True if there is something new to see. Never waits.
    pub(in super::super) fn look(&mut self) -> bool {
        let Outcome::Working(comparing) = &self.outcome else { return false };
        let found = match comparing.outcome() {
            Some(found) => found,
            None if comparing.is_over() => {
                Err(UserError { what: text::NOT_COMPARED.into(), action: None })
            }
            None => return false,
        };
        self.outcome = Outcome::Done(found);
        true
    }

    /// Result, if any.
    pub fn found(&self) -> Option<&Compared> {
        match &self.outcome {
            Outcome::Done(Ok(compared)) => Some(compared),
            Outcome::Nothing | Outcome::Working(_) | Outcome::Done(Err(_)) => None,
        }
    }
}

/// Shows the choice of the older calibration.
pub(super) fn ask(ui: &mut Ui, comparison: &mut Comparison, asks: &mut Vec<UiAction>) {
    let name = ui.label(words::COMPARE).on_hover_text(words::COMPARE_TIP);
    ui.horizontal(|ui| {
        if !comparison.older.is_empty() {
            let list = ComboBox::from_id_salt("older").selected_text(text::settings::CHOOSE);
            let list = list.show_ui(ui, |ui| {
                for file in &comparison.older {
                    let file = file.display().to_string();
                    ui.selectable_value(&mut comparison.path, file.clone(), file);
                }
            });
            list.response.labelled_by(name.id).on_hover_text(words::COMPARE_TIP);
        }
        let field = TextEdit::singleline(&mut comparison.path)
            .hint_text(words::COMPARE_HINT)
            .desired_width((ui.available_width() - 120.0).clamp(120.0, 300.0));
        let field = ui.add(field).labelled_by(name.id).on_hover_text(words::COMPARE_TIP);
        let enter = field.lost_focus() && ui.input(|input| input.key_pressed(egui::Key::Enter));
        let working = comparison.is_working();
        let can = !working && !comparison.path.trim().is_empty();
        let button = ui.add_enabled(can, egui::Button::new(words::COMPARE_BUTTON));
        if button.on_hover_text(words::COMPARE_TIP).clicked() || (enter && can) {
            asks.push(UiAction::Compare(comparison.path.trim().into()));
        }
        if working {
            ui.spinner();
            ui.label(words::COMPARING);
        }
    });
}

/// Shows the result of the comparison.
pub(super) fn show(ui: &mut Ui, comparison: &Comparison) {
    let Outcome::Done(outcome) = &comparison.outcome else { return };
    let compared = match outcome {
        Ok(compared) => compared,
        Err(trouble) => {
            error_lines(ui, trouble);
            return;
        }
    };
    ui.add_space(theme::UNIT);
    theme::card(ui.visuals()).show(ui, |ui| {
        ui.set_width(ui.available_width());
        what_changed(ui, compared);
    });
}

fn what_changed(ui: &mut Ui, compared: &Compared) {
    ui.label(text::compared_with(&compared.against));
    let palette = theme::palette(ui.visuals());
    let color = match compared.drift.as_ref().map(|drift| drift.verdict) {
        Some(DriftVerdict::Ok) => palette.good,
        Some(DriftVerdict::CannotTell) | None => palette.care,
        Some(DriftVerdict::Recalibrate) => palette.bad,
    };
    ui.label(RichText::new(format!("{}.", compared.what)).size(theme::TITLE).strong().color(color));
    ui.label(RichText::new(&compared.action).size(theme::BODY).strong());
    for doubt in &compared.doubts {
        ui.label(format!("{doubt}."));
    }
    if let Some(drift) = &compared.drift {
        for (what, how_much) in text::drift_lines(drift) {
            ui.horizontal_wrapped(|ui| {
                ui.label(RichText::new(text::camera::capital(what)).weak());
                ui.label(how_much);
            });
        }
    }
}
