//! stdout for machines, stderr for people, and signals.

use std::{
    borrow::Cow,
    io::Write,
    sync::{
        Arc, Mutex, PoisonError,
        atomic::{AtomicBool, Ordering},
    },
    time::{Duration, Instant},
};

use anyhow::Context;
use indicatif::ProgressBar;
use serde_json::{Value, json};

use boresight_app::{Announcer, Lines};
use boresight_capture::{end_programs, stop_opening};
use boresight_present::text;

/// Writes a line to stdout. A closed reader such as `head` is no failure: the exit code still
/// follows from the command's result. Commands to a terminal, in names from files and devices, are
/// left out, or escaped in JSON.
pub fn print(line: &str) -> anyhow::Result<()> {
    match writeln!(std::io::stdout(), "{}", harmless(line)) {
        Err(err) if err.kind() == std::io::ErrorKind::BrokenPipe => Ok(()),
        written => written.context("could not write to stdout"),
    }
}

/// `text` without commands to a terminal. In JSON, where such characters stand in strings only,
/// they are escaped, so programs read the same.
pub fn harmless(text: &str) -> Cow<'_, str> {
    let is_shown = |c: char| text::camera::is_harmless(c) || matches!(c, '\n' | '\t');
    if text.chars().all(is_shown) {
        return text.into();
    }
    let is_json = text.starts_with(['{', '[']);
    let mut shown = String::with_capacity(text.len());
    for c in text.chars() {
        if is_shown(c) {
            shown.push(c);
        } else if is_json {
            // All of them are below U+10000.
            shown += &format!("\\u{:04x}", u32::from(c));
        }
    }
    shown.into()
}

/// True if a program reads stderr: every line is then a JSON object.
static AS_JSON: AtomicBool = AtomicBool::new(false);

/// True if every line on stderr is a JSON object.
pub fn is_json() -> bool {
    AS_JSON.load(Ordering::Relaxed)
}

/// Lines at the end of stderr, rewritten in place below all others.
static STATUS: Mutex<Option<ProgressBar>> = Mutex::new(None);

/// Keeps `lines` below every sentence, until [`take_status`].
pub fn set_status(lines: ProgressBar) {
    *STATUS.lock().unwrap_or_else(PoisonError::into_inner) = Some(lines);
}

/// Takes the lines of [`set_status`] away.
pub fn take_status() {
    *STATUS.lock().unwrap_or_else(PoisonError::into_inner) = None;
}

/// Switches stderr to JSON lines.
pub fn log_as_json() {
    AS_JSON.store(true, Ordering::Relaxed);
}

/// Another reader of the events.
static READER: Mutex<Option<Lines>> = Mutex::new(None);

/// Sends every event to `reader`, too; `None` ends the sending.
pub fn log_to(reader: Option<Lines>) {
    *READER.lock().unwrap_or_else(PoisonError::into_inner) = reader;
}

/// Writes a line to stderr; without a reader the work continues. Leaves out commands to a terminal.
pub fn say(line: &str) {
    log("message", || json!({ "text": line.trim() }));
    if is_json() {
        return;
    }
    let line = harmless(line);
    let write = || {
        let _ = writeln!(std::io::stderr(), "{line}");
    };
    match &*STATUS.lock().unwrap_or_else(PoisonError::into_inner) {
        Some(lines) => lines.suspend(write),
        None => write(),
    }
}

/// Sends an event with `fields` to the programs on stderr or elsewhere.
pub fn log(event: &str, fields: impl FnOnce() -> Value) {
    let reader = READER.lock().unwrap_or_else(PoisonError::into_inner);
    if reader.is_none() && !is_json() {
        return;
    }
    let mut line = fields();
    line["event"] = event.into();
    line["time"] = jiff::Timestamp::now().to_string().into();
    if let Some(reader) = &*reader {
        reader(&line.to_string());
    }
    if is_json() {
        // A single write keeps lines of several threads whole.
        let _ = std::io::stderr().write_all(format!("{line}\n").as_bytes());
    }
}

/// Time within which a second Ctrl-C counts as the first: some shells and wrappers pass it on
/// twice.
const ONE_REQUEST: Duration = Duration::from_millis(500);
const LOOK: Duration = Duration::from_millis(50);
/// Exit code after a second Ctrl-C, as in shells.
const INTERRUPTED: i32 = 130;

/// Flag set by Ctrl-C, a polite kill and the closing of the terminal. A second Ctrl-C or kill ends
/// the program at once, even if hanging. To be called before a source is opened.
pub fn stop_flag() -> anyhow::Result<Arc<AtomicBool>> {
    use signal_hook::consts::{SIGINT, SIGTERM};
    let stop = Arc::new(AtomicBool::new(false));
    let again = Arc::new(AtomicBool::new(false));
    for signal in [SIGINT, SIGTERM] {
        signal_hook::flag::register(signal, Arc::clone(&stop))?;
        signal_hook::flag::register(signal, Arc::clone(&again))?;
    }
    #[cfg(unix)]
    signal_hook::flag::register(signal_hook::consts::SIGHUP, Arc::clone(&stop))?;
    let first = Arc::clone(&stop);
    std::thread::Builder::new().name("signals".into()).spawn(move || {
        while !first.load(Ordering::Relaxed) {
            std::thread::sleep(LOOK);
        }
        stop_opening();
        std::thread::sleep(ONE_REQUEST);
        again.store(false, Ordering::Relaxed);
        while !again.load(Ordering::Relaxed) {
            std::thread::sleep(LOOK);
        }
        // The hanging part may be the terminal.
        let said = std::thread::Builder::new().spawn(|| {
            #[cfg(unix)]
            crate::typing::restore();
            say(text::window::ENDED_AT_ONCE);
        });
        let began = Instant::now();
        while said.as_ref().is_ok_and(|said| !said.is_finished()) && began.elapsed() < ONE_REQUEST {
            std::thread::sleep(LOOK);
        }
        end_programs();
        std::process::exit(INTERRUPTED);
    })?;
    Ok(stop)
}

/// Prints every sentence on stderr.
pub fn announcer() -> Announcer {
    Announcer::new(say)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_of_files_command_no_terminal_and_json_reads_the_same() {
        assert_eq!(harmless("a\u{1b}[2J\u{9b}b\u{202e}\tc\nd é"), "a[2Jb\tc\nd é");
        let line = json!({ "name": "a\u{1b}\u{9b}\u{202e}\u{2028}é" });
        let text = line.to_string();
        let shown = harmless(&text);
        assert!(!shown.contains(['\u{1b}', '\u{9b}', '\u{202e}', '\u{2028}']), "{shown}");
        assert_eq!(serde_json::from_str::<Value>(&shown).expect("JSON"), line);
    }
}
