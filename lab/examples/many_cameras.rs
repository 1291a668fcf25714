//! Many simulated cameras, watched in a single process as `boresight watch --list --once` does:
//! pictures are read, measured, learned from and stored. Prints their states, memory, processor
//! time and the stores' size.
//!
//! ```text
//! many_cameras FOLDER CAMERAS DAYS HOURS:STREET…
//! ```
//!
//! Each street (`6:7,pan=2.5px@24d`: a picture every 6 hours, a seed, and the planted change) is
//! drawn first into `FOLDER/street-N`, since drawing takes longer than watching; existing pictures
//! are reused. Then each camera watches the next street. Cameras of one street begin a picture
//! apart: no two learn from the same pictures.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
    sync::{Mutex, PoisonError, atomic::AtomicBool},
    time::{Duration, Instant},
};

use anyhow::Context;
use boresight_app::Announcer;
use boresight_station::{Feed, Places, Round, WatchedCamera, run, street::Street};
use boresight_watch::Lens;

fn main() -> anyhow::Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [folder, cameras, days, streets @ ..] = arguments.as_slice() else {
        anyhow::bail!("FOLDER CAMERAS DAYS HOURS:STREET…");
    };
    anyhow::ensure!(!streets.is_empty(), "name a street at least");
    let announcer = Announcer::silent();
    let drawn: Vec<Drawn> = streets
        .iter()
        .enumerate()
        .map(|(n, street)| draw(street, &Path::new(folder).join(format!("street-{n}")), days))
        .collect::<Result<_, _>>()?;
    let plan = |n: usize| (&streets[n % streets.len()], &drawn[n % streets.len()]);
    let stores = Path::new(folder).join("stores");
    let mut rounds = Vec::new();
    for n in 0..cameras.parse()? {
        let (_, Drawn { lens, files, every }) = plan(n);
        let name = format!("{n:03}");
        let (camera, _) =
            WatchedCamera::open(&stores.join(&name), &name, None, (Some(lens.clone()), false))?;
        let feed = Feed::Files(files[(n / streets.len()).min(files.len())..].to_vec());
        let places = Places::one(camera);
        rounds.push(Round { name, places, feed, every: *every, is_frozen: false });
    }
    let said: Mutex<BTreeMap<String, Vec<&str>>> = Mutex::default();
    let hear = |camera: &WatchedCamera, decision: &boresight_watch::Decision| {
        let mut said = said.lock().unwrap_or_else(PoisonError::into_inner);
        let states = said.entry(camera.name().to_owned()).or_default();
        if states.last() != Some(&decision.state.code()) {
            states.push(decision.state.code());
        }
    };
    let (began, spent) = (Instant::now(), processor_secs());
    let rounds = run(rounds, true, &AtomicBool::new(false), &hear, &announcer)?;
    let (wall, spent) = (began.elapsed().as_secs_f64(), processor_secs() - spent);
    let mut counts: BTreeMap<(&str, String), u32> = BTreeMap::new();
    for (name, states) in &said.into_inner().unwrap_or_else(PoisonError::into_inner) {
        *counts.entry((plan(name.parse()?).0, states.join(" → "))).or_default() += 1;
    }
    for ((street, states), count) in counts {
        println!("{count:4} cameras, {street}: {states}");
    }
    let pictures: u64 =
        rounds.iter().flat_map(|r| r.places.cameras()).flat_map(WatchedCamera::pictures).sum();
    println!(
        "{pictures} pictures: {spent:.0} s of processor time ({:.0} ms each, reading too) in {wall:.0} s: {:.3} % of one processor over {days} days",
        1e3 * spent / pictures as f64,
        100.0 * spent / (86_400.0 * days.parse::<f64>()?)
    );
    println!("{:.2} MB in each store", megabytes(&stores) / rounds.len().max(1) as f64);
    let status = std::fs::read_to_string("/proc/self/status")?;
    status.lines().filter(|line| line.starts_with("VmHWM")).for_each(|line| println!("{line}"));
    Ok(())
}

/// Pictures of a street, in files named by time.
struct Drawn {
    lens: Lens,
    files: Vec<PathBuf>,
    every: Duration,
}

fn draw(street: &str, folder: &Path, days: &str) -> anyhow::Result<Drawn> {
    let (hours, street) = street.split_once(':').context("HOURS:STREET")?;
    let every = Duration::from_secs_f64(3600.0 * hours.parse::<f64>()?);
    let street = Street::parse(&format!("{street},days={days}"))?;
    std::fs::create_dir_all(folder)?;
    let mut files = Vec::new();
    let mut at_secs = street.began_secs;
    while at_secs < street.began_secs + 86_400.0 * street.days {
        let file = folder.join(format!("{at_secs}.png"));
        if !file.exists() {
            street.picture(at_secs).save(&file)?;
        }
        files.push(file);
        at_secs += every.as_secs_f64();
    }
    Ok(Drawn { lens: Lens::new(street.camera, None, street.image_size), files, every })
}

/// User and system time of the process; a tick is 10 ms on Linux.
fn processor_secs() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let after_name = stat.rsplit(')').next().unwrap_or_default();
    let ticks = after_name.split_whitespace().skip(11).take(2);
    ticks.filter_map(|ticks| ticks.parse::<f64>().ok()).sum::<f64>() / 100.0
}

fn megabytes(folder: &Path) -> f64 {
    let Ok(entries) = std::fs::read_dir(folder) else { return 0.0 };
    let size = |entry: std::fs::DirEntry| match entry.metadata() {
        Ok(of) if of.is_dir() => megabytes(&entry.path()),
        Ok(of) => of.len() as f64 / 1e6,
        Err(_) => 0.0,
    };
    entries.flatten().map(size).sum()
}
