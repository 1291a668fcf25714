//! From capture to decision, by source: time of a picture on its way to the program, and time until
//! the session's decision.
//!
//! `cargo bench --bench sources` measures a simulated camera of the kernel (V4L2); with names of
//! sources, those. `v4l2:FOLDER` is the simulated one with the pictures of a folder.
//! `tests/sources/latency.py` makes a table of every source. The sender writes the time into the
//! picture to include its way.

#![expect(clippy::expect_used, reason = "a benchmark that cannot go on has failed")]

use std::{
    collections::BTreeMap,
    sync::{
        Arc, Mutex,
        atomic::{AtomicBool, Ordering},
    },
    time::Duration,
};

use anyhow::Context;
use boresight::{
    app::{
        Announcer, Host, Opening,
        session::source::{OpenSource, SourceName},
    },
    capture::v4l2::{LiveCamera, discover, find},
    config::Config,
    device::Wanted,
    frame::{Frame, FrameId, ImageSize},
    pipeline::Onlooker,
    session::Snapshot,
    simulation::{
        Scene,
        kernel::{SimCamera, SimKernel},
        render_view,
    },
};
use image::GrayImage;
use nalgebra::{Isometry3, Vector3};
use rustix::time::{ClockId, clock_gettime};

const SIZE: ImageSize = ImageSize { width_px: 1280, height_px: 720 };
const INTERVAL_US: u64 = 33_333;
const DECISIONS: usize = 300;
/// Decisions before the first counted: everything has started then.
const FIRST: usize = 30;
/// A time in a picture: as many squares in its upper left corner, white for one, each this many
/// pixels wide.
const BITS: u32 = 48;
const SQUARE_PX: u32 = 8;
/// Bits of the time, in microseconds; eight more check them.
const TIME_BITS: u32 = 40;

/// Clock shared by all programs of the computer.
fn now_us() -> u64 {
    let now = clock_gettime(ClockId::Monotonic);
    now.tv_sec as u64 * 1_000_000 + now.tv_nsec as u64 / 1000
}

fn check(time_us: u64) -> u64 {
    u64::from(time_us.to_le_bytes().iter().fold(0xa5, |sum, byte| sum ^ byte))
}

fn stamp(image: &mut GrayImage, time_us: u64) {
    let time_us = time_us % (1 << TIME_BITS);
    let bits = time_us | check(time_us) << TIME_BITS;
    for (x, y) in (0..BITS * SQUARE_PX).flat_map(|x| (0..SQUARE_PX).map(move |y| (x, y))) {
        image.put_pixel(x, y, image::Luma([255 * (bits >> (x / SQUARE_PX) & 1) as u8]));
    }
}

/// Time stamp in a picture.
fn stamped(image: &GrayImage) -> Option<u64> {
    let middle = |bit| image.get_pixel_checked(bit * SQUARE_PX + SQUARE_PX / 2, SQUARE_PX / 2);
    let bits = (0..BITS)
        .map(|bit| Some(u64::from(middle(bit)?.0[0] > 127) << bit))
        .sum::<Option<u64>>()?;
    let time_us = bits % (1 << TIME_BITS);
    (bits >> TIME_BITS == check(time_us)).then_some(time_us)
}

/// A board tipped to each side in turn.
fn rendered() -> Vec<GrayImage> {
    let scene = Scene { image_size: SIZE, ..Scene::default_720p(1) };
    let tipped = (0..12).map(|number| {
        let turn = f64::from(number) / 12.0 * std::f64::consts::TAU;
        let tilt = Vector3::new(0.6 * turn.sin(), 0.5 * turn.cos(), 0.0);
        render_view(&scene, &Isometry3::new(Vector3::new(0.0, 0.0, 0.4), tilt))
    });
    tipped.collect()
}

/// Files of a folder, one byte a pixel, in the order of names.
fn read(folder: &str) -> anyhow::Result<Vec<GrayImage>> {
    let listed: Result<Vec<_>, _> =
        std::fs::read_dir(folder)?.map(|entry| entry.map(|entry| entry.path())).collect();
    let mut files = listed?;
    files.sort();
    let picture = |file| {
        let bytes = std::fs::read(file)?;
        GrayImage::from_raw(SIZE.width_px, SIZE.height_px, bytes).context("another size")
    };
    files.into_iter().map(picture).collect()
}

