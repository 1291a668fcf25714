//! Threads: frames are lost in one place only, failures are reported, and an end is an end.

use std::{
    fs,
    path::Path,
    sync::{
        Arc, Mutex, Weak,
        atomic::{AtomicUsize, Ordering},
        mpsc,
    },
    time::Duration,
};

use boresight::{
    boards::Board,
    capture::{Arrival, CaptureError, FrameSource, SourceIdentity},
    config::Config,
    detection::{Detection, Miss, OtherBoard, Search},
    frame::{CaptureTime, Frame, FrameId, FrameKind, ImageSize},
    pipeline::{
        BoardFinder, Finished, FrameReport, LatestReceiver, Pipeline, PipelineError, Setup, latest,
    },
    recording::{Header, SessionFolder},
    session::{Command, Outcome, Session, Snapshot},
};
use image::GrayImage;
use tempfile::TempDir;

use crate::pictures::{PAIRS, picture};

/// Behaviour of a source after the last picture.
#[derive(Clone, Copy)]
enum Then {
    End,
    Fail,
    Panic,
    Silence,
}

struct Pictures {
    pictures: Vec<GrayImage>,
    next: u64,
    count: u64,
    then: Then,
}

impl FrameSource for Pictures {
    fn identity(&self) -> SourceIdentity {
        SourceIdentity { name: "test".into(), image_size: self.pictures.first().map(ImageSize::of) }
    }

    fn next_frame(&mut self, _patience: Duration) -> Result<Arrival, CaptureError> {
        if self.next == self.count {
            return match self.then {
                Then::End => Ok(Arrival::End),
                Then::Silence => Ok(Arrival::NothingYet),
                Then::Panic => panic!("the driver went mad"),
                Then::Fail => Err(CaptureError::Decode {
                    reason: "it burns".into(),
                    path: "/dev/camera".into(),
                }),
            };
        }
        let image = self.pictures[self.next as usize % self.pictures.len()].clone();
        let id = FrameId(self.next);
        self.next += 1;
        let captured_at = CaptureTime { nanos: id.0 * 1_000_000_000 };
        let kind = FrameKind::Photograph;
        Ok(Arrival::Frame(Arc::new(Frame { id, captured_at, kind, name: String::new(), image })))
    }
}

/// Small pictures without a board.
fn blank(count: u64, then: Then) -> Pictures {
    Pictures { pictures: vec![GrayImage::new(64, 48)], next: 0, count, then }
}

/// Informative views.
fn boards(then: Then) -> Pictures {
    let pictures: Vec<_> =
        PAIRS.iter().map(|(tilt_deg, slot_deg)| picture(*tilt_deg, *slot_deg)).collect();
    Pictures { next: 0, count: pictures.len() as u64, pictures, then }
}

fn session(source: &Pictures) -> Session {
    let size = source.identity().image_size.expect("pictures");
    Session::new(Config::load(None, &[]).expect("defaults").session(size).expect("board"))
}

fn setup(source: Pictures, lossless: bool) -> Setup {
    let session = session(&source);
    Setup { lossless, ..Setup::new(Box::new(source), session) }
}

fn folder(path: &Path, source: &Pictures) -> SessionFolder {
    let size = source.identity().image_size.expect("pictures");
    let header = Header::new("test", size, Config::load(None, &[]).expect("defaults"));
    SessionFolder::create(path, &header).expect("created")
}

/// Runs until the source has ended or failed.
fn run(setup: Setup) -> Result<Finished, PipelineError> {
    let (pipeline, snapshots) = started(setup);
    wait_until(&snapshots, |snapshot| snapshot.source_ended || !snapshot.failures.is_empty());
    pipeline.stop()
}

fn started(setup: Setup) -> (Pipeline, LatestReceiver<Snapshot>) {
    let (pipeline, feed) = Pipeline::start(setup, || ()).expect("threads");
    (pipeline, feed.into_snapshots())
}

