//! The result page: the verdict, what speaks for and against it, the numbers, and what can be done with it.

mod charts;
mod comparison;
mod verdict;

pub use comparison::{Comparison, Outcome};

use std::path::PathBuf;

use egui::{CentralPanel, Panel, RichText, ScrollArea, Ui};

use super::{keys::UiAction, screen::Screen};
use crate::{
    app::host::{Ended, UserError},
    text::{charts::Chart, window as words},
};

/// Where the session is.
#[derive(Clone, Copy, Debug)]
pub enum State<'a> {
    /// There is none.
    Nothing,
    /// Views are being taken.
    Running,
    /// It is being stored.
    Background,
    /// It is stored.
    Ended(&'a Ended),
}

/// What the page is shown with besides the screen.
#[derive(Clone, Copy, Debug)]
pub struct Context<'a> {
    /// Where the session is.
    pub state: State<'a>,
    /// Names of the formats that it can be exported in.
    pub formats: &'a [&'static str],
    /// What came of the newest export.
    pub exported: Option<&'a Result<PathBuf, UserError>>,
}

/// What the person does on the page.
#[derive(Debug, Default)]
pub struct ResultPage {
    /// The chart that is seen.
    pub chart: Chart,
    /// The comparison with an older calibration.
    pub comparison: Comparison,
}

impl ResultPage {
    /// Takes what a comparison found, and shows it. Never waits.
    pub(super) fn look(&mut self) {
        if self.comparison.look() {
            self.show_change();
        }
    }

    /// Shows the result of a session that has ended and may be compared with one of `older`.
    pub(super) fn begin(&mut self, ended: &Ended, older: Vec<PathBuf>) {
        self.comparison = Comparison::with(older);
        if let Some(compared) = ended.compared.clone() {
            self.comparison.outcome = Outcome::Done(compared);
            self.show_change();
        }
    }

    fn show_change(&mut self) {
        if self.comparison.found().is_some_and(|compared| compared.drift.is_some()) {
            self.chart = Chart::Change;
        }
    }
}

/// Shows the page.
pub fn show(
    ui: &mut Ui,
    screen: &Screen,
    context: &Context<'_>,
    table: &mut ResultPage,
    asks: &mut Vec<UiAction>,
) {
    let has_result = screen.snapshot.as_ref().is_some_and(|s| s.calibration.is_some());
    Panel::top("actions").show_separator_line(false).show(ui, |ui| match context.state {
        State::Nothing | State::Running => {}
        State::Background => {
            ui.label(RichText::new(words::ENDING).size(22.0));
        }
        State::Ended(ended) => {
            actions(ui, ended, context, asks);
            if has_result {
                comparison::ask(ui, &mut table.comparison, asks);
            }
        }
    });
    if has_result {
        let width = 0.5 * ui.available_width();
        Panel::right("charts").resizable(false).exact_size(width).show(ui, |ui| {
            charts::show(ui, screen, table);
        });
    }
    CentralPanel::default().show(ui, |ui| {
        ScrollArea::vertical().auto_shrink([false, false]).show(ui, |ui| {
            verdict::show(ui, screen, &table.comparison);
        });
    });
}

fn actions(ui: &mut Ui, ended: &Ended, context: &Context<'_>, asks: &mut Vec<UiAction>) {
    if let Some(trouble) = &ended.trouble {
        trouble_lines(ui, trouble);
    }
    ui.horizontal_wrapped(|ui| {
        ui.label(words::EXPORT);
        for (index, name) in context.formats.iter().enumerate() {
            if ui.button(*name).on_hover_text(words::export_tip(name)).clicked() {
                asks.push(UiAction::Export(index));
            }
        }
    });
    match context.exported {
        Some(Ok(file)) => {
            ui.label(words::written(file));
        }
        Some(Err(trouble)) => trouble_lines(ui, trouble),
        None => {}
    }
    ui.horizontal_wrapped(|ui| {
        for file in &ended.files {
            let name = file.file_name().unwrap_or_default().to_string_lossy();
            if ui.button(name).on_hover_text(words::show_tip(file)).clicked() {
                asks.push(UiAction::Show(file.clone()));
            }
        }
        ui.label(RichText::new(words::stored_in(&ended.folder)).small().weak());
    });
}

fn trouble_lines(ui: &mut Ui, trouble: &UserError) {
    ui.colored_label(super::theme::RED, RichText::new(&trouble.what).size(18.0));
    if let Some(action) = &trouble.action {
        ui.label(RichText::new(action).size(16.0));
    }
}
