//! The window's frame: pages, keys, and the session behind them.

mod bar;
mod phone;
mod sessions;

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
    sync::{
        Arc,
        atomic::{AtomicU64, Ordering},
    },
    time::Duration,
};

use egui::{Context, Ui, ViewportCommand};

use super::{
    aloud, guide,
    keys::{self, UiAction},
    replay::RecordingBrowser,
    result,
    rig::{MOMENT, RigView},
    screen::{FACES, Preferences, Screen},
    session_state::{Running, SessionState},
    settings,
    sound::{Sound, Tone},
    start::{self, Choices, StartPage},
    theme::{self, background, switch},
    user_error,
};
use boresight_app::{
    BoardFromCode,
    explain::{UserError, user_error as user_error_of},
    window::services::{
        Ended, Memory, RigRequest, SeenBoard, SeenCode, Services, SessionRequest, Storing, Wake,
    },
};
use boresight_detect::Miss;
use boresight_geometry::{boards::BoardChoice, device::Control};
use boresight_guide::session::{Command, Snapshot};
use boresight_present::text::{self, Act, window as words};

/// Time between two paintings during a motion without a new picture, such as a fading flash. Equals
/// a usual camera's frame interval, to paint both together.
const MOVING: Duration = Duration::from_millis(33);
/// Time between two looks of the window in a session without news.
const IDLE: Duration = Duration::from_millis(500);
/// Time between two looks while paused or without a session. Without a graphics card, a look costs
/// the processor 30 ms.
const REST: Duration = Duration::from_secs(2);
/// Time without mouse or keys before a session is shown without bar and panels.
const UNTOUCHED_SECS: f64 = 2.0;
/// Time between two looks at another board, before the first view.
const OTHER_BOARD_SECS: f64 = 0.5;
/// Looks in a row that agree on the other board, with its whole rim, until it's used.
const OTHER_BOARD_LOOKS: u32 = 3;
/// Maximum number of switches, against two boards in view taking turns for ever.
const MOST_SWITCHES: u32 = 3;

/// Page of the window.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Page {
    /// Camera, board and plan of the next session.
    Start,
    /// The live picture and the next action.
    Guide,
    /// The calibration and charts.
    Result,
    /// Settings of the next session, and of looks and sounds.
    Settings,
    /// A recording, decision by decision.
    Replay,
}

/// The whole window.
pub struct App {
    services: Box<dyn Services>,
    wish: SessionRequest,
    start: StartPage,
    choices: Choices,
    /// Source of the offered modes.
    offered_of: String,
    /// Camera with the counted board.
    counted: Option<String>,
    /// True while the cameras are previewed.
    looks: bool,
    memory: Memory,
    /// Another board in view, with the time of the last look, and the number of looks that agree.
    other_board: Option<(BoardChoice, f64, u32)>,
    /// Number of automatic switches of the board since the person started.
    switches: u32,
    /// True if the window fills the screen only while the person is away.
    fills_screen: bool,
    phone: phone::PhoneCard,
    stage: SessionState,
    /// Session of several cameras, instead of every page.
    rig: Option<RigView>,
    screen: Screen,
    page: Page,
    result: result::ResultPage,
    /// Values of the camera's controls set by the person.
    adjusted: BTreeMap<Control, i64>,
    shelf: RecordingBrowser,
    /// A stored session being read.
    storing: Option<(PathBuf, Storing)>,
    /// Calibration to compare the next result with.
    compare_later: Option<PathBuf>,
    sound: Sound,
    /// True for the picture alone even while the person is at the computer.
    wants_distance: bool,
    /// Time of the last use of mouse or keys, by the window's clock.
    touched_secs: f64,
    help: bool,
    /// Scale on top of the person's choice, to fit everything into the window and stay readable.
    fitted: f32,
    note: Option<String>,
    /// Reason for silence at the last attempt to speak.
    no_voice: Option<String>,
    exported: Option<Result<PathBuf, UserError>>,
    wake: Wake,
    /// Milliseconds from a new picture to its painting: see [`Self::pace`].
    pace_ms: Arc<AtomicU64>,
}

