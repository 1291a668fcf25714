//! Do rigs state what they know? Halves of the instants of real rigs, compared by what both state.
//!
//! ```text
//! rigs FOLDER SET...
//! ```
//!
//! FOLDER has `sets.json` with the corner files of each set's cameras, the size of the pictures and
//! the side of a square; the corner files are `boresight detect --json`. Prints for each two
//! cameras of a set the ratio of the difference of two halves to what they state (1 is honest), the
//! share inside 95 %, and the held-out row error; then what is found if a camera is turned by
//! 0.02°, 0.05° or 0.2° from an instant on.

use std::{collections::BTreeMap, fs, path::Path};

use anyhow::{Context, Result};
use boresight_calibrate::{CalibrationParams, RigCalibration, RigFinding, RigViews, calibrate_rig};
use boresight_geometry::{
    Camera, Corner, LENS_PARAMETERS, Rig, boards::Board, expect_unseen, frame::ImageSize,
};
use nalgebra::{DMatrix, DVector, Point2, Vector3};
use serde::Deserialize;

/// Splits of a set into halves.
const SPLITS: u64 = 4;
/// Numbers of a camera in the covariance: lens, turn and shift.
const OF_CAMERA: usize = LENS_PARAMETERS + 6;

#[derive(Deserialize)]
struct Set {
    cameras: Vec<String>,
    size_px: [u32; 2],
    square_mm: f64,
    named: bool,
}

#[derive(Deserialize)]
struct Line {
    file: String,
    found: bool,
    board: [u16; 2],
    corners: Option<Vec<CornerEntry>>,
}

/// Column, row, x, y and standard deviation in pixels.
type CornerEntry = (usize, usize, f64, f64, Option<f64>);

fn main() -> Result<()> {
    let mut args = std::env::args().skip(1);
    let folder = args.next().context("a folder")?;
    let sets: BTreeMap<String, Set> =
        serde_json::from_str(&fs::read_to_string(Path::new(&folder).join("sets.json"))?)?;
    for name in args {
        let set = sets.get(&name).context("no such set")?;
        let (cameras, board) = read(Path::new(&folder), set)?;
        let started = std::time::Instant::now();
        match calibrate_rig(&cameras, &board, &params()) {
            Err(err) => println!("{name}: {} {err}", err.code()),
            Ok(rig) => {
                print_whole(&name, &rig, started.elapsed().as_secs_f64());
                let kept: Vec<Halves> =
                    (0..SPLITS).filter_map(|seed| halves(&cameras, &board, seed)).collect();
                print_halves(&kept, rig.cameras.len());
                print_known(&cameras, &board, rig.cameras.len());
                for turn_deg in [0.02, 0.05, 0.2] {
                    for seed in 0..2 {
                        print_planted(&cameras, &board, &rig, turn_deg, seed);
                    }
                }
            }
        }
    }
    Ok(())
}

fn params() -> CalibrationParams {
    CalibrationParams { threads: 2, ..CalibrationParams::default() }
}

fn read(folder: &Path, set: &Set) -> Result<(Vec<RigViews>, Board)> {
    let mut size = None;
    let mut cameras = Vec::new();
    for camera in &set.cameras {
        let text = fs::read_to_string(folder.join(format!("{camera}.jsonl")))?;
        let mut views = Vec::new();
        for line in text.lines() {
            let line: Line = serde_json::from_str(line)?;
            let (true, Some(corners)) = (line.found, line.corners) else { continue };
            size = size.or(Some(line.board));
            let [columns, rows] = line.board.map(usize::from);
            let mut all = vec![Corner::unseen(Point2::new(f64::NAN, f64::NAN)); columns * rows];
            for (column, row, x, y, sd) in corners {
                let sd = sd.unwrap_or(0.05).max(0.004);
                all[row * columns + column] = Corner::isotropic(Point2::new(x, y), sd);
            }
            views.push((number(&line.file), all));
        }
        let image_size = ImageSize { width_px: set.size_px[0], height_px: set.size_px[1] };
        cameras.push(RigViews { image_size, views, known_lens: None });
    }
    let [columns, rows] = size.context("no corners")?;
    // A square of 1 mm means an unknown size.
    let square_m = if set.square_mm > 1.0 { set.square_mm } else { 25.0 } / 1e3;
    let board = Board::new(columns, rows, square_m)?;
    let board = if set.named && board.looks_the_same_upside_down() {
        board.with(boresight_geometry::boards::Pattern::Charuco {
            dictionary: "DICT_4X4_1000".parse().map_err(|_| anyhow::anyhow!("dictionary"))?,
            side: boresight_geometry::boards::MarkerSide::Squares(0.75),
        })?
    } else {
        board
    };
    let board_m = board.corners_in_board_m();
    for (_, corners) in cameras.iter_mut().flat_map(|camera| &mut camera.views) {
        expect_unseen(&board_m, corners);
    }
    Ok((cameras, board))
}

