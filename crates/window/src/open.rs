//! Window, opened from the command line.

use std::{
    path::Path,
    sync::{Arc, PoisonError},
};

use anyhow::bail;

use crate::{NoWindow, run as run_window, run_replay, window_host::WindowHost};
use boresight_app::{AppHost, Exit, Opening, usual_memory, window::recordings::DecidedRecording};
use boresight_formats::CalibrationFile;
use boresight_present::text::window as words;
use boresight_terminal::{
    announcer, beside::BesideArguments, operation::Operation, print, stop_flag,
};

/// Runs sessions in a window until it's closed. The last session's result decides the exit code.
/// Without `at_once`, the start page asks about the first session.
pub fn run(
    opening: Opening,
    beside: &BesideArguments,
    operation: Operation,
    (at_once, json): (bool, bool),
) -> anyhow::Result<Exit> {
    let host = host(opening, beside, operation, at_once, (json, true))?;
    let host = host.remembering(usual_memory());
    let exit = host.exit();
    or_say_why(run_window(Box::new(host)))?;
    Ok(*exit.lock().unwrap_or_else(PoisonError::into_inner))
}

/// Program behind a window shown by others, such as tests; remembers nothing.
pub fn app_host(
    opening: Opening,
    beside: &BesideArguments,
    at_once: bool,
    paced: bool,
) -> anyhow::Result<Box<dyn AppHost>> {
    Ok(Box::new(host(opening, beside, Operation::default(), at_once, (false, paced))?))
}

/// Steps through a recording in a window until it's closed.
pub fn replay(recording: DecidedRecording) -> anyhow::Result<()> {
    or_say_why(run_replay(recording))
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
    let host = WindowHost::new(opening, paced, stop_flag()?, announcer(), on_result);
    #[cfg(feature = "serve")]
    let host = host.with_phone(beside.phone()?);
    let host = host.watched_by(watching).speaking(beside.speaks());
    let host = host.facing(beside.stands_facing());
    Ok(if at_once { host } else { host.asking() })
}

/// Turns the lack of a window into an error with a next action.
pub fn or_say_why(outcome: Result<(), NoWindow>) -> anyhow::Result<()> {
    match outcome {
        Ok(()) => Ok(()),
        Err(err @ NoWindow::NoDisplay) => bail!("{err}\n{}", words::NO_DISPLAY_ACTION),
        Err(err @ NoWindow::Lost { .. }) => bail!("{err}\n{}", words::LOST_DISPLAY_ACTION),
        Err(err @ NoWindow::Refused { .. }) => bail!("{err}\n{}", words::NO_WINDOW_ACTION),
    }
}
