//! The result page: the verdict, what speaks for and against it, the numbers, and what can be done with it.

mod verdict;

use std::path::PathBuf;

use egui::{CentralPanel, RichText, ScrollArea, Ui};

use super::{
    desk::{Ended, Trouble},
    keys::{Ask, button},
    screen::Screen,
};
use crate::text::{Act, window as words};

/// Where the session is.
#[derive(Clone, Copy, Debug)]
pub enum State<'a> {
    /// There is none.
    Nothing,
    /// Views are being taken.
    Running,
    /// It is being stored.
    Ending,
    /// It is stored.
    Ended(&'a Ended),
}

/// Shows the page.
pub fn show(
    ui: &mut Ui,
    screen: &Screen,
    state: &State<'_>,
    formats: &[&'static str],
    exported: Option<&Result<PathBuf, Trouble>>,
    asks: &mut Vec<Ask>,
) {
    CentralPanel::default().show(ui, |ui| {
        ScrollArea::vertical().auto_shrink([false, false]).show(ui, |ui| {
            match state {
                State::Nothing | State::Running => {}
                State::Ending => {
                    ui.label(RichText::new(words::ENDING).size(22.0));
                }
                State::Ended(ended) => actions(ui, ended, formats, exported, asks),
            }
            verdict::show(ui, screen);
        });
    });
}

fn actions(
    ui: &mut Ui,
    ended: &Ended,
    formats: &[&'static str],
    exported: Option<&Result<PathBuf, Trouble>>,
    asks: &mut Vec<Ask>,
) {
    if let Some(trouble) = &ended.trouble {
        trouble_lines(ui, trouble);
    }
    ui.horizontal_wrapped(|ui| {
        button(ui, Act::GoOn, asks);
        button(ui, Act::New, asks);
        ui.separator();
        ui.label(words::EXPORT);
        for (index, name) in formats.iter().enumerate() {
            if ui.button(*name).on_hover_text(words::export_tip(name)).clicked() {
                asks.push(Ask::Export(index));
            }
        }
    });
    match exported {
        Some(Ok(file)) => {
            ui.label(words::written(file));
        }
        Some(Err(trouble)) => trouble_lines(ui, trouble),
        None => {}
    }
    for file in &ended.files {
        ui.label(RichText::new(words::written(file)).small().weak());
    }
    ui.separator();
}

fn trouble_lines(ui: &mut Ui, trouble: &Trouble) {
    ui.colored_label(super::theme::RED, RichText::new(&trouble.what).size(18.0));
    if let Some(action) = &trouble.action {
        ui.label(RichText::new(action).size(16.0));
    }
}
