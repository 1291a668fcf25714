//! Hub between the program's state and the pages' requests.

use std::{
    collections::VecDeque,
    sync::{
        Arc, Mutex, MutexGuard, PoisonError,
        atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering},
    },
    time::Instant,
};

use serde::{Deserialize, Serialize};
use tokio::sync::watch;

use super::keys::Role;
use boresight_geometry::{boards::Pattern, frame::Frame};
use boresight_guide::{
    guidance::Refusal,
    session::{Command, Gravity, Snapshot, ViewNumber},
};
use boresight_present::{
    browser::{self, EndedPage, Led, Teller},
    speech::{Rank, Word},
};
use boresight_run::pipeline::{CommandLink, NotSent, Onlooker};

/// Number of news kept for an absent page.
const NEWS_KEPT: usize = 64;

/// Hub between the program and the pages. Nothing here ever waits for a page.
pub struct Hub {
    picture: watch::Sender<Option<Picture>>,
    /// Newest picture, not yet judged by the session.
    unjudged: Mutex<Option<Picture>>,
    state: watch::Sender<State>,
    pictures: AtomicU64,
    told: Mutex<Told>,
    commands: Mutex<Option<CommandLink>>,
    request: Mutex<Option<Request>>,
    wants_end: AtomicBool,
    /// True if a page requested to take back the newest place of several cameras.
    wants_undo: AtomicBool,
    /// True if a page requested to continue the ended session.
    wants_more: AtomicBool,
    /// Zero of the pages' clock.
    began: Instant,
    pages: AtomicUsize,
    /// Number of watching pages.
    watchers: AtomicUsize,
    /// Time of the last page's leaving; `None` before the first page.
    left: Mutex<Option<Instant>>,
}

/// Newest picture.
#[derive(Clone)]
pub(super) struct Picture {
    /// Sequence number of the picture over all sessions, from 1.
    pub(super) number: u64,
    pub(super) frame: Arc<Frame>,
    pub(super) came: Instant,
}

/// State shown by pages beside the picture.
#[derive(Clone)]
pub(super) struct State {
    pub(super) version: u64,
    pub(super) stage: Stage,
    /// Newest snapshot of the running or ended session.
    pub(super) snapshot: Option<Arc<Snapshot>>,
    /// Number of the newest news in this state.
    pub(super) news: u64,
    /// True if the session's pictures are rendered.
    pub(super) simulated: bool,
    /// Board in front of the camera, in words.
    pub(super) board: String,
    /// Request to the person, if several cameras are led.
    pub(super) led: Option<Arc<Led>>,
    /// What those cameras have reached so far.
    pub(super) reached: String,
}

/// Stage of the program.
#[derive(Clone, Debug)]
pub enum Stage {
    /// No session: a page may start one.
    Waiting(Arc<Offer>),
    /// Session being opened.
    Starting,
    /// Session running.
    Guiding,
    /// Watched camera being pushed back.
    Adjusting(Arc<AdjustPage>),
    /// Result being computed and stored.
    Ending,
    /// Result stored.
    Ended(Arc<EndedPage>),
}

/// Choices for a new session.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Offer {
    /// Cameras to choose from.
    pub cameras: Vec<OfferedCamera>,
    /// Dictionaries of ChArUco boards, with numbers of markers.
    pub dictionaries: Vec<(&'static str, usize)>,
    /// Last choice.
    pub last: Option<Request>,
    /// Failure of the last session to start, and the next action.
    pub trouble: Option<(String, String)>,
}

/// Camera offered to the page.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct OfferedCamera {
    /// Source name for opening the camera.
    pub source: String,
    /// Display name.
    pub name: String,
}

/// Session requested by a page.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Request {
    /// Source of an offered camera.
    pub source: String,
    /// Inner corners: columns, rows.
    pub board: [u16; 2],
    /// Print of the board.
    #[serde(rename = "markers", default, skip_serializing_if = "Pattern::is_plain")]
    pub pattern: Pattern,
    /// Side of a square.
    pub square_m: f64,
    /// Name of the plan.
    pub plan: String,
}

