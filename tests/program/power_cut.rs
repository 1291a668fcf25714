//! The power fails at any instant of any operation, and the disk has kept all obligations and any
//! part of the rest: acknowledged views are there, the folder opens, and `doctor` tells the truth.
//!
//! Every change of the disk is logged, then played on a model of a disk under the strictest reading
//! of POSIX: data last once their file is synced, names once their folder is. Unsynced changes
//! survive in part: names of a folder up to some one, bytes of a file up to some one, or with holes
//! of zeros.

use std::{
    collections::{BTreeMap, HashMap},
    fs,
    hash::{DefaultHasher, Hash, Hasher},
    path::{Component, Path, PathBuf},
    sync::{Arc, Mutex},
};

use boresight::{
    app::{Announcer, Host, Opening, SavedSession, commands::doctor::verify},
    config::Config,
    files::{DiskLog, LoggedChange},
    recording::{Header, SessionFolder, recover, stored_frame},
    session::{Command, Input},
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use tempfile::TempDir;

use crate::crash::place;

type Number = usize;
type Names = BTreeMap<String, Number>;

/// A name appearing, disappearing or changing.
#[derive(Clone, Debug)]
enum Renaming {
    Put(String, Number),
    Take(String),
    Move(String, String),
}

impl Renaming {
    fn apply(&self, names: &mut Names) {
        match self {
            Self::Put(name, node) => drop(names.insert(name.clone(), *node)),
            Self::Take(name) => drop(names.remove(name)),
            Self::Move(from, to) => {
                if let Some(node) = names.remove(from) {
                    names.insert(to.clone(), node);
                }
            }
        }
    }
}

#[derive(Clone, Debug)]
enum Node {
    File { now: Vec<u8>, synced: Vec<u8> },
    Folder { now: Names, synced: Names, since: Vec<Renaming> },
}

/// A disk, as seen by the program and as is.
#[derive(Clone, Debug)]
pub(crate) struct Disk {
    nodes: Vec<Node>,
}

impl Disk {
    /// A disk with the contents of `folder`.
    pub(crate) fn holding(folder: &Path) -> Self {
        let mut disk = Self { nodes: Vec::new() };
        disk.load(folder);
        disk
    }

    fn load(&mut self, path: &Path) -> Number {
        let number = self.nodes.len();
        if path.is_dir() {
            self.nodes.push(Node::Folder {
                now: Names::new(),
                synced: Names::new(),
                since: Vec::new(),
            });
            for entry in fs::read_dir(path).expect("listable") {
                let entry = entry.expect("listable");
                let name = entry.file_name().to_string_lossy().into_owned();
                let child = self.load(&entry.path());
                let Node::Folder { now, synced, .. } = &mut self.nodes[number] else { continue };
                now.insert(name.clone(), child);
                synced.insert(name, child);
            }
        } else {
            let bytes = fs::read(path).expect("readable");
            self.nodes.push(Node::File { now: bytes.clone(), synced: bytes });
        }
        number
    }

    fn find(&self, path: &Path) -> Number {
        path.components().filter(|part| matches!(part, Component::Normal(_))).fold(0, |at, part| {
            let Node::Folder { now, .. } = &self.nodes[at] else { unreachable!("{path:?}") };
            now[&part.as_os_str().to_string_lossy().into_owned()]
        })
    }

    fn rename(&mut self, folder: &Path, renaming: Renaming) {
        let at = self.find(folder);
        let Node::Folder { now, since, .. } = &mut self.nodes[at] else {
            unreachable!("{folder:?}")
        };
        renaming.apply(now);
        since.push(renaming);
    }

    fn add(&mut self, path: &Path, node: Node) {
        self.nodes.push(node);
        let number = self.nodes.len() - 1;
        self.rename(folder_of(path), Renaming::Put(name_of(path), number));
    }

    fn file(&mut self, path: &Path) -> (&mut Vec<u8>, &mut Vec<u8>) {
        let at = self.find(path);
        let Node::File { now, synced } = &mut self.nodes[at] else { unreachable!("{path:?}") };
        (now, synced)
    }

    pub(crate) fn apply(&mut self, change: &LoggedChange) {
        match change {
            LoggedChange::MakeFolder(path) => {
                let (now, synced) = (Names::new(), Names::new());
                self.add(path, Node::Folder { now, synced, since: Vec::new() });
            }
            LoggedChange::Create(path) => {
                self.add(path, Node::File { now: Vec::new(), synced: Vec::new() });
            }
            LoggedChange::Append { path, bytes } => self.file(path).0.extend(bytes),
            LoggedChange::Cut { path, bytes } => self.file(path).0.truncate(*bytes as usize),
            LoggedChange::Rename { from, to } => {
                self.rename(folder_of(from), Renaming::Move(name_of(from), name_of(to)));
            }
            LoggedChange::Remove(path) => {
                self.rename(folder_of(path), Renaming::Take(name_of(path)));
            }
            LoggedChange::SyncFile(path) => {
                let (now, synced) = self.file(path);
                synced.clone_from(now);
            }
            LoggedChange::SyncFolder(path) => {
                let at = self.find(path);
                let Node::Folder { now, synced, since } = &mut self.nodes[at] else {
                    unreachable!("{path:?}")
                };
                synced.clone_from(now);
                since.clear();
            }
        }
    }

    /// Contents after a power failure: paths with contents, `None` for folders.
    pub(crate) fn left(
        &self,
        fate: Fate,
        rng: &mut ChaCha8Rng,
    ) -> BTreeMap<PathBuf, Option<Vec<u8>>> {
        let mut left = BTreeMap::new();
        self.leave(0, Path::new(""), fate, rng, &mut left);
        left
    }

    fn leave(
        &self,
        at: Number,
        path: &Path,
        fate: Fate,
        rng: &mut ChaCha8Rng,
        left: &mut BTreeMap<PathBuf, Option<Vec<u8>>>,
    ) {
        match &self.nodes[at] {
            Node::File { now, synced } => {
                left.insert(path.to_path_buf(), Some(fate.bytes(now, synced, rng)));
            }
            Node::Folder { synced, since, .. } => {
                left.insert(path.to_path_buf(), None);
                let mut names = synced.clone();
                let kept = match fate {
                    Fate::Least => 0,
                    Fate::Most | Fate::NamesOnly => since.len(),
                    Fate::Chance => rng.random_range(0..=since.len()),
                };
                since[..kept].iter().for_each(|renaming| renaming.apply(&mut names));
                for (name, child) in names {
                    self.leave(child, &path.join(name), fate, rng, left);
                }
            }
        }
    }
}

fn folder_of(path: &Path) -> &Path {
    path.parent().expect("it has a name")
}

fn name_of(path: &Path) -> String {
    path.file_name().expect("it has a name").to_string_lossy().into_owned()
}

/// Surviving part of unsynced changes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Fate {
    /// Nothing.
    Least,
    /// Everything.
    Most,
    /// Names and sizes, but no bytes: zeros.
    NamesOnly,
    /// Any part.
    Chance,
}

