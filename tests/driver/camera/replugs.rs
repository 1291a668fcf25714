//! Repeated unplugging and replugging of a camera. `BORESIGHT_REPLUGS=100` sets the number.

use std::{fs, time::Duration};

use boresight::device::Fault;

use super::{frames, lost, open, returned, row, small, tell, until, words};

const USUAL: usize = 20;

/// Resources held by the process.
#[derive(Clone, Copy, Debug)]
struct Held {
    resident_kb: u64,
    threads: u64,
    descriptors: usize,
    mappings: usize,
}

impl Held {
    fn now() -> Self {
        let status = fs::read_to_string("/proc/self/status").expect("readable");
        let number = |name: &str| {
            let line = status.lines().find(|line| line.starts_with(name)).expect("is stated");
            line.split_whitespace().nth(1).and_then(|text| text.parse().ok()).expect("a number")
        };
        Self {
            resident_kb: number("VmRSS:"),
            threads: number("Threads:"),
            descriptors: fs::read_dir("/proc/self/fd").expect("listable").count(),
            mappings: fs::read_to_string("/proc/self/maps").expect("readable").lines().count(),
        }
    }
}

#[test]
#[ignore = "needs the camera of tests/vm"]
fn an_unplugged_camera_is_noticed_and_comes_back_as_often_as_it_goes() {
    let asked = std::env::var("BORESIGHT_REPLUGS").ok().and_then(|count| count.parse().ok());
    let times: usize = asked.unwrap_or(USUAL);
    let mut source = open(&small());
    frames(&mut source, 3);
    let (mut noticed, mut back): (Vec<Duration>, Vec<Duration>) = Default::default();
    let mut held = Vec::new();
    for count in 0..times {
        tell("unplug");
        let seen = until(&mut source, |seen| lost(seen).is_some());
        assert_eq!(lost(&seen), Some(Fault::Unplugged));
        noticed.push(seen.took);
        tell("plug");
        let seen = until(&mut source, |seen| returned(seen) && seen.frames > 0);
        back.push(seen.took);
        // The first few times allocate reusable room.
        if [4, times / 2, times - 1].contains(&count) {
            held.push(Held::now());
            println!("after {} times: {:?}", count + 1, Held::now());
        }
    }
    let longest = |all: &[Duration]| all.iter().max().copied().unwrap_or_default();
    let fault = format!("unplugged and plugged in, {times} times");
    row(&fault, &words(Fault::Unplugged), longest(&back));
    println!("noticed within {:.2} s", longest(&noticed).as_secs_f64());
    let (first, last) = (held[0], held[held.len() - 1]);
    assert_eq!(first.threads, last.threads);
    assert_eq!(first.descriptors, last.descriptors);
    assert_eq!(first.mappings, last.mappings);
    assert!(last.resident_kb < first.resident_kb + 512, "{held:?}");
}
