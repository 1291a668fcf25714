//! A session of several cameras: a pipeline for each, led to common places.

use std::{
    collections::{BTreeMap, VecDeque},
    path::{Path, PathBuf},
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    time::Duration,
};

use anyhow::{Context, bail};
use crossbeam_channel::bounded;
use image::GrayImage;
use nalgebra::{Isometry3, Vector3};

use super::{
    opening::new_session_path, run::RunContext, saved_session::SavedSession,
    source::open_simulated_rig,
};
use crate::{Announcer, Opening, Run, commands::rig::known_lens};
use boresight_calibrate::{CalibrationParams, Pair, RigCalibration, RigViews};
use boresight_capture::read_picture;
use boresight_geometry::{
    boards::Board,
    frame::{Frame, FrameId},
};
use boresight_guide::{
    rig::{Order, Place, Plan, RigPrompt, RigSession, plan},
    session::{Input, Session, Snapshot},
};
use boresight_present::{
    instruction::Instruction,
    text::{is_simulated, rig as words},
};
use boresight_run::{
    config::Config,
    pipeline::{Background, LiveFeed, Pipeline},
    recording::{Header, RigSessionCamera, RigSessionFile, SessionFolder, is_name},
};
use boresight_sim::{Scene, technician::Person};

/// Distance of the simulated cameras.
pub const SIMULATED_BASELINE_M: f64 = 0.12;
/// Most cameras of a rig.
pub const MOST_CAMERAS: usize = 8;
/// Longest wait for news before the stop flag is read again.
const PATIENCE: Duration = Duration::from_millis(100);

/// Settings to open a rig's session with.
#[derive(Clone, Debug)]
pub struct RigOpening {
    /// Each camera, with its source and settings.
    pub cameras: Vec<(RigSessionCamera, Opening)>,
    /// True if one trigger starts every exposure.
    pub is_synchronised: bool,
    /// Folder of a new session; `None` for a new one in `sessions`.
    pub out: Option<PathBuf>,
}

/// Orders of the person to a rig's session.
#[derive(Clone, Debug)]
pub struct RigHand {
    /// End the session.
    pub stop: Arc<AtomicBool>,
    /// End the session; what shows its result stays.
    pub end: Arc<AtomicBool>,
    /// Take the newest place back.
    pub undo: Arc<AtomicBool>,
}

impl RigHand {
    /// Orders of which `stop` may also come from elsewhere.
    pub fn new(stop: Arc<AtomicBool>) -> Self {
        Self { stop, end: Arc::default(), undo: Arc::default() }
    }
}

/// Sessions of several cameras, ready to run.
pub struct RigRun {
    folder: PathBuf,
    file: RigSessionFile,
    runs: Vec<Run>,
    rig: RigSession,
    params: CalibrationParams,
    board: Board,
    is_paced: bool,
}

/// A finished session of several cameras.
#[derive(Clone, Debug)]
pub struct FinishedRig {
    /// The session's folder.
    pub folder: PathBuf,
    /// Names of the cameras.
    pub names: Vec<String>,
    /// Settings of the first camera.
    pub config: Config,
    /// Time at which the session began, as written.
    pub created: String,
    /// True if the pictures are rendered.
    pub is_simulated: bool,
    /// Views of each camera, numbered by place.
    pub views: Vec<RigViews>,
    /// Picture of each camera's view, by place.
    frames: Vec<BTreeMap<u64, FrameId>>,
}

impl FinishedRig {
    /// Picture of the camera `name` at the place `number`; `None` without a view there, or if it
    /// can't be read.
    pub fn picture(&self, name: &str, number: u64) -> Option<GrayImage> {
        let camera = self.names.iter().position(|other| other == name)?;
        let frame = self.frames[camera].get(&number)?;
        read_picture(&self.folder.join(name).join(frame.stored_name())).ok()
    }
}