/// Page while a watched camera is pushed back. The second of each pair is for a person facing the
/// camera.
#[derive(Clone, Debug)]
pub struct AdjustPage {
    /// Direction: one of `←→↑↓↺↻●?`.
    pub arrow: [&'static str; 2],
    /// Amount with unit.
    pub number: String,
    /// Action.
    pub sentence: [String; 2],
    /// Gravity of the action.
    pub gravity: Gravity,
    /// Closeness to the target, 0 to 1; `None` if unknown.
    pub close: Option<f64>,
    /// Words to say aloud.
    pub aloud: Option<Word>,
    /// Size of the picture.
    pub image_size_px: [u32; 2],
    /// Points on edges of the scene at the target positions, px.
    pub outline: Vec<[i32; 2]>,
}

/// News of all snapshots, for pages possibly absent at the time.
#[derive(Default)]
struct Told {
    teller: Teller,
    news: VecDeque<News>,
    next: u64,
}

/// One-time event.
#[derive(Clone)]
pub(super) struct News {
    /// Sequence number, from 1.
    pub(super) number: u64,
    pub(super) came: Instant,
    pub(super) what: browser::News,
}

impl Default for Hub {
    fn default() -> Self {
        Self::new()
    }
}

impl Hub {
    /// Hub showing that a session is being opened.
    pub fn new() -> Self {
        let state = State {
            version: 0,
            stage: Stage::Starting,
            snapshot: None,
            news: 0,
            simulated: false,
            board: String::new(),
            led: None,
            reached: String::new(),
        };
        Self {
            picture: watch::Sender::new(None),
            unjudged: Mutex::default(),
            state: watch::Sender::new(state),
            pictures: AtomicU64::new(0),
            told: Mutex::default(),
            commands: Mutex::default(),
            request: Mutex::default(),
            wants_end: AtomicBool::new(false),
            wants_undo: AtomicBool::new(false),
            wants_more: AtomicBool::new(false),
            began: Instant::now(),
            pages: AtomicUsize::new(0),
            watchers: AtomicUsize::new(0),
            left: Mutex::default(),
        }
    }

    /// Shows the program's stage.
    pub fn show(&self, stage: Stage) {
        self.wants_end.store(false, Ordering::Relaxed);
        self.state.send_modify(|state| {
            state.version += 1;
            if matches!(stage, Stage::Starting | Stage::Waiting(_)) {
                state.snapshot = None;
            }
            state.stage = stage;
        });
    }

    /// Shows a picture of a watched camera, and the action.
    pub fn adjusting(&self, frame: &Arc<Frame>, page: AdjustPage) {
        self.publish(Some(self.numbered(frame)));
        self.show(Stage::Adjusting(Arc::new(page)));
    }

    /// Shows the state of one of several cameras, with its newest picture, and the request of
    /// `led`; `reached` says what the cameras have reached so far.
    pub fn leading(
        &self,
        frame: Option<&Arc<Frame>>,
        snapshot: &Snapshot,
        led: Led,
        reached: String,
    ) {
        let is_shown = |frame: &&Arc<Frame>| {
            let shown = self.picture.borrow();
            shown.as_ref().is_some_and(|picture| Arc::ptr_eq(&picture.frame, frame))
        };
        if let Some(frame) = frame.filter(|frame| !is_shown(frame)) {
            self.publish(Some(self.numbered(frame)));
        }
        let before = self.state.borrow().led.as_ref().map_or(0, |led| led.places);
        let newest = if led.places > before {
            let [text, mirrored] = led.sentence.clone();
            let word = Word { rank: Rank::Taken, text, mirrored };
            self.add_news(vec![browser::News { word, view: Some(ViewNumber(led.places - 1)) }])
        } else {
            lock(&self.told).next
        };
        self.state.send_modify(|state| {
            state.version += 1;
            state.news = newest;
            state.stage = Stage::Guiding;
            state.snapshot = Some(Arc::new(snapshot.clone()));
            state.led = Some(Arc::new(led));
            state.reached = reached;
        });
    }

    /// True, once, if a page requested to take back the newest place.
    pub fn take_undo(&self) -> bool {
        self.wants_undo.swap(false, Ordering::Relaxed)
    }

    /// Keeps news for pages; the number of the newest.
    fn add_news(&self, all: Vec<browser::News>) -> u64 {
        let mut told = lock(&self.told);
        for what in all {
            told.next += 1;
            if told.news.len() == NEWS_KEPT {
                told.news.pop_front();
            }
            let (number, came) = (told.next, Instant::now());
            told.news.push_back(News { number, came, what });
        }
        told.next
    }

    /// Takes the session requested by a page, once.
    pub fn take_request(&self) -> Option<Request> {
        lock(&self.request).take()
    }

    /// Number of pages following the events now.
    pub fn pages(&self) -> usize {
        self.pages.load(Ordering::Relaxed)
    }

    /// Seconds since the last page left; `None` if a page is present or none has come.
    pub fn alone_secs(&self) -> Option<f64> {
        let left = (*lock(&self.left))?;
        (self.pages() == 0).then(|| left.elapsed().as_secs_f64())
    }

    /// Number of watching pages following the events now.
    pub(super) fn watchers(&self) -> usize {
        self.watchers.load(Ordering::Relaxed)
    }

    pub(super) fn page_came(&self, role: Role) {
        self.pages.fetch_add(1, Ordering::Relaxed);
        self.watchers.fetch_add(usize::from(role == Role::Watcher), Ordering::Relaxed);
    }

    pub(super) fn page_left(&self, role: Role) {
        *lock(&self.left) = Some(Instant::now());
        self.watchers.fetch_sub(usize::from(role == Role::Watcher), Ordering::Relaxed);
        self.pages.fetch_sub(1, Ordering::Relaxed);
    }

