//! Many simulated cameras, watched in one process as `boresight watch --list --once` does it: pictures are drawn, measured,
//! learned from and stored. Prints what was said of them, memory, processor time and the stores' size.
//!
//! ```text
//! many_cameras FOLDER CAMERAS DAYS HOURS STREET…
//! ```
//!
//! Each camera gets the next of the streets (`pan=2.5px@12d`), a seed of its own, and a picture every HOURS.

use std::{
    collections::BTreeMap,
    path::Path,
    sync::{Mutex, PoisonError, atomic::AtomicBool},
    time::{Duration, Instant},
};

use boresight_app::{
    Announcer,
    watch::{Feed, Places, Round, WatchedCamera, run},
};
use boresight_run::config::Config;

fn main() -> anyhow::Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [folder, cameras, days, hours, streets @ ..] = arguments.as_slice() else {
        anyhow::bail!("FOLDER CAMERAS DAYS HOURS STREET…");
    };
    let (config, announcer) = (Config::load(None, &[])?, Announcer::silent());
    let plan = |n: usize| streets.get(n % streets.len().max(1)).map_or("", String::as_str);
    let mut rounds = Vec::new();
    for n in 0..cameras.parse()? {
        let street = format!("sim:street:{},days={days},{}", n + 1, plan(n));
        let feed = Feed::parse(&[street.trim_end_matches(',').into()], &config, &announcer)?;
        let name = format!("{n:03}");
        let store = Path::new(folder).join(&name);
        let (camera, _) = WatchedCamera::open(&store, &name, None, (feed.own_lens(), false))?;
        let every = Duration::from_secs_f64(3600.0 * hours.parse::<f64>()?);
        rounds.push(Round { name, places: Places::one(camera), feed, every });
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
        *counts.entry((plan(name.parse()?), states.join(" → "))).or_default() += 1;
    }
    for ((plan, states), count) in counts {
        println!("{count:4} cameras, {}: {states}", if plan.is_empty() { "nothing" } else { plan });
    }
    let pictures: u64 =
        rounds.iter().flat_map(|r| r.places.cameras()).flat_map(WatchedCamera::pictures).sum();
    println!(
        "{pictures} pictures: {spent:.0} s of processor time ({:.0} ms each, drawing too) in {wall:.0} s",
        1e3 * spent / pictures as f64
    );
    println!("{:.2} MB in each store", megabytes(Path::new(folder)) / rounds.len().max(1) as f64);
    let status = std::fs::read_to_string("/proc/self/status")?;
    status.lines().filter(|line| line.starts_with("VmHWM")).for_each(|line| println!("{line}"));
    Ok(())
}

/// User and system time of this process; a tick is 10 ms on Linux.
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
