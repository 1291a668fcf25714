//! Is the stated uncertainty true? Calibrates two disjoint halves of the views of real cameras, and
//! compares their difference, after the best rotation between them, with both statements.
//!
//! ```text
//! split_halves LIST SPLITS
//! ```
//!
//! A line of LIST names a file of `boresight detect --json` lines (`{"file", "corners": [[column,
//! row, x, y, sigma], …]}`), the board's corners, and the pictures' size: `antonio.jsonl 11x10
//! 1280x720`.

mod best_turn;
mod corner_lists;
mod outlines;

use std::path::Path;

use best_turn::{differences_px, rms_px};
use boresight_calibrate::{
    Calibration, CalibrationParams, Limits, OldLens, Severity, Verdict, calibrate, drift,
    projection_jacobian,
};
use boresight_geometry::Corner;
use corner_lists::{Set, each, read_list};
use nalgebra::{Point2, Point3};
use outlines::outlines;
use rand::{SeedableRng, seq::SliceRandom};
use rand_chacha::ChaCha8Rng;

/// Mutual comparison of two halves.
struct Halves {
    /// Of f, and of the principal point.
    z: [f64; 3],
    /// Root mean square, in stated sd, over the part covered by both, over the picture, and in the
    /// corners.
    z_covered: f64,
    z_picture: f64,
    z_corners: f64,
    /// Root mean square a coordinate over the part covered by both, in pixels.
    difference_px: f64,
    inside: bool,
    good_wrong: bool,
    /// True if a check of each half against the other finds a change, with all views and with four;
    /// `None` without a verdict.
    checks: [[Option<bool>; 2]; 2],
}

fn result_of(set: &Set, views: &[Vec<Corner>], params: &CalibrationParams) -> Option<Calibration> {
    calibrate(views, &set.board, set.size, params).ok()
}

fn halves_of(set: &Set, split: u64, params: &CalibrationParams) -> Option<Halves> {
    let mut order: Vec<usize> = (0..set.views.len()).collect();
    if split > 0 {
        order.shuffle(&mut ChaCha8Rng::seed_from_u64(split));
    }
    let half = |odd: usize| -> Vec<Vec<Corner>> {
        let mut mine: Vec<usize> = order.iter().copied().skip(odd).step_by(2).collect();
        mine.sort_unstable();
        mine.into_iter().map(|view| set.views[view].clone()).collect()
    };
    let views = [half(0), half(1)];
    let [a, b] = [result_of(set, &views[0], params)?, result_of(set, &views[1], params)?];
    let boards = [outlines(&set.board, &views[0]), outlines(&set.board, &views[1])];
    let both =
        |px: &Point2<f64>| boards.iter().all(|half| half.iter().any(|board| board.covers(px)));
    let covariance = a.covariance_all + b.covariance_all;
    let whole = projection_jacobian(&a.camera, set.size)?;
    let off = |is_inside: &dyn Fn(&Point2<f64>) -> bool| -> Option<(f64, f64)> {
        // Beyond its fold, a lens model is invalid.
        let is_known = |point: &Point3<f64>, px: &Point2<f64>| {
            let ray = b.camera.ray_from_px(px);
            ray.is_some_and(|ray| ray.angle(&point.coords) < 1e-3)
        };
        let project =
            |point: &Point3<f64>| b.camera.project(point).filter(|px| is_known(point, px));
        let differences = differences_px(&a.camera, &project, set.size, is_inside)?;
        let stated = whole.turned_over(is_inside)?.sd(&covariance);
        let variances: Vec<f64> = stated
            .grid
            .iter()
            .filter(|point| differences.iter().any(|(px, _)| *px == point.px))
            .map(|point| point.sd_px.powi(2))
            .collect();
        let sd_px = (variances.iter().sum::<f64>() / variances.len() as f64).sqrt();
        Some((rms_px(&differences), rms_px(&differences) / sd_px))
    };
    let (difference_px, z_covered) = off(&both)?;
    let (_, z_picture) = off(&|_| true)?;
    let (width, height) = (f64::from(set.size.width_px), f64::from(set.size.height_px));
    let is_corner = |px: &Point2<f64>| {
        let outer = |at: f64, of: f64| at < 0.2 * of || at > 0.8 * of;
        outer(px.x, width) && outer(px.y, height)
    };
    let (_, z_corners) = off(&is_corner)?;
    let sd = |i: usize| covariance[(i, i)].sqrt();
    let pp_px = a.camera.pp_px - b.camera.pp_px;
    let z = [(a.camera.f_px.x - b.camera.f_px.x) / sd(0), pp_px.x / sd(2), pp_px.y / sd(3)];
    let bounds = [a.covered_bound_px?, b.covered_bound_px?];
    let bound_px = bounds[0].hypot(bounds[1]);
    let is_good = a.verdict == Verdict::Good && b.verdict == Verdict::Good;
    let check = |old: &Calibration, half: usize| {
        let old = OldLens {
            camera: old.camera,
            covariance: Some(old.covariance_all),
            outlines: &boards[half],
            image_size: set.size,
        };
        let new = &views[1 - half];
        let four: Vec<_> = new.iter().step_by((new.len() / 4).max(1)).take(4).cloned().collect();
        [new, &four].map(|new| {
            drift(new, &set.board, set.size, &old, None).ok().map(|it| it.is_significant)
        })
    };
    Some(Halves {
        z,
        z_covered,
        z_picture,
        z_corners,
        difference_px,
        inside: difference_px <= bound_px,
        good_wrong: is_good && difference_px > 2.0 * bound_px,
        checks: [check(&a, 0), check(&b, 1)],
    })
}