    /// `frame` with the next number, come now.
    fn numbered(&self, frame: &Arc<Frame>) -> Picture {
        let number = self.pictures.fetch_add(1, Ordering::Relaxed) + 1;
        Picture { number, frame: Arc::clone(frame), came: Instant::now() }
    }

    /// Publishes a picture to the pages.
    fn publish(&self, picture: Option<Picture>) {
        if picture.is_some() {
            // Free the previous frame outside the slot's lock.
            drop(self.picture.send_replace(picture));
        }
    }

    pub(super) fn pictures(&self) -> watch::Receiver<Option<Picture>> {
        self.picture.subscribe()
    }

    pub(super) fn states(&self) -> watch::Receiver<State> {
        self.state.subscribe()
    }

    /// News after number `seen`, oldest first, as far as included in `state`.
    pub(super) fn news_after(&self, seen: u64, state: &State) -> Vec<News> {
        let is_new = |news: &&News| news.number > seen && news.number <= state.news;
        lock(&self.told).news.iter().filter(is_new).cloned().collect()
    }

    /// Milliseconds since the hub was created.
    pub(super) fn clock_ms(&self) -> u64 {
        u64::try_from(self.began.elapsed().as_millis()).unwrap_or(u64::MAX)
    }

    /// Announces a session being opened: rendered pictures or not, and the board.
    pub fn opens(&self, simulated: bool, board: String) {
        self.state.send_modify(|state| {
            state.version += 1;
            (state.simulated, state.board) = (simulated, board);
        });
    }

    /// True, once, if a page requested to continue the ended session.
    pub fn take_more(&self) -> bool {
        self.wants_more.swap(false, Ordering::Relaxed)
    }

    /// See [`Teller::refused`].
    pub(super) fn refused(&self) -> Vec<(Refusal, u64)> {
        lock(&self.told).teller.refused()
    }

    /// Forwards a page's command.
    pub(super) fn command(&self, command: Command) -> Result<(), NotSent> {
        match &*lock(&self.commands) {
            Some(link) => link.send(command),
            None if command == Command::UndoLast && self.is_leading() => {
                self.wants_undo.store(true, Ordering::Relaxed);
                Ok(())
            }
            None => Err(NotSent::Over),
        }
    }

    fn is_leading(&self) -> bool {
        let state = self.state.borrow();
        matches!(state.stage, Stage::Guiding) && state.led.is_some()
    }

    /// Records a page's request to end the session. False without a session.
    pub(super) fn end(&self) -> bool {
        let guiding = matches!(self.state.borrow().stage, Stage::Guiding);
        self.wants_end.store(guiding, Ordering::Relaxed);
        guiding
    }

    /// Records a page's request for a session. False if none can be started now.
    pub(super) fn start(&self, request: Request) -> bool {
        let can_start = match &self.state.borrow().stage {
            Stage::Waiting(offer) => {
                offer.cameras.iter().any(|camera| camera.source == request.source)
            }
            _ => false,
        };
        if can_start {
            *lock(&self.request) = Some(request);
        }
        can_start
    }

    /// Records a page's request to continue the ended session. False if impossible.
    pub(super) fn go_on(&self) -> bool {
        let can_go_on =
            matches!(&self.state.borrow().stage, Stage::Ended(ended) if ended.can_go_on);
        if can_go_on {
            self.wants_more.store(true, Ordering::Relaxed);
        }
        can_go_on
    }

    /// Records a page's request to leave the result. False without anything to go to.
    pub(super) fn leave(&self) -> bool {
        let can_leave =
            matches!(&self.state.borrow().stage, Stage::Ended(ended) if ended.can_restart);
        if can_leave {
            self.wants_end.store(true, Ordering::Relaxed);
        }
        can_leave
    }
}

impl Onlooker for Hub {
    fn began(&self, commands: CommandLink) {
        *lock(&self.commands) = Some(commands);
        // The last session's picture doesn't belong to this session.
        lock(&self.unjudged).take();
        self.picture.send_replace(None);
        // Pages continue counting.
        lock(&self.told).teller = Teller::default();
        self.show(Stage::Guiding);
    }

    fn captured(&self, frame: &Arc<Frame>) {
        let picture = self.numbered(frame);
        // A frame is published after its judgement: encoding JPEGs while the detector works would
        // slow it down. The previous frame, if unjudged, is published now.
        let before = lock(&self.unjudged).replace(picture);
        self.publish(before);
    }

    fn decided(&self, snapshot: &Snapshot) {
        let news = lock(&self.told).teller.tell(snapshot);
        let newest = self.add_news(news);
        let judged = lock(&self.unjudged).take();
        self.publish(judged);
        let snapshot = Some(Arc::new(snapshot.clone()));
        let before = {
            let mut before = None;
            self.state.send_modify(|state| {
                state.version += 1;
                state.news = newest;
                before = std::mem::replace(&mut state.snapshot, snapshot);
            });
            before
        };
        drop(before);
    }

    fn wants_end(&self) -> bool {
        self.wants_end.load(Ordering::Relaxed)
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
