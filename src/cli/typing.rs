//! How a terminal hands over what is typed.

use std::sync::{Mutex, PoisonError};

use rustix::termios::{LocalModes, OptionalActions, Termios, tcgetattr, tcsetattr};

/// The terminal's settings from before keys were read; `None` while they're unchanged.
static BEFORE: Mutex<Option<Termios>> = Mutex::new(None);

/// From now on, the terminal at stdin hands over every key at once and shows none; Ctrl-C still ends the session. `None` if
/// it can't.
pub(super) fn by_key() -> Option<()> {
    let stdin = std::io::stdin();
    let before = tcgetattr(&stdin).ok()?;
    let mut by_key = before.clone();
    by_key.local_modes.remove(LocalModes::ICANON | LocalModes::ECHO);
    tcsetattr(&stdin, OptionalActions::Now, &by_key).ok()?;
    *BEFORE.lock().unwrap_or_else(PoisonError::into_inner) = Some(before);
    Some(())
}

/// Restores the terminal's settings.
pub(super) fn restore() {
    if let Some(before) = BEFORE.lock().unwrap_or_else(PoisonError::into_inner).take() {
        tcsetattr(std::io::stdin(), OptionalActions::Now, &before).ok();
    }
}
