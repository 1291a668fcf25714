//! Redraws camera-years from a recorded camera: rate of false alarms, and delay until planted steps
//! are found.
//!
//! ```text
//! camera_years WATCH.jsonl WIDTH fx YEARS [--times 1,1.5,2,2.5] [--steps]
//! ```
//!
//! The answers' residuals about a daily cycle, without a slow creep, are cut into days; days are
//! drawn at random and added to the cycle again. Then everything runs through the program's fold:
//! learning, cycle, scatter, sequential test.

use std::{collections::BTreeMap, io::BufRead};

use boresight_geometry::{Camera, frame::ImageSize};
use boresight_watch::{Answer, Cycle, Input, Lens, Picture, Sample, State, Watch, px_per_turn};
use nalgebra::{Point2, Vector4};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

type Failed = Box<dyn std::error::Error>;
const DAY_SECS: f64 = 86_400.0;

fn main() -> Result<(), Failed> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [file, width, fx, years, options @ ..] = arguments.as_slice() else {
        return Err("WATCH.jsonl WIDTH fx YEARS [--times 1,2] [--steps]".into());
    };
    let (width_px, f_px): (u32, f64) = (width.parse()?, fx.parse()?);
    let size = ImageSize { width_px, height_px: width_px * 3 / 4 };
    let lens = Lens::new(Camera::pinhole(f_px, Point2::new(0.0, 0.0)), None, size);
    let mut answers: Vec<(f64, Answer)> = Vec::new();
    for line in std::io::BufReader::new(std::fs::File::open(file)?).lines() {
        if let Input::Picture(picture) = serde_json::from_str(&line?)? {
            let Picture { at, answer, .. } = *picture;
            answers.extend(answer.map(|answer| (at, answer)));
        }
    }
    let days = Days::of(&answers, &lens).ok_or("no answers")?;
    println!("{} answers on {} days to draw from", answers.len(), days.days.len());
    describe(&answers, &lens, &days.cycle);
    let years: usize = years.parse()?;
    let times = options.iter().position(|o| o == "--times").and_then(|at| options.get(at + 1));
    for times in times.map_or("1", String::as_str).split(',') {
        let times: f64 = times.parse()?;
        let mut alarms = BTreeMap::new();
        let (mut scatter, mut pictures) = (Vec::new(), 0_usize);
        for year in 0..years {
            let mut rng = ChaCha8Rng::seed_from_u64(year as u64);
            let mut watch = Watch::new(&lens);
            let (mut before, mut found) = ("LEARNING", Vec::<&str>::new());
            for (at, answer) in days.drawn(365, times, &mut rng) {
                pictures += 1;
                let decision = watch.handle(&Input::Picture(Box::new(Picture {
                    at,
                    late: false,
                    answer: Some(answer),
                    none: None,
                })));
                let code = decision.state.code();
                if code != before && !matches!(decision.state, State::Ok | State::Learning { .. }) {
                    *alarms.entry(code).or_insert(0) += 1;
                    if std::env::var_os("ALARMS").is_some() {
                        let since = (at - decision.since_secs) / 3600.0;
                        println!(
                            "day {:.2}: {code}, off {:.2?} px, began {since:.1} h before; scatter {:.2?}",
                            at / DAY_SECS,
                            decision.off_px.as_slice(),
                            watch.scatter_px().unwrap_or_default().as_slice()
                        );
                    }
                }
                before = code;
                for finding in &decision.findings {
                    if !found.contains(&finding.code()) {
                        *alarms.entry(finding.code()).or_insert(0) += 1;
                    }
                }
                found = decision.findings.iter().map(|f| f.code()).collect();
            }
            scatter.extend(watch.scatter_px().map(|s| s.amax()));
        }
        scatter.sort_by(f64::total_cmp);
        let middle = scatter.get(scatter.len() / 2).copied().unwrap_or(f64::NAN);
        println!(
            "residuals x {times}: {years} camera-years, {pictures} pictures, alarms and findings {alarms:?}; scatter at the end {middle:.2} px"
        );
    }
    if options.iter().any(|o| o == "--steps") {
        steps(&days, &lens, years);
    }
    Ok(())
}