impl Fate {
    fn bytes(self, now: &[u8], synced: &[u8], rng: &mut ChaCha8Rng) -> Vec<u8> {
        let same = now.iter().zip(synced).take_while(|(a, b)| a == b).count();
        if same < synced.len() {
            // Cut, and not yet synced: the old or the new.
            let old = self == Self::Least || (self == Self::Chance && rng.random_bool(0.5));
            return if old { synced.to_vec() } else { now.to_vec() };
        }
        match self {
            Self::Least => synced.to_vec(),
            Self::Most => now.to_vec(),
            Self::NamesOnly => [synced, &vec![0; now.len() - same]].concat(),
            Self::Chance => {
                let mut bytes = now[..rng.random_range(same..=now.len())].to_vec();
                if bytes.len() > same && rng.random_bool(0.5) {
                    let hole = rng.random_range(same..bytes.len());
                    let end = rng.random_range(hole..=bytes.len());
                    bytes[hole..end].fill(0);
                }
                bytes
            }
        }
    }
}

/// Frames of announced or withdrawn views, by the number of changes before.
#[derive(Clone, Debug, Default)]
struct Promises(Vec<(usize, Promise)>);

#[derive(Clone, Debug, PartialEq, Eq)]
enum Promise {
    /// At least the given number of views.
    Taken(usize),
    /// Exactly the given number of views.
    Exactly(usize),
}