/// State of a rig's session after news of a camera.
pub struct RigNews<'a> {
    /// Request to the person, in words, with left and right of who is behind the cameras, and of
    /// who faces them.
    pub sentences: [String; 2],
    /// True if the person faces the cameras.
    pub is_mirrored: bool,
    /// The same as a value.
    pub prompt: RigPrompt,
    /// Camera whose picture the person looks at.
    pub shown: usize,
    /// Number of places taken.
    pub places: usize,
    /// Cameras that have been linked.
    pub links: &'a Arc<[RigLink]>,
    /// The newest picture and state of each camera.
    pub cameras: Vec<(Option<&'a Arc<Frame>>, Option<&'a Snapshot>)>,
    /// True for the last news: the rig is being calibrated.
    pub is_over: bool,
}

impl RigNews<'_> {
    /// Request to the person, in words.
    pub fn sentence(&self) -> &str {
        &self.sentences[usize::from(self.is_mirrored)]
    }
}

/// Link of two cameras.
#[derive(Clone, Debug, PartialEq)]
pub struct RigLink {
    /// The cameras.
    pub of: [usize; 2],
    /// Error against the goal, in words.
    pub words: String,
    /// True if the goal is met.
    pub is_met: bool,
}

impl RigOpening {
    /// Opens the sources and the folders.
    ///
    /// # Errors
    ///
    /// If there are fewer than two or more than eight cameras, a name is no name, or one can't be
    /// opened.
    pub fn open(&self, announcer: &Announcer) -> anyhow::Result<RigRun> {
        if !(2..=MOST_CAMERAS).contains(&self.cameras.len()) {
            bail!("a rig has two to eight cameras: --rig left=SOURCE right=SOURCE");
        }
        for (index, (camera, _)) in self.cameras.iter().enumerate() {
            if !is_name(&camera.name) {
                bail!("{:?} is no name of a camera: letters, digits, - and _", camera.name);
            }
            if self.cameras[..index].iter().any(|(other, _)| other.name == camera.name) {
                bail!("two cameras are called {:?}", camera.name);
            }
        }
        let folder = self.out.clone().unwrap_or_else(new_session_path);
        if RigSessionFile::is_in(&folder) {
            bail!("there is a session already: boresight guide --session {}", folder.display());
        }
        let cameras = self.cameras.iter().map(|(camera, _)| camera.clone()).collect();
        let openings = self.cameras.iter().map(|(camera, opening)| {
            let out = Some(folder.join(&camera.name));
            (camera.name.as_str(), Opening { out, ..opening.clone() })
        });
        let runs = opened(openings, announcer)?;
        let file = RigSessionFile::new(cameras, self.is_synchronised);
        file.write(&folder)?;
        RigRun::new(folder, file, runs)
    }
}

impl RigRun {
    /// A pair of simulated cameras, [`SIMULATED_BASELINE_M`] apart, and a person with a board on a
    /// tripod, who follows what is asked for. Ends after `max_frames` at most.
    ///
    /// # Errors
    ///
    /// If the folder isn't new.
    pub fn simulated(seed: u64, out: Option<PathBuf>, max_frames: u64) -> anyhow::Result<Self> {
        let folder = out.unwrap_or_else(new_session_path);
        let config = Config::load(None, &[])?;
        let person = Person::Tripod.params();
        let scene = |seed: u64| Scene { technician: person, ..Scene::demo(seed) };
        let apart = Vector3::new(-SIMULATED_BASELINE_M, 0.0, 0.0);
        let scenes = vec![
            (scene(seed), Isometry3::identity()),
            (scene(seed + 1), Isometry3::new(apart, Vector3::y() * -0.05)),
        ];
        let names = ["left", "right"];
        let mut runs = Vec::with_capacity(names.len());
        for (name, open) in names.iter().zip(open_simulated_rig(scenes, max_frames)) {
            let source = format!("sim:demo:{seed}");
            let opening = Opening::new(&source, config.clone());
            let opening = Opening { out: Some(folder.join(name)), ..opening };
            runs.push(opening.begin_with(&source, open, config.clone())?);
        }
        let camera = |name: &&str| RigSessionCamera { name: (*name).into(), known_lens: None };
        let file = RigSessionFile::new(names.iter().map(camera).collect(), false);
        file.write(&folder)?;
        Self::new(folder, file, runs)
    }

