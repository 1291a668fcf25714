//! The window's frame: pages, keys, and the session behind them.

mod bar;

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
    sync::Arc,
    time::Duration,
};

use egui::{Context, Ui, ViewportCommand};

#[cfg(feature = "study")]
use super::explore::{self, Explored};
use super::{
    guide,
    keys::{self, UiAction},
    replay::RecordingBrowser,
    result,
    screen::Screen,
    session_state::{Running, SessionState},
    settings,
    sound::{Sound, Tone},
    theme::{background, switch},
    user_error,
};
use crate::{
    app::host::{AppHost, Ended, SessionRequest, UserError, Wake},
    device::Control,
    session::Command,
    text::{Act, window as words},
};

/// How often the picture is painted while something moves that does not come from the source.
const MOVING: Duration = Duration::from_millis(16);
/// How often the window looks around while nothing comes.
const IDLE: Duration = Duration::from_millis(500);
/// A session is shown in big letters once mouse and keys have rested for this long.
const UNTOUCHED_SECS: f64 = 2.0;
/// How long the flash and the words after a view move.
const FLASH_SECS: f64 = 1.3;

/// What is seen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Page {
    /// The live picture and what to do next.
    Guide,
    /// The calibration.
    Result,
    /// The paper's effect to play with.
    #[cfg(feature = "study")]
    Explore,
    /// The next session, and how the window looks and sounds.
    Settings,
    /// A recording, decision by decision.
    Replay,
}

/// The whole window.
pub struct App {
    host: Box<dyn AppHost>,
    wish: SessionRequest,
    /// What the settings page says of the next session.
    draft: SessionRequest,
    offered: settings::Offered,
    /// The source whose modes are offered.
    offered_of: String,
    stage: SessionState,
    screen: Screen,
    page: Page,
    #[cfg(feature = "study")]
    explored: Explored,
    result: result::ResultPage,
    /// What the person set of the camera's controls.
    adjusted: BTreeMap<Control, i64>,
    shelf: RecordingBrowser,
    sound: Sound,
    /// Big letters whether or not somebody is at the computer.
    wants_distance: bool,
    /// When mouse or keys were used last, by the window's clock.
    touched_secs: f64,
    help: bool,
    note: Option<String>,
    exported: Option<Result<PathBuf, UserError>>,
    wake: Wake,
}

impl App {
    /// Starts the first session.
    pub fn new(ctx: &Context, host: Box<dyn AppHost>) -> Self {
        let wake: Wake = {
            let ctx = ctx.clone();
            // Not at once: several wakes within a moment paint once.
            Arc::new(move || ctx.request_repaint_after(Duration::from_millis(1)))
        };
        super::theme::apply(ctx);
        let wish = host.first_wish();
        let nothing = UserError { what: String::new(), action: None };
        let mut app = Self {
            host,
            wish: wish.clone(),
            draft: wish.clone(),
            offered: settings::Offered::default(),
            offered_of: String::new(),
            stage: SessionState::NotStarted(nothing),
            screen: Screen::default(),
            page: Page::Guide,
            #[cfg(feature = "study")]
            explored: Explored::default(),
            result: result::ResultPage::default(),
            adjusted: BTreeMap::new(),
            shelf: RecordingBrowser::default(),
            sound: Sound::new(),
            wants_distance: false,
            touched_secs: 0.0,
            help: false,
            note: None,
            exported: None,
            wake,
        };
        app.open(ctx, wish);
        app
    }

    /// What the panels see now.
    pub fn screen(&self) -> &Screen {
        &self.screen
    }

    /// Shows a running session in big letters while nobody is at the computer.
    fn notice_hands(&mut self, ctx: &Context) {
        let touched = ctx.input(|input| {
            // A window without a person, as in a test, has no focus to gain or lose.
            input.viewport().focused.is_none()
                || input.pointer.delta() != egui::Vec2::ZERO
                || input.pointer.any_down()
                || !input.keys_down.is_empty()
                || input.smooth_scroll_delta() != egui::Vec2::ZERO
        });
        let now_secs = self.screen.now_secs;
        if touched {
            self.touched_secs = now_secs;
        }
        let runs = matches!(self.stage, SessionState::Running(_)) && self.page == Page::Guide;
        let rests = now_secs - self.touched_secs > UNTOUCHED_SECS;
        self.screen.distance = runs && (self.wants_distance || rests);
    }

    /// What is seen now.
    pub fn page(&self) -> Page {
        self.page
    }

    /// The session that ended, once its result is stored.
    pub fn ended(&self) -> Option<&Ended> {
        match &self.stage {
            SessionState::Ended(ended) => Some(ended),
            _ => None,
        }
    }

