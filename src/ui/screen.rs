//! State of the screen: the newest snapshot and picture, and the person's preferences.

use std::collections::BTreeMap;

use egui::{ColorImage, Context, TextureHandle, TextureOptions};
use image::GrayImage;

use super::picture::Picture;
use boresight_geometry::device::{Adjustable, Control, Lock, Locks};
use boresight_guide::session::{Outcome, Prompt, Snapshot, Stream, ViewNumber};
use boresight_present::instruction::Instruction;

/// Time without a picture that is worth saying.
const STALLED_SECS: f64 = 2.0;
/// Width of a thumbnail's texture.
const THUMBNAIL_PX: u32 = 192;

/// Preferences of the person for picture and sound.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Preferences {
    /// True to show the picture as a mirror, with left and right of the person in front of the camera.
    pub mirrored: bool,
    /// A tone for each view taken.
    pub tone: bool,
    /// The sentence spoken.
    pub speech: bool,
    /// Numbers beside the picture.
    pub panels: bool,
    /// Marks for engineers on the picture: corners, covered area, principal lines.
    pub lines: bool,
    /// Full screen while nobody is at the computer.
    pub full_screen: bool,
    /// A word on the picture on how the guide works, until the first view is taken.
    pub hint: bool,
}

impl Default for Preferences {
    fn default() -> Self {
        Self {
            mirrored: false,
            tone: true,
            speech: false,
            panels: true,
            lines: false,
            full_screen: false,
            hint: false,
        }
    }
}

/// Everything that the panels may see.
#[derive(Default)]
pub struct Screen {
    /// The newest state of the session.
    pub snapshot: Option<Snapshot>,
    /// The newest picture.
    pub picture: Picture,
    /// Small pictures of the accepted views, by their numbers.
    pub thumbnails: BTreeMap<ViewNumber, TextureHandle>,
    /// Prompts of refused frames, with their counts, the most frequent first.
    pub asked: Vec<(Prompt, usize)>,
    /// Name of the source.
    pub source: String,
    /// Folder of the session.
    pub folder: Option<std::path::PathBuf>,
    /// What's said of source and board until the first view is taken.
    pub opening_note: Option<String>,
    /// Frames that newer ones replaced before they were looked at.
    pub frames_replaced: u64,
    /// Time at which the last view was taken, by the window's clock.
    pub taken_secs: Option<f64>,
    /// The window's clock.
    pub now_secs: f64,
    /// The camera's controls that can be set.
    pub adjustables: Vec<Adjustable>,
    /// Values at which the controls were locked at first.
    pub first_locks: Locks,
    /// Requested values of controls that are not read back yet.
    pub adjusting: BTreeMap<Control, Adjusting>,
    /// True if the screen is read from afar: big letters, no panels.
    pub distance: bool,
    /// A moment of a recording, in which nothing can be changed.
    pub is_recorded: bool,
    /// See [`Preferences`].
    pub preferences: Preferences,
}

/// A value on its way to the camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Adjusting {
    /// Requested value, in the driver's unit.
    pub value: i64,
    /// State of the control before.
    before: Lock,
    /// Longest wait for an answer, by the window's clock.
    until_secs: f64,
}

/// Longest time that a camera takes to obey and to be read back.
const LONGEST_ADJUSTING_SECS: f64 = 2.0;

impl Screen {
    /// Takes the newest state of the session.
    pub fn show(&mut self, snapshot: Snapshot) {
        let locks = snapshot.camera.locks;
        for control in Control::ALL {
            if self.first_locks.of(control).value().is_none() {
                self.first_locks.note(control, locks.of(control));
            }
        }
        let now_secs = self.now_secs;
        self.adjusting.retain(|control, adjusting| {
            locks.of(*control) == adjusting.before && now_secs < adjusting.until_secs
        });
        self.count(&snapshot);
        self.snapshot = Some(snapshot);
    }

    fn count(&mut self, snapshot: &Snapshot) {
        let (Outcome::Refused { .. }, Some(live)) = (snapshot.decision.outcome, &snapshot.live)
        else {
            return;
        };
        let prompt = Prompt::of_decision(&snapshot.decision, live.corners_px.as_ref().err());
        match self.asked.iter_mut().find(|(asked, _)| *asked == prompt) {
            Some((_, count)) => *count += 1,
            None => self.asked.push((prompt, 1)),
        }
        self.asked.sort_by_key(|(_, count)| std::cmp::Reverse(*count));
    }

    /// Remembers that `control` was asked to be at `value`.
    pub fn adjust(&mut self, control: Control, value: i64) {
        let before = self.locks().of(control);
        let until_secs = self.now_secs + LONGEST_ADJUSTING_SECS;
        if before.value() != Some(value) {
            self.adjusting.insert(control, Adjusting { value, before, until_secs });
        }
    }

    /// State of the camera's controls.
    pub fn locks(&self) -> Locks {
        self.snapshot.as_ref().map(|snapshot| snapshot.camera.locks).unwrap_or_default()
    }

    /// How many times as large words are that are read from afar, too.
    pub fn larger(&self) -> f32 {
        if self.distance { 1.5 } else { 1.0 }
    }

    /// Age of the drawing relative to the picture below it, in seconds.
    pub fn overlay_age_secs(&self) -> Option<f64> {
        let live = self.snapshot.as_ref()?.live.as_ref()?;
        Some(self.picture.captured_at?.secs_since(live.captured_at).max(0.0))
    }

    /// Keeps a small copy of the picture of `view`.
    pub fn add_thumbnail(&mut self, ctx: &Context, view: ViewNumber, image: &GrayImage) {
        let height = THUMBNAIL_PX * image.height().max(1) / image.width().max(1);
        let small = image::imageops::thumbnail(image, THUMBNAIL_PX, height.max(1));
        let size = [small.width() as usize, small.height() as usize];
        let pixels = ColorImage::from_gray(size, small.as_raw());
        let texture = ctx.load_texture(format!("view {view}"), pixels, TextureOptions::LINEAR);
        self.thumbnails.insert(view, texture);
    }

    /// What to do now; `None` before the first decision.
    pub fn instruction(&self) -> Option<Instruction> {
        let instruction = Instruction::of(self.snapshot.as_ref()?);
        let is_old = self.stalled_secs().is_some();
        Some(if is_old { instruction.without_picture() } else { instruction })
    }

    /// Time without a picture, if that is worth saying and nothing else explains it.
    pub fn stalled_secs(&self) -> Option<f64> {
        let snapshot = self.snapshot.as_ref()?;
        let silent_secs = self.now_secs - self.picture.came_secs?;
        let is_explained = snapshot.shown.prompt.is_state();
        (silent_secs > STALLED_SECS && !is_explained).then_some(silent_secs)
    }

    /// Time since the last picture, if the camera is lost or stalled; `None` if it isn't.
    pub fn lost_secs(&self) -> Option<f64> {
        let camera = &self.snapshot.as_ref()?.camera;
        let is_lost = matches!(camera.stream, Stream::Lost { .. });
        let silent_secs = || self.now_secs - self.picture.came_secs.unwrap_or(self.now_secs);
        is_lost.then(silent_secs).or_else(|| self.stalled_secs())
    }

    /// Time since the last view was taken.
    pub fn since_taken_secs(&self) -> Option<f64> {
        self.taken_secs.map(|taken| self.now_secs - taken)
    }
}
