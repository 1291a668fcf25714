//! State of stepping through a recording.

use egui::{Key, Ui};

use super::super::{
    picture::Picture,
    screen::{Preferences, Screen},
};
use boresight_app::window::recordings::{DecidedRecording, LoadPicture};
use boresight_guide::session::{Outcome, Snapshot};

/// A recording with decisions made again.
pub struct Replayed {
    pub(super) steps: Vec<Snapshot>,
    /// Seconds since the first frame.
    pub(super) secs: Vec<f64>,
    /// True for each step decided differently in the recording.
    pub(super) differs: Vec<bool>,
    pub(super) load: LoadPicture,
    pub(super) screen: Screen,
    pub(super) at: usize,
    /// Step on the screen.
    pub(super) shown: Option<usize>,
    /// Time of the recording at the window's clock 0, while playing.
    pub(super) playing_from_secs: Option<f64>,
    /// True for gauges and numbers beside the picture.
    pub(super) numbers: bool,
}

impl Replayed {
    /// Starts at the first step; `None` for an empty recording.
    pub fn new(recording: DecidedRecording) -> Option<Self> {
        let DecidedRecording { steps, different, name, load } = recording;
        let first = steps.iter().find_map(|step| step.live.as_ref()).map(|live| live.captured_at);
        let mut now = 0.0;
        let secs = steps
            .iter()
            .map(|step| {
                if let (Some(first), Some(live)) = (first, &step.live) {
                    // Clocks may restart when a session is resumed.
                    now = live.captured_at.secs_since(first).max(now);
                }
                now
            })
            .collect();
        let differs = (0..steps.len()).map(|index| different.contains(&index)).collect();
        let screen = Screen { source: name, is_recorded: true, ..Screen::default() };
        (!steps.is_empty()).then_some(Self {
            steps,
            secs,
            differs,
            load,
            screen,
            at: 0,
            shown: None,
            playing_from_secs: None,
            numbers: false,
        })
    }

    /// Present step.
    pub fn at(&self) -> usize {
        self.at
    }

    /// Applies the person's preferences.
    pub fn prefer(&mut self, preferences: Preferences) {
        self.screen.preferences = preferences;
    }

    pub(super) fn go(&mut self, to: usize) {
        self.at = to.min(self.steps.len() - 1);
        self.playing_from_secs = None;
    }

    pub(super) fn is_taken(&self, step: usize) -> bool {
        matches!(self.steps[step].decision.outcome, Outcome::Accepted { .. })
    }

    pub(super) fn obey_keys(&mut self, ui: &Ui) {
        let pressed = |key: Key| ui.input(|input| input.key_pressed(key));
        let focused = ui.memory(|memory| memory.focused().is_some());
        if pressed(Key::PageUp) {
            self.view_before();
        } else if pressed(Key::PageDown) {
            self.next_view();
        } else if focused {
            // The slider has its own arrow keys.
        } else if pressed(Key::ArrowLeft) {
            self.go(self.at.saturating_sub(1));
        } else if pressed(Key::ArrowRight) {
            self.go(self.at + 1);
        } else if pressed(Key::Space) {
            self.play(ui);
        }
    }

    pub(super) fn view_before(&mut self) {
        let before = (0..self.at).rev().find(|step| self.is_taken(*step));
        self.go(before.unwrap_or(0));
    }

    pub(super) fn next_view(&mut self) {
        let next = (self.at + 1..self.steps.len()).find(|step| self.is_taken(*step));
        self.go(next.unwrap_or(self.steps.len() - 1));
    }

    pub(super) fn play(&mut self, ui: &Ui) {
        self.playing_from_secs = match self.playing_from_secs {
            Some(_) => None,
            None => Some(self.secs[self.at] - ui.ctx().time()),
        };
    }

    /// Follows the clock while playing.
    pub(super) fn follow(&mut self, ui: &Ui) {
        let Some(from_secs) = self.playing_from_secs else { return };
        let now = from_secs + ui.ctx().time();
        while self.at + 1 < self.steps.len() && self.secs[self.at + 1] <= now {
            self.at += 1;
        }
        if self.at + 1 == self.steps.len() {
            self.playing_from_secs = None;
        }
        ui.ctx().request_repaint();
    }

    /// Brings the step onto the screen.
    pub(super) fn bring(&mut self, ui: &Ui) {
        self.screen.now_secs = ui.ctx().time();
        self.screen.preferences.panels = self.numbers;
        if self.shown == Some(self.at) {
            return;
        }
        self.shown = Some(self.at);
        let step = &self.steps[self.at];
        self.screen.snapshot = Some(step.clone());
        self.screen.picture = Picture::default();
        // A view's picture is the sharpest of its hold, not the one of its last frame.
        let frame = match step.decision.outcome {
            Outcome::Accepted { frame, .. } => Some(frame),
            _ => step.decision.frame,
        };
        self.screen.taken_secs = self.is_taken(self.at).then_some(self.screen.now_secs);
        if let Some(picture) = frame.and_then(|frame| (self.load)(frame)) {
            self.screen.picture.show_image(&picture);
            self.screen.picture.captured_at = step.live.as_ref().map(|live| live.captured_at);
        }
        for view in step.views.iter() {
            if self.screen.thumbnails.contains_key(&view.number) {
                continue;
            }
            if let Some(picture) = (self.load)(view.frame_id.0) {
                self.screen.add_thumbnail(ui.ctx(), view.number, &picture);
            }
        }
    }
}