/// Columns of a table of z: root mean square, and median of the sizes.
fn spread(values: impl Iterator<Item = f64>) -> String {
    let mut sizes: Vec<f64> = values.map(f64::abs).filter(|z| z.is_finite()).collect();
    sizes.sort_by(f64::total_cmp);
    let rms = (sizes.iter().map(|z| z * z).sum::<f64>() / sizes.len().max(1) as f64).sqrt();
    let most = sizes.iter().filter(|z| **z > 2.0).count();
    let median = sizes.get(sizes.len() / 2).copied().unwrap_or(f64::NAN);
    format!("{rms:.2} (median {median:.2}, {most} of {} beyond 2)", sizes.len())
}

fn main() -> anyhow::Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [list, splits, ..] = arguments.as_slice() else {
        anyhow::bail!("split_halves LIST SPLITS");
    };
    let (list, splits) = (Path::new(list), splits.parse::<u64>()?);
    let sets = read_list(list)?;
    let params = CalibrationParams::default();
    let rows = each(&sets, |set| {
        let halves = (0..splits).filter_map(|split| halves_of(set, split, &params));
        (result_of(set, &set.views, &params), halves.collect::<Vec<Halves>>())
    });
    println!(
        "| set | views | model | verdict | bound (covered, picture) | goal | valid | halves differ by | inside | z of f, cx, cy | alarms (all, four views) | findings |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|---|");
    let (mut agree, mut good_of_agreeing, mut good) = (0, 0, 0);
    for (set, (whole, halves)) in &rows {
        let Some(whole) = whole else {
            println!("| {} | {} | no result |", set.name, set.views.len());
            continue;
        };
        let goal_px = Limits::of(set.size).goal_px;
        let differ_px = halves.iter().map(|it| it.difference_px).fold(0.0, f64::max);
        let agrees = !halves.is_empty() && differ_px <= goal_px;
        let is_good = whole.verdict == Verdict::Good;
        agree += usize::from(agrees);
        good += usize::from(is_good);
        good_of_agreeing += usize::from(agrees && is_good);
        let findings: Vec<&str> = whole
            .findings
            .iter()
            .filter(|finding| finding.severity != Severity::Info)
            .map(|finding| finding.code.code())
            .collect();
        let z: Vec<String> = halves
            .iter()
            .map(|it| format!("{:.1} {:.1} {:.1}", it.z[0], it.z[1], it.z[2]))
            .collect();
        let alarms = |which: usize| {
            let checks = halves.iter().flat_map(|it| &it.checks).filter_map(|it| it[which]);
            checks.filter(|is_alarm| *is_alarm).count()
        };
        println!(
            "| {} | {} | {:?} | {:?} | {:.2}, {:.2} | {goal_px:.2} | {:.0} % | {differ_px:.2} | {}/{} | {} | {}, {} | {} |",
            set.name,
            set.views.len(),
            whole.model,
            whole.verdict,
            whole.covered_bound_px.unwrap_or(f64::NAN),
            whole.picture_bound_px().unwrap_or(f64::NAN),
            100.0 * whole.valid_area.share,
            halves.iter().filter(|it| it.inside).count(),
            halves.len(),
            z.join("; "),
            alarms(0),
            alarms(1),
            findings.join(" ")
        );
    }
    let all = || rows.iter().flat_map(|(_, (_, halves))| halves);
    let count = all().count();
    for (name, which) in ["f", "cx", "cy"].iter().zip(0..) {
        println!("z of {name}: {}", spread(all().map(|it| it.z[which])));
    }
    println!("covered part: {}", spread(all().map(|it| it.z_covered)));
    println!("picture: {}", spread(all().map(|it| it.z_picture)));
    println!("corners: {}", spread(all().map(|it| it.z_corners)));
    println!("inside the bound: {} of {count}", all().filter(|it| it.inside).count());
    println!("GOOD and wrong: {}", all().filter(|it| it.good_wrong).count());
    for (name, which) in ["all views", "four views"].iter().zip(0..) {
        let told: Vec<bool> =
            all().flat_map(|it| &it.checks).filter_map(|check| check[which]).collect();
        let alarms = told.iter().filter(|is_alarm| **is_alarm).count();
        println!("check with {name}: {alarms} alarms of {}", told.len());
    }
    println!(
        "GOOD: {good} of {} sets; {good_of_agreeing} of the {agree} whose halves agree within the goal",
        rows.len()
    );
    Ok(())
}
