//! Window, opened from the command line.

use std::{
    path::Path,
    sync::{
        Arc, PoisonError,
        atomic::{AtomicBool, Ordering},
    },
    thread::{self, Builder},
};

use anyhow::bail;

use super::{
    beside::BesideArguments,
    operation::Operation,
    terminal::{announcer, print, stop_flag},
};
use crate::{
    ui::{self, AdjustPage, Link, NoWindow, WayBack},
    window_host::WindowHost,
};
use boresight_app::{
    AppHost, Exit, Opening, memory,
    recordings::DecidedRecording,
    usual_memory,
    watch::{self, Feed, Step, WatchedCamera},
};
use boresight_formats::CalibrationFile;
use boresight_present::text::window as words;

/// Runs sessions in a window until it's closed. The last session's result decides the exit code.
/// Without `at_once`, the start page asks about the first session.
pub(super) fn run(
    opening: Opening,
    beside: &BesideArguments,
    operation: Operation,
    (at_once, json): (bool, bool),
) -> anyhow::Result<Exit> {
    let host = host(opening, beside, operation, at_once, (json, true))?;
    let host = host.remembering(usual_memory());
    let exit = host.exit();
    or_say_why(ui::run(Box::new(host)))?;
    Ok(*exit.lock().unwrap_or_else(PoisonError::into_inner))
}

/// Program behind a window shown by others, such as tests; remembers nothing.
pub(super) fn app_host(
    opening: Opening,
    beside: &BesideArguments,
    at_once: bool,
    paced: bool,
) -> anyhow::Result<Box<dyn AppHost>> {
    Ok(Box::new(host(opening, beside, Operation::default(), at_once, (false, paced))?))
}

/// Steps through a recording in a window until it's closed.
pub(super) fn replay(recording: DecidedRecording) -> anyhow::Result<()> {
    or_say_why(ui::run_replay(recording))
}

/// Guides in a window to push `camera` back until it's closed; `hear` gets every step. True if the
/// camera points right.
pub(super) fn adjust(
    (camera, feed): (&WatchedCamera, &Feed),
    faces: bool,
    stop: &AtomicBool,
    hear: &mut (dyn FnMut(&Step<'_>) + Send),
) -> anyhow::Result<bool> {
    let link = Arc::new(Link::default());
    thread::scope(|scope| {
        let shown = Arc::clone(&link);
        let work = move || {
            let outcome = watch::adjust(camera, feed, stop, &mut |step| {
                shown.show(WayBack::of(step, camera.lens()));
                hear(step);
            });
            shown
                .has_ended
                .store(outcome.is_err() || stop.load(Ordering::Relaxed), Ordering::Relaxed);
            outcome
        };
        let worker = Builder::new().name("way back".into()).spawn_scoped(scope, work)?;
        let memory = usual_memory().as_deref().map(memory::read).unwrap_or_default();
        let opened = or_say_why(ui::run_adjust(AdjustPage::new(link, faces, &memory)));
        stop.store(true, Ordering::Relaxed);
        let outcome = worker.join().unwrap_or_else(|payload| std::panic::resume_unwind(payload));
        opened.and(outcome)
    })
}

fn host(
    opening: Opening,
    beside: &BesideArguments,
    operation: Operation,
    at_once: bool,
    (json, paced): (bool, bool),
) -> anyhow::Result<WindowHost> {
    let watching = operation.onlookers();
    let on_result = Arc::new(move |folder: &Path, result: &CalibrationFile| {
        operation.ended(folder, result);
        if json {
            // An unprintable result is in the session's folder all the same.
            let _ = result.to_json().map(|json| print(&json.to_string()));
        }
    });
    // The window's picture isn't mirrored, unless its voice addresses someone facing the camera.
    let announcer = match beside.speaks_to_facing() {
        Some(true) => announcer(),
        _ => announcer().from_behind(),
    };
    let host = WindowHost::new(opening, paced, stop_flag()?, announcer, on_result);
    #[cfg(feature = "serve")]
    let host = host.with_phone(beside.phone()?);
    let host = host.watched_by(watching).speaking(beside.speaks_to_facing());
    Ok(if at_once { host } else { host.asking() })
}

/// Turns the lack of a window into an error with a next action.
fn or_say_why(outcome: Result<(), NoWindow>) -> anyhow::Result<()> {
    match outcome {
        Ok(()) => Ok(()),
        Err(err @ NoWindow::NoDisplay) => bail!("{err}\n{}", words::NO_DISPLAY_ACTION),
        Err(err @ NoWindow::Lost { .. }) => bail!("{err}\n{}", words::LOST_DISPLAY_ACTION),
        Err(err @ NoWindow::Refused { .. }) => bail!("{err}\n{}", words::NO_WINDOW_ACTION),
    }
}
