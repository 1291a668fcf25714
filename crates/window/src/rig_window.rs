//! A window with a session of several cameras only.

use std::sync::{Arc, Mutex, PoisonError};

use anyhow::Context as _;
use egui::{Ui, ViewportCommand};

use super::{open::or_say_why, rig::RigView, run, theme};
use boresight_app::{Exit, window::services::RigOpened};

/// Runs a session of several cameras in a window until it's closed.
///
/// # Errors
///
/// Those of the session, or if the window can't be opened: then nothing has been started.
pub fn run_rig(rig: RigOpened) -> anyhow::Result<Exit> {
    let outcome = Arc::new(Mutex::new(None));
    let kept = Arc::clone(&outcome);
    let mut trouble = None;
    let opened = run::open(|ctx| {
        theme::apply(ctx);
        let on_end = move |result| {
            *kept.lock().unwrap_or_else(PoisonError::into_inner) = Some(result);
        };
        let view = RigView::start(ctx, rig, on_end).map_err(|err| trouble = Some(err)).ok();
        Box::new(RigWindow { view, fitted: 1.0 })
    });
    or_say_why(opened)?;
    if let Some(err) = trouble {
        return Err(err.into());
    }
    let outcome = outcome.lock().unwrap_or_else(PoisonError::into_inner).take();
    outcome.context("the session's thread ended without a result")?
}

/// Window with a session only.
struct RigWindow {
    /// `None` if it could not start.
    view: Option<RigView>,
    fitted: f32,
}

impl eframe::App for RigWindow {
    fn ui(&mut self, ui: &mut Ui, _frame: &mut eframe::Frame) {
        theme::fit(ui.ctx(), &mut self.fitted);
        if self.view.as_mut().is_none_or(|view| view.show(ui)) {
            ui.ctx().send_viewport_cmd(ViewportCommand::Close);
        }
    }

    fn clear_color(&self, _visuals: &egui::Visuals) -> [f32; 4] {
        theme::BAND.to_normalized_gamma_f32()
    }
}
