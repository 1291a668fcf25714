//! A session on a terminal: the next action, in a few lines rewritten in place, and keys.
//!
//! | file | holds |
//! |---|---|
//! | `lines` | state shared by the writing session and the keys |
//! | `drawing` | present and requested board, in dots |
//! | `words` | the lines beside it |
//! | `layout` | both together, beside or below each other |
//! | `keys` | the keys, read without waiting for Enter |

mod drawing;
#[cfg(unix)]
pub(super) mod keys;
mod layout;
mod lines;
mod words;

#[cfg(unix)]
use std::sync::atomic::Ordering;
use std::{io::IsTerminal, sync::Arc};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use boresight_run::pipeline::Onlooker;
use boresight_terminal::{beside::Code, is_json, set_status, take_status};
use lines::Lines;

/// Maximum rate of rewriting per second: a slow link to the terminal isn't flooded.
const PER_SEC: u8 = 8;

/// Lines on the terminal. Dropping removes them.
pub(super) struct Status {
    lines: Arc<Lines>,
    #[cfg(unix)]
    _keys: Option<keys::Keys>,
}

impl Status {
    /// Status lines; `None` unless stderr is a rewritable terminal. If `mirrored`, for a person
    /// facing the camera.
    pub(super) fn new(mirrored: bool) -> Option<Self> {
        let is_dumb = std::env::var_os("TERM").is_none_or(|term| term == "dumb");
        if !std::io::stderr().is_terminal() || is_dumb || is_json() {
            return None;
        }
        let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::stderr_with_hz(PER_SEC));
        bar.set_style(ProgressStyle::with_template("{msg}").ok()?);
        let locale = ["LC_ALL", "LC_CTYPE", "LANG"].map(std::env::var);
        let locale = locale.into_iter().flatten().find(|it| !it.is_empty()).unwrap_or_default();
        let locale = locale.to_lowercase();
        let draws_dots = locale.contains("utf-8") || locale.contains("utf8");
        let lines = Arc::new(Lines::new(bar.clone(), draws_dots, mirrored));
        set_status(bar);
        #[cfg(unix)]
        {
            let pressed = Arc::clone(&lines);
            let keys = keys::Keys::start(move |key| pressed.pressed(key));
            lines.has_keys.store(keys.is_some(), Ordering::Relaxed);
            Some(Self { lines, _keys: keys })
        }
        #[cfg(not(unix))]
        Some(Self { lines })
    }

    /// See [`Lines::offer_code`].
    pub(super) fn offer_code(&self, code: Code) {
        self.lines.offer_code(code);
    }

    /// Onlooker for a session.
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