/// Waits for a condition, or for the session's end.
fn wait_until(snapshots: &LatestReceiver<Snapshot>, mut seen: impl FnMut(&Snapshot) -> bool) {
    while let Some(snapshot) = snapshots.recv() {
        if seen(&snapshot) {
            return;
        }
    }
}

#[test]
fn the_slot_keeps_the_newest_and_counts_the_rest() {
    let (sender, receiver) = latest();
    for i in 0..5 {
        sender.publish(i).expect("open");
    }
    assert_eq!((receiver.try_recv(), receiver.replaced()), (Some(4), 4));
    sender.publish(9).expect("open");
    drop(sender);
    assert_eq!(
        (receiver.recv(), receiver.recv()),
        (Some(9), None),
        "the last one outlives its sender"
    );
    let (sender, receiver) = latest::<u8>();
    drop(receiver);
    assert!(sender.publish(1).is_err());
}

/// Numbers of the judged frames.
fn judged_frames(count: u64, lossless: bool) -> (Vec<u64>, u64) {
    let seen = Arc::new(Mutex::new(Vec::new()));
    let log = Arc::clone(&seen);
    let judged = move |judged: FrameReport<'_>| {
        log.lock().expect("whole").push(judged.observation.frame_id.0);
    };
    let finished =
        run(Setup { on_frame: Box::new(judged), ..setup(blank(count, Then::End), lossless) })
            .expect("clean");
    let frames = seen.lock().expect("whole").clone();
    (frames, finished.frames_replaced)
}

#[test]
fn a_source_that_waits_loses_no_frame() {
    let (frames, replaced) = judged_frames(200, true);
    assert_eq!(frames, (0..200).collect::<Vec<_>>());
    assert_eq!(replaced, 0);
}

#[test]
fn a_live_source_loses_frames_in_the_slot_only_and_in_order() {
    let (frames, replaced) = judged_frames(3000, false);
    assert!(frames.windows(2).all(|pair| pair[0] < pair[1]));
    assert_eq!(frames.len() as u64 + replaced, 3000, "each frame is judged or counted");
    assert_eq!(frames.last(), Some(&2999), "the newest is never the one that is lost");
}

/// A source of any number of frames, with weak references to each.
struct Remembered {
    pictures: Pictures,
    frames: Arc<Mutex<Vec<Weak<Frame>>>>,
    wanted: Arc<AtomicUsize>,
}

impl FrameSource for Remembered {
    fn identity(&self) -> SourceIdentity {
        self.pictures.identity()
    }

    fn next_frame(&mut self, patience: Duration) -> Result<Arrival, CaptureError> {
        if self.frames.lock().expect("whole").len() >= self.wanted.load(Ordering::SeqCst) {
            return Ok(Arrival::NothingYet);
        }
        let arrival = self.pictures.next_frame(patience)?;
        if let Arrival::Frame(frame) = &arrival {
            self.frames.lock().expect("whole").push(Arc::downgrade(frame));
        }
        Ok(arrival)
    }
}

#[test]
fn however_slow_the_judge_frames_do_not_pile_up() {
    const FRAMES: usize = 3000;
    const FRAMES_PER_JUDGEMENT: usize = 100;
    // One in the slot, one being looked at, four observed and four pictures on their way to the
    // judge, one there, and the one in the source's hand.
    const HELD: usize = 12;
    let frames = Arc::new(Mutex::new(Vec::<Weak<Frame>>::new()));
    let wanted = Arc::new(AtomicUsize::new(FRAMES_PER_JUDGEMENT));
    let most = Arc::new(Mutex::new(0));
    let (seen, more, found) = (Arc::clone(&frames), Arc::clone(&wanted), Arc::clone(&most));
    let judged = move |_: FrameReport<'_>| {
        // Slow: many frames come meanwhile.
        let until = more.fetch_add(FRAMES_PER_JUDGEMENT, Ordering::SeqCst) + FRAMES_PER_JUDGEMENT;
        while seen.lock().expect("whole").len() < until.min(FRAMES) {
            std::thread::yield_now();
        }
        let held = seen.lock().expect("whole").iter().filter(|f| f.strong_count() > 0).count();
        let mut most = found.lock().expect("whole");
        *most = held.max(*most);
    };
    let source = Remembered { pictures: blank(FRAMES as u64, Then::End), frames, wanted };
    let setup = Setup {
        source: Box::new(source),
        on_frame: Box::new(judged),
        ..setup(blank(1, Then::End), false)
    };
    let finished = run(setup).expect("clean");
    let most = *most.lock().expect("whole");
    assert!((1..=HELD).contains(&most), "{most}");
    assert!(finished.frames_replaced > FRAMES as u64 / 2, "{}", finished.frames_replaced);
}

