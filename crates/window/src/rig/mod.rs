//! Several cameras in the window: their pictures, the links between them, and one sentence.
//!
//! | file | shows |
//! |---|---|
//! | `page` | pictures, sentence, and the result |
//! | `links` | what each two cameras have reached, between their pictures |

mod links;
mod page;

use std::{
    cell::RefCell,
    sync::{Arc, atomic::Ordering},
    time::Duration,
};

use egui::{Context, Ui, ViewportCommand};

use super::{
    keys::{self, UiAction},
    picture::Picture,
    sound::{Sound, Tone},
};
use boresight_app::{
    Exit,
    session::{
        rig_result::RigEnded,
        rig_run::{RigHand, RigLink, RigNews},
    },
    window::services::RigOpened,
};
use boresight_geometry::frame::Frame;
use boresight_guide::{rig::RigPrompt, session::Snapshot};
use boresight_present::{known::NewestKnown, text::Act};
use boresight_run::pipeline::{Background, LatestReceiver, PipelineError, latest};

pub(crate) use page::arranged;
pub use page::show;

/// Time within which wakes paint once: for a picture, and its detections.
pub(super) const MOMENT: Duration = Duration::from_millis(15);

/// Camera of a rig on the screen.
#[derive(Default)]
pub struct RigCamera {
    /// Name.
    pub name: String,
    /// The newest picture.
    pub picture: Picture,
    /// The newest state.
    pub snapshot: Option<Snapshot>,
    frame: Option<Arc<Frame>>,
    known: RefCell<NewestKnown>,
}

/// State of the page.
#[derive(Default)]
pub struct RigScreen {
    /// Each camera.
    pub cameras: Vec<RigCamera>,
    /// Request to the person.
    pub sentence: String,
    /// The same as a value; `None` before the first picture.
    pub prompt: Option<RigPrompt>,
    /// Number of places taken.
    pub places: usize,
    /// Linked cameras.
    pub links: Arc<[RigLink]>,
    /// True once the session has ended and the rig is being calibrated.
    pub is_ending: bool,
    /// Result, or the reason for none.
    pub ended: Option<RigEnded>,
}

impl RigScreen {
    /// Screen before the first picture.
    pub fn new(names: Vec<String>) -> Self {
        let of = |name| RigCamera { name, ..RigCamera::default() };
        Self { cameras: names.into_iter().map(of).collect(), ..Self::default() }
    }

    /// Shows news of the session, arrived at `now_secs` by the window's clock.
    fn show(&mut self, news: Newest, now_secs: f64) {
        let Newest { sentence, prompt, places, links, cameras, is_over } = news;
        self.is_ending |= is_over;
        (self.sentence, self.prompt, self.places, self.links) =
            (sentence, Some(prompt), places, links);
        for (camera, (frame, snapshot)) in self.cameras.iter_mut().zip(cameras) {
            let is_new = match (&frame, &camera.frame) {
                (Some(now), Some(before)) => !Arc::ptr_eq(now, before),
                (now, _) => now.is_some(),
            };
            if let Some(frame) = frame.as_ref().filter(|_| is_new) {
                camera.picture.show_frame(frame, now_secs);
            }
            (camera.frame, camera.snapshot) = (frame, snapshot);
        }
    }
}

/// News on their way from the session's thread.
struct Newest {
    sentence: String,
    prompt: RigPrompt,
    places: usize,
    links: Arc<[RigLink]>,
    cameras: Vec<(Option<Arc<Frame>>, Option<Snapshot>)>,
    is_over: bool,
}

impl Newest {
    fn of(news: &RigNews<'_>) -> Self {
        let cameras = news.cameras.iter();
        Self {
            sentence: news.sentence().to_owned(),
            prompt: news.prompt,
            places: news.places,
            links: Arc::clone(news.links),
            cameras: cameras.map(|(frame, state)| (frame.cloned(), state.cloned())).collect(),
            is_over: news.is_over,
        }
    }
}

/// Session of several cameras on show.
pub struct RigView {
    screen: RigScreen,
    hand: RigHand,
    newest: LatestReceiver<Newest>,
    work: Background<RigEnded>,
    sound: Sound,
}

impl RigView {
    /// Starts the session; `on_end` gets its outcome on the session's thread.
    ///
    /// # Errors
    ///
    /// [`PipelineError::Spawn`].
    pub fn start(
        ctx: &Context,
        RigOpened { names, hand, work }: RigOpened,
        on_end: impl FnOnce(anyhow::Result<Exit>) + Send + 'static,
    ) -> Result<Self, PipelineError> {
        let (newest_in, newest) = latest();
        let ctx = ctx.clone();
        let work = Background::start(move || {
            let result = work(&mut |news| {
                newest_in.publish(Newest::of(news)).ok();
                ctx.request_repaint_after(MOMENT);
            });
            let ended = result.as_ref().map_or_else(
                |err| RigEnded {
                    exit: Exit::Failed,
                    grade: None,
                    lines: vec![format!("{err:#}")],
                    file: None,
                    json: String::new(),
                },
                Clone::clone,
            );
            on_end(result.map(|ended| ended.exit));
            ctx.request_repaint();
            ended
        })?;
        Ok(Self { screen: RigScreen::new(names), hand, newest, work, sound: Sound::found() })
    }

    /// State that the page shows now.
    pub fn screen(&self) -> &RigScreen {
        &self.screen
    }

    /// Shows the page and carries out requests. True once the person closes it.
    pub fn show(&mut self, ui: &mut Ui) -> bool {
        let ctx = ui.ctx().clone();
        // The page is dark, whatever the theme of the others.
        ui.set_style(ctx.style_of(egui::Theme::Dark));
        let places = self.screen.places;
        if let Some(news) = self.newest.try_recv() {
            self.screen.show(news, ctx.input(|input| input.time));
        }
        if let Some(ended) = self.work.outcome() {
            self.screen.ended = Some(ended);
        }
        if self.screen.places > places {
            self.sound.play(Tone::Taken);
        }
        let mut asks: Vec<UiAction> = Vec::new();
        asks.extend(keys::pressed(&ctx).into_iter().map(UiAction::Act));
        show(ui, &self.screen, &mut asks);
        asks.into_iter().any(|ask| matches!(ask, UiAction::Act(act) if self.closes(&ctx, act)))
    }

    /// Carries out `act`. True if it closes the page.
    fn closes(&mut self, ctx: &Context, act: Act) -> bool {
        match act {
            Act::Undo => self.hand.undo.store(true, Ordering::Relaxed),
            Act::Finish if self.screen.ended.is_some() => return true,
            Act::Finish => {
                self.hand.stop.store(true, Ordering::Relaxed);
                self.screen.is_ending = true;
            }
            Act::FullScreen => {
                let is_full = ctx.input(|input| input.viewport().fullscreen == Some(true));
                ctx.send_viewport_cmd(ViewportCommand::Fullscreen(!is_full));
            }
            _ => {}
        }
        false
    }
}

impl Drop for RigView {
    /// Ends the session: the work is waited for, so every place is stored and calibrated.
    fn drop(&mut self) {
        self.hand.stop.store(true, Ordering::Relaxed);
    }
}