    /// Resumes the session in `folder`, with `source` for each camera's name or the recorded one.
    ///
    /// # Errors
    ///
    /// If the folder can't be read, or a camera can't be opened.
    pub fn resume(
        folder: &Path,
        like: &Opening,
        source: impl Fn(&str) -> Option<String>,
        announcer: &Announcer,
    ) -> anyhow::Result<Self> {
        let file = RigSessionFile::read(folder)?;
        let openings = file.cameras.iter().map(|camera| {
            let session = Some(folder.join(&camera.name));
            let source = source(&camera.name).unwrap_or_else(|| "auto".into());
            (camera.name.as_str(), Opening { session, source, ..like.clone() })
        });
        let runs = opened(openings, announcer)?;
        Self::new(folder.to_path_buf(), file, runs)
    }

    fn new(folder: PathBuf, file: RigSessionFile, runs: Vec<Run>) -> anyhow::Result<Self> {
        let first = runs.first().context("a rig has cameras")?.session.setup();
        let (board, params) = (first.board, first.calibration.clone());
        let rig = rig_of(&file, runs.iter().map(|run| &run.session))?;
        Ok(Self { folder, file, runs, rig, params, board, is_paced: true })
    }

    /// True if the pictures are rendered.
    pub fn is_simulated(&self) -> bool {
        self.runs.iter().any(|run| run.open.truth.is_some())
    }

    /// Board in words.
    pub fn board_in_words(&self) -> String {
        self.runs.first().map_or(String::new(), Run::board_in_words)
    }

    /// The session's folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Names of the cameras.
    pub fn names(&self) -> Vec<String> {
        self.file.names()
    }

    /// The same as fast as the computer can; recorded cameras then drift apart.
    #[must_use]
    pub fn fast(self) -> Self {
        Self { is_paced: false, ..self }
    }

