//! Opens the window, or reports the reason for a failure.

use std::panic::{AssertUnwindSafe, catch_unwind, set_hook, take_hook};
use std::sync::{Arc, Mutex, PoisonError};

use egui::{Vec2, ViewportBuilder};

use super::{
    app::App,
    replay::{self, Replayed},
    theme,
    window_icon::window_icon,
};
use boresight_app::{
    Services,
    window::{desktop::has_display, recordings::DecidedRecording},
};
use boresight_geometry::panic_message;
use boresight_present::text::window as words;

/// Minimum readable window.
const LEAST: Vec2 = Vec2::new(640.0, 400.0);

/// Reason for a missing window.
#[derive(Debug, thiserror::Error)]
pub enum NoWindow {
    /// Neither X11 nor Wayland exists.
    #[error("there is no display to open a window on")]
    NoDisplay,
    /// The display went away while the window was open; the session has been ended and stored.
    #[error("the display went away: {reason}")]
    Lost {
        /// The system's message.
        reason: String,
    },
    /// A library is missing, or the display refuses.
    #[error("the window could not be opened: {reason}")]
    Refused {
        /// The system's message.
        reason: String,
    },
}

/// Runs the window until closed.
///
/// # Errors
///
/// [`NoWindow`]; no session has been started then.
pub fn run(services: Box<dyn Services>) -> Result<(), NoWindow> {
    open(|ctx| Box::new(App::new(ctx, services)))
}

/// Shows a recording until the window is closed.
///
/// # Errors
///
/// [`NoWindow`].
pub fn run_replay(recording: DecidedRecording) -> Result<(), NoWindow> {
    open(|ctx| {
        theme::apply(ctx);
        Box::new(ReplayWindow(Replayed::new(recording)))
    })
}

struct ReplayWindow(Option<Replayed>);

impl eframe::App for ReplayWindow {
    fn ui(&mut self, ui: &mut egui::Ui, _frame: &mut eframe::Frame) {
        if let Some(replayed) = &mut self.0 {
            replay::show(ui, replayed);
        }
    }

    fn clear_color(&self, visuals: &egui::Visuals) -> [f32; 4] {
        theme::background(visuals)
    }
}

/// Options of the window.
pub fn options() -> eframe::NativeOptions {
    eframe::NativeOptions {
        viewport: ViewportBuilder::default()
            .with_title(words::TITLE)
            .with_app_id(words::TITLE)
            .with_icon(window_icon())
            // With its title, it fits a screen 768 points high.
            .with_inner_size([1280.0, 720.0])
            .with_min_inner_size(LEAST),
        renderer: eframe::Renderer::Glow,
        // Dithering only smooths gradients, absent here, at a cost for each painted pixel.
        dithering: false,
        ..eframe::NativeOptions::default()
    }
}

/// Opens a window for `app` until it's closed.
///
/// # Errors
///
/// [`NoWindow`].
pub fn open(app: impl FnOnce(&egui::Context) -> Box<dyn eframe::App>) -> Result<(), NoWindow> {
    if !has_display() {
        return Err(NoWindow::NoDisplay);
    }
    // A missing library makes the window system's client panic; until the window exists, that is
    // only a reason to report.
    let before = Arc::new(Mutex::new(Some(take_hook())));
    set_hook(Box::new(|_| ()));
    let restore = {
        let before = Arc::clone(&before);
        move || {
            if let Some(hook) = before.lock().unwrap_or_else(PoisonError::into_inner).take() {
                set_hook(hook);
            }
        }
    };
    let opened = restore.clone();
    let outcome = catch_unwind(AssertUnwindSafe(|| {
        eframe::run_native(
            words::TITLE,
            options(),
            Box::new(move |creation| {
                opened();
                Ok(app(&creation.egui_ctx))
            }),
        )
    }));
    let was_open = before.lock().unwrap_or_else(PoisonError::into_inner).is_none();
    restore();
    match outcome {
        Ok(Ok(())) => Ok(()),
        Ok(Err(err)) if was_open => Err(NoWindow::Lost { reason: plain(&err.to_string()) }),
        Ok(Err(err)) => Err(NoWindow::Refused { reason: plain(&err.to_string()) }),
        Err(payload) if was_open => std::panic::resume_unwind(payload),
        Err(payload) => Err(NoWindow::Refused {
            reason: panic_message::panic_message(&*payload).unwrap_or_default(),
        }),
    }
}

/// System's message, without the source location in the window library.
fn plain(reason: &str) -> String {
    let after_place = reason.split_once(".rs:").and_then(|(_, rest)| rest.split_once(": "));
    after_place.map_or(reason, |(_, words)| words).to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_reason_has_no_place_in_source() {
        let noticed = "winit EventLoopError: os error at /src/linux/mod.rs:788: No connection: 1";
        assert_eq!(plain(noticed), "No connection: 1");
        assert_eq!(plain("winit EventLoopError: Exit: 1"), "winit EventLoopError: Exit: 1");
    }
}
