//! Progress of long work: a bar on a terminal, occasional lines elsewhere.

use std::{
    io::IsTerminal,
    sync::{
        Arc,
        atomic::{AtomicU64, Ordering},
    },
    time::{Duration, Instant},
};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};

use crate::say;

/// Usual kind of work.
pub const FINDING: &str = "finding the board";
/// Minimum duration for showing progress.
const SOON: Duration = Duration::from_secs(1);
/// Time between two lines without a terminal.
const BETWEEN_LINES: Duration = Duration::from_secs(10);
const REDRAW: Duration = Duration::from_millis(500);

/// Progress of a piece of work, on stderr.
pub struct Progress {
    bar: ProgressBar,
    what: String,
    began: Instant,
    is_terminal: bool,
    /// Lines written, or 1 once the bar is shown.
    shown: AtomicU64,
    /// Time of the last step, in milliseconds after the beginning.
    last_step: Arc<AtomicU64>,
}

impl Progress {
    /// Progress of `what` in `total` steps, shown after a second.
    pub fn new(what: &str, total: usize) -> Self {
        let bar = ProgressBar::with_draw_target(Some(total as u64), ProgressDrawTarget::hidden())
            .with_message(what.to_owned());
        let last_step = Arc::new(AtomicU64::new(0));
        let stepped = Arc::clone(&last_step);
        let left = move |state: &ProgressState, out: &mut dyn std::fmt::Write| {
            let at = Duration::from_millis(stepped.load(Ordering::Relaxed));
            let words = left(state.pos(), state.len().unwrap_or(0), state.elapsed(), at);
            let _ = out.write_str(&words);
        };
        if let Ok(style) = ProgressStyle::with_template("{msg} {bar:30} {pos} of {len}{left}") {
            bar.set_style(style.with_key("left", left));
        }
        let is_terminal = std::io::stderr().is_terminal();
        let shown = AtomicU64::new(0);
        Self { bar, what: what.to_owned(), began: Instant::now(), is_terminal, shown, last_step }
    }

    /// Progress of long steps: shown at once on a terminal.
    pub fn of_long_steps(what: &str, total: usize) -> Self {
        let progress = Self::new(what, total);
        if progress.is_terminal {
            progress.show_bar();
        }
        progress
    }

    /// Names the present work.
    pub fn now(&self, what: &str) {
        self.bar.set_message(what.to_owned());
    }

    /// Counts a step.
    pub fn step(&self) {
        self.bar.inc(1);
        self.stepped();
        self.show();
    }

    /// Sets the progress to `done` of `total` steps.
    pub fn at(&self, done: usize, total: usize) {
        self.bar.set_length(total as u64);
        if self.bar.position() != done as u64 {
            self.bar.set_position(done as u64);
            self.stepped();
        }
        self.show();
    }

    fn stepped(&self) {
        let millis = self.began.elapsed().as_millis();
        self.last_step.store(u64::try_from(millis).unwrap_or(u64::MAX), Ordering::Relaxed);
    }

    /// Writes a line above the bar.
    pub fn say(&self, line: &str) {
        self.bar.suspend(|| say(line));
    }

    /// Runs a terminal writer, with the bar hidden.
    pub fn aside<T>(&self, write: impl FnOnce() -> T) -> T {
        self.bar.suspend(write)
    }

    /// Ends the work and removes the bar.
    pub fn finish(&self) {
        self.bar.finish_and_clear();
    }

    fn show(&self) {
        let elapsed = self.began.elapsed();
        if self.is_terminal {
            if elapsed >= SOON {
                self.show_bar();
            }
            return;
        }
        let lines = elapsed.as_secs() / BETWEEN_LINES.as_secs();
        if self.shown.fetch_max(lines, Ordering::Relaxed) < lines {
            let (done, total) = (self.bar.position(), self.bar.length().unwrap_or_default());
            let last = Duration::from_millis(self.last_step.load(Ordering::Relaxed));
            say(&line(&self.what, done, total, elapsed, last));
        }
    }

    fn show_bar(&self) {
        if self.shown.swap(1, Ordering::Relaxed) == 0 {
            self.bar.set_draw_target(ProgressDrawTarget::stderr());
            self.bar.enable_steady_tick(REDRAW);
        }
    }
}

/// Progress line: "finding the board: 120 of 400, about 2 min left".
fn line(what: &str, done: u64, total: u64, elapsed: Duration, last_step: Duration) -> String {
    format!("{what}: {done} of {total}{}", left(done, total, elapsed, last_step))
}

/// Remaining time: ", about 2 min left"; empty before the first step. Counts down from the estimate
/// at the last step; once exhausted, the work takes longer than the steps so far suggested, and the
/// remaining time is unknown.
fn left(done: u64, total: u64, elapsed: Duration, last_step: Duration) -> String {
    if done == 0 {
        return String::new();
    }
    let at_step = last_step.as_secs_f64() * total.saturating_sub(done) as f64 / done as f64;
    let left_secs = at_step - elapsed.saturating_sub(last_step).as_secs_f64();
    if left_secs < 0.5 {
        return String::new();
    }
    if left_secs < 90.0 {
        format!(", about {left_secs:.0} s left")
    } else {
        format!(", about {:.0} min left", left_secs / 60.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_says_how_far_and_how_long() {
        let after = |secs| Duration::from_secs(secs);
        let line = |done, secs, last| line("replaying", done, 400, after(secs), after(last));
        assert_eq!(line(100, 10, 10), "replaying: 100 of 400, about 30 s left");
        assert_eq!(line(1, 1, 1), "replaying: 1 of 400, about 7 min left");
        assert_eq!(line(0, 1, 0), "replaying: 0 of 400");
        // Time passes without a step: less is left, until it's unknown.
        assert_eq!(line(100, 25, 10), "replaying: 100 of 400, about 15 s left");
        assert_eq!(line(100, 41, 10), "replaying: 100 of 400");
        // At the end, nothing is left.
        assert_eq!(line(400, 10, 10), "replaying: 400 of 400");
        assert_eq!(line(400, 11, 10), "replaying: 400 of 400");
    }

    #[test]
    fn short_work_shows_nothing() {
        let progress = Progress::new("replaying", 2);
        progress.step();
        progress.at(2, 2);
        progress.finish();
        assert!(progress.bar.is_hidden());
        assert_eq!(progress.shown.load(Ordering::Relaxed), 0);
    }
}
