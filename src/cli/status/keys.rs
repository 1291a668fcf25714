//! Keys of the terminal, read key by key.

use std::{
    io::IsTerminal,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    thread::{Builder, JoinHandle},
};

use rustix::{
    event::{PollFd, PollFlags, Timespec, poll},
    io::read,
};

use boresight_terminal::typing;

/// Longest wait for a key before checking for the end of the session.
const LOOK: Timespec = Timespec { tv_sec: 0, tv_nsec: 100_000_000 };

/// Reads keys until dropped, then restores the terminal's settings.
pub(crate) struct Keys {
    over: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Keys {
    /// Calls `pressed` with each key; `None` unless stdin is a terminal.
    pub(crate) fn start(pressed: impl Fn(u8) + Send + 'static) -> Option<Self> {
        let stdin = std::io::stdin();
        if !stdin.is_terminal() {
            return None;
        }
        typing::by_key()?;
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
                    Ok(1) => pressed(key[0]),
                    // The terminal is gone.
                    _ => break,
                }
            }
        };
        let thread = Builder::new().name("keys".into()).spawn(look).ok();
        // Without a thread, no key would be read.
        Some(Self { over, thread })
    }
}

impl Drop for Keys {
    fn drop(&mut self) {
        self.over.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            thread.join().ok();
        }
        typing::restore();
    }
}