/// A source of any number of numbered pictures, with weak references to each.
struct Numbered {
    frames: Arc<Mutex<Vec<Weak<Frame>>>>,
    wanted: Arc<AtomicUsize>,
}

impl FrameSource for Numbered {
    fn identity(&self) -> SourceIdentity {
        let size = ImageSize { width_px: 64, height_px: 48 };
        SourceIdentity { name: "numbered".into(), image_size: Some(size) }
    }

    fn next_frame(&mut self, _patience: Duration) -> Result<Arrival, CaptureError> {
        let mut frames = self.frames.lock().expect("whole");
        let number = frames.len();
        if number >= self.wanted.load(Ordering::SeqCst) {
            return Ok(Arrival::NothingYet);
        }
        let mut image = GrayImage::new(64, 48);
        image.as_mut()[..2].copy_from_slice(&(number as u16).to_le_bytes());
        let id = FrameId(number as u64);
        let captured_at = CaptureTime { nanos: id.0 * 33_000_000 };
        let (kind, name) = (FrameKind::Video, String::new());
        let frame = Arc::new(Frame { id, captured_at, kind, name, image });
        frames.push(Arc::downgrade(&frame));
        Ok(Arrival::Frame(frame))
    }
}

/// Stand-in for the detector: reports the frame under its eyes, and looks until told to stop.
struct Held {
    looks_at: mpsc::Sender<u64>,
    let_go: mpsc::Receiver<()>,
}

impl BoardFinder for Held {
    fn find(
        &mut self,
        image: &GrayImage,
        _board: &Board,
        _search: Search<'_>,
    ) -> Result<Detection, Miss> {
        let number = u16::from_le_bytes([image.as_raw()[0], image.as_raw()[1]]);
        // Both ends are gone when the test is over.
        self.looks_at.send(number.into()).ok();
        self.let_go.recv().ok();
        Err(Miss::NoBoard)
    }
}

#[test]
fn however_slow_the_detector_one_frame_waits_and_it_is_the_newest() {
    const FRAMES_PER_LOOK: usize = 50;
    let frames = Arc::new(Mutex::new(Vec::<Weak<Frame>>::new()));
    let wanted = Arc::new(AtomicUsize::new(1));
    let source = Numbered { frames: Arc::clone(&frames), wanted: Arc::clone(&wanted) };
    let (looks_at, looked_at) = mpsc::channel();
    let (go, let_go) = mpsc::channel();
    let finder = Box::new(Held { looks_at, let_go });
    let setup = Setup { source: Box::new(source), finder, ..setup(blank(1, Then::End), false) };
    let (pipeline, showing) = Pipeline::start(setup, || ()).expect("threads");
    let alive = || -> Vec<u64> {
        let frames = frames.lock().expect("whole");
        let numbers = frames.iter().enumerate().filter(|(_, frame)| frame.strong_count() > 0);
        numbers.map(|(number, _)| number as u64).collect()
    };
    let mut in_hand = looked_at.recv().expect("looks");
    for _ in 0..20 {
        let newest = wanted.fetch_add(FRAMES_PER_LOOK, Ordering::SeqCst) + FRAMES_PER_LOOK - 1;
        let newest = newest as u64;
        // The picture continues while the detector is busy.
        let mut shown = None;
        while shown != Some(newest) {
            shown = showing.newest_frame().map(|frame| frame.id.0).or(shown);
            // Besides the one looked at: one waits, one is replacing it, one is shown.
            let waiting = alive().into_iter().filter(|number| *number > in_hand).count();
            assert!(waiting <= 3, "{:?}", alive());
        }
        while alive() != [in_hand, newest] {
            std::thread::yield_now();
        }
        assert!(looked_at.try_recv().is_err(), "one look at a time");
        go.send(()).expect("held");
        in_hand = looked_at.recv().expect("looks");
        assert_eq!(in_hand, newest, "what waited is the newest");
    }
    drop(go);
    let finished = pipeline.stop().expect("clean");
    assert_eq!(finished.frames_replaced, 20 * (FRAMES_PER_LOOK as u64 - 1));
}