/// Checks of every state.
struct Checks {
    /// The session's folder, and a possible second folder.
    session: PathBuf,
    recovered: Option<PathBuf>,
    seen: HashMap<u64, Result<usize, String>>,
    tried: usize,
    lost: usize,
    unopenable: usize,
    views_there: usize,
}

impl Checks {
    fn of(session: &str) -> Self {
        Self {
            session: session.into(),
            recovered: None,
            seen: HashMap::new(),
            tried: 0,
            lost: 0,
            unopenable: 0,
            views_there: 0,
        }
    }

    /// Opens the folder in each of the states that weren't seen before, all at once.
    fn look(&mut self, states: &[(Fate, Left)], folder: &Path) {
        let states = states.iter().map(|(_, left)| below(left, folder));
        let fresh: HashMap<u64, Below<'_>> = states
            .map(|state| (key(&state), state))
            .filter(|(key, _)| !self.seen.contains_key(key))
            .collect();
        let found = std::thread::scope(|scope| {
            let open = |(key, state)| scope.spawn(move || (key, views(&state)));
            let looks: Vec<_> = fresh.into_iter().map(open).collect();
            looks.into_iter().map(|look| look.join().expect("a fault")).collect::<Vec<_>>()
        });
        self.seen.extend(found);
    }

    /// Views in the folder after [`Self::look`], or a fault.
    fn views(&self, left: &Left, folder: &Path) -> Result<usize, String> {
        self.seen[&key(&below(left, folder))].clone()
    }

    /// Tries the possible states at each instant of `changes`.
    fn try_all(
        &mut self,
        mut disk: Disk,
        changes: &[LoggedChange],
        promises: &Promises,
        chances: usize,
    ) {
        let mut rng = ChaCha8Rng::seed_from_u64(11);
        for at in 0..=changes.len() {
            if let Some(change) = at.checked_sub(1).map(|before| &changes[before]) {
                disk.apply(change);
            }
            let promised = promises.0.iter().rev().find(|(by, _)| *by <= at).map(|(_, what)| what);
            let fates = [Fate::Least, Fate::Most, Fate::NamesOnly]
                .into_iter()
                .chain(std::iter::repeat_n(Fate::Chance, chances));
            let states: Vec<(Fate, Left)> =
                fates.map(|fate| (fate, disk.left(fate, &mut rng))).collect();
            let session = self.session.clone();
            self.look(&states, &session);
            if let Some(copy) = self.recovered.clone() {
                self.look(&states, &copy);
            }
            for (fate, left) in states {
                self.tried += 1;
                let views = match self.views(&left, &session) {
                    Ok(views) => views,
                    Err(what) => {
                        self.unopenable += 1;
                        println!("after {at} changes, {fate:?}: {what}");
                        continue;
                    }
                };
                self.views_there += views;
                let kept = match promised {
                    None => true,
                    Some(Promise::Taken(told)) => views >= *told,
                    Some(Promise::Exactly(told)) => views == *told,
                };
                if !kept {
                    self.lost += 1;
                    println!("after {at} changes, {fate:?}: {promised:?}, {views} are there");
                }
                // A copy is complete as soon as it has its name.
                if let Some(folder) =
                    self.recovered.clone().filter(|folder| left.contains_key(folder))
                    && let Err(what) = self.views(&left, &folder)
                {
                    self.unopenable += 1;
                    println!("after {at} changes, {fate:?}, the copy: {what}");
                }
            }
        }
    }

    fn must_hold(&self, operation: &str, least: usize) {
        println!(
            "{operation}: {} states tried, {} different; {} lost a view, {} did not open",
            self.tried,
            self.seen.len(),
            self.lost,
            self.unopenable
        );
        assert_eq!((self.lost, self.unopenable), (0, 0), "{operation}");
        assert!(self.tried >= least && self.views_there > 0, "{operation}: {}", self.tried);
    }
}

/// Contents after a power failure: see [`Disk::left`].
type Left = BTreeMap<PathBuf, Option<Vec<u8>>>;

/// Contents of a folder, by path below.
type Below<'a> = Vec<(&'a Path, &'a Option<Vec<u8>>)>;

