//! Keys of the terminal, read one at a time.

use std::{
    io::IsTerminal,
    sync::{
        Arc, Mutex, PoisonError,
        atomic::{AtomicBool, Ordering},
    },
    thread::{Builder, JoinHandle},
};

use rustix::{
    event::{PollFd, PollFlags, Timespec, poll},
    io::read,
    termios::{LocalModes, OptionalActions, Termios, tcgetattr, tcsetattr},
};

use super::Lines;

/// Longest wait for a key until it's asked whether the session is over.
const LOOK: Timespec = Timespec { tv_sec: 0, tv_nsec: 100_000_000 };

/// The terminal before keys were read; `None` while it's as it was.
static BEFORE: Mutex<Option<Termios>> = Mutex::new(None);

/// Leaves the terminal as it was.
pub(in super::super) fn restore() {
    if let Some(before) = BEFORE.lock().unwrap_or_else(PoisonError::into_inner).take() {
        tcsetattr(std::io::stdin(), OptionalActions::Now, &before).ok();
    }
}

/// Reads keys until it's dropped; the terminal is then as it was.
pub(super) struct Keys {
    over: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Keys {
    /// `None` if nobody types at stdin.
    pub(super) fn start(lines: Arc<Lines>) -> Option<Self> {
        let stdin = std::io::stdin();
        if !stdin.is_terminal() {
            return None;
        }
        let before = tcgetattr(&stdin).ok()?;
        let mut by_key = before.clone();
        *BEFORE.lock().unwrap_or_else(PoisonError::into_inner) = Some(before);
        // Ctrl-C still ends the session.
        by_key.local_modes.remove(LocalModes::ICANON | LocalModes::ECHO);
        let over = Arc::new(AtomicBool::new(false));
        let is_over = Arc::clone(&over);
        let look = move || {
            while !is_over.load(Ordering::Relaxed) {
                let stdin = std::io::stdin();
                let mut waits = [PollFd::new(&stdin, PollFlags::IN)];
                if !matches!(poll(&mut waits, Some(&LOOK)), Ok(1..)) {
                    continue;
                }
                let mut key = [0];
                match read(&stdin, &mut key) {
                    Ok(1) => lines.pressed(key[0]),
                    // The terminal is gone.
                    _ => break,
                }
            }
        };
        let thread = Builder::new().name("keys".into()).spawn(look).ok()?;
        tcsetattr(&stdin, OptionalActions::Now, &by_key).ok();
        Some(Self { over, thread: Some(thread) })
    }
}

impl Drop for Keys {
    fn drop(&mut self) {
        self.over.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            thread.join().ok();
        }
        restore();
    }
}