impl App {
    /// Starts the first session.
    pub fn new(ctx: &Context, services: Box<dyn Services>) -> Self {
        let pace_ms = Arc::new(AtomicU64::new(in_ms(MOMENT)));
        let wake: Wake = {
            let (ctx, pace_ms) = (ctx.clone(), Arc::clone(&pace_ms));
            Arc::new(move || {
                let wait = Duration::from_millis(pace_ms.load(Ordering::Relaxed));
                ctx.request_repaint_after(wait);
            })
        };
        theme::apply(ctx);
        let (wish, memory) = (services.first_wish(), services.remembered());
        let at_once = services.starts_at_once();
        theme::choose(ctx, memory.theme.as_deref().unwrap_or_default());
        if let Some(zoom) = memory.zoom {
            ctx.set_zoom_factor(zoom);
        }
        let usual = Preferences::default();
        let preferences = Preferences {
            mirrored: memory.mirrored.unwrap_or(FACES),
            tone: memory.tone.unwrap_or(usual.tone),
            speech: memory.speech.unwrap_or(usual.speech),
            panels: memory.panels.unwrap_or(usual.panels),
            full_screen: memory.full_screen.unwrap_or(usual.full_screen),
            hint: memory.knows_guide != Some(true),
            ..usual
        };
        let mut start = StartPage::new(wish.clone());
        start.paper = memory.paper.unwrap_or_default();
        start.knows_square = memory.square_m.is_some();
        start.knows_board = memory.board.is_some();
        let choices = Choices {
            streams: memory.streams.clone(),
            papers: services.papers(),
            mirrored: memory.mirrored,
            full_screen: preferences.full_screen,
            ..Choices::default()
        };
        let phone = phone::PhoneCard::of(&*services);
        let mut app = Self {
            services,
            wish: wish.clone(),
            start,
            choices,
            offered_of: String::new(),
            counted: None,
            looks: false,
            memory,
            other_board: None,
            switches: 0,
            fills_screen: false,
            phone,
            stage: SessionState::Idle,
            rig: None,
            screen: Screen { preferences, ..Screen::default() },
            page: Page::Start,
            result: result::ResultPage::default(),
            adjusted: BTreeMap::new(),
            shelf: RecordingBrowser::default(),
            storing: None,
            compare_later: None,
            sound: Sound::found(),
            wants_distance: false,
            touched_secs: 0.0,
            help: false,
            fitted: 1.0,
            note: None,
            no_voice: None,
            exported: None,
            wake,
            pace_ms,
        };
        if at_once {
            app.open(ctx, wish);
        }
        app
    }

    /// State that the panels show now.
    pub fn screen(&self) -> &Screen {
        &self.screen
    }