fn below<'a>(left: &'a Left, folder: &Path) -> Below<'a> {
    let below =
        |(path, bytes): (&'a PathBuf, &'a _)| Some((path.strip_prefix(folder).ok()?, bytes));
    left.iter().filter_map(below).collect()
}

fn key(state: &Below<'_>) -> u64 {
    let mut hasher = DefaultHasher::new();
    state.hash(&mut hasher);
    hasher.finish()
}

/// Views in a folder of these contents, or a fault.
fn views(state: &Below<'_>) -> Result<usize, String> {
    let place = TempDir::new().expect("folder");
    let path = place.path().join("session");
    for (below, bytes) in state {
        let at = path.join(below);
        match bytes {
            None => fs::create_dir_all(at).expect("made"),
            Some(bytes) => fs::write(at, bytes).expect("written"),
        }
    }
    let views = if path.join("session.toml").exists() {
        let found = verify(&path).map_err(|err| format!("doctor: {err:#}"))?;
        if !found.problems.is_empty() {
            return Err(format!("doctor: {:?}", found.problems));
        }
        let (mut folder, saved) =
            SavedSession::resume(&path).map_err(|err| format!("resume: {err:#}"))?;
        for view in saved.session.accepted() {
            let frame = view.view.frame_id.0;
            let stored = saved.contents.stored.iter().find(|stored| stored.frame == frame);
            let stored = stored.ok_or_else(|| format!("no picture of frame {frame}"))?;
            stored_frame(&path, stored).map_err(|err| err.to_string())?;
        }
        // The session continues, and the new view is there the next time.
        let mut session = saved.session.clone();
        let decision = session.handle(&Input::Resumed);
        let appended = folder.journal_mut().append(&Input::Resumed, &decision, None, true);
        appended.map_err(|err| err.to_string())?;
        drop(folder);
        let again = SessionFolder::journal(&path).map_err(|err| err.to_string())?;
        if again.cut || again.lines.len() != saved.contents.lines.len() + 1 {
            return Err("what was cut came back".into());
        }
        saved.session.accepted().len()
    } else {
        // Nothing was promised; a session may begin here.
        let config = Config::load(None, &[]).expect("defaults");
        let size = boresight::frame::ImageSize { width_px: 320, height_px: 240 };
        SessionFolder::create(&path, &Header::new("sim", size, config))
            .map_err(|err| format!("begin: {err}"))?;
        0
    };
    Ok(views)
}

/// Random states tried at each instant; `BORESIGHT_CRASHES` sets another number.
pub(crate) fn chances() -> usize {
    std::env::var("BORESIGHT_CRASHES").ok().and_then(|count| count.parse().ok()).unwrap_or(1)
}

/// Runs a session in the logged `place` and notes the announcement of each view.
fn run(place: &Path, log: &Arc<DiskLog>, opening: &Opening, before: usize) -> Promises {
    let promises = Arc::new(Mutex::new(Promises::default()));
    let taken = Arc::new(Mutex::new(before));
    let announcer = Announcer::new({
        let (promises, log) = (Arc::clone(&promises), Arc::clone(log));
        move |sentence| {
            if sentence.starts_with("Taken: view") {
                let mut taken = taken.lock().expect("not poisoned");
                *taken += 1;
                let promise = (log.changes().len(), Promise::Taken(*taken));
                promises.lock().expect("not poisoned").0.push(promise);
            }
        }
    });
    Host::new(announcer, Arc::default()).session(opening).expect("runs");
    assert!(place.join("session/calibration.json").exists());
    let promises = promises.lock().expect("not poisoned").clone();
    assert!(!promises.0.is_empty(), "views are taken");
    promises
}

fn opening(place: &Path) -> Opening {
    let settings = ["guidance.hold_secs=0.1", "guidance.plan=quick"].map(str::to_owned);
    let source = format!("sim:{}", place.join("scene.toml").display());
    let config = Config::load(None, &settings).expect("valid");
    Opening {
        out: Some(place.join("session")),
        max_frames: Some(1000),
        ..Opening::new(&source, config)
    }
}

