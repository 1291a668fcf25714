//! Duration of a live frame: the integrity gate, and from capture to decision.
//!
//! Goals: gate 2 ms for a frame of 1920x1080, decoding left out; capture to decision 60 ms for 95
//! of 100 frames and 100 ms for 99, at 1280x720 and 30 frames per second.

#![expect(clippy::expect_used, reason = "a benchmark that cannot go on has failed")]

use std::{
    sync::{Arc, Mutex, Weak},
    time::{Duration, Instant},
};

use boresight::{
    boards::Board,
    capture::{Arrival, CaptureError, FrameSource, SourceIdentity, Unpacker, integrity::JpegGate},
    config::Config,
    detection::{Detection, Detector, DetectorParams, Miss, Search},
    device::PixelLayout,
    frame::{CaptureTime, Frame, FrameId, FrameKind, ImageSize},
    pipeline::{BoardFinder, FrameReport, Pipeline, Setup},
    session::Session,
    simulation::{Scene, render_view},
};
use image::{ExtendedColorType, GrayImage, codecs::jpeg::JpegEncoder};
use nalgebra::{Isometry3, Vector3};

const FRAMES: u64 = 300;
const INTERVAL: Duration = Duration::from_nanos(33_333_333);

/// Frames of a camera of `size` before a board tipped to and fro.
fn frames(size: ImageSize, count: u32) -> Vec<Vec<u8>> {
    let scene = Scene { image_size: size, ..Scene::default_720p(1) };
    (0..count)
        .map(|number| {
            let turn = f64::from(number) / f64::from(count) * std::f64::consts::TAU;
            let tilt = Vector3::new(0.6 * turn.sin(), 0.5 * turn.cos(), 0.0);
            let picture = render_view(&scene, &Isometry3::new(Vector3::new(0.0, 0.0, 0.4), tilt));
            let rgb: Vec<u8> = picture.as_raw().iter().flat_map(|value| [*value; 3]).collect();
            let mut bytes = Vec::new();
            JpegEncoder::new_with_quality(&mut bytes, 85)
                .encode(&rgb, size.width_px, size.height_px, ExtendedColorType::Rgb8)
                .expect("encodes");
            bytes
        })
        .collect()
}

/// Quantile of sorted times.
fn at(times: &[Duration], share: f64) -> f64 {
    let index = (share * (times.len() - 1) as f64) as usize;
    times[index].as_secs_f64() * 1e3
}

fn gate() {
    let size = ImageSize { width_px: 1920, height_px: 1080 };
    let frames = frames(size, 4);
    let mut gate = JpegGate::default();
    let mut times = Vec::new();
    for frame in frames.iter().cycle().take(200) {
        let started = Instant::now();
        gate.check(frame, size).expect("whole");
        times.push(started.elapsed());
    }
    times.sort();
    let kilobytes = frames.iter().map(Vec::len).sum::<usize>() / frames.len() / 1000;
    println!(
        "gate, 1920x1080 MJPEG of {kilobytes} kB: median {:.2} ms, p95 {:.2} ms (goal 2 ms)",
        at(&times, 0.5),
        at(&times, 0.95)
    );
}

/// Plays frames at a rate; a late reader gets the newest.
struct Playing {
    frames: Vec<Vec<u8>>,
    unpacker: Unpacker,
    size: ImageSize,
    started: Instant,
    next: u64,
}

impl FrameSource for Playing {
    fn identity(&self) -> SourceIdentity {
        SourceIdentity { name: "recording".into(), image_size: Some(self.size) }
    }

    fn waits(&self) -> bool {
        false
    }

    fn next_frame(&mut self, _patience: Duration) -> Result<Arrival, CaptureError> {
        if self.next == FRAMES {
            return Ok(Arrival::End);
        }
        let due = INTERVAL * self.next as u32;
        std::thread::sleep(due.saturating_sub(self.started.elapsed()));
        let bytes = &self.frames[self.next as usize % self.frames.len()];
        let image = self.unpacker.unpack(bytes).expect("whole");
        let id = FrameId(self.next);
        self.next += 1;
        let captured_at = CaptureTime { nanos: due.as_nanos() as u64 };
        let (kind, name) = (FrameKind::Video, String::new());
        Ok(Arrival::Frame(Arc::new(Frame { id, captured_at, kind, name, image })))
    }
}

fn latency() {
    let size = ImageSize { width_px: 1280, height_px: 720 };
    let frames = frames(size, 60);
    let unpacker = Unpacker::new(PixelLayout::Mjpeg, size, 0);
    let started = Instant::now();
    let times = Arc::new(Mutex::new(Vec::new()));
    let log = Arc::clone(&times);
    let config = Config::load(None, &[]).expect("defaults");
    let playing = Playing { frames, unpacker, size, started, next: 0 };
    let session = Session::new(config.session(size).expect("a board"));
    let setup = Setup {
        lossless: false,
        on_frame: Box::new(move |judged: FrameReport<'_>| {
            let captured = Duration::from_nanos(judged.observation.captured_at.nanos);
            log.lock().expect("whole").push(started.elapsed().saturating_sub(captured));
        }),
        ..Setup::new(Box::new(playing), session)
    };
    let (pipeline, feed) = Pipeline::start(setup, || ()).expect("threads");
    let snapshots = feed.into_snapshots();
    while snapshots.recv().is_some_and(|snapshot| !snapshot.source_ended) {}
    let finished = pipeline.stop().expect("clean");
    let mut times = times.lock().expect("whole").clone();
    times.sort();
    println!(
        "capture to decision, 1280x720 MJPEG at 30 per second: median {:.1} ms, p95 {:.1} ms (goal 60), p99 {:.1} ms (goal 100); {} of {FRAMES} frames judged, {} replaced by newer ones",
        at(&times, 0.5),
        at(&times, 0.95),
        at(&times, 0.99),
        times.len(),
        finished.frames_replaced
    );
}

