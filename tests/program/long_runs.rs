//! Cost of a session over hours: no more at its end than at its beginning.
//!
//! `BORESIGHT_LONG_RUN_FRAMES=7200` runs the eight hours; without it, a few minutes of them.

use std::{fs, path::Path, process::Stdio, thread::sleep, time::Duration};

use tempfile::TempDir;

use crate::person::program;

/// Constantly moving hands, at a picture in four seconds.
const SCENE: &str =
    "image_size_px = [200, 150]\nfps = 0.25\nclutter = 0.0\n[technician]\ntremor_deg = 12.0\n";

/// Resources of a process.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Cost {
    memory_kb: u64,
    threads: u64,
    descriptors: usize,
}

/// Present resources of the process `id`; `None` once ended.
fn cost(id: u32) -> Option<Cost> {
    let process = Path::new("/proc").join(id.to_string());
    let status = fs::read_to_string(process.join("status")).ok()?;
    let number = |name: &str| {
        let line = status.lines().find_map(|line| line.strip_prefix(name))?;
        line.trim_start_matches(':').split_whitespace().next()?.parse().ok()
    };
    let descriptors = fs::read_dir(process.join("fd")).ok()?.count();
    Some(Cost { memory_kb: number("VmRSS")?, threads: number("Threads")?, descriptors })
}

fn frames() -> u64 {
    let asked = std::env::var("BORESIGHT_LONG_RUN_FRAMES").ok();
    asked.and_then(|frames| frames.parse().ok()).unwrap_or(240)
}

#[test]
fn a_session_that_is_never_complete_takes_no_more_and_more() {
    let place = TempDir::new().expect("folder");
    fs::write(place.path().join("scene.toml"), SCENE).expect("written");
    let frames = frames();
    let count = frames.to_string();
    let arguments =
        ["guide", "--headless", "--source", "sim:scene.toml", "--out", "s", "--max-frames", &count];
    let mut child = program(place.path(), &arguments).stderr(Stdio::null()).spawn().expect("runs");
    let journal = place.path().join("s/journal.jsonl");
    // By the length of the journal, growing with every frame.
    let mut looks: Vec<(u64, Cost)> = Vec::new();
    let code = loop {
        if let Some(ended) = child.try_wait().expect("can be waited for") {
            break ended.code();
        }
        if let (Ok(journal), Some(cost)) = (fs::metadata(&journal), cost(child.id())) {
            looks.push((journal.len(), cost));
        }
        sleep(Duration::from_millis(20));
    };
    assert!(matches!(code, Some(0 | 3)), "{code:?}: the verdict's code");
    let (of_session, bytes) = (code, fs::metadata(&journal).expect("there").len());
    let at = |share: f64| {
        let wanted = (share * bytes as f64) as u64;
        looks.iter().find(|(length, _)| *length >= wanted).or(looks.last()).expect("looks").1
    };
    let (start, middle, end) = (at(0.2), at(0.5), at(0.9));
    println!("{frames} frames, journal of {bytes} bytes");
    println!("start {start:?}, middle {middle:?}, end {end:?}");
    assert!(end.memory_kb < start.memory_kb + 4096, "memory grows");
    assert_eq!(end.threads, start.threads);
    // A file may be open for a moment.
    assert!(end.descriptors <= start.descriptors + 1, "descriptors are kept");

    let mut child = program(place.path(), &["replay", "s"])
        .stderr(Stdio::null())
        .stdout(Stdio::null())
        .spawn()
        .expect("runs");
    let mut most_kb = 0;
    let code = loop {
        if let Some(ended) = child.try_wait().expect("can be waited for") {
            break ended.code();
        }
        most_kb = most_kb.max(cost(child.id()).map_or(0, |cost| cost.memory_kb));
        sleep(Duration::from_millis(5));
    };
    // 1 if a decision came out differently.
    assert_eq!(code, of_session, "the same decisions");
    println!("replayed: at most {most_kb} kB");
    assert!(most_kb < (64 << 10) + 4 * (bytes >> 10), "{most_kb} kB for {bytes} bytes");
}