#[test]
fn no_power_cut_costs_a_view_or_a_session() {
    let place = place();
    // Every state is opened and decided again: few pictures a second make short journals.
    let scene = place.path().join("scene.toml");
    let quick = fs::read_to_string(&scene).expect("there");
    fs::write(&scene, quick.replace("fps = 15", "fps = 5")).expect("written");
    let log = Arc::new(DiskLog::of(place.path()));
    let start = Disk::holding(place.path());

    // Start, views, end, with every view's picture, the result and the report.
    let promises = run(place.path(), &log, &opening(place.path()), 0);
    let changes = log.changes();
    let mut checks = Checks::of("session");
    checks.try_all(start, &changes, &promises, chances());
    checks.must_hold("start to end", 200);

    // Resuming a session cut off after two views.
    let session = place.path().join("session");
    let journal = fs::read(session.join("journal.jsonl")).expect("there");
    let lines = SessionFolder::journal(&session).expect("whole").lines;
    let mut with_picture = lines
        .iter()
        .enumerate()
        .filter(|(_, line)| line.as_ref().expect("readable").stored.is_some());
    let second = with_picture.nth(1).expect("two views").0 + 1;
    let cut =
        journal.split_inclusive(|byte| *byte == b'\n').take(second).map(<[u8]>::len).sum::<usize>();
    fs::write(session.join("journal.jsonl"), [&journal[..cut], b"{\"seq\":"].concat())
        .expect("written");
    for name in ["calibration.json", "report.html", "truth.json"] {
        fs::remove_file(session.join(name)).expect("removed");
    }
    let named: Vec<String> = SessionFolder::journal(&session)
        .expect("whole")
        .stored
        .iter()
        .map(|stored| format!("{:08}.png", stored.frame))
        .collect();
    for entry in fs::read_dir(session.join("frames")).expect("there") {
        let entry = entry.expect("listable");
        if !named.contains(&entry.file_name().to_string_lossy().into_owned()) {
            fs::remove_file(entry.path()).expect("removed");
        }
    }
    let start = Disk::holding(place.path());
    let before = log.changes().len();
    let going_on = Opening { session: Some(session.clone()), out: None, ..opening(place.path()) };
    let promises = run(place.path(), &log, &going_on, 2);
    let promises =
        Promises(promises.0.into_iter().map(|(at, promise)| (at - before, promise)).collect());
    let promises = Promises([vec![(0, Promise::Taken(2))], promises.0].concat());
    let mut checks = Checks::of("session");
    checks.try_all(start, &log.changes()[before..], &promises, chances());
    checks.must_hold("going on", 100);

    // A view is taken back, and comes again.
    let start = Disk::holding(place.path());
    let before = log.changes().len();
    let (mut folder, saved) = SavedSession::resume(&session).expect("opens");
    let mut state = saved.session;
    let views = state.accepted().len();
    let mut promises = Promises(vec![(0, Promise::Exactly(views))]);
    for (command, left) in [(Command::UndoLast, views - 1), (Command::Restore, views)] {
        let input = Input::Command(command);
        let decision = state.handle(&input);
        // While it is being written, both are right.
        promises.0.push((log.changes().len() - before + 1, Promise::Taken(views - 1)));
        folder.journal_mut().append(&input, &decision, None, true).expect("appended");
        promises.0.push((log.changes().len() - before, Promise::Exactly(left)));
    }
    drop(folder);
    let mut checks = Checks::of("session");
    checks.try_all(start, &log.changes()[before..], &promises, 20 + chances());
    checks.must_hold("undo and restore", 50);

    // A report is written again.
    let start = Disk::holding(place.path());
    let before = log.changes().len();
    boresight::app::session::session_report::write_and_announce(
        &session,
        &state,
        &Announcer::silent(),
    );
    let promises = Promises(vec![(0, Promise::Exactly(views))]);
    let mut checks = Checks::of("session");
    checks.try_all(start, &log.changes()[before..], &promises, 20 + chances());
    checks.must_hold("report", 50);

    // Intact parts are copied.
    let start = Disk::holding(place.path());
    let before = log.changes().len();
    recover(&session, &place.path().join("copy")).expect("copied");
    let mut checks = Checks { recovered: Some("copy".into()), ..Checks::of("session") };
    checks.try_all(start, &log.changes()[before..], &promises, chances());
    checks.must_hold("recover", 300);
}
