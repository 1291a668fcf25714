//! Window, opened from the command line.

use std::sync::{Arc, PoisonError};

use anyhow::bail;

use crate::{NoWindow, program_services::ProgramServices, run as run_window, run_replay};
use boresight_app::{
    Exit, Host, Opening, Services, usual_memory, window::recordings::DecidedRecording,
};
use boresight_present::text::window as words;
use boresight_terminal::{announcer, beside::BesideArguments, operation::Operation, stop_flag};

/// Runs sessions in a window until it's closed. The last session's result decides the exit code.
/// Without `at_once`, the start page asks about the first session.
pub fn run(
    opening: Opening,
    beside: &BesideArguments,
    operation: Operation,
    (at_once, json): (bool, bool),
) -> anyhow::Result<Exit> {
    let services = program_services(opening, beside, operation, at_once, (json, true))?;
    let services = services.remembering(usual_memory());
    let exit = services.exit();
    or_say_why(run_window(Box::new(services)))?;
    Ok(*exit.lock().unwrap_or_else(PoisonError::into_inner))
}

/// Program behind a window shown by others, such as tests; remembers nothing.
pub fn services(
    opening: Opening,
    beside: &BesideArguments,
    at_once: bool,
    paced: bool,
) -> anyhow::Result<Box<dyn Services>> {
    Ok(Box::new(program_services(opening, beside, Operation::default(), at_once, (false, paced))?))
}

/// Steps through a recording in a window until it's closed.
pub fn replay(recording: DecidedRecording) -> anyhow::Result<()> {
    or_say_why(run_replay(recording))
}

fn program_services(
    opening: Opening,
    beside: &BesideArguments,
    operation: Operation,
    at_once: bool,
    (json, paced): (bool, bool),
) -> anyhow::Result<ProgramServices> {
    let host = Host::new(announcer(), stop_flag()?).paced(paced).beside(Arc::new(operation));
    let services = ProgramServices::new(opening, host).printing(json).speaking(beside.speaks());
    #[cfg(feature = "serve")]
    let services = services.with_phone(beside.phone()?);
    let services = services.facing(beside.stands_facing());
    Ok(if at_once { services } else { services.asking() })
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