/// A camera of the simulated kernel with pictures in real time.
fn kernels_camera(mut pictures: Vec<GrayImage>) -> OpenSource {
    let count = pictures.len() as u64;
    let mut next_us = now_us();
    let kernel =
        SimKernel::new(vec![SimCamera::new(0, "A1", (*b"GREY", 1280, 720), move |number| {
            next_us = (next_us + INTERVAL_US).max(now_us());
            std::thread::sleep(Duration::from_micros(next_us.saturating_sub(now_us())));
            let picture = &mut pictures[(number / 30 % count) as usize];
            stamp(picture, now_us());
            picture.as_raw().clone()
        })]);
    let camera = find(&discover(&mut kernel.clone()), "/dev/video0").expect("there");
    let camera = LiveCamera::open(kernel, camera, &Wanted::default()).expect("opens");
    OpenSource { source: Box::new(camera), on_frame: Box::new(|_| ()), truth: None }
}

#[derive(Default)]
struct Stopwatch {
    /// Times of sending and arrival of each undecided picture.
    came: Mutex<BTreeMap<FrameId, (Option<u64>, u64)>>,
    /// Milliseconds on the way, and from arrival to decision.
    times: Mutex<Vec<(Option<f64>, f64)>>,
    enough: AtomicBool,
}

impl Onlooker for Stopwatch {
    fn captured(&self, frame: &Arc<Frame>) {
        let now = now_us();
        self.came.lock().expect("whole").insert(frame.id, (stamped(&frame.image), now));
    }

    fn decided(&self, snapshot: &Snapshot) {
        let now = now_us();
        let Some(frame) = snapshot.decision.frame.map(FrameId) else { return };
        let mut came = self.came.lock().expect("whole");
        let Some((sent, at)) = came.remove(&frame) else { return };
        *came = came.split_off(&frame);
        let way = sent.map(|sent| (at % (1 << TIME_BITS)).saturating_sub(sent) as f64 / 1e3);
        let mut times = self.times.lock().expect("whole");
        times.push((way, (now - at) as f64 / 1e3));
        self.enough.store(times.len() >= DECISIONS, Ordering::Relaxed);
    }

    fn wants_end(&self) -> bool {
        self.enough.load(Ordering::Relaxed)
    }
}

fn quantile(mut values: Vec<f64>, share: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    values
        .get((share * values.len().saturating_sub(1) as f64).round() as usize)
        .copied()
        .unwrap_or(f64::NAN)
}

/// A row of the table.
fn measure(name: &str, open: OpenSource, config: Config) -> anyhow::Result<String> {
    let waits = open.source.waits();
    let place = tempfile::tempdir()?;
    let opening =
        Opening { out: Some(place.path().join("session")), ..Opening::new(name, config.clone()) };
    let run = opening.begin_with(name, open, config)?;
    let watch = Arc::new(Stopwatch::default());
    Host::silent().watched_by(Arc::clone(&watch) as _).finish(run)?;
    let times = watch.times.lock().expect("whole");
    let times = times.get(FIRST..).unwrap_or(&[]);
    let decided: Vec<f64> = times.iter().map(|(_, decided)| *decided).collect();
    // The stamp of a recording is its recording time.
    let ways: Vec<(f64, f64)> = times
        .iter()
        .filter(|_| !waits)
        .filter_map(|(way, decided)| Some(((*way)?, *decided)))
        .collect();
    let together: Vec<f64> = ways.iter().map(|(way, decided)| way + decided).collect();
    let way = ways.into_iter().map(|(way, _)| way).collect();
    let ms = |values: &Vec<f64>| {
        if values.is_empty() {
            return "– | –".into();
        }
        format!("{:.1} | {:.1}", quantile(values.clone(), 0.5), quantile(values.clone(), 0.95))
    };
    let row = [&way, &decided, &together].map(ms).join(" | ");
    Ok(format!("{} decisions | {row}", times.len()))
}

fn main() -> anyhow::Result<()> {
    let settings = ["board.columns=9", "board.rows=6", "board.square_mm=25", "guidance.plan=full"];
    let size = format!("camera.mode={}x{}", SIZE.width_px, SIZE.height_px);
    let settings: Vec<String> = settings.into_iter().map(Into::into).chain([size]).collect();
    let config = Config::load(None, &settings)?;
    let names: Vec<String> = std::env::args().skip(1).filter(|name| name != "--bench").collect();
    if names.is_empty() {
        println!(
            "on its way, ms: median | p95 | to the decision: median | p95 | together: median | p95"
        );
        println!("{}", measure("v4l2", kernels_camera(rendered()), config.clone())?);
    }
    for name in names {
        let open = match name.strip_prefix("v4l2:") {
            Some(folder) => kernels_camera(read(folder)?),
            None => SourceName::parse(&name, &config, &Announcer::silent())?.open(None)?,
        };
        println!("{}", measure(&name, open, config.clone())?);
    }
    Ok(())
}