/// Frames of a source, each remembered without being kept.
type Remembered = Arc<Mutex<Vec<Weak<Frame>>>>;

/// Number of frames newer than `looked_at` alive in the program.
fn waiting(frames: &Remembered, looked_at: u64) -> usize {
    let frames = frames.lock().expect("whole");
    frames.iter().skip(looked_at as usize + 1).filter(|frame| frame.strong_count() > 0).count()
}

/// Observed behaviour of a slowed detector.
#[derive(Default)]
struct Slowed {
    looked_at: u64,
    ages: Vec<Duration>,
    deepest: usize,
}

/// Measures the queue at every new frame.
struct Watched {
    playing: Playing,
    frames: Remembered,
    seen: Arc<Mutex<Slowed>>,
}

impl FrameSource for Watched {
    fn identity(&self) -> SourceIdentity {
        self.playing.identity()
    }

    fn waits(&self) -> bool {
        false
    }

    fn next_frame(&mut self, patience: Duration) -> Result<Arrival, CaptureError> {
        {
            let mut seen = self.seen.lock().expect("whole");
            seen.deepest = seen.deepest.max(waiting(&self.frames, seen.looked_at));
        }
        let arrival = self.playing.next_frame(patience)?;
        if let Arrival::Frame(frame) = &arrival {
            self.frames.lock().expect("whole").push(Arc::downgrade(frame));
        }
        Ok(arrival)
    }
}

/// Detector slowed by half a second.
struct HalfASecond {
    detector: Detector,
    frames: Remembered,
    seen: Arc<Mutex<Slowed>>,
    started: Instant,
}

impl BoardFinder for HalfASecond {
    fn find(
        &mut self,
        image: &GrayImage,
        board: &Board,
        search: Search<'_>,
    ) -> Result<Detection, Miss> {
        let frames: Vec<Arc<Frame>> =
            self.frames.lock().expect("whole").iter().filter_map(Weak::upgrade).collect();
        let frame = frames.iter().find(|frame| std::ptr::eq(&frame.image, image));
        if let Some(frame) = frame {
            let taken = Duration::from_nanos(frame.captured_at.nanos);
            let mut seen = self.seen.lock().expect("whole");
            seen.looked_at = frame.id.0;
            seen.ages.push(self.started.elapsed().saturating_sub(taken));
        }
        drop(frames);
        std::thread::sleep(Duration::from_millis(500));
        self.detector.find(image, board, search)
    }
}

fn slow_detector() {
    let size = ImageSize { width_px: 1280, height_px: 720 };
    let pictures = frames(size, 60);
    let unpacker = Unpacker::new(PixelLayout::Mjpeg, size, 0);
    let seen = Arc::new(Mutex::new(Slowed::default()));
    let frames = Remembered::default();
    let started = Instant::now();
    let playing = Playing { frames: pictures, unpacker, size, started, next: 0 };
    let source = Watched { playing, frames: Arc::clone(&frames), seen: Arc::clone(&seen) };
    let detector = Detector::new(DetectorParams::default());
    let looks = HalfASecond { detector, frames, seen: Arc::clone(&seen), started };
    let config = Config::load(None, &[]).expect("defaults");
    let session = Session::new(config.session(size).expect("a board"));
    let setup =
        Setup { lossless: false, finder: Box::new(looks), ..Setup::new(Box::new(source), session) };
    let (pipeline, showing) = Pipeline::start(setup, || ()).expect("threads");
    // A window takes every picture it can.
    let mut shown = 0;
    while showing.newest_snapshot().is_none_or(|snapshot| !snapshot.source_ended) {
        shown += u32::from(showing.newest_frame().is_some());
        std::thread::sleep(Duration::from_millis(5));
    }
    let finished = pipeline.stop().expect("clean");
    let mut seen = seen.lock().expect("whole");
    seen.ages.sort();
    println!(
        "detector slowed to 500 ms, 1280x720 MJPEG at 30 per second: at most {} frame waits (goal 1), age when looked at median {:.1} ms, largest {:.1} ms; {} of {FRAMES} frames looked at, {} replaced by newer ones, {shown} shown",
        seen.deepest,
        at(&seen.ages, 0.5),
        at(&seen.ages, 1.0),
        seen.ages.len(),
        finished.frames_replaced
    );
}

fn main() {
    gate();
    latency();
    slow_detector();
}
