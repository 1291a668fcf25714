//! A session on a terminal: what to do now, in a few lines that are rewritten in place, and keys.
//!
//! | file | holds |
//! |---|---|
//! | `drawing` | the board now and as it should be held, in dots |
//! | `words` | the lines beside it |
//! | `keys` | the keys, read without waiting for Enter |

mod drawing;
#[cfg(unix)]
pub(super) mod keys;
mod words;

use std::{
    io::IsTerminal,
    sync::{
        Arc, Mutex, PoisonError,
        atomic::{AtomicBool, Ordering},
    },
};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use super::terminal::{set_status, take_status};
use boresight_guide::session::{Command, Snapshot};
use boresight_present::instruction::Instruction;
use boresight_run::pipeline::{CommandLink, Onlooker};

/// Rewritten this often per second at most: a slow link to the terminal isn't flooded.
const PER_SEC: u8 = 8;

/// The lines on the terminal. They go when it's dropped.
pub(super) struct Status {
    lines: Arc<Lines>,
    #[cfg(unix)]
    _keys: Option<keys::Keys>,
}

/// State shared by the session, which writes, and the keys.
struct Lines {
    bar: ProgressBar,
    commands: Mutex<Option<CommandLink>>,
    is_paused: AtomicBool,
    wants_end: AtomicBool,
    has_keys: AtomicBool,
    draws_dots: bool,
}

impl Status {
    /// `None` unless people read stderr on a terminal that can be written over.
    pub(super) fn new() -> Option<Self> {
        let is_dumb = std::env::var_os("TERM").is_none_or(|term| term == "dumb");
        if !std::io::stderr().is_terminal() || is_dumb || super::terminal::is_json() {
            return None;
        }
        let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::stderr_with_hz(PER_SEC));
        bar.set_style(ProgressStyle::with_template("{msg}").ok()?);
        let locale = ["LC_ALL", "LC_CTYPE", "LANG"].map(std::env::var);
        let locale = locale.into_iter().flatten().find(|it| !it.is_empty()).unwrap_or_default();
        let locale = locale.to_lowercase();
        let lines = Arc::new(Lines {
            bar: bar.clone(),
            commands: Mutex::default(),
            is_paused: AtomicBool::new(false),
            wants_end: AtomicBool::new(false),
            has_keys: AtomicBool::new(false),
            draws_dots: locale.contains("utf-8") || locale.contains("utf8"),
        });
        set_status(bar);
        #[cfg(unix)]
        {
            let keys = keys::Keys::start(Arc::clone(&lines));
            lines.has_keys.store(keys.is_some(), Ordering::Relaxed);
            Some(Self { lines, _keys: keys })
        }
        #[cfg(not(unix))]
        Some(Self { lines })
    }

    /// Looks on at a session.
    pub(super) fn onlooker(&self) -> Arc<dyn Onlooker> {
        Arc::clone(&self.lines) as Arc<dyn Onlooker>
    }
}

impl Drop for Status {
    fn drop(&mut self) {
        take_status();
        self.lines.bar.finish_and_clear();
    }
}

impl Lines {
    /// Does what the key is for; other keys do nothing.
    #[cfg(unix)]
    fn pressed(&self, key: u8) {
        let command = match key.to_ascii_lowercase() {
            b'p' if self.is_paused.load(Ordering::Relaxed) => Command::Resume,
            b'p' => Command::Pause,
            b'u' => Command::UndoLast,
            b't' => Command::ForceNext,
            b'q' => {
                self.wants_end.store(true, Ordering::Relaxed);
                return;
            }
            _ => return,
        };
        let commands = self.commands.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(link) = &*commands {
            // A session that is busy for that long isn't served by another try.
            link.send(command).ok();
        }
    }
}

impl Onlooker for Lines {
    fn began(&self, commands: CommandLink) {
        *self.commands.lock().unwrap_or_else(PoisonError::into_inner) = Some(commands);
    }

    fn decided(&self, snapshot: &Snapshot) {
        self.is_paused.store(snapshot.paused, Ordering::Relaxed);
        let now = Instruction::of(snapshot);
        let keys = self.has_keys.load(Ordering::Relaxed);
        let beside = words::lines(&now, snapshot, keys);
        self.bar.set_message(drawing::beside(&now, &beside, self.draws_dots).join("\n"));
    }

    fn wants_end(&self) -> bool {
        self.wants_end.load(Ordering::Relaxed)
    }
}