/// Last number in a name.
fn number(name: &str) -> u64 {
    let stem = name.rsplit_once('.').map_or(name, |(stem, _)| stem);
    let digits: String = stem
        .chars()
        .rev()
        .skip_while(|c| !c.is_ascii_digit())
        .take_while(char::is_ascii_digit)
        .collect();
    digits.chars().rev().collect::<String>().parse().unwrap_or_default()
}

fn print_whole(name: &str, rig: &RigCalibration, secs: f64) {
    let codes: Vec<String> = rig.findings.iter().map(|it| format!("{it:?}")).collect();
    println!(
        "{name}: {:?} in {secs:.2} s, stretch {:.4} %  {codes:?}",
        rig.verdict,
        100.0 * rig.stretch
    );
    for (index, camera) in rig.cameras.iter().enumerate() {
        println!(
            "  camera {index}: f {:.2} pp {:.2} {:.2}, rms {:.3} px, alone {:.3}",
            rig.rig.cameras[index].f_px.x,
            rig.rig.cameras[index].pp_px.x,
            rig.rig.cameras[index].pp_px.y,
            camera.rms_px,
            camera.alone_rms_px.unwrap_or(f64::NAN)
        );
    }
    for pair in &rig.pairs {
        let sd = pair.sd.map(|sd| {
            (sd.baseline_m * 1e3, sd.row_px.unwrap_or(f64::NAN), 100.0 * sd.distance, sd.at_m)
        });
        println!(
            "  {:?}: {} instants, baseline {:.3} mm, rows {:.4?} px, sd (mm, px, %, m) {sd:.4?}",
            pair.of,
            pair.instants,
            pair.second_from_first.translation.vector.norm() * 1e3,
            pair.row_rms_px,
        );
    }
}

