//! The result page: one card, and behind it the engineer's view with the evidence for and against
//! the verdict, the numbers, and the actions.

mod card;
mod charts;
mod comparison;
mod correlations;
mod distance;
mod error_lines;
mod poses;
mod radius;
mod result_page;
mod scatter;
mod state;
mod verdict;
mod view_bars;

pub(crate) use card::{color, sign};
pub use comparison::{Comparison, Outcome};
pub use result_page::ResultPage;
pub use state::State;

use std::path::PathBuf;

use egui::{CentralPanel, Panel, RichText, ScrollArea, Ui};

use error_lines::error_lines;

use super::{keys::UiAction, screen::Screen, theme};
use boresight_app::{explain::UserError, window::services::Ended};
use boresight_present::{result_card::ResultCard, text::window as words};

/// Inputs of the page in addition to the screen.
#[derive(Clone, Copy, Debug)]
pub struct Context<'a> {
    /// State of the session.
    pub state: State<'a>,
    /// Names of the export formats.
    pub formats: &'a [&'static str],
    /// Outcome of the newest export.
    pub exported: Option<&'a Result<PathBuf, UserError>>,
}

/// Shows the page.
pub fn show(
    ui: &mut Ui,
    screen: &Screen,
    context: &Context<'_>,
    table: &mut ResultPage,
    asks: &mut Vec<UiAction>,
) {
    let snapshot = screen.snapshot.as_ref();
    let card = snapshot.and_then(|snapshot| Some((snapshot, ResultCard::of(snapshot)?)));
    if let (Some((snapshot, card)), State::Ended(ended), false) =
        (&card, context.state, table.engineer)
    {
        CentralPanel::default().show(ui, |ui| {
            card::show(ui, (screen, snapshot, card), (ended, context), table, asks);
        });
        return;
    }
    let has_result = card.is_some();
    if has_result {
        let width = 0.5 * ui.available_width();
        Panel::right("charts").resizable(false).exact_size(width).show(ui, |ui| {
            charts::show(ui, screen, table, asks);
        });
    }
    CentralPanel::default().show(ui, |ui| {
        ScrollArea::vertical().auto_shrink([false, false]).show(ui, |ui| {
            if matches!(context.state, State::Ending) {
                ui.label(RichText::new(words::ENDING).size(theme::TITLE));
            }
            if has_result && matches!(context.state, State::Ended(_)) {
                let back = ui.button(words::RESULT_CARD);
                table.engineer &= !back.clicked();
            }
            verdict::show(ui, screen, context.state, asks);
            verdict::found(ui, screen);
            if let State::Ended(ended) = context.state {
                ui.add_space(theme::UNIT);
                theme::card(ui.visuals()).show(ui, |ui| {
                    ui.set_width(ui.available_width());
                    actions(ui, ended, (context, has_result), asks);
                    if has_result {
                        comparison::ask(ui, &mut table.comparison, asks);
                    }
                });
            }
            verdict::details(ui, screen, &table.comparison);
        });
    });
}

fn actions(
    ui: &mut Ui,
    ended: &Ended,
    (context, has_result): (&Context<'_>, bool),
    asks: &mut Vec<UiAction>,
) {
    if let Some(trouble) = &ended.trouble {
        error_lines(ui, trouble);
    }
    ui.horizontal_wrapped(|ui| {
        ui.label(words::EXPORT);
        ui.add_enabled_ui(has_result, |ui| {
            for (index, name) in context.formats.iter().enumerate() {
                if ui.button(*name).on_hover_text(words::export_tip(name)).clicked() {
                    asks.push(UiAction::Export(index));
                }
            }
        });
    });
    match context.exported {
        Some(Ok(file)) => {
            ui.label(words::written(file));
        }
        Some(Err(trouble)) => error_lines(ui, trouble),
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
