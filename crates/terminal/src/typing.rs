//! Mode of a terminal's keyboard input.

use std::sync::{Mutex, PoisonError};

use rustix::termios::{LocalModes, OptionalActions, Termios, tcgetattr, tcsetattr};

/// Settings of the terminal before reading keys; `None` while unchanged.
static BEFORE: Mutex<Option<Termios>> = Mutex::new(None);

/// Switches the terminal at stdin to single keys without echo; Ctrl-C still ends the session.
/// `None` if unsupported.
pub fn by_key() -> Option<()> {
    let stdin = std::io::stdin();
    let before = tcgetattr(&stdin).ok()?;
    let mut by_key = before.clone();
    by_key.local_modes.remove(LocalModes::ICANON | LocalModes::ECHO);
    tcsetattr(&stdin, OptionalActions::Now, &by_key).ok()?;
    *BEFORE.lock().unwrap_or_else(PoisonError::into_inner) = Some(before);
    Some(())
}

/// Restores the terminal's settings.
pub fn restore() {
    if let Some(before) = BEFORE.lock().unwrap_or_else(PoisonError::into_inner).take() {
        tcsetattr(std::io::stdin(), OptionalActions::Now, &before).ok();
    }
}