/// Differences over stated sds of one split, by pair and quantity, and the held-out row error.
struct Halves(BTreeMap<(usize, usize, &'static str), Vec<f64>>);

fn halves(cameras: &[RigViews], board: &Board, seed: u64) -> Option<Halves> {
    use rand::{SeedableRng, seq::SliceRandom};
    let mut numbers: Vec<u64> =
        cameras.iter().flat_map(|camera| camera.views.iter().map(|(number, _)| *number)).collect();
    numbers.sort_unstable();
    numbers.dedup();
    numbers.shuffle(&mut rand_chacha::ChaCha8Rng::seed_from_u64(seed));
    let half = |kept: &[u64]| -> Vec<RigViews> {
        cameras
            .iter()
            .map(|camera| RigViews {
                views: camera.views.iter().filter(|(it, _)| kept.contains(it)).cloned().collect(),
                ..camera.clone()
            })
            .collect()
    };
    let (one, two) = numbers.split_at(numbers.len() / 2);
    let (one, two) = (half(one), half(two));
    let rigs: Vec<RigCalibration> = [&one, &two]
        .into_iter()
        .filter_map(|half| {
            calibrate_rig(half, board, &params())
                .inspect_err(|err| println!("  split {seed}: {err}"))
                .ok()
        })
        .collect();
    let [a, b] = rigs.as_slice() else { return None };
    for rig in [a, b] {
        let codes: Vec<&str> = rig.findings.iter().map(RigFinding::code).collect();
        println!("  split {seed}: {:?} {codes:?}", rig.verdict);
    }
    let (Some(cov_a), Some(cov_b)) = (&a.covariance, &b.covariance) else { return None };
    let mut found = BTreeMap::new();
    for pair in &a.pairs {
        let [i, j] = pair.of;
        let px = seen_by_both(&one, [i, j]);
        let places: Vec<_> = px.iter().step_by(px.len().div_ceil(80).max(1)).copied().collect();
        // Exact pixels of the places that the first half sees.
        let exact: Vec<[Point2<f64>; 2]> = places
            .iter()
            .filter_map(|px| {
                let point = a.rig.triangulate(&[(i, px[0]), (j, px[1])])?;
                let of = |camera: usize| {
                    a.rig.cameras[camera].project(&(a.rig.cam_from_rig[camera] * point))
                };
                Some([of(i)?, of(j)?])
            })
            .collect();
        if exact.len() < 6 {
            continue;
        }
        let base = a.rig.cam_from_cam(j, i);
        type Of<'a> = Box<dyn Fn(&Rig) -> Option<DVector<f64>> + 'a>;
        let points = |rig: &Rig| -> Option<Vec<nalgebra::Point3<f64>>> {
            exact
                .iter()
                .map(|px| Some(rig.cam_from_rig[i] * rig.triangulate(&[(i, px[0]), (j, px[1])])?))
                .collect()
        };
        let quantities: [(&'static str, Of<'_>); 5] = [
            (
                "rows",
                Box::new(|rig: &Rig| {
                    let of: Option<Vec<f64>> =
                        exact.iter().map(|px| rig.row_error_px([i, j], *px)).collect();
                    of.map(DVector::from_vec)
                }),
            ),
            ("base", Box::new(|rig: &Rig| Some(DVector::from_element(1, rig.baseline_m(i, j))))),
            (
                "turn",
                Box::new(|rig: &Rig| {
                    let turn = rig.cam_from_cam(j, i).rotation * base.rotation.inverse();
                    Some(DVector::from_iterator(3, turn.scaled_axis().iter().copied()))
                }),
            ),
            (
                "depth",
                Box::new(|rig: &Rig| {
                    points(rig)
                        .map(|all| DVector::from_iterator(all.len(), all.iter().map(|p| p.z)))
                }),
            ),
            (
                "length",
                Box::new(|rig: &Rig| {
                    points(rig).map(|all| {
                        let lengths = all.windows(2).map(|two| (two[0] - two[1]).norm());
                        DVector::from_iterator(all.len() - 1, lengths)
                    })
                }),
            ),
        ];
        for (name, of) in &quantities {
            let (Some(of_a), Some(of_b)) = (of(&a.rig), of(&b.rig)) else { continue };
            let sd = |rig: &Rig, cov: &DMatrix<f64>| covariance(rig, cov, of).map(|c| c.diagonal());
            let (Some(var_a), Some(var_b)) = (sd(&a.rig, cov_a), sd(&b.rig, cov_b)) else {
                continue;
            };
            let z = (0..of_a.len())
                .map(|k| (of_a[k] - of_b[k]) / (var_a[k] + var_b[k]).max(1e-30).sqrt());
            found.insert((i, j, *name), z.collect());
        }
        let held = [(&a.rig, &two), (&b.rig, &one)].map(|(rig, other)| {
            let rows = seen_by_both(other, [i, j]);
            let errors: Vec<f64> =
                rows.iter().filter_map(|px| rig.row_error_px([i, j], *px)).collect();
            (errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt()
        });
        found.insert((i, j, "held"), held.to_vec());
    }
    Some(Halves(found))
}

/// Rows of four instants with lenses from others, against the rig of the rest: root mean square in
/// pixels, and over what both state.
fn print_known(cameras: &[RigViews], board: &Board, count: usize) {
    use rand::{SeedableRng, seq::SliceRandom};
    let common: Vec<u64> = {
        let has = |camera: &RigViews, number| camera.views.iter().any(|(it, _)| *it == number);
        let first = cameras[0].views.iter().map(|(number, _)| *number);
        first.filter(|number| cameras.iter().all(|camera| has(camera, *number))).collect()
    };
    let (mut off, mut z) = (Vec::new(), Vec::new());
    for seed in 0..SPLITS {
        let mut numbers = common.clone();
        numbers.shuffle(&mut rand_chacha::ChaCha8Rng::seed_from_u64(50 + seed));
        let (own, rest) = numbers.split_at(numbers.len() * 2 / 5);
        let Some((four, rest)) = rest.split_at_checked(4) else { return };
        let part = |kept: &[u64]| -> Vec<RigViews> {
            let views = |camera: &RigViews| {
                camera.views.iter().filter(|(it, _)| kept.contains(it)).cloned().collect()
            };
            cameras.iter().map(|of| RigViews { views: views(of), ..of.clone() }).collect()
        };
        let mut shared = part(four);
        for (camera, own) in shared.iter_mut().zip(part(own)) {
            let views: Vec<_> = own.views.into_iter().map(|(_, corners)| corners).collect();
            let found = boresight_calibrate::calibrate(&views, board, own.image_size, &params());
            let Ok(found) = found else { return };
            let known = boresight_calibrate::KnownLens::new(&found.camera, &found.covariance_all);
            camera.known_lens = Some(known);
        }
        let rest = part(rest);
        let [Ok(a), Ok(b)] = [&shared, &rest].map(|of| calibrate_rig(of, board, &params())) else {
            continue;
        };
        let (Some(cov_a), Some(cov_b)) = (&a.covariance, &b.covariance) else { continue };
        for i in 0..count {
            for j in i + 1..count {
                let exact: Vec<_> = seen_by_both(&rest, [i, j])
                    .iter()
                    .step_by(20)
                    .filter_map(|px| {
                        let point = b.rig.triangulate(&[(i, px[0]), (j, px[1])])?;
                        let of = |camera: usize| {
                            b.rig.cameras[camera].project(&(b.rig.cam_from_rig[camera] * point))
                        };
                        Some([of(i)?, of(j)?])
                    })
                    .collect();
                let rows = |rig: &Rig| -> Option<DVector<f64>> {
                    let all: Option<Vec<f64>> =
                        exact.iter().map(|px| rig.row_error_px([i, j], *px)).collect();
                    all.map(DVector::from_vec)
                };
                let sd = |rig: &Rig, cov| covariance(rig, cov, &rows).map(|c| c.diagonal());
                let (Some(of_a), Some(of_b)) = (rows(&a.rig), rows(&b.rig)) else { continue };
                let (Some(var_a), Some(var_b)) = (sd(&a.rig, cov_a), sd(&b.rig, cov_b)) else {
                    continue;
                };
                for k in 0..of_a.len() {
                    off.push(of_a[k] - of_b[k]);
                    z.push((of_a[k] - of_b[k]) / (var_a[k] + var_b[k]).sqrt());
                }
            }
        }
    }
    let rms = |all: &[f64]| (all.iter().map(|it| it * it).sum::<f64>() / all.len() as f64).sqrt();
    println!("  four instants, known lenses: rows {:.4} px off, z {:.2}", rms(&off), rms(&z));
}

/// What is found if a camera is turned from an instant on.
fn print_planted(
    cameras: &[RigViews],
    board: &Board,
    rig: &RigCalibration,
    turn_deg: f64,
    seed: u64,
) {
    use rand::{RngExt, SeedableRng};
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(1000 + seed);
    let camera = rng.random_range(0..cameras.len());
    let numbers: Vec<u64> = rig.instants.iter().map(|instant| instant.number).collect();
    let at = numbers[rng.random_range(numbers.len() / 4..3 * numbers.len() / 4)];
    let axis = Vector3::new(rng.random_range(-1.0..1.0), rng.random_range(-1.0..1.0), 0.1);
    let turn =
        nalgebra::UnitQuaternion::from_scaled_axis(axis.normalize() * f64::to_radians(turn_deg));
    let mut planted = cameras.to_vec();
    let lens = &rig.rig.cameras[camera];
    let later = planted[camera].views.iter_mut().filter(|(number, _)| *number >= at);
    for corner in later.flat_map(|(_, corners)| corners) {
        let ray = lens.ray_from_px(&corner.px).map(|ray| turn * ray);
        if let Some(px) = ray.and_then(|ray| lens.project(&ray.into())) {
            corner.px = px;
        }
    }
    let found = calibrate_rig(&planted, board, &params());
    let findings = found.map(|rig| rig.findings);
    println!("  camera {camera} turned by {turn_deg}° from {at} on: {findings:?}");
}

/// Pixels of the corners that both cameras saw.
fn seen_by_both(cameras: &[RigViews], [i, j]: [usize; 2]) -> Vec<[Point2<f64>; 2]> {
    let second: BTreeMap<u64, &Vec<Corner>> =
        cameras[j].views.iter().map(|(number, corners)| (*number, corners)).collect();
    let both =
        cameras[i].views.iter().filter_map(|(number, one)| Some((one, *second.get(number)?)));
    both.flat_map(|(one, two)| {
        one.iter().zip(two).filter(|(a, b)| a.is_seen() && b.is_seen()).map(|(a, b)| [a.px, b.px])
    })
    .collect()
}

/// Covariance of a function of the rig by numeric derivatives.
fn covariance(
    rig: &Rig,
    all: &DMatrix<f64>,
    of: &dyn Fn(&Rig) -> Option<DVector<f64>>,
) -> Option<DMatrix<f64>> {
    let rows: Vec<usize> =
        (0..OF_CAMERA * rig.cameras.len()).filter(|row| all[(*row, *row)] > 0.0).collect();
    let columns = rows.iter().map(|row| {
        let step = 0.05 * all[(*row, *row)].sqrt();
        let at = |by: f64| of(&moved(rig, *row, by));
        Some((at(step)? - at(-step)?) / (2.0 * step))
    });
    let jacobian = DMatrix::from_columns(&columns.collect::<Option<Vec<_>>>()?);
    let part = DMatrix::from_fn(rows.len(), rows.len(), |i, j| all[(rows[i], rows[j])]);
    Some(&jacobian * part * jacobian.transpose())
}

fn moved(rig: &Rig, row: usize, by: f64) -> Rig {
    let mut rig = rig.clone();
    let (camera, i) = (row / OF_CAMERA, row % OF_CAMERA);
    if i < LENS_PARAMETERS {
        let mut parameters = rig.cameras[camera].lens_parameters();
        parameters[i] += by;
        rig.cameras[camera] = rig.cameras[camera].with_lens_parameters(&parameters);
    } else {
        let mut step = [Vector3::zeros(), Vector3::zeros()];
        step[(i - LENS_PARAMETERS) / 3][(i - LENS_PARAMETERS) % 3] = by;
        rig.cam_from_rig[camera] = Camera::moved(&rig.cam_from_rig[camera], &step[0], &step[1]);
    }
    rig
}

fn print_halves(halves: &[Halves], cameras: usize) {
    let rms =
        |values: &[f64]| (values.iter().map(|z| z * z).sum::<f64>() / values.len() as f64).sqrt();
    for i in 0..cameras {
        for j in i + 1..cameras {
            let mut line = format!("  {i}-{j}:");
            for name in ["rows", "base", "turn", "depth", "length"] {
                let all: Vec<f64> = halves
                    .iter()
                    .flat_map(|of| of.0.get(&(i, j, name)))
                    .flatten()
                    .copied()
                    .collect();
                let inside =
                    all.iter().filter(|z| z.abs() < 1.96).count() as f64 / all.len() as f64;
                line += &format!(" {name} z {:.2} in {inside:.2};", rms(&all));
            }
            let held: Vec<f64> =
                halves.iter().flat_map(|of| of.0.get(&(i, j, "held"))).flatten().copied().collect();
            println!("{line} held-out rows {:.4} px", rms(&held));
        }
    }
}
