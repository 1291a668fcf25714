//! Are the causes that a calibration names true? Real corners as they are, in halves, and with
//! planted faults: the corners are moved as the fault would move them, and keep their real errors.
//!
//! ```text
//! causes LIST [as-they-are]
//! ```
//!
//! LIST is that of `split_halves`.

mod corner_lists;

use std::{collections::BTreeMap, path::Path, time::Instant};

use boresight_calibrate::{
    Calibration, CalibrationParams, FindingCode, Severity, Verdict, calibrate,
};
use boresight_geometry::Corner;
use corner_lists::{Set, each, read_list};
use nalgebra::{Point3, Vector2, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Families of causes; members look alike, or call for the same action.
const FAMILIES: [(&str, &[&str]); 6] = [
    ("focus", &["FOCUS-MOVED"]),
    ("mixed", &["VIEWS-MIXED"]),
    ("board", &["BOARD-BENT", "BOARD-FLEXES"]),
    ("aspect", &["PIXELS-NOT-SQUARE", "BOARD-STRETCHED"]),
    ("shutter", &["ROLLING-SHUTTER"]),
    ("shift", &["PICTURE-SHIFTED"]),
];

/// Planted faults, with the family of each.
const FAULTS: [(&str, &str); 8] = [
    ("focus 1 %", "focus"),
    ("focus 3 %", "focus"),
    ("another camera", "mixed"),
    ("bent 1 mm", "board"),
    ("pixels .2 %", "aspect"),
    ("stretched .2 %", "aspect"),
    ("shear 3 px", "shutter"),
    ("flexes 1 mm", "board"),
];

fn family(code: &str) -> Option<&'static str> {
    FAMILIES.iter().find(|(_, codes)| codes.contains(&code)).map(|(name, _)| *name)
}

/// Families named by a result: alone, and among others.
fn named(found: &Calibration) -> (Vec<&'static str>, Vec<&'static str>) {
    let (mut alone, mut among) = (Vec::new(), Vec::new());
    for finding in &found.findings {
        if let FindingCode::CauseUnclear { candidates, .. } = finding.code {
            among.extend(candidates.into_iter().flatten().filter_map(family));
        }
        alone.extend(family(finding.code.code()));
    }
    (alone, among)
}