/// Stand-in for the detector that looks for other boards until told to stop.
struct Naming(mpsc::Sender<&'static str>);

impl BoardFinder for Naming {
    fn find(&mut self, _: &GrayImage, _: &Board, _: Search<'_>) -> Result<Detection, Miss> {
        self.0.send("look").ok();
        Err(Miss::NoBoard)
    }

    fn recognise(
        &mut self,
        step: &mut usize,
        _image: &GrayImage,
        _board: &Board,
        keep_on: &dyn Fn() -> bool,
    ) -> Option<OtherBoard> {
        *step += 1;
        self.0.send("name").ok();
        while keep_on() {
            std::thread::yield_now();
        }
        None
    }
}

#[test]
fn other_boards_are_named_while_no_frame_waits() {
    let wanted = Arc::new(AtomicUsize::new(0));
    let source = Numbered { frames: Arc::default(), wanted: Arc::clone(&wanted) };
    let (does, done) = mpsc::channel();
    let finder = Box::new(Naming(does));
    let setup = Setup { source: Box::new(source), finder, ..setup(blank(1, Then::End), false) };
    let (pipeline, _showing) = Pipeline::start(setup, || ()).expect("threads");
    for _ in 0..3 {
        wanted.fetch_add(1, Ordering::SeqCst);
        assert_eq!([(); 2].map(|()| done.recv().expect("works")), ["look", "name"]);
    }
    pipeline.stop().expect("clean");
}

#[test]
fn in_a_pause_the_detector_rests_and_a_source_that_waits_loses_nothing() {
    for lossless in [false, true] {
        let frames = Arc::new(Mutex::new(Vec::<Weak<Frame>>::new()));
        let wanted = Arc::new(AtomicUsize::new(1));
        let source = Numbered { frames: Arc::clone(&frames), wanted: Arc::clone(&wanted) };
        let (looks_at, looked_at) = mpsc::channel();
        let (go, let_go) = mpsc::channel();
        drop(go); // Nothing holds it up.
        let finder = Box::new(Held { looks_at, let_go });
        let setup =
            Setup { source: Box::new(source), finder, ..setup(blank(1, Then::End), lossless) };
        let (pipeline, showing) = Pipeline::start(setup, || ()).expect("threads");
        let told = |command: Command, paused: bool| {
            while pipeline.try_command(command).is_err() {}
            while showing.newest_snapshot().is_none_or(|snapshot| snapshot.paused != paused) {
                std::thread::yield_now();
            }
        };
        assert_eq!(looked_at.recv(), Ok(0));
        told(Command::Pause, true);
        wanted.store(11, Ordering::SeqCst);
        // The picture continues, as far as the source does.
        let last = if lossless { 1 } else { 10 };
        while showing.newest_frame().is_none_or(|frame| frame.id.0 != last) {
            std::thread::yield_now();
        }
        let is_gone = |frame: &Weak<Frame>| frame.strong_count() == 0;
        while !lossless && !frames.lock().expect("whole").iter().all(is_gone) {
            std::thread::yield_now();
        }
        assert!(looked_at.try_recv().is_err(), "nothing is looked for");
        told(Command::Resume, false);
        wanted.store(12, Ordering::SeqCst);
        for number in if lossless { 1..12 } else { 11..12 } {
            assert_eq!(looked_at.recv(), Ok(number));
        }
        // A pause doesn't keep the threads from ending.
        told(Command::Pause, true);
        wanted.store(14, Ordering::SeqCst);
        pipeline.stop().expect("clean");
    }
}

#[test]
fn a_broken_source_is_told_and_costs_no_view() {
    for (then, words) in [(Then::Fail, "it burns"), (Then::Panic, "the driver went mad")] {
        let finished = run(setup(boards(then), true)).expect("the session survives");
        let failures = finished.session.failures();
        assert_eq!(failures.len(), 1);
        assert_eq!(failures[0].0, "capture");
        assert!(failures[0].1.contains(words), "{failures:?}");
        assert!(finished.session.accepted().len() >= 4);
    }
}

#[test]
fn a_silent_source_can_be_stopped() {
    let (pipeline, snapshots) = started(setup(blank(3, Then::Silence), true));
    wait_until(&snapshots, |snapshot| snapshot.decision.frame == Some(2));
    pipeline.stop().expect("clean");
    // Dropping without stopping ends the threads, too.
    drop(started(setup(blank(3, Then::Silence), false)));
}

#[test]
fn commands_reach_the_session() {
    let (pipeline, snapshots) = started(setup(boards(Then::Silence), true));
    wait_until(&snapshots, |snapshot| snapshot.decision.frame == Some(5));
    let taken = |snapshot: &Snapshot| snapshot.views.len();
    let mut before = 0;
    let mut command = Command::UndoLast;
    while let Err(refused) = pipeline.try_command(command) {
        command = refused;
    }
    wait_until(&snapshots, |snapshot| {
        before = taken(snapshot);
        matches!(snapshot.decision.outcome, Outcome::Removed { .. })
    });
    assert_eq!(pipeline.stop().expect("clean").session.accepted().len(), before);
}

#[test]
fn a_view_is_shown_as_taken_only_when_it_is_on_disk() {
    let place = TempDir::new().expect("folder");
    let path = place.path().join("session");
    let source = boards(Then::End);
    let folder = folder(&path, &source);
    let taken = Arc::new(Mutex::new(0));
    let (count, session_path) = (Arc::clone(&taken), path.clone());
    let judged = move |judged: FrameReport<'_>| {
        if let Outcome::Accepted { frame, .. } = judged.snapshot.decision.outcome {
            *count.lock().expect("whole") += 1;
            assert!(session_path.join(format!("frames/{frame:08}.png")).is_file());
            let journal = fs::read_to_string(session_path.join("journal.jsonl")).expect("readable");
            let last = journal.lines().last().expect("a line");
            assert!(last.contains("accepted") && journal.ends_with('\n'), "{last}");
        }
    };
    let setup = Setup { folder: Some(folder), on_frame: Box::new(judged), ..setup(source, true) };
    let finished = run(setup).expect("clean");
    assert_eq!(*taken.lock().expect("whole"), finished.session.accepted().len());
    assert!(finished.session.accepted().len() >= 4);
}

#[test]
fn a_session_that_cannot_be_written_ends_with_the_reason() {
    let place = TempDir::new().expect("folder");
    let path = place.path().join("session");
    let source = boards(Then::End);
    let folder = folder(&path, &source);
    fs::remove_dir(path.join("frames")).expect("removed");
    let setup = Setup { folder: Some(folder), ..setup(source, true) };
    let (pipeline, snapshots) = started(setup);
    wait_until(&snapshots, |_| false);
    let error = pipeline.stop().expect_err("nowhere to write");
    assert!(matches!(error, PipelineError::Recording(_)), "{error}");
    let contents = SessionFolder::journal(&path).expect("whole");
    assert!(contents.lines.iter().all(|line| {
        let line = line.expect("readable");
        !line.decision.get().contains("accepted\"")
    }));
}
