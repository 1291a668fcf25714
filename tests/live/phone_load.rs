//! Cost of phones to a session: runs for minutes on a quiet machine, only if `BORESIGHT_PHONE_LOAD`
//! is set.

use std::{
    collections::BTreeMap,
    io::{Read, Write},
    net::TcpStream,
    sync::{
        Arc, Mutex,
        atomic::{AtomicBool, AtomicUsize, Ordering},
    },
    thread::{Builder, Scope, sleep},
    time::{Duration, Instant},
};

use boresight::{
    app::{Announcer, Opening, session::source::OpenSource},
    config::Config,
    frame::{Frame, FrameId},
    pipeline::{Onlooker, Pipeline},
    session::Snapshot,
    simulation::{NoCues, Scene, SyntheticSource},
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::phone::{Ask, Site};

/// Niceness of the clients' threads: they represent other machines, at no cost to this one.
const POLITENESS: i32 = 19;
/// Number of rounds; each kind of clients is measured once a round, in another order each time.
const ROUNDS: usize = 12;

/// Times from capture to decision, by the kind of load.
#[derive(Default)]
struct Stopwatch {
    began: Mutex<BTreeMap<FrameId, Instant>>,
    times_ms: Mutex<Vec<Vec<f64>>>,
    kind: AtomicUsize,
    captured: AtomicUsize,
    decided: AtomicUsize,
}

impl Stopwatch {
    /// Times of the kind so far.
    fn count(&self, kind: usize) -> usize {
        self.times_ms.lock().expect("no panic").get(kind).map_or(0, Vec::len)
    }
}

impl Onlooker for Stopwatch {
    fn captured(&self, frame: &Arc<Frame>) {
        self.captured.fetch_add(1, Ordering::Relaxed);
        self.began.lock().expect("no panic").insert(frame.id, Instant::now());
    }

    fn decided(&self, snapshot: &Snapshot) {
        let Some(frame) = snapshot.decision.frame else { return };
        self.decided.fetch_add(1, Ordering::Relaxed);
        let mut began = self.began.lock().expect("no panic");
        let Some(at) = began.remove(&FrameId(frame)) else { return };
        *began = began.split_off(&FrameId(frame));
        let kind = self.kind.load(Ordering::Relaxed);
        let mut times = self.times_ms.lock().expect("no panic");
        if times.len() <= kind {
            times.resize_with(kind + 1, Vec::new);
        }
        times[kind].push(at.elapsed().as_secs_f64() * 1e3);
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Clients {
    Pages(usize),
    Hostile,
}

/// A page: events and sequential pictures.
fn page<'a>(scope: &'a Scope<'a, '_>, site: &'a Site, key: &'a str, stop: &'a AtomicBool) {
    let get = move |path: &str, until: bool| {
        let Ok(mut stream) = TcpStream::connect(site.at) else { return };
        stream.set_read_timeout(Some(Duration::from_secs(2))).expect("a time-out");
        stream.write_all(&Ask::get(path).key(key).bytes(site)).ok();
        let mut part = vec![0; 16 << 10];
        while !(until && stop.load(Ordering::Relaxed)) {
            if !stream.read(&mut part).is_ok_and(|count| count > 0) {
                break;
            }
        }
    };
    let low = || rustix::process::nice(POLITENESS).ok();
    Builder::new()
        .spawn_scoped(scope, move || {
            low();
            get("/api/events", true);
        })
        .expect("a thread");
    Builder::new()
        .spawn_scoped(scope, move || {
            low();
            while !stop.load(Ordering::Relaxed) {
                get("/api/picture", false);
            }
        })
        .expect("a thread");
}

/// Sends garbage, reads nothing, or opens and leaves.
fn hostile<'a>(
    scope: &'a Scope<'a, '_>,
    site: &'a Site,
    key: &'a str,
    stop: &'a AtomicBool,
    which: u64,
) {
    let work = move || {
        rustix::process::nice(POLITENESS).ok();
        let mut rng = ChaCha8Rng::seed_from_u64(which);
        while !stop.load(Ordering::Relaxed) {
            let Ok(mut stream) = TcpStream::connect(site.at) else { continue };
            match which % 3 {
                0 => {
                    let garbage: Vec<u8> = (0..4096).map(|_| rng.random()).collect();
                    stream.write_all(&garbage).ok();
                }
                1 => {
                    let path = if which.is_multiple_of(2) { "/api/events" } else { "/api/picture" };
                    stream.write_all(&Ask::get(path).key(key).bytes(site)).ok();
                    for _ in 0..20 {
                        if !stop.load(Ordering::Relaxed) {
                            sleep(Duration::from_millis(100));
                        }
                    }
                }
                _ => {}
            }
            sleep(Duration::from_millis(20));
        }
    };
    Builder::new().spawn_scoped(scope, work).expect("a thread");
}

/// Quantile of `values` at `share`.
fn quantile(mut values: Vec<f64>, share: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get((share * values.len().saturating_sub(1) as f64) as usize).copied().unwrap_or(0.0)
}

fn resident_mb() -> f64 {
    let text = std::fs::read_to_string("/proc/self/statm").unwrap_or_default();
    let pages = text.split(' ').nth(1).and_then(|pages| pages.parse::<f64>().ok());
    pages.unwrap_or(0.0) * 4096.0 / 1e6
}

#[test]
fn phones_dont_slow_a_session_down() {
    if std::env::var_os("BORESIGHT_PHONE_LOAD").is_none() {
        return;
    }
    let place = tempfile::tempdir().expect("a folder");
    let site = Site::new();
    let config = Config::load(None, &[]).expect("settings");
    let opening =
        Opening { out: Some(place.path().join("s")), ..Opening::new("sim", config.clone()) };
    let source = SyntheticSource::new(Scene::default_720p(1), Box::new(NoCues), None, 24);
    let open = OpenSource { source: Box::new(source), on_frame: Box::new(|_| ()), truth: None };
    let run = opening.begin_with("sim", open, config).expect("a session").paced();
    let (mut setup, _context) = run.setup(&Announcer::silent()).expect("a session");
    // As a live camera: it doesn't wait, and frames can be lost.
    setup.lossless = false;
    let watch = Arc::new(Stopwatch::default());
    setup.onlookers = vec![Arc::clone(&watch) as _, Arc::clone(&site.hub) as _];
    let (pipeline, _feed) = Pipeline::start(setup, || ()).expect("threads");
    let keys: Vec<String> = (0..64).map(|_| site.key(&site.watcher)).collect();
    // No clients, twice: their difference is the noise of this measurement.
    let kinds = [
        Clients::Pages(0),
        Clients::Pages(0),
        Clients::Pages(1),
        Clients::Pages(8),
        Clients::Pages(64),
        Clients::Hostile,
    ];
    // The last kind is the time between.
    let between = kinds.len();
    watch.kind.store(between, Ordering::Relaxed);
    sleep(Duration::from_secs(3));
    let mut lost = [0; 6];
    let mut memory = Vec::new();
    let mut p95_ms = vec![Vec::new(); kinds.len()];
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    for _ in 0..ROUNDS {
        let mut order: Vec<usize> = (0..kinds.len()).collect();
        for at in 1..order.len() {
            order.swap(at, rng.random_range(0..=at));
        }
        for kind in order {
            let clients = kinds[kind];
            let stop = AtomicBool::new(false);
            std::thread::scope(|scope| {
                match clients {
                    Clients::Pages(count) => {
                        keys.iter().take(count).for_each(|key| page(scope, &site, key, &stop));
                    }
                    Clients::Hostile => {
                        for (which, key) in keys.iter().enumerate() {
                            hostile(scope, &site, key, &stop, which as u64);
                        }
                    }
                }
                sleep(Duration::from_secs(1));
                let before = pipeline.frames_replaced();
                let from = watch.count(kind);
                watch.kind.store(kind, Ordering::Relaxed);
                sleep(Duration::from_secs(4));
                watch.kind.store(between, Ordering::Relaxed);
                lost[kind] += pipeline.frames_replaced() - before;
                memory.push((clients, resident_mb()));
                let times = watch.times_ms.lock().expect("no panic")[kind][from..].to_vec();
                p95_ms[kind].push(quantile(times, 0.95));
                stop.store(true, Ordering::Relaxed);
            });
        }
    }
    let times = watch.times_ms.lock().expect("no panic");
    let median_of = |kind: usize| quantile(p95_ms[kind].clone(), 0.5);
    for (kind, clients) in kinds.iter().enumerate() {
        let p50 = quantile(times[kind].clone(), 0.5);
        let p95 = quantile(times[kind].clone(), 0.95);
        // Round by round, against no clients in the same round.
        let ratios = |against: usize| -> Vec<f64> {
            p95_ms[kind].iter().zip(&p95_ms[against]).map(|(ours, none)| ours / none).collect()
        };
        let against = usize::from(kind == 0);
        println!(
            "{clients:?}: {} frames, {} lost, capture to decision p50 {p50:.2} ms, p95 {p95:.2} ms; \
             p95 of a round: median {:.2} ms, against nobody {:.3} ({:.3} to {:.3} in half of the rounds)",
            times[kind].len(),
            lost[kind],
            median_of(kind),
            quantile(ratios(against), 0.5),
            quantile(ratios(against), 0.25),
            quantile(ratios(against), 0.75),
        );
    }
    let largest = memory.iter().map(|(_, mb)| *mb).fold(0.0, f64::max);
    println!("memory: {:.1} MB at first, {largest:.1} MB at most", memory[0].1);
    drop(times);
    pipeline.stop().expect("it's recorded");
}
