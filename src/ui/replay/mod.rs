//! A recording, decision by decision: what was seen, and why it was taken or not.

mod picker;
mod recording_browser;
mod strip;

pub use picker::{Picker, pick};
pub(super) use recording_browser::RecordingBrowser;

use egui::{Button, Key, Panel, RichText, Slider, Ui};
use image::GrayImage;

use super::{
    guide,
    picture::Picture,
    screen::{Preferences, Screen},
    theme,
};
use crate::{
    session::{Outcome, Snapshot},
    text::replay as words,
};

/// Loads the stored picture of a frame; `None` if none was stored or it cannot be read.
pub type LoadPicture = Box<dyn Fn(u64) -> Option<GrayImage> + Send>;

/// A recording that was decided again.
pub struct Replayed {
    steps: Vec<Snapshot>,
    /// Seconds since the first frame.
    secs: Vec<f64>,
    /// Whether the recording decided differently.
    differs: Vec<bool>,
    load: LoadPicture,
    screen: Screen,
    at: usize,
    /// The step that the screen shows.
    shown: Option<usize>,
    /// Time of the recording at the window's clock 0, while it plays.
    playing_from_secs: Option<f64>,
}

impl Replayed {
    /// Of the snapshots after each input, and the inputs at which the recording decided differently. `None`
    /// without a step.
    pub fn new(
        steps: Vec<Snapshot>,
        different: &[usize],
        source: String,
        load: LoadPicture,
    ) -> Option<Self> {
        let first = steps.iter().find_map(|step| step.live.as_ref()).map(|live| live.captured_at);
        let mut now = 0.0;
        let secs = steps
            .iter()
            .map(|step| {
                if let (Some(first), Some(live)) = (first, &step.live) {
                    // Clocks may start anew when a session goes on.
                    now = live.captured_at.secs_since(first).max(now);
                }
                now
            })
            .collect();
        let differs = (0..steps.len()).map(|index| different.contains(&index)).collect();
        let screen = Screen { source, is_recorded: true, ..Screen::default() };
        (!steps.is_empty()).then_some(Self {
            steps,
            secs,
            differs,
            load,
            screen,
            at: 0,
            shown: None,
            playing_from_secs: None,
        })
    }

    /// The step that is shown.
    pub fn at(&self) -> usize {
        self.at
    }

    /// Shows it as the person wants to see it.
    pub fn prefer(&mut self, preferences: Preferences) {
        self.screen.preferences = preferences;
    }

    fn go(&mut self, to: usize) {
        self.at = to.min(self.steps.len() - 1);
        self.playing_from_secs = None;
    }

    fn is_taken(&self, step: usize) -> bool {
        matches!(self.steps[step].decision.outcome, Outcome::Accepted { .. })
    }

    fn obey_keys(&mut self, ui: &Ui) {
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

    fn view_before(&mut self) {
        let before = (0..self.at).rev().find(|step| self.is_taken(*step));
        self.go(before.unwrap_or(0));
    }

    fn next_view(&mut self) {
        let next = (self.at + 1..self.steps.len()).find(|step| self.is_taken(*step));
        self.go(next.unwrap_or(self.steps.len() - 1));
    }

    fn play(&mut self, ui: &Ui) {
        self.playing_from_secs = match self.playing_from_secs {
            Some(_) => None,
            None => Some(self.secs[self.at] - ui.ctx().time()),
        };
    }

    /// Follows the clock while it plays.
    fn follow(&mut self, ui: &Ui) {
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
    fn bring(&mut self, ui: &Ui) {
        self.screen.now_secs = ui.ctx().time();
        if self.shown == Some(self.at) {
            return;
        }
        self.shown = Some(self.at);
        let step = &self.steps[self.at];
        self.screen.snapshot = Some(step.clone());
        self.screen.picture = Picture::default();
        // A view's picture is the sharpest of its hold, not the one of the frame that ended it.
        let frame = match step.decision.outcome {
            Outcome::Accepted { frame, .. } => Some(frame),
            _ => step.decision.frame,
        };
        self.screen.taken_secs = self.is_taken(self.at).then_some(self.screen.now_secs);
        if let Some(picture) = frame.and_then(|frame| (self.load)(frame)) {
            self.screen.picture.show_image(ui.ctx(), &picture);
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

/// Shows the page.
pub fn show(ui: &mut Ui, replayed: &mut Replayed) {
    replayed.obey_keys(ui);
    replayed.follow(ui);
    replayed.bring(ui);
    Panel::bottom("replay").show(ui, |ui| {
        let step = &replayed.steps[replayed.at];
        ui.label(RichText::new(words::why(step)).size(24.0).strong());
        ui.horizontal(|ui| {
            let frame = step.decision.frame;
            let (at, steps) = (replayed.at, replayed.steps.len());
            ui.label(words::place(at, steps, frame, replayed.secs[at]));
            if replayed.differs[at] {
                ui.label(RichText::new(words::DIFFERS).color(theme::RED).strong());
            } else if frame.is_some() && replayed.screen.picture.texture().is_none() {
                ui.label(RichText::new(words::NO_PICTURE).weak());
            }
        });
        if let Some(to) = strip::show(ui, replayed) {
            replayed.go(to);
        }
        ui.horizontal(|ui| {
            let clicked = |ui: &mut Ui, (label, key, tip): words::Step, on: bool| {
                ui.add(Button::selectable(on, label))
                    .on_hover_text(format!("{tip} ({key})"))
                    .clicked()
            };
            if clicked(ui, words::VIEW_BACK, false) {
                replayed.view_before();
            }
            if clicked(ui, words::BACK, false) {
                replayed.go(replayed.at.saturating_sub(1));
            }
            if clicked(ui, words::PLAY, replayed.playing_from_secs.is_some()) {
                replayed.play(ui);
            }
            if clicked(ui, words::ON, false) {
                replayed.go(replayed.at + 1);
            }
            if clicked(ui, words::VIEW_ON, false) {
                replayed.next_view();
            }
            ui.spacing_mut().slider_width = (ui.available_width() - 140.0).max(80.0);
            let mut at = replayed.at;
            let last = replayed.steps.len() - 1;
            if ui.add(Slider::new(&mut at, 0..=last).text(words::SCRUBBER)).changed() {
                replayed.go(at);
            }
        });
    });
    // Nothing can be changed in a recording.
    guide::show(ui, &replayed.screen, &mut Vec::new());
}
