//! Output of the session, and commands of the keys.

use std::sync::{
    Mutex, OnceLock, PoisonError,
    atomic::{AtomicBool, Ordering},
};

use indicatif::ProgressBar;

use super::{drawing, layout::laid_out, words};
#[cfg(unix)]
use boresight_guide::session::Command;
use boresight_guide::session::Snapshot;
use boresight_present::{instruction::Instruction, text::terminal};
use boresight_run::pipeline::{CommandLink, Onlooker};
use boresight_terminal::beside::Code;

/// State shared by the writing session and the keys.
pub(super) struct Lines {
    pub(super) bar: ProgressBar,
    commands: Mutex<Option<CommandLink>>,
    is_paused: AtomicBool,
    wants_end: AtomicBool,
    pub(super) has_keys: AtomicBool,
    draws_dots: bool,
    /// True for a person facing the camera.
    mirrored: bool,
    /// QR code for a phone.
    code: OnceLock<Code>,
    /// True while the code takes the place of the other lines.
    shows_code: AtomicBool,
}

impl Lines {
    /// Empty lines. With `draws_dots`, the terminal has braille; with `mirrored`, the person faces
    /// the camera.
    pub(super) fn new(bar: ProgressBar, draws_dots: bool, mirrored: bool) -> Self {
        Self {
            bar,
            commands: Mutex::default(),
            is_paused: AtomicBool::new(false),
            wants_end: AtomicBool::new(false),
            has_keys: AtomicBool::new(false),
            draws_dots,
            mirrored,
            code: OnceLock::new(),
            shows_code: AtomicBool::new(false),
        }
    }

    /// Offers the QR code for a phone, which a key shows instead of the other lines.
    pub(super) fn offer_code(&self, code: Code) {
        self.code.set(code).ok();
    }

    /// Runs the command of a key; ignores other keys.
    #[cfg(unix)]
    pub(super) fn pressed(&self, key: u8) {
        let command = match key.to_ascii_lowercase() {
            b'p' if self.is_paused.load(Ordering::Relaxed) => Command::Resume,
            b'p' => Command::Pause,
            b'u' => Command::UndoLast,
            b'r' => Command::Restore,
            b't' => Command::ForceNext,
            b'c' => {
                self.shows_code.fetch_xor(true, Ordering::Relaxed);
                return;
            }
            b'q' => {
                self.wants_end.store(true, Ordering::Relaxed);
                return;
            }
            _ => return,
        };
        let commands = self.commands.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(link) = &*commands {
            // A full inbox isn't worth another try.
            link.send(command).ok();
        }
    }
}

/// Width of the terminal in characters; unlimited where unknown.
fn width() -> usize {
    #[cfg(unix)]
    if let Ok(size) = rustix::termios::tcgetwinsize(std::io::stderr())
        && size.ws_col > 0
    {
        return size.ws_col.into();
    }
    usize::MAX
}

impl Onlooker for Lines {
    fn began(&self, commands: CommandLink) {
        *self.commands.lock().unwrap_or_else(PoisonError::into_inner) = Some(commands);
    }

    fn decided(&self, snapshot: &Snapshot) {
        self.is_paused.store(snapshot.paused, Ordering::Relaxed);
        let code = self.code.get().filter(|_| self.shows_code.load(Ordering::Relaxed));
        if let Some(code) = code {
            let back = std::iter::once(terminal::CODE_BACK.to_owned());
            self.bar.set_message(code().into_iter().chain(back).collect::<Vec<_>>().join("\n"));
            return;
        }
        let now = Instruction::of(snapshot);
        let keys = self.has_keys.load(Ordering::Relaxed);
        let mut words = words::lines(&now, snapshot, self.mirrored, keys);
        words.extend(self.code.get().filter(|_| keys).map(|_| terminal::CODE.to_owned()));
        let drawing = drawing::drawing(&now, self.draws_dots, self.mirrored);
        self.bar.set_message(laid_out(&drawing, &words, width()).join("\n"));
    }

    fn wants_end(&self) -> bool {
        self.wants_end.load(Ordering::Relaxed)
    }
}