/// Corners of `set` with a fault, from the poses of `found`.
fn with_fault(set: &Set, found: &Calibration, fault: &str) -> Vec<Vec<Corner>> {
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let (camera, count) = (found.camera, set.views.len());
    let width_px = f64::from(set.size.width_px);
    let (centre_px, height_px) = (set.size.centre_px(), f64::from(set.size.height_px));
    let half_m = found.board_m.iter().map(|p| p.coords.amax()).fold(0.0, f64::max);
    let mut order: Vec<usize> = (0..count).collect();
    rand::seq::SliceRandom::shuffle(order.as_mut_slice(), &mut rng);
    let other = &order[..(count / 4).max(2)];
    set.views
        .iter()
        .enumerate()
        .map(|(view, corners)| {
            let mut normal = || (0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0;
            let own = [normal(), normal(), normal()];
            let pose = found.views[view].cam_from_board;
            let moved = |corner: &Corner, point_m: &Point3<f64>| -> Option<Vector2<f64>> {
                let (u, v) = (point_m.x / half_m, point_m.y / half_m);
                let bows = [1.0 - u * u, 1.0 - v * v, u * v];
                let off = corner.px - camera.pp_px;
                let is_late = view >= count - count / 3;
                let on_board = |shift_m: Vector3<f64>| -> Option<Vector2<f64>> {
                    let at = camera.project(&(pose * (point_m + shift_m)))?;
                    Some(at - camera.project(&(pose * point_m))?)
                };
                match fault {
                    "focus 1 %" if is_late => Some(off * 0.01),
                    "focus 3 %" if is_late => Some(off * 0.03),
                    "another camera" if other.contains(&view) => {
                        Some(off * 0.05 + Vector2::new(0.02, -0.012) * width_px)
                    }
                    "bent 1 mm" => on_board(Vector3::z() * (1e-3 * bows[0])),
                    "pixels .2 %" => Some(Vector2::new(0.0, 0.002 * off.y)),
                    "stretched .2 %" => on_board(Vector3::y() * (0.002 * point_m.y)),
                    "shear 3 px" => {
                        let row = (corner.px.y - centre_px.y) / height_px;
                        Some(Vector2::new(own[0], own[1]) * (3.0 * row * width_px / 1280.0))
                    }
                    "flexes 1 mm" => {
                        let rise: f64 = bows.iter().zip(own).map(|(bow, size)| bow * size).sum();
                        on_board(Vector3::z() * (1e-3 * rise))
                    }
                    _ => Some(Vector2::zeros()),
                }
            };
            let with = |(corner, point_m): (&Corner, &Point3<f64>)| {
                let shift = moved(corner, point_m).unwrap_or_default();
                Corner { px: corner.px + shift, ..*corner }
            };
            corners.iter().zip(&found.board_m).map(with).collect()
        })
        .collect()
}

fn codes(found: &Calibration) -> String {
    let code = |finding: &boresight_calibrate::Finding| {
        let bad = if finding.severity == Severity::Bad { "!" } else { "" };
        match finding.code {
            FindingCode::CauseUnclear { candidates, .. } => {
                let all: Vec<&str> = candidates.into_iter().flatten().collect();
                Some(format!("({})", all.join(" | ")))
            }
            code => family(code.code()).map(|_| format!("{bad}{}", code.code())),
        }
    };
    found.findings.iter().filter_map(code).collect::<Vec<_>>().join(" ")
}

fn main() -> anyhow::Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [list, rest @ ..] = arguments.as_slice() else {
        anyhow::bail!("causes LIST [as-they-are]")
    };
    let sets = read_list(Path::new(list))?;
    let params = CalibrationParams::default();
    let run =
        |set: &Set, views: &[Vec<Corner>]| calibrate(views, &set.board, set.size, &params).ok();
    let rows = each(&sets, |set| {
        let start = Instant::now();
        let whole = run(set, &set.views);
        let seconds = start.elapsed().as_secs_f64();
        let half = |odd: usize| -> Vec<Vec<Corner>> {
            set.views.iter().skip(odd).step_by(2).cloned().collect()
        };
        let halves = [0, 1].map(|odd| run(set, &half(odd)));
        let faults: Vec<Option<Calibration>> = match (&whole, rest.is_empty()) {
            (Some(whole), true) => {
                FAULTS.iter().map(|(fault, _)| run(set, &with_fault(set, whole, fault))).collect()
            }
            _ => Vec::new(),
        };
        (whole, halves, faults, seconds)
    });
    let (mut fits, mut grave, mut bad, mut confirmed, mut asked) = (0, 0, 0, 0, 0);
    let mut counts: BTreeMap<&str, [u32; 4]> = BTreeMap::new();
    for (set, (whole, halves, faults, seconds)) in &rows {
        let Some(whole) = whole else {
            println!("{}: no result", set.name);
            continue;
        };
        let of_halves: Vec<String> =
            halves.iter().map(|half| half.as_ref().map_or("none".into(), codes)).collect();
        println!(
            "{} {:?} f {:.1} pp {:.1} {:.1} covered {:.2} ({seconds:.2} s): {} / {}",
            set.name,
            whole.verdict,
            whole.camera.f_px.x,
            whole.camera.pp_px.x,
            whole.camera.pp_px.y,
            whole.covered_bound_px.unwrap_or(f64::NAN),
            codes(whole),
            of_halves.join(" / ")
        );
        let (alone, _) = named(whole);
        for found in std::iter::once(whole).chain(halves.iter().flatten()) {
            fits += 1;
            let of_found = named(found).0;
            grave += u32::from(of_found.iter().any(|it| ["focus", "mixed"].contains(it)));
            bad += u32::from(found.verdict == Verdict::Untrustworthy);
        }
        for half in halves.iter().flatten() {
            let (of_half, among) = named(half);
            asked += alone.len();
            confirmed +=
                alone.iter().filter(|it| of_half.contains(it) || among.contains(it)).count();
        }
        for ((fault, truth), found) in FAULTS.iter().zip(faults) {
            let Some(found) = found else { continue };
            let (of_fault, among) = named(found);
            let is_new = |it: &&str| !alone.contains(it);
            let outcome = if of_fault.contains(truth) {
                0
            } else if among.contains(truth) {
                1
            } else if of_fault.iter().any(is_new) {
                3
            } else {
                2
            };
            counts.entry(*fault).or_default()[outcome] += 1;
        }
    }
    println!("focus or mixed named in {grave} of {fits} fits; not trustworthy {bad}");
    println!("named causes of whole sets that their halves name, too: {confirmed} of {asked}");
    for (fault, _) in FAULTS {
        if let Some([right, among, missed, wrong]) = counts.get(fault) {
            println!(
                "{fault}: {right} right, {among} among others, {missed} missed, {wrong} wrong"
            );
        }
    }
    Ok(())
}