    /// Runs until every pair meets the goal, a source ends, or the person ends it; `each` is called
    /// after all news.
    ///
    /// # Errors
    ///
    /// If a place can't be written; every announced place is on disk.
    pub fn carry_out(
        self,
        RigHand { stop, end, undo }: &RigHand,
        announcer: &Announcer,
        mut each: impl FnMut(&RigNews<'_>),
    ) -> anyhow::Result<FinishedRig> {
        let (names, board_in_words) = (self.file.names(), self.board_in_words());
        let Self { folder, file, runs, rig, params, board, is_paced } = self;
        announcer.say(&format!("Session: {}", folder.display()));
        announcer.say(&board_in_words);
        let (news, has_news) = bounded(1);
        let mut cameras = Vec::with_capacity(runs.len());
        for run in runs {
            let news = news.clone();
            // Someone else's sentences: this fold has its own.
            let run = if is_paced { run.paced() } else { run };
            let (setup, context) = run.setup(&Announcer::silent())?;
            let wake = move || {
                news.try_send(()).ok();
            };
            let (pipeline, feed) = Pipeline::start(setup, wake)?;
            let waiting = VecDeque::new();
            cameras.push(Running { pipeline, feed, context, waiting, frame: None, newest: None });
        }
        let (planner, links) = (None, Arc::from([]));
        let mut led = Led { rig, cameras, folder, file, names, planner, links, params, board };
        led.plan();
        while !stop.load(Ordering::Relaxed) && !end.load(Ordering::Relaxed) {
            has_news.recv_timeout(PATIENCE).ok();
            let before = led.rig.places().len();
            if undo.swap(false, Ordering::Relaxed) {
                let orders = led.rig.undo();
                led.carry_out(orders)?;
                if led.rig.places().len() < before {
                    announcer.say(&words::place_removed(led.rig.places().len()));
                }
            }
            let is_over = led.look(announcer)?;
            each(&led.news(announcer.is_mirrored()));
            if is_over || led.rig.is_complete() || led.rig.has_ended() {
                break;
            }
        }
        each(&RigNews { is_over: true, ..led.news(announcer.is_mirrored()) });
        led.finished()
    }
}

fn opened<'a>(
    cameras: impl Iterator<Item = (&'a str, Opening)>,
    announcer: &Announcer,
) -> anyhow::Result<Vec<Run>> {
    cameras
        .map(|(name, opening)| opening.open(announcer).with_context(|| format!("camera {name}")))
        .collect()
}

/// Camera whose pipeline runs.
struct Running {
    pipeline: Pipeline,
    feed: LiveFeed,
    context: RunContext,
    /// Inputs that the session had no room for yet.
    waiting: VecDeque<Input>,
    frame: Option<Arc<Frame>>,
    newest: Option<Snapshot>,
}

/// The fold, with the pipelines that it leads.
struct Led {
    rig: RigSession,
    cameras: Vec<Running>,
    folder: PathBuf,
    file: RigSessionFile,
    names: Vec<String>,
    planner: Option<Background<Plan>>,
    links: Arc<[RigLink]>,
    params: CalibrationParams,
    board: Board,
}

impl Led {
    /// Takes in what has come. True if a session has ended by itself.
    fn look(&mut self, announcer: &Announcer) -> anyhow::Result<bool> {
        let mut is_over = false;
        for camera in 0..self.cameras.len() {
            let Running { feed, frame, .. } = &mut self.cameras[camera];
            is_over |= feed.has_ended();
            if let Some(newest) = feed.newest_frame() {
                *frame = Some(newest);
            }
            let Some(snapshot) = feed.newest_snapshot() else { continue };
            let before = self.rig.places().len();
            let orders = self.rig.seen(camera, &snapshot);
            self.cameras[camera].newest = Some(snapshot);
            self.carry_out(orders)?;
            let places = self.rig.places();
            if let Some(place) = places.last().filter(|_| places.len() > before) {
                let seen_by = place.views.iter().map(|(of, _)| self.names[*of].as_str());
                announcer.say(&words::taken(&seen_by.collect::<Vec<_>>(), places.len()));
            }
        }
        if let Some(plan) = self.planner.as_ref().and_then(Background::outcome) {
            self.planner = None;
            if plan.places == self.rig.places().len() {
                if plan.places > 0
                    && let Some(line) = words::so_far(plan.found.as_ref(), &self.names)
                {
                    announcer.say(&line);
                }
                self.links =
                    plan.found.as_ref().map_or_else(|_| Arc::from([]), |rig| self.linked(rig));
                let orders = self.rig.planned(plan);
                self.carry_out(orders)?;
            } else {
                self.plan();
            }
        }
        for camera in &mut self.cameras {
            while let Some(input) = camera.waiting.pop_front() {
                if let Err(input) = camera.pipeline.try_give(input) {
                    camera.waiting.push_front(input);
                    break;
                }
            }
        }
        Ok(is_over)
    }

    fn carry_out(&mut self, orders: Vec<Order>) -> anyhow::Result<()> {
        for order in orders {
            match order {
                Order::Give { camera, input } => self.cameras[camera].waiting.push_back(input),
                Order::Keep(_) | Order::Forget(_) => {
                    // The views are on disk already: a place is announced once it is, too.
                    self.file.set_places(self.rig.places());
                    self.file.write(&self.folder)?;
                    self.plan();
                }
            }
        }
        Ok(())
    }

    /// Plans the next place in the background, unless it does already: then once it's done.
    fn plan(&mut self) {
        if self.planner.is_some() {
            return;
        }
        let (places, views) = (self.rig.places().len(), self.rig.views());
        let (board, params) = (self.board, self.params.clone());
        // Without a thread, the person shows the board where it likes.
        self.planner = Background::start(move || plan(places, &views, &board, &params)).ok();
    }

    fn linked(&self, rig: &RigCalibration) -> Arc<[RigLink]> {
        let of = |pair: &Pair| {
            let bound = pair.bound(self.params.accept);
            let is_met = bound.is_some_and(|it| it.bound <= it.goal);
            RigLink { of: pair.of, words: words::link(pair, bound), is_met }
        };
        rig.pairs.iter().filter(|pair| pair.instants > 0).map(of).collect()
    }

