//! How long a live frame takes: the integrity gate, and from capture to decision.
//!
//! Goals: gate 2 ms for a frame of 1920x1080, decoding left out; capture to decision 60 ms for 95 of 100
//! frames and 100 ms for 99, at 1280x720 and 30 frames per second.

#![expect(clippy::expect_used, reason = "a benchmark that cannot go on has failed")]

use std::{
    sync::{Arc, Mutex},
    time::{Duration, Instant},
};

use boresight::{
    capture::{
        Arrival, CaptureError, FrameSource, SourceIdentity, Unpacker,
        integrity::JpegGate,
        synthetic::{Scene, render_view},
    },
    config::Config,
    device::PixelLayout,
    frame::{CaptureTime, Frame, FrameId, FrameKind, ImageSize},
    pipeline::{Judged, Pipeline, Setup},
    session::Session,
};
use image::{ExtendedColorType, codecs::jpeg::JpegEncoder};
use nalgebra::{Isometry3, Vector3};

const FRAMES: u64 = 300;
const INTERVAL: Duration = Duration::from_nanos(33_333_333);

/// What a camera of `size` sends while a board is tipped to and fro before it.
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

/// A share of the way through the times, in order.
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

/// Plays frames at their rate; whoever is late gets the newest.
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
    let setup = Setup {
        source: Box::new(Playing { frames, unpacker, size, started, next: 0 }),
        session: Session::new(config.session(size).expect("a board")),
        folder: None,
        lossless: false,
        record_stream: false,
        first_frame: 0,
        judged: Box::new(move |judged: Judged<'_>| {
            let captured = Duration::from_nanos(judged.observation.captured_at.nanos);
            log.lock().expect("whole").push(started.elapsed().saturating_sub(captured));
        }),
    };
    let (pipeline, snapshots) = Pipeline::start(setup, || ()).expect("threads");
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

fn main() {
    gate();
    latency();
}