    /// What needs no painting, also while the window is hidden: the session goes on and ends by itself.
    pub fn look(&mut self, ctx: &Context) {
        self.screen.now_secs = ctx.time();
        self.notice_hands(ctx);
        if self.host.interrupted() {
            ctx.send_viewport_cmd(ViewportCommand::Close);
        }
        match &mut self.stage {
            SessionState::Running(running) => {
                let news = running.look(ctx, &mut self.screen);
                if news.taken && self.screen.preferences.tone {
                    self.sound.play(Tone::Taken);
                }
                if self.screen.preferences.speech {
                    self.sound.say(&guide::sentence_words(&self.screen).0);
                }
                if news.over {
                    self.end();
                }
            }
            SessionState::Ending(ending) => {
                if let Some(ended) = ending.outcome() {
                    let tone =
                        if ended.trouble.is_some() { Tone::UserError } else { Tone::Complete };
                    if self.screen.preferences.tone {
                        self.sound.play(tone);
                    }
                    self.result.begin(&ended, self.host.older(&ended.folder));
                    self.stage = SessionState::Ended(ended);
                    self.page = Page::Result;
                } else if ending.is_over() {
                    self.stage = SessionState::NotStarted(UserError {
                        what: words::ENDING_FAILED.into(),
                        action: Some(words::FAILED_ACTION.into()),
                    });
                }
            }
            SessionState::NotStarted(_) | SessionState::Ended(_) => {}
        }
        self.result.look();
        self.shelf.look();
        for file in ctx.input(|input| input.raw.dropped_files.clone()) {
            self.dropped(file.path());
        }
    }

    /// A file or folder was dropped onto the window.
    fn dropped(&mut self, path: &Path) {
        if self.host.is_folder(path) {
            self.page = Page::Replay;
            self.shelf.open(&mut *self.host, path, Arc::clone(&self.wake));
        } else if matches!(self.stage, SessionState::Ended(_)) {
            self.page = Page::Result;
            self.compare(path);
        } else {
            self.note = Some(words::DROP_TIP.into());
        }
    }

    fn compare(&mut self, old: &Path) {
        let SessionState::Ended(ended) = &self.stage else { return };
        let wake = Arc::clone(&self.wake);
        self.result.comparison.begin(&mut *self.host, (&ended.folder, old), wake);
    }

    /// Paints the page and does what is asked for.
    pub fn paint(&mut self, ui: &mut Ui) {
        // A recording has its own keys.
        let replaying = self.page == Page::Replay;
        let mut asks: Vec<UiAction> = keys::pressed(ui.ctx())
            .into_iter()
            .filter(|act| !(replaying && keys::is_of_session(*act)))
            .map(UiAction::Act)
            .collect();
        if !self.screen.distance {
            self.bar(ui, &mut asks);
        }
        match (&self.stage, self.page) {
            (SessionState::NotStarted(trouble), Page::Guide) => {
                user_error::show(ui, trouble, &self.wish, &mut asks);
            }
            (_, Page::Settings) => {
                let preferences = self.screen.preferences;
                if self.offered_of != self.draft.source {
                    self.offered_of.clone_from(&self.draft.source);
                    self.offered.modes = self.host.modes(&self.draft.source);
                }
                settings::show(ui, &mut self.draft, &self.offered, &preferences, &mut asks);
            }
            (_, Page::Replay) => self.shelf.show(ui, self.screen.preferences, &mut asks),
            #[cfg(feature = "study")]
            (_, Page::Explore) => explore::show(ui, &mut self.explored),
            (_, Page::Guide) => guide::show(ui, &self.screen, &mut asks),
            (stage, Page::Result) => {
                let state = match stage {
                    SessionState::NotStarted(_) => result::State::Nothing,
                    SessionState::Running(_) => result::State::Running,
                    SessionState::Ending(_) => result::State::Ending,
                    SessionState::Ended(ended) => result::State::Ended(ended),
                };
                let formats = self.host.formats();
                let exported = self.exported.as_ref();
                let context = result::Context { state, formats: &formats, exported };
                result::show(ui, &self.screen, &context, &mut self.result, &mut asks);
            }
        }
        self.help(ui);
        for ask in asks {
            self.obey(ui.ctx(), ask);
        }
        let moving = self.screen.since_taken_secs().is_some_and(|since| since < FLASH_SECS);
        ui.ctx().request_repaint_after(if moving { MOVING } else { IDLE });
    }

    /// Stores what there is; the window is closing.
    pub fn close(&mut self) {
        self.end();
        // Dropping what is being ended waits for it.
        self.stage = SessionState::NotStarted(UserError { what: String::new(), action: None });
    }

    fn open(&mut self, ctx: &Context, wish: SessionRequest) {
        self.end();
        let preferences = self.screen.preferences;
        self.screen = Screen { preferences, now_secs: ctx.time(), ..Screen::default() };
        (self.exported, self.note, self.page) = (None, None, Page::Guide);
        self.result = result::ResultPage::default();
        self.stage = match self.host.open(&wish, Arc::clone(&self.wake)) {
            Ok(opened) => {
                self.screen.source.clone_from(&opened.source);
                self.screen.folder = Some(opened.folder.clone());
                self.note.clone_from(&opened.note);
                for (view, picture) in &opened.pictures {
                    self.screen.add_thumbnail(ctx, *view, picture);
                }
                self.screen.adjustables.clone_from(&opened.adjustables);
                let running = Running::new(opened, wish.first);
                // A camera forgets between sessions what the person set.
                if wish.source != self.wish.source {
                    self.adjusted.clear();
                }
                for (control, value) in &self.adjusted {
                    running.adjust(*control, *value);
                }
                SessionState::Running(Box::new(running))
            }
            Err(trouble) => SessionState::NotStarted(trouble),
        };
        self.wish = SessionRequest { first: None, ..wish };
    }