/// Prints the camera's own behaviour, for comparing simulated and real cameras.
fn describe(answers: &[(f64, Answer)], lens: &Lens, cycle: &Cycle) {
    let px = px_per_turn(lens);
    let spread = |mut values: Vec<f64>| {
        values.sort_by(f64::total_cmp);
        let centre = values.get(values.len() / 2).copied().unwrap_or(f64::NAN);
        let mut away: Vec<f64> = values.iter().map(|v| (v - centre).abs()).collect();
        away.sort_by(f64::total_cmp);
        1.4826 * away.get(away.len() / 2).copied().unwrap_or(f64::NAN)
    };
    let value = |a: &Answer| a.turn().vector().component_mul(&px);
    let near = |w: &&[(f64, Answer)]| w[1].0 - w[0].0 < 3600.0;
    let steps: Vec<Vector4<f64>> =
        answers.windows(2).filter(near).map(|w| value(&w[1].1) - value(&w[0].1)).collect();
    let each = |of: &dyn Fn(usize) -> f64| -> Vec<String> {
        (0..4).map(|i| format!("{:.3}", of(i))).collect()
    };
    let neighbours = each(&|i| spread(steps.iter().map(|s| s[i]).collect()) / 2_f64.sqrt());
    let hours: Vec<Vector4<f64>> = (0..24).map(|hour| cycle.at(f64::from(hour) * 3600.0)).collect();
    let swing = each(&|i| {
        let of = hours.iter().map(|at| at[i]);
        of.clone().fold(f64::NEG_INFINITY, f64::max) - of.fold(f64::INFINITY, f64::min)
    });
    let of = |value: fn(&Answer) -> Option<f64>| {
        spread(answers.iter().filter_map(|(_, a)| value(a)).collect())
    };
    let mean = |i: usize| {
        answers.iter().map(|(_, a)| f64::from(a.patches[i])).sum::<f64>() / answers.len() as f64
    };
    println!(
        "px for pan, tilt, roll, focal length: neighbours {}; daily cycle {}; scatter about it {}",
        neighbours.join(" "),
        swing.join(" "),
        each(&|i| cycle.scatter_px[i]).join(" ")
    );
    println!(
        "sharpness ± {:.2}, contrast ± {:.2}; {:.0} patches found, {:.0} agree",
        of(|a| a.sharp),
        of(|a| a.contrast),
        mean(0),
        mean(1)
    );
}

/// Days of residuals, and the cycle.
struct Days {
    cycle: Cycle,
    days: Vec<Vec<(f64, Vector4<f64>, Answer)>>,
    px: Vector4<f64>,
}

impl Days {
    fn of(answers: &[(f64, Answer)], lens: &Lens) -> Option<Self> {
        let px = px_per_turn(lens);
        let sample = |at: f64, a: &Answer| Sample {
            at_secs: at,
            value_px: a.turn().vector().component_mul(&px),
        };
        let samples: Vec<Sample> = answers.iter().map(|(at, a)| sample(*at, a)).collect();
        let cycle = Cycle::learn(&samples, f64::from(lens.image_size.width_px), None)?;
        // Creep and slow movements over weeks: a line through each run of days without a gap.
        let mut by_day: BTreeMap<i64, Vec<(f64, Vector4<f64>, Answer)>> = BTreeMap::new();
        for ((at, answer), sample) in answers.iter().zip(&samples) {
            let day = (at / DAY_SECS).floor();
            by_day.entry(day as i64).or_default().push((
                at - day * DAY_SECS,
                cycle.residual(sample),
                answer.clone(),
            ));
        }
        let most = by_day.values().map(Vec::len).max()?;
        let mut runs: Vec<Vec<i64>> = Vec::new();
        for day in by_day.keys() {
            match runs.last_mut() {
                Some(run) if run.last() == Some(&(day - 1)) => run.push(*day),
                _ => runs.push(vec![*day]),
            }
        }
        let mut days = Vec::new();
        for run in runs {
            let all: Vec<(f64, Vector4<f64>)> = run
                .iter()
                .flat_map(|day| {
                    by_day[day].iter().map(|(at, off, _)| (*day as f64 + at / DAY_SECS, *off))
                })
                .collect();
            let n = all.len() as f64;
            let mean_at = all.iter().map(|(at, _)| at).sum::<f64>() / n;
            let mean: Vector4<f64> = all.iter().map(|(_, off)| off).sum::<Vector4<f64>>() / n;
            let spread: f64 = all.iter().map(|(at, _)| (at - mean_at).powi(2)).sum();
            let slope = all.iter().map(|(at, off)| off * (at - mean_at)).sum::<Vector4<f64>>()
                / spread.max(1e-9);
            for day in run {
                let own: Vec<(f64, Vector4<f64>, Answer)> = by_day[&day]
                    .iter()
                    .map(|(at, off, answer)| {
                        (
                            *at,
                            off - mean - slope * (day as f64 + at / DAY_SECS - mean_at),
                            answer.clone(),
                        )
                    })
                    .collect();
                if 2 * own.len() >= most {
                    days.push(own);
                }
            }
        }
        Some(Self { cycle, days, px })
    }

