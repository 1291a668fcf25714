//! State of the screen: the newest snapshot and picture, and the person's preferences.

use std::{cell::RefCell, collections::BTreeMap};

use egui::{ColorImage, Context, TextureHandle, TextureOptions};
use image::GrayImage;

use super::picture::Picture;
use boresight_geometry::device::{Adjustable, Control, Lock, Locks};
use boresight_guide::session::{Outcome, Prompt, Snapshot, Stream, ViewNumber};
use boresight_present::{instruction::Instruction, known::NewestKnown};

/// Time without a picture before it's reported.
const STALLED_SECS: f64 = 2.0;
/// Width of a thumbnail's texture.
const THUMBNAIL_PX: u32 = 480;

/// Preferences of the person for picture and sound.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Preferences {
    /// True for a mirrored picture, with left and right of the person in front of the camera.
    pub mirrored: bool,
    /// True for a tone with each view taken.
    pub tone: bool,
    /// True for spoken sentences.
    pub speech: bool,
    /// True for numbers beside the picture.
    pub panels: bool,
    /// Marks for engineers on the picture: corners, covered area, principal lines.
    pub lines: bool,
    /// True for full screen while the person is away.
    pub full_screen: bool,
    /// True for a hint on the picture about the guide, until the first view is taken.
    pub hint: bool,
}

/// True if a person faces the camera, unless somebody says otherwise, as for the terminal, the
/// voice and the phone.
pub(crate) const FACES: bool = true;

impl Default for Preferences {
    fn default() -> Self {
        Self {
            mirrored: false,
            tone: true,
            speech: false,
            panels: false,
            lines: false,
            full_screen: true,
            hint: false,
        }
    }
}

/// State visible to the panels.
#[derive(Default)]
pub struct Screen {
    /// The newest state of the session.
    pub snapshot: Option<Snapshot>,
    /// The newest picture.
    pub picture: Picture,
    /// What is known of the picture.
    pub known: RefCell<NewestKnown>,
    /// Thumbnails of the accepted views, by number.
    pub thumbnails: BTreeMap<ViewNumber, TextureHandle>,
    /// Prompts of refused frames, with counts, the most frequent first.
    pub asked: Vec<(Prompt, usize)>,
    /// Name of the source.
    pub source: String,
    /// Folder of the session.
    pub folder: Option<std::path::PathBuf>,
    /// Notes on source and board until the first view is taken.
    pub opening_note: Option<String>,
    /// Frames replaced by newer frames before being looked at.
    pub frames_replaced: u64,
    /// Time of the last view, by the window's clock.
    pub taken_secs: Option<f64>,
    /// The window's clock.
    pub now_secs: f64,
    /// Adjustable controls of the camera.
    pub adjustables: Vec<Adjustable>,
    /// First locked values of the controls.
    pub first_locks: Locks,
    /// Requested values of controls not yet read back.
    pub adjusting: BTreeMap<Control, Adjusting>,
    /// True if the screen is read from afar: the picture alone.
    pub distance: bool,
    /// True for a moment of a recording, which is read-only.
    pub is_recorded: bool,
    /// See [`Preferences`].
    pub preferences: Preferences,
}

/// A value on the way to the camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Adjusting {
    /// Requested value, in the driver's unit.
    pub value: i64,
    /// State of the control before.
    before: Lock,
    /// Longest wait for an answer, by the window's clock.
    until_secs: f64,
}

/// Longest time for a camera to obey and be read back.
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

    /// Remembers the requested `value` of `control`.
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

    /// Scale of words to be read from afar, too.
    pub fn larger(&self) -> f32 {
        if self.distance { 1.5 } else { 1.0 }
    }

    /// Age of the drawing relative to the picture below, in seconds.
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

    /// Next instruction; `None` before the first decision.
    pub fn instruction(&self) -> Option<Instruction> {
        let instruction = Instruction::of(self.snapshot.as_ref()?);
        let is_old = self.stalled_secs().is_some();
        Some(if is_old { instruction.without_picture() } else { instruction })
    }

    /// Time without a picture, if long and otherwise unexplained.
    pub fn stalled_secs(&self) -> Option<f64> {
        let snapshot = self.snapshot.as_ref()?;
        let silent_secs = self.now_secs - self.picture.came_secs?;
        let is_explained = snapshot.shown.prompt.is_state();
        (silent_secs > STALLED_SECS && !is_explained).then_some(silent_secs)
    }

    /// Time since the last picture, if the camera is lost or stalled.
    pub fn lost_secs(&self) -> Option<f64> {
        let camera = &self.snapshot.as_ref()?.camera;
        let is_lost = matches!(camera.stream, Stream::Lost { .. });
        let silent_secs = || self.now_secs - self.picture.came_secs.unwrap_or(self.now_secs);
        is_lost.then(silent_secs).or_else(|| self.stalled_secs())
    }

    /// Time since the last view.
    pub fn since_taken_secs(&self) -> Option<f64> {
        self.taken_secs.map(|taken| self.now_secs - taken)
    }
}
