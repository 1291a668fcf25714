//! stdout for machines, stderr for people, and signals.

use std::{
    io::Write,
    process::ExitCode,
    sync::{Arc, atomic::AtomicBool},
};

use anyhow::Context;

use crate::app::{Announcer, Exit};

/// Writes a line to stdout. A reader that has gone, as `head` goes, is no failure: what the command finds
/// out still decides its exit code.
pub(super) fn print(line: &str) -> anyhow::Result<()> {
    match writeln!(std::io::stdout(), "{line}") {
        Err(err) if err.kind() == std::io::ErrorKind::BrokenPipe => Ok(()),
        written => written.context("could not write to stdout"),
    }
}

/// Writes a line to stderr; without a reader the work goes on.
pub(super) fn say(line: &str) {
    let _ = writeln!(std::io::stderr(), "{line}");
}

/// A flag that Ctrl-C and a polite kill set.
pub(super) fn stop_flag() -> anyhow::Result<Arc<AtomicBool>> {
    let stop = Arc::new(AtomicBool::new(false));
    for signal in [signal_hook::consts::SIGINT, signal_hook::consts::SIGTERM] {
        signal_hook::flag::register(signal, Arc::clone(&stop))?;
    }
    Ok(stop)
}

/// Prints every sentence on stderr.
pub(super) fn announcer() -> Announcer {
    Announcer::new(say)
}

impl From<Exit> for ExitCode {
    fn from(exit: Exit) -> Self {
        match exit {
            Exit::Good => Self::SUCCESS,
            Exit::Failed => Self::from(1),
            Exit::NotTrustworthy => Self::from(3),
            Exit::Recalibrate => Self::from(4),
        }
    }
}