    /// Shows a running session as its picture alone while the person is away.
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
        let runs = matches!(self.stage, SessionState::Running(_));
        let is_picture = match self.page {
            Page::Guide => runs,
            Page::Start => self.looks && !self.start.is_changing,
            _ => false,
        };
        let rests = now_secs - self.touched_secs > UNTOUCHED_SECS;
        self.screen.distance = is_picture && (rests || (runs && self.wants_distance));
        let fills = runs && self.screen.distance && self.screen.preferences.full_screen;
        if fills != self.fills_screen {
            self.fills_screen = fills;
            ctx.send_viewport_cmd(ViewportCommand::Fullscreen(fills));
        }
    }

    /// Scale chosen by the person; 1 is the usual size.
    fn zoom(&self, ctx: &Context) -> f32 {
        ctx.zoom_factor() / self.fitted
    }

    /// Previews the cameras on the start page, if free.
    fn look_around(&mut self) {
        let has_session = matches!(self.stage, SessionState::Running(_) | SessionState::Ending(_));
        if self.page != Page::Start || has_session {
            self.stop_looking();
            return;
        }
        self.looks = true;
        self.choices.cameras = self.services.cameras(&self.wake);
        self.start.see(&self.choices);
        if self.offered_of != self.start.draft.source {
            self.offered_of.clone_from(&self.start.draft.source);
            self.choices.modes = self.services.modes(&self.offered_of);
        }
        let counted = self.start.counted(&self.choices);
        if counted != self.counted {
            self.services.count_board(counted.as_deref());
            self.counted = counted;
        }
    }

    fn stop_looking(&mut self) {
        if std::mem::take(&mut self.looks) {
            self.services.stop_looking();
            self.start.leave();
            self.counted = None;
        }
    }

    /// Replaces the chosen board by a plain board in view before the first view. Circles may be
    /// something else: they're offered.
    fn notice_other_board(&mut self, ctx: &Context) {
        let seen = self.screen.snapshot.as_ref();
        let seen = seen.filter(|snapshot| !snapshot.keeps_views() && !snapshot.source_ended);
        let other = seen.and_then(|snapshot| snapshot.shown.prompt.other_board());
        let other = other.filter(|board| board.pattern.is_plain());
        let now_secs = self.screen.now_secs;
        self.other_board = match (other, self.other_board) {
            (Some(board), Some((before, since, looks))) if board == before => {
                Some((board, since, looks))
            }
            (other, _) => other.map(|board| (board, now_secs, 0)),
        };
        let Some((board, since, looks)) = self.other_board else { return };
        if now_secs - since < OTHER_BOARD_SECS || self.switches >= MOST_SWITCHES {
            return;
        }
        // A part of a board would be counted as a smaller one.
        match self.whole_board(board) {
            Some(seen) if looks + 1 >= OTHER_BOARD_LOOKS => {
                self.switches += 1;
                self.use_board(ctx, board, seen.code.as_ref());
            }
            Some(_) => self.other_board = Some((board, now_secs, looks + 1)),
            None => self.other_board = Some((board, now_secs, 0)),
        }
    }

    /// The plain board `choice`, if the picture shows all of it.
    fn whole_board(
        &mut self,
        BoardChoice { columns, rows, pattern }: BoardChoice,
    ) -> Option<SeenBoard> {
        let image = self.screen.picture.grey().filter(|_| pattern.is_plain())?;
        self.services.whole_board(image, [columns, rows])
    }

    /// Starts a new session with another board. One with views is stored, and stays.
    fn use_board(&mut self, ctx: &Context, choice: BoardChoice, code: Option<&SeenCode>) {
        let BoardChoice { columns, rows, pattern } = choice;
        let board = [columns, rows];
        // Without a code, only the number of corners or circles identifies the board in view.
        let square_m = code.map_or(self.wish.square_m, |code| code.square_m);
        let (go_on_with, first) = (None, None);
        let wish =
            SessionRequest { board, square_m, pattern, go_on_with, first, ..self.wish.clone() };
        let draft = &mut self.start.draft;
        (draft.board, draft.square_m, draft.pattern) = (board, square_m, pattern);
        (self.start.knows_board, self.start.knows_square) = (true, code.is_some());
        if self.memory.board.is_some() {
            let (board, square_m) = (Some(board), Some(square_m));
            self.memorise(Memory { board, square_m, pattern, ..self.memory.clone() });
        }
        let has_views = self.screen.snapshot.as_ref().is_some_and(Snapshot::keeps_views);
        let kept = self.screen.folder.clone().filter(|_| has_views);
        // Dropping what is being ended waits for it: a view may have been taken meanwhile. An empty
        // session stays only where there's no bin.
        self.end();
        self.stage = SessionState::Idle;
        if let Some(ended) = &self.screen.folder {
            let _ = self.services.discard(ended);
        }
        self.open(ctx, wish);
        let id = code.map(|code| code.id.as_str());
        let kept = kept.map(|folder| words::stored_in(&folder));
        let said = text::start::switched(id, choice, square_m);
        self.note = Some(kept.into_iter().chain([said]).collect::<Vec<_>>().join(". "));
    }

    /// Switches the voice as chosen; off without a program to speak.
    fn voice(&mut self) {
        let Preferences { speech, mirrored, .. } = self.screen.preferences;
        if let Err(trouble) = self.services.speak(speech, mirrored) {
            self.stay_silent(trouble);
        }
    }

    fn stay_silent(&mut self, trouble: UserError) {
        self.screen.preferences.speech = false;
        self.no_voice = Some(trouble.what.clone());
        self.note = Some(trouble.what);
    }

    /// Keeps the person's choices for the next window.
    fn keep(&mut self, ctx: &Context) {
        let preferences = self.screen.preferences;
        let usual = Preferences::default();
        let changed = |now: bool, usual: bool, before: Option<bool>| {
            before.map(|_| now).or_else(|| (now != usual).then_some(now))
        };
        let before = &self.memory;
        let memory = Memory {
            paper: Some(self.start.paper).filter(|paper| *paper > 0),
            mirrored: changed(preferences.mirrored, FACES, before.mirrored),
            tone: changed(preferences.tone, usual.tone, before.tone),
            speech: changed(preferences.speech, usual.speech, before.speech),
            panels: changed(preferences.panels, usual.panels, before.panels),
            full_screen: changed(preferences.full_screen, usual.full_screen, before.full_screen),
            knows_guide: (!preferences.hint).then_some(true),
            zoom: Some(self.zoom(ctx)).filter(|zoom| (zoom - 1.0).abs() > 1e-3),
            ..before.clone()
        };
        self.memorise(memory);
    }

    fn memorise(&mut self, memory: Memory) {
        if memory != self.memory {
            if let Err(trouble) = self.services.remember(&memory) {
                self.note = Some(trouble.what);
            }
            self.choices.mirrored = memory.mirrored;
            self.choices.streams.clone_from(&memory.streams);
            self.memory = memory;
        }
        self.choices.full_screen = self.screen.preferences.full_screen;
    }

    /// Keeps the session choices of the start page.
    fn keep_wish(&mut self, wish: &SessionRequest) {
        let mut memory = Memory {
            board: Some(wish.board),
            pattern: wish.pattern,
            square_m: Some(wish.square_m),
            plan: Some(wish.plan),
            ..self.memory.clone()
        };
        // The next time, a camera is more likely wanted than the simulation.
        if !text::is_simulated(&wish.source) {
            let is_camera = self.start.camera(&self.choices).is_some();
            memory.source = is_camera.then(|| wish.source.clone()).or(memory.source);
            memory.mode = is_camera.then(|| wish.mode.clone()).or(memory.mode);
            if !is_camera {
                memory.note_stream(&wish.source);
            }
        }
        self.memorise(memory);
    }

    /// The page on show.
    pub fn page(&self) -> Page {
        self.page
    }

    /// The ended session, once stored.
    pub fn ended(&self) -> Option<&Ended> {
        match &self.stage {
            SessionState::Ended(ended) => Some(ended),
            _ => None,
        }
    }

    /// Does the work without painting, also while the window is hidden: the session continues and
    /// ends unattended.
    pub fn look(&mut self, ctx: &Context) {
        self.screen.now_secs = ctx.time();
        theme::fit(ctx, &mut self.fitted);
        self.notice_hands(ctx);
        self.voice();
        if self.services.interrupted() {
            ctx.send_viewport_cmd(ViewportCommand::Close);
        }
        if self.rig.is_some() {
            return;
        }
        match &mut self.stage {
            SessionState::Running(running) => {
                let news = running.look(ctx, &mut self.screen);
                if news.taken && self.screen.preferences.tone {
                    self.sound.play(Tone::Taken);
                }
                if news.taken && self.screen.preferences.hint {
                    self.screen.preferences.hint = false;
                    self.keep(ctx);
                }
                if news.over || self.services.phone_ends_session() {
                    self.end();
                } else {
                    self.notice_other_board(ctx);
                }
            }
            SessionState::Ending(ending) => {
                if let Some(ended) = ending.outcome() {
                    let tone =
                        if ended.trouble.is_some() { Tone::UserError } else { Tone::Complete };
                    if self.screen.preferences.tone {
                        self.sound.play(tone);
                    }
                    self.result.begin(&ended, self.services.older(&ended.folder));
                    self.stage = SessionState::Ended(ended);
                    if let Some(old) = self.compare_later.take() {
                        self.compare(&old);
                    }
                    // On another page, the person sees a notice and stays there.
                    if matches!(self.page, Page::Guide | Page::Start) {
                        self.page = Page::Result;
                    } else if self.page != Page::Result {
                        self.note = Some(words::FINISHED.into());
                    }
                } else if ending.is_over() {
                    self.stage = SessionState::NotStarted(UserError {
                        what: words::ENDING_FAILED.into(),
                        action: Some(words::FAILED_ACTION.into()),
                    });
                }
            }
            SessionState::Ended(_) if self.services.phone_wants_more() => {
                self.command(ctx, Command::TakeMore);
            }
            SessionState::Idle | SessionState::NotStarted(_) | SessionState::Ended(_) => {}
        }
        let phones = self.services.phones();
        self.phone.notice(&*self.services, phones);
        self.pace_ms.store(in_ms(self.pace()), Ordering::Relaxed);
        self.look_around();
        self.result.look();
        self.shelf.look(ctx);
        self.look_at_stored(ctx);
        for file in ctx.input(|input| input.raw.dropped_files.clone()) {
            self.dropped(file.path());
        }
    }

    fn compare(&mut self, old: &Path) {
        let SessionState::Ended(ended) = &self.stage else { return };
        let wake = Arc::clone(&self.wake);
        self.result.comparison.begin(&mut *self.services, (&ended.folder, old), wake);
    }

    /// Paints the page and carries out requests.
    pub fn paint(&mut self, ui: &mut Ui) {
        aloud::name_window(ui.ctx(), &self.title());
        if let Some(rig) = &mut self.rig {
            if rig.show(ui) {
                self.rig = None;
                self.page = Page::Start;
                ui.ctx().request_repaint();
            }
            return;
        }
        // A recording has its own keys.
        let replaying = self.page == Page::Replay;
        let mut asks: Vec<UiAction> = keys::pressed(ui.ctx())
            .into_iter()
            .filter(|act| !(replaying && keys::is_of_session(*act)))
            // There, Space starts a session.
            .filter(|act| self.page != Page::Start || *act != Act::Force)
            .map(UiAction::Act)
            .collect();
        if !self.screen.distance {
            self.bar(ui, &mut asks);
        }
        let mut typed = None;
        match (&self.stage, self.page) {
            (SessionState::Running(_) | SessionState::Ending(_), Page::Start) => {
                start::show_running(ui, &mut asks);
            }
            (_, Page::Start) | (SessionState::Idle, Page::Guide) => {
                start::show(ui, &mut self.start, &self.choices, &mut asks);
            }
            (SessionState::NotStarted(trouble), Page::Guide) => {
                user_error::show(ui, trouble, &self.wish, &mut asks);
            }
            (_, Page::Settings) => {
                let no_voice = self.no_voice.as_deref();
                let mut memory = self.memory.clone();
                let preferences = &self.screen.preferences;
                let looks = (preferences, self.zoom(ui.ctx()));
                settings::show(ui, looks, no_voice, &mut memory, &mut asks);
                typed = Some(memory);
            }
            (stage, Page::Replay) => {
                let busy = matches!(stage, SessionState::Running(_) | SessionState::Ending(_));
                self.shelf.note_busy(busy);
                self.shelf.show(ui, self.screen.preferences, &mut asks);
            }
            (_, Page::Guide) => guide::show(ui, &self.screen, &mut asks),
            (stage, Page::Result) => {
                let state = match stage {
                    SessionState::Idle | SessionState::NotStarted(_) => result::State::Nothing,
                    SessionState::Running(_) => result::State::Running,
                    SessionState::Ending(_) => result::State::Ending,
                    SessionState::Ended(ended) => result::State::Ended(ended),
                };
                let formats = self.services.formats(false);
                let exported = self.exported.as_ref();
                let context = result::Context { state, formats: &formats, exported };
                result::show(ui, &self.screen, &context, &mut self.result, &mut asks);
            }
        }
        self.help(ui);
        self.phone.show(ui.ctx(), self.services.phones());
        if self.start.shows_board {
            self.start.shows_board = start::show_board(ui.ctx(), self.start.in_squares());
        }
        if let Some(memory) = typed {
            self.memorise(memory);
        }
        let asked = !asks.is_empty();
        for ask in asks {
            self.obey(ui.ctx(), ask);
        }
        if asked {
            self.keep(ui.ctx());
        }
        let moving =
            self.screen.since_taken_secs().is_some_and(|since| since < guide::overlay::FLASH_SECS);
        let runs = matches!(self.stage, SessionState::Running(_));
        let next = match (moving, runs && self.pace() != REST) {
            (true, _) => MOVING,
            (false, true) => IDLE,
            (false, false) => REST,
        };
        ui.ctx().request_repaint_after(next);
    }

    /// Time from a new picture to its painting: rarely while paused, every second picture while
    /// only the room moves.
    fn pace(&self) -> Duration {
        let Some(snapshot) = &self.screen.snapshot else { return MOMENT };
        let live = snapshot.live.as_ref();
        let is_room = live.is_some_and(|live| live.corners_px == Err(Miss::NoBoard));
        if snapshot.paused {
            REST
        } else if is_room {
            MOVING
        } else {
            MOMENT
        }
    }

    /// Stores everything before the window closes.
    pub fn close(&mut self) {
        self.stop_looking();
        self.end();
        // Dropping an ending session waits for it.
        self.stage = SessionState::Idle;
        self.rig = None;
    }

    /// Title of the window: the session's camera, if any.
    fn title(&self) -> String {
        let source = self.screen.source.as_str();
        if source.is_empty() { words::TITLE.into() } else { words::title(source) }
    }

    fn open(&mut self, ctx: &Context, wish: SessionRequest) {
        self.stop_looking();
        self.end();
        self.other_board = None;
        let preferences = self.screen.preferences;
        self.screen = Screen { preferences, now_secs: ctx.time(), ..Screen::default() };
        (self.exported, self.note, self.page) = (None, None, Page::Guide);
        self.result = result::ResultPage::default();
        self.stage = match self.services.open(&wish, Arc::clone(&self.wake)) {
            Ok(opened) => {
                self.screen.source.clone_from(&opened.source);
                ctx.send_viewport_cmd(ViewportCommand::Title(self.title()));
                self.screen.folder = Some(opened.folder.clone());
                self.note.clone_from(&opened.note);
                self.screen.opening_note.clone_from(&opened.note);
                for (view, picture) in &opened.pictures {
                    self.screen.add_thumbnail(ctx, *view, picture);
                }
                self.screen.adjustables.clone_from(&opened.adjustables);
                let running = Running::new(opened, wish.first);
                // A camera forgets the person's settings between sessions.
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
        self.wish = SessionRequest { first: None, board_code: BoardFromCode::Nothing, ..wish };
    }

    fn open_rig(&mut self, ctx: &Context, request: &RigRequest) {
        self.stop_looking();
        self.end();
        // Dropping an ending session waits for it.
        (self.stage, self.note) = (SessionState::Idle, None);
        let opened = self.services.open_rig(request);
        let started = opened.and_then(|opened| {
            let view = RigView::start(ctx, opened, |_| ());
            view.map_err(|err| user_error_of(&err.into()))
        });
        match started {
            Ok(view) => self.rig = Some(view),
            Err(UserError { what, action }) => {
                self.note = Some([what].into_iter().chain(action).collect::<Vec<_>>().join(". "));
            }
        }
    }

    /// Ends the running session, if any.
    fn end(&mut self) {
        self.stage = match std::mem::replace(&mut self.stage, SessionState::Idle) {
            SessionState::Running(running) => running.end(Arc::clone(&self.wake)),
            other => other,
        };
    }

    fn command(&mut self, ctx: &Context, command: Command) {
        match &mut self.stage {
            SessionState::Running(running) => running.command(command),
            SessionState::Ended(ended) if self.page == Page::Result && leaves_out(command) => {
                let folder = ended.folder.clone();
                self.correct(folder, command);
            }
            // An ended session changes by resuming it.
            SessionState::Ended(ended) => {
                let folder = ended.folder.clone();
                let wish = SessionRequest {
                    go_on_with: Some(folder),
                    first: Some(command),
                    ..self.wish.clone()
                };
                self.open(ctx, wish);
            }
            SessionState::Idle | SessionState::NotStarted(_) | SessionState::Ending(_) => {}
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
                    self.pace_ms.store(in_ms(MOMENT), Ordering::Relaxed);
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
                    let theme = Some(theme::name(ctx).to_owned());
                    self.memorise(Memory { theme, ..self.memory.clone() });
                }
                Act::Help => self.help ^= true,
                Act::StartPage => self.page = Page::Start,
                Act::GuidePage if matches!(self.stage, SessionState::Idle) => {
                    self.page = Page::Start;
                }
                Act::GuidePage => self.page = Page::Guide,
                Act::ResultPage => self.page = Page::Result,
                Act::ReplayPage => {
                    self.page = Page::Replay;
                    self.shelf.browse(&*self.services, Arc::clone(&self.wake));
                }
                Act::SettingsPage => self.page = Page::Settings,
            },
            UiAction::Mirror(mirrored) => {
                preferences.mirrored = mirrored;
                self.memorise(Memory { mirrored: Some(mirrored), ..self.memory.clone() });
            }
            UiAction::TestVoice => {
                preferences.speech = true;
                self.no_voice = None;
                if let Err(trouble) = self.services.test_voice() {
                    self.stay_silent(trouble);
                }
            }
            UiAction::Zoom(zoom) => ctx.set_zoom_factor(zoom * self.fitted),
            UiAction::FullScreenAfar(full) => preferences.full_screen = full,
            UiAction::Start(wish) => {
                self.keep_wish(&wish);
                self.switches = 0;
                self.open(ctx, *wish);
            }
            UiAction::StartRig(request) => {
                self.keep_wish(&request.wish);
                self.open_rig(ctx, &request);
            }
            UiAction::UseBoard(board) => {
                let code = self.whole_board(board).and_then(|seen| seen.code);
                self.use_board(ctx, board, code.as_ref());
            }
            UiAction::Print { board, paper } => {
                let printed = self.services.print_board(board, paper);
                if let Ok(printed) = &printed {
                    self.start.note_printed(printed.square_m);
                }
                self.start.printed = Some(printed);
            }
            UiAction::TakeMore => self.command(ctx, Command::TakeMore),
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
                self.shelf.open(&mut *self.services, &folder, Arc::clone(&self.wake));
            }
            UiAction::Browse(folder) => self.shelf.look_into(&folder),
            UiAction::CloseRecording => {
                self.shelf.close();
                self.shelf.browse(&*self.services, Arc::clone(&self.wake));
            }
            UiAction::Compare(old) => self.compare(&old),
            UiAction::ShowResult(folder) => self.show_stored(folder),
            UiAction::GoOnWith(folder) => self.go_on_with(ctx, folder),
            UiAction::GoOnWithRig(folder) => {
                let wish = SessionRequest { go_on_with: Some(folder), ..self.wish.clone() };
                self.open_rig(ctx, &RigRequest { cameras: Vec::new(), wish });
            }
            UiAction::ExportOf(folder, format) => self.export_of(&folder, format),
            UiAction::Delete(folder) => self.delete(&folder),
            UiAction::Show(file) => {
                if let Err(trouble) = self.services.show(&file) {
                    self.note = Some(trouble.what.clone());
                    self.exported = Some(Err(trouble));
                }
            }
            UiAction::Export(format) => {
                if let SessionState::Ended(ended) = &self.stage {
                    let folder = ended.folder.clone();
                    self.exported = Some(self.services.export(&folder, format));
                }
            }
        }
    }
}

fn in_ms(wait: Duration) -> u64 {
    wait.as_millis() as u64
}

/// True if `command` needs no camera.
fn leaves_out(command: Command) -> bool {
    matches!(command, Command::UndoLast | Command::Remove { .. } | Command::Restore)
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