    fn news(&self, is_mirrored: bool) -> RigNews<'_> {
        let prompt = self.rig.prompt();
        let of_camera = match prompt {
            RigPrompt::OfCamera { camera } => self.cameras[camera].newest.as_ref(),
            _ => None,
        };
        let of_camera = of_camera.map(Instruction::of);
        let sentence = |is_mirrored| {
            let said = |_| of_camera.as_ref().map(|it| it.sentence(is_mirrored));
            words::prompt(&prompt, &self.names, said)
        };
        fn of(Running { frame, newest, .. }: &Running) -> (Option<&Arc<Frame>>, Option<&Snapshot>) {
            (frame.as_ref(), newest.as_ref())
        }
        RigNews {
            sentences: [false, true].map(sentence),
            is_mirrored,
            prompt,
            shown: self.rig.shown(),
            places: self.rig.places().len(),
            links: &self.links,
            cameras: self.cameras.iter().map(of).collect(),
            is_over: false,
        }
    }

    fn finished(self) -> anyhow::Result<FinishedRig> {
        let Self { rig, cameras, folder, names, .. } = self;
        let mut sessions = Vec::with_capacity(cameras.len());
        for Running { pipeline, context, .. } in cameras {
            sessions.push(context.finished(pipeline.stop())?.session);
        }
        finished(folder, names, &sessions, rig)
    }
}

/// The fold of the sessions, after the places in `file`.
///
/// # Errors
///
/// If two sessions have different boards, or a known lens can't be read.
fn rig_of<'a>(
    file: &RigSessionFile,
    sessions: impl Iterator<Item = &'a Session>,
) -> anyhow::Result<RigSession> {
    let mut cameras = Vec::with_capacity(file.cameras.len());
    let mut of_first = None;
    for (session, camera) in sessions.zip(&file.cameras) {
        let setup = session.setup();
        if *of_first.get_or_insert(setup.board) != setup.board {
            bail!("{}: another board than the first camera's", camera.name);
        }
        let known = camera.known_lens.as_deref().map(known_lens).transpose()?;
        cameras.push((setup.image_size, known));
    }
    let board = of_first.context("a rig has cameras")?;
    Ok(RigSession::new(board, cameras, file.places(), file.synchronised))
}

/// Views of the sessions, numbered by the places of `rig`.
fn finished(
    folder: PathBuf,
    names: Vec<String>,
    sessions: &[Session],
    mut rig: RigSession,
) -> anyhow::Result<FinishedRig> {
    for (camera, session) in sessions.iter().enumerate() {
        rig.settle(camera, session);
    }
    let first = folder.join(names.first().context("a rig has cameras")?);
    let Header { config, created, source, .. } = SessionFolder::header(&first)?;
    let is_simulated = is_simulated(&source);
    let frames = sessions.iter().enumerate().map(|(camera, session)| {
        let frame = |place: &Place| {
            let (_, number) = place.views.iter().find(|(of, _)| *of == camera)?;
            let view = session.accepted().iter().find(|view| view.number == *number)?;
            Some((place.number, view.view.frame_id))
        };
        rig.places().iter().filter_map(frame).collect()
    });
    Ok(FinishedRig {
        frames: frames.collect(),
        views: rig.views(),
        folder,
        names,
        config,
        created,
        is_simulated,
    })
}

/// The session of several cameras in `folder`, as recorded.
///
/// # Errors
///
/// If the folder, or the session of a camera, can't be read.
pub fn saved_rig(folder: &Path, announcer: &Announcer) -> anyhow::Result<FinishedRig> {
    let file = RigSessionFile::read(folder)?;
    let mut sessions = Vec::with_capacity(file.cameras.len());
    for camera in &file.cameras {
        let saved = SavedSession::open(&folder.join(&camera.name))?;
        saved.announce(announcer);
        sessions.push(saved.session);
    }
    let rig = rig_of(&file, sessions.iter())?;
    finished(folder.to_path_buf(), file.names(), &sessions, rig)
}