    fn drawn(&self, count: usize, times: f64, rng: &mut ChaCha8Rng) -> Vec<(f64, Answer)> {
        let mut all = Vec::new();
        for day in 0..count {
            let drawn = &self.days[rng.random_range(0..self.days.len())];
            for (at, off, answer) in drawn {
                let at_secs = day as f64 * DAY_SECS + at;
                let value = self.cycle.at(at_secs) + off * times;
                let turn = (value.component_div(&self.px) * 1e6).into();
                all.push((at_secs, Answer { turn, causes: None, ..answer.clone() }));
            }
        }
        all
    }
}

/// Hours until a step planted into a drawn fortnight is found.
fn steps(days: &Days, lens: &Lens, tries: usize) {
    let half = lens.half_diagonal_px();
    let deg = std::f64::consts::PI / 180.0;
    for (name, step) in [
        ("pan 1 px", Vector4::new(1.0, 0.0, 0.0, 0.0)),
        ("pan 1.5 px", Vector4::new(1.5, 0.0, 0.0, 0.0)),
        ("tilt 2 px", Vector4::new(0.0, 2.0, 0.0, 0.0)),
        ("roll 0.1 deg", Vector4::new(0.0, 0.0, 0.1 * deg * half, 0.0)),
        ("roll 0.2 deg", Vector4::new(0.0, 0.0, 0.2 * deg * half, 0.0)),
        ("focal 0.3 %", Vector4::new(0.0, 0.0, 0.0, 0.003 * half)),
        ("focal 0.1 %", Vector4::new(0.0, 0.0, 0.0, 0.001 * half)),
        ("0.1 % of the width", Vector4::new(0.002 * half, 0.0, 0.0, 0.0)),
        ("0.2 % of the width", Vector4::new(0.004 * half, 0.0, 0.0, 0.0)),
    ] {
        let (mut hours, mut wrong) = (Vec::new(), 0);
        for seed in 0..tries {
            let mut rng = ChaCha8Rng::seed_from_u64(1_000 + seed as u64);
            let began = (14.0 + rng.random_range(0.0..1.0)) * DAY_SECS;
            let mut watch = Watch::new(lens);
            for (at, mut answer) in days.drawn(20, 1.0, &mut rng) {
                if at >= began {
                    let added = step.component_div(&days.px) * 1e6;
                    answer.turn = [0, 1, 2, 3].map(|i| answer.turn[i] + added[i]);
                }
                let decision = watch.handle(&Input::Picture(Box::new(Picture {
                    at,
                    late: false,
                    answer: Some(answer),
                    none: None,
                })));
                if at >= began && matches!(decision.state, State::Moved(_) | State::Zoom) {
                    hours.push((at - began) / 3600.0);
                    wrong += usize::from((decision.state == State::Zoom) != (step[3] != 0.0));
                    break;
                }
            }
        }
        hours.sort_by(f64::total_cmp);
        let at = |share: f64| {
            hours.get((share * hours.len() as f64) as usize).copied().unwrap_or(f64::NAN)
        };
        println!(
            "{name:20} found {} of {tries}; hours: half {:.1}, 90 % {:.1}; wrong kind {wrong}",
            hours.len(),
            at(0.5),
            at(0.9)
        );
    }
}