    /// Ends the running session, if there is one.
    fn end(&mut self) {
        let nothing = SessionState::NotStarted(UserError { what: String::new(), action: None });
        self.stage = match std::mem::replace(&mut self.stage, nothing) {
            SessionState::Running(running) => running.end(Arc::clone(&self.wake)),
            other => other,
        };
    }

    fn command(&mut self, ctx: &Context, command: Command) {
        match &mut self.stage {
            SessionState::Running(running) => running.command(command),
            // Going on is how an ended session changes.
            SessionState::Ended(ended) => {
                let folder = ended.folder.clone();
                let wish = SessionRequest {
                    go_on_with: Some(folder),
                    first: Some(command),
                    ..self.wish.clone()
                };
                self.open(ctx, wish);
            }
            SessionState::NotStarted(_) | SessionState::Ending(_) => {}
        }
    }

    fn obey(&mut self, ctx: &Context, ask: UiAction) {
        let preferences = &mut self.screen.preferences;
        match ask {
            UiAction::Act(act) => match act {
                Act::Force => self.command(ctx, Command::ForceNext),
                Act::Undo => self.command(ctx, Command::UndoLast),
                Act::Restore => self.command(ctx, Command::Restore),
                Act::Pause => {
                    let paused = self.screen.snapshot.as_ref().is_some_and(|s| s.paused);
                    self.command(ctx, if paused { Command::Resume } else { Command::Pause });
                }
                Act::Finish => self.end(),
                Act::New => {
                    let wish =
                        SessionRequest { go_on_with: None, first: None, ..self.wish.clone() };
                    self.open(ctx, wish);
                }
                Act::GoOn => {
                    if let SessionState::Ended(ended) = &self.stage {
                        let folder = Some(ended.folder.clone());
                        self.open(ctx, SessionRequest { go_on_with: folder, ..self.wish.clone() });
                    }
                }
                Act::Mirror => preferences.mirrored ^= true,
                Act::Tone => preferences.tone ^= true,
                Act::Speech => preferences.speech ^= true,
                Act::Panels => preferences.panels ^= true,
                Act::Lines => preferences.lines ^= true,
                Act::Distance => self.wants_distance ^= true,
                Act::FullScreen => {
                    let full = ctx.input(|input| input.viewport().fullscreen.unwrap_or(false));
                    ctx.send_viewport_cmd(ViewportCommand::Fullscreen(!full));
                }
                Act::Theme => {
                    switch(ctx);
                }
                Act::Help => self.help ^= true,
                Act::GuidePage => self.page = Page::Guide,
                Act::ResultPage => self.page = Page::Result,
                #[cfg(feature = "study")]
                Act::ExplorePage => self.page = Page::Explore,
                #[cfg(not(feature = "study"))]
                Act::ExplorePage => {}
                Act::ReplayPage => {
                    self.page = Page::Replay;
                    self.shelf.browse(&*self.host);
                }
                Act::SettingsPage => {
                    self.page = Page::Settings;
                    self.offered.sources = self.host.sources();
                }
            },
            UiAction::Remove(view) => self.command(ctx, Command::Remove { view }),
            UiAction::Open(wish) => self.open(ctx, *wish),
            UiAction::Adjust { control, value } => {
                if let SessionState::Running(running) = &self.stage {
                    running.adjust(control, value);
                    self.adjusted.insert(control, value);
                    self.screen.adjust(control, value);
                }
            }
            UiAction::Replay(folder) => {
                self.shelf.open(&mut *self.host, &folder, Arc::clone(&self.wake));
            }
            UiAction::CloseRecording => {
                self.shelf.close();
                self.shelf.browse(&*self.host);
            }
            UiAction::Compare(old) => self.compare(&old),
            UiAction::Show(file) => {
                if let Err(trouble) = self.host.show(&file) {
                    self.exported = Some(Err(trouble));
                }
            }
            UiAction::Export(format) => {
                if let SessionState::Ended(ended) = &self.stage {
                    let folder = ended.folder.clone();
                    self.exported = Some(self.host.export(&folder, format));
                }
            }
        }
    }
}

impl eframe::App for App {
    fn logic(&mut self, ctx: &Context, _frame: &mut eframe::Frame) {
        self.look(ctx);
    }

    fn ui(&mut self, ui: &mut Ui, _frame: &mut eframe::Frame) {
        self.paint(ui);
    }

    fn clear_color(&self, visuals: &egui::Visuals) -> [f32; 4] {
        background(visuals)
    }

    fn on_exit(&mut self, _gl: Option<&eframe::glow::Context>) {
        self.close();
    }
}
