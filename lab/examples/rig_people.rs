//! Guided sessions of several simulated cameras, as a table: places and seconds until every pair
//! meets the goal, and whether errors are as stated. Corners are projected; no picture is drawn.
//!
//! ```text
//! rig_people SEEDS [LAYOUT]
//! ```

#[expect(clippy::expect_used, reason = "a person without a request is a fault")]
#[path = "../../crates/guide/src/rig/world.rs"]
mod world;

use std::{sync::Mutex, thread};

use anyhow::{Context, Result};
use boresight_calibrate::{PairSd, RigCalibration};
use boresight_geometry::Rig;
use nalgebra::{Isometry3, Point2, Point3, Vector3};
use world::World;

/// Time limit of a person.
const PATIENCE_SECS: u64 = 180;
/// Cameras, and a person with a board.
type Layout = fn() -> World;
/// Layouts by name.
const LAYOUTS: [(&str, Layout); 4] = [
    ("stereo, 12 cm", || World::of(&[0.0, 0.12])),
    ("stereo, 60 cm", || {
        World::at(World::places(&[0.0, 0.6]), 0.08, Isometry3::translation(0.3, 0.0, 2.0))
    }),
    ("four corners", World::in_corners),
    ("chain of three", World::in_a_chain),
];

/// End of a session.
struct Ended {
    places: usize,
    secs: u64,
    is_good: bool,
    /// Errors over stated standard deviations: rows, baselines, distances of each pair.
    ratios: [Vec<f64>; 3],
}

fn main() -> Result<()> {
    let mut args = std::env::args().skip(1);
    let seeds: u64 = args.next().context("a number of seeds")?.parse()?;
    let only = args.next();
    println!(
        "{:16} {:>4} places, median and most; seconds; ratios: rows, baselines, distances",
        "", "good"
    );
    for (name, layout) in LAYOUTS {
        if only.as_ref().is_none_or(|only| name.starts_with(only.as_str())) {
            let mut ended = run(layout, seeds);
            print(name, &mut ended, seeds);
        }
    }
    Ok(())
}

fn run(layout: Layout, seeds: u64) -> Vec<Ended> {
    let (next, ended) = (Mutex::new(0), Mutex::new(Vec::new()));
    let taken = || {
        let mut next = next.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        *next += 1;
        *next
    };
    let work = || {
        let mut seed = taken();
        while seed <= seeds {
            let mut world = World { random: 0x9E37_79B9_7F4A_7C15 ^ (seed << 32), ..layout() };
            world.run(PATIENCE_SECS);
            match of(&world) {
                Some(one) => {
                    ended.lock().unwrap_or_else(std::sync::PoisonError::into_inner).push(one);
                }
                None => eprintln!("seed {seed}: no rig, {} places", world.kept.len()),
            }
            seed = taken();
        }
    };
    thread::scope(|scope| {
        for _ in 0..thread::available_parallelism().map_or(1, usize::from) {
            scope.spawn(work);
        }
    });
    ended.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner)
}

/// End of the session of `world`; `None` without a rig.
fn of(world: &World) -> Option<Ended> {
    let found = world.rig.plan()?.found.as_ref().ok()?;
    let mut ratios = [const { Vec::new() }; 3];
    for pair in &found.pairs {
        let Some(sd) = &pair.sd else { continue };
        let off_m = found.rig.baseline_m(pair.of[0], pair.of[1])
            - world.truth.baseline_m(pair.of[0], pair.of[1]);
        ratios[1].push(off_m / sd.baseline_m);
        let (rows, distance) = of_points(found, &world.truth, pair.of, sd);
        ratios[0].extend(rows);
        ratios[2].extend(distance);
    }
    let (places, secs) = (world.kept.len(), world.secs());
    Some(Ended { places, secs, is_good: world.rig.is_complete(), ratios })
}

/// Row errors and error of the mean distance of the boards' corners, over what is stated.
fn of_points(
    found: &RigCalibration,
    truth: &Rig,
    [a, b]: [usize; 2],
    sd: &PairSd,
) -> (Option<f64>, Option<f64>) {
    let (mut rows, mut distances) = (Vec::new(), Vec::new());
    let sees = |camera: usize, place: &Isometry3<f64>| {
        let pose = found.rig.cam_from_rig[camera] * place;
        (pose * Vector3::z()).dot(&pose.translation.vector) > 0.0
    };
    let seen =
        found.instants.iter().filter(|it| [a, b].iter().all(|of| sees(*of, &it.rig_from_board)));
    for instant in seen {
        for point in &found.board_m {
            let in_first = found.rig.cam_from_rig[a] * (instant.rig_from_board * point);
            let point = truth.cam_from_rig[a].inverse() * in_first;
            let px = |camera: usize| -> Option<Point2<f64>> {
                let size = found.cameras[camera].image_size;
                let px = truth.cameras[camera].project(&(truth.cam_from_rig[camera] * point))?;
                size.contains(&px).then_some(px)
            };
            let (Some(first), Some(second)) = (px(a), px(b)) else { continue };
            rows.extend(found.rig.row_error_px([a, b], [first, second]));
            let far = |rig: &Rig, point: Point3<f64>| (rig.cam_from_rig[a] * point).coords.norm();
            let seen = found.rig.triangulate(&[(a, first), (b, second)]);
            let true_m = far(truth, point);
            distances.extend(seen.map(|seen| far(&found.rig, seen) / true_m - 1.0));
        }
    }
    (
        sd.row_px.filter(|_| !rows.is_empty()).map(|sd_px| rms(&rows) / sd_px),
        (!distances.is_empty()).then(|| rms(&distances) / sd.distance),
    )
}

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|value| value * value).sum::<f64>() / values.len().max(1) as f64).sqrt()
}

fn print(name: &str, ended: &mut [Ended], seeds: u64) {
    let good = ended.iter().filter(|ended| ended.is_good).count();
    ended.sort_by_key(|ended| ended.secs);
    let middle = |of: fn(&Ended) -> u64| {
        let mut all: Vec<u64> = ended.iter().map(of).collect();
        all.sort_unstable();
        (all.get(all.len() / 2).copied().unwrap_or(0), all.last().copied().unwrap_or(0))
    };
    let (places, most_places) = middle(|ended| ended.places as u64);
    let (secs, most_secs) = middle(|ended| ended.secs);
    let ratios = [0, 1, 2].map(|of| {
        ended.iter().flat_map(|ended| ended.ratios[of].iter().copied()).collect::<Vec<_>>()
    });
    let inside = ratios[1].iter().filter(|ratio| ratio.abs() < 1.96).count();
    println!(
        "{name:16} {good:>4} of {seeds}: {places}, {most_places}; {secs}, {most_secs} s; {:.2}, {:.2}, {:.2}; baselines inside {inside} of {}",
        rms(&ratios[0]),
        rms(&ratios[1]),
        rms(&ratios[2]),
        ratios[1].len(),
    );
}
