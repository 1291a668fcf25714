//! Stores of simulated watched cameras, without pictures: a simulated street's mast sways, is
//! pushed, and pushed back; each measurement is the truth with the scatter of a real picture. For
//! drawings, and to measure the cost of many cameras and the correctness of their states.
//!
//! ```text
//! camera_month FOLDER CAMERAS DAYS MINUTES STREET…
//! ```
//!
//! Each camera gets the next of the streets (`pan=2.5px@12d..14.5d,focal=0.4%@26d`), and a seed of
//! its own.

use std::{collections::BTreeMap, path::Path, time::Instant};

use boresight_station::street::Street;
use boresight_station::{Access, Named, Store};
use boresight_watch::{Answer, Input, Lens, Picture, Watch};

/// Scatter of a picture's estimate: pan, tilt (px), roll (degrees), focal ratio, as a webcam's
/// neighbours in time.
const SCATTER: [f64; 4] = [0.04, 0.09, 0.008, 0.000_07];

fn main() -> anyhow::Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [folder, cameras, days, minutes, streets @ ..] = arguments.as_slice() else {
        anyhow::bail!("FOLDER CAMERAS DAYS MINUTES STREET…");
    };
    let (cameras, days): (u64, f64) = (cameras.parse()?, days.parse()?);
    let every_secs = 60.0 * minutes.parse::<f64>()?;
    let (mut spent, mut bytes) = (0.0, 0);
    let mut states: BTreeMap<(String, &str), u32> = BTreeMap::new();
    let mut watches = Vec::new();
    for n in 0..cameras {
        let plan = streets.get(n as usize % streets.len().max(1)).map_or("", String::as_str);
        let street = Street::parse(&format!("{},{plan}", n + 1))?;
        let lens = Lens::new(street.camera, None, street.image_size);
        let store = Path::new(folder).join(format!("camera-{n:03}"));
        let simulated = Named { path: "simulated".into(), sha256: String::new() };
        Store::create(&store, &format!("camera {n}"), simulated, &lens, true)?;
        let (mut watch, mut inputs, mut said) = (Watch::new(&lens), Vec::new(), Vec::new());
        let mut chance = Chance(n + 1);
        let mut at = street.began_secs;
        while at < street.began_secs + days * 86_400.0 {
            inputs.push(Input::Picture(Box::new(picture(&street, at, &mut chance))));
            at += every_secs;
        }
        let began = Instant::now();
        for input in &inputs {
            let code = watch.handle(input).state.code();
            if said.last() != Some(&code) {
                said.push(code);
            }
        }
        spent += began.elapsed().as_secs_f64();
        let (mut store, _) = Store::open(&store, Access::Watch)?;
        store.record(&inputs, None)?;
        bytes += std::fs::metadata(store.folder().join("watch.jsonl"))?.len();
        *states
            .entry((said.join(" → "), if plan.is_empty() { "nothing" } else { plan }))
            .or_default() += 1;
        watches.push(watch);
    }
    for ((said, plan), count) in &states {
        println!("{count:4} cameras, {plan}: {said}");
    }
    println!(
        "{cameras} cameras for {days} days: {spent:.1} s for the states, {:.2} MB of lines each",
        bytes as f64 / 1e6 / cameras as f64
    );
    if let Ok(status) = std::fs::read_to_string("/proc/self/status") {
        status.lines().filter(|line| line.starts_with("VmRSS")).for_each(|line| println!("{line}"));
    }
    Ok(())
}

fn picture(street: &Street, at: f64, chance: &mut Chance) -> Picture {
    let stand = street.stand(at);
    let f = street.camera.f_px;
    let of = [
        stand.rotation_rad.y + chance.normal() * SCATTER[0] / f.x,
        stand.rotation_rad.x + chance.normal() * SCATTER[1] / f.y,
        stand.rotation_rad.z + chance.normal() * SCATTER[2].to_radians(),
        stand.log_focal + chance.normal() * SCATTER[3],
    ];
    let answer = Answer {
        turn: of.map(|v| v * 1e6),
        cov: [0.01, 0.0, 0.0, 0.0, 0.01, 0.0, 0.0, 0.01, 0.0, 0.01],
        patches: [180, 140],
        sought: Some(200),
        sharp: Some(0.05 * chance.normal()),
        contrast: Some(0.1 * chance.normal()),
        shake: None,
        causes: None,
    };
    Picture { at, late: false, answer: Some(answer), none: None }
}

/// Pseudo-random numbers, the same each time.
struct Chance(u64);

impl Chance {
    fn uniform(&mut self) -> f64 {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 40) as f64 / (1_u64 << 24) as f64
    }

    /// Sum of twelve uniform numbers, nearly normal.
    fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
    }
}
