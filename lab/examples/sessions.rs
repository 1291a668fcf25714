//! Is the verdict true? Simulated sessions with known truth: lenses in and out of the models,
//! corners' errors of several kinds, ordinary boards, and sometimes a flaw. No picture is drawn.
//!
//! ```text
//! sessions COUNT [FIRST [each | FLAW [TIMES]]]
//! ```
//!
//! `each` prints a line for every session. A flaw's name gives all sessions the flaw, TIMES as
//! large, and prints how often its cause is named, by size.

mod best_turn;
mod outlines;

use std::{borrow::Borrow, collections::BTreeMap, f64::consts::TAU, sync::Mutex, thread};

use best_turn::{differences_px, rms_px};
use boresight_calibrate::{CalibrationParams, FindingCode, Severity, Verdict, calibrate};
use boresight_geometry::{Camera, Corner, Distortion, LensKind, boards::Board, frame::ImageSize};
use nalgebra::{
    Cholesky, DMatrix, DVector, Isometry3, Point2, Point3, Translation3, UnitQuaternion, Vector2,
    Vector3,
};
use outlines::outlines;
use rand::{Rng, RngExt, SeedableRng, seq::IndexedRandom};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal, StudentT};

const SIZES: [(u32, u32); 4] = [(640, 480), (1280, 720), (1920, 1080), (720, 1280)];
const BOARDS: [(u16, u16); 4] = [(7, 5), (9, 6), (11, 8), (10, 7)];
const SQUARE_M: f64 = 0.025;
/// Minimum distance of a measured corner from the picture's edge.
const EDGE_PX: f64 = 5.0;

const LENSES: [&str; 8] =
    ["pinhole", "brown", "tangential", "decentred", "tilted", "fov", "division", "fisheye"];
/// Lenses outside all models.
const OUTSIDE: [&str; 4] = ["decentred", "tilted", "fov", "division"];
const NOISES: [&str; 4] = ["independent", "correlated", "per view", "heavy tails"];
const FLAWS: [&str; 8] =
    ["none", "print", "bend", "pixels", "shutter", "focus", "breathing", "two cameras"];
/// Right causes for a finding, by flaw; any of them counts.
const RIGHT: [&[&str]; 8] = [
    &[],
    &["BOARD-STRETCHED", "PIXELS-NOT-SQUARE"],
    &["BOARD-BENT"],
    &["BOARD-STRETCHED", "PIXELS-NOT-SQUARE"],
    &["ROLLING-SHUTTER"],
    &["FOCUS-MOVED", "FOCAL-VARIES"],
    &["FOCUS-MOVED", "FOCAL-VARIES"],
    &["VIEWS-MIXED"],
];
/// Ordinary imperfections of boards: a little stretched, and bent.
const STRETCHED: [&str; 2] = ["BOARD-STRETCHED", "PIXELS-NOT-SQUARE"];
/// Rows of a table of sizes.
const SHARES: usize = 5;
/// Bend beyond which any session may name the bend.
const BENT_M: f64 = 5e-5;
const CAUSES: [&str; 11] = [
    "FOCUS-MOVED",
    "VIEWS-MIXED",
    "PIXELS-NOT-SQUARE",
    "PIXELS-SKEWED",
    "BOARD-STRETCHED",
    "BOARD-BENT",
    "BOARD-FLEXES",
    "ROLLING-SHUTTER",
    "PICTURE-SHIFTED",
    "LENS-OTHER",
    "FOCAL-VARIES",
];

/// A lens: a camera, and its deviation from the models.
#[derive(Clone, Copy)]
struct Lens {
    camera: Camera,
    shape: Shape,
}

#[derive(Clone, Copy)]
enum Shape {
    OfCamera,
    /// Distortion centre beside the principal point, in units of f.
    Decentred(Vector2<f64>),
    /// Tilted sensor: `x / (1 + t·x)`.
    Tilted(Vector2<f64>),
    /// `atan(g r)/g`.
    Fov(f64),
    /// `r = d/(1 + λ d²)`.
    Division(f64),
}

impl Lens {
    fn project(&self, point: &Point3<f64>) -> Option<Point2<f64>> {
        let Camera { f_px, pp_px, .. } = self.camera;
        if let Shape::OfCamera = self.shape {
            return self.camera.project(point);
        }
        let x = point.xy().coords / point.z;
        let r = x.norm();
        let seen = match self.shape {
            _ if point.z <= 0.0 => return None,
            Shape::Decentred(off) => {
                let off_px = off.component_mul(&f_px);
                let centred = Camera { pp_px: pp_px + off_px, ..self.camera };
                return Some(centred.px_from_normalized(&Point2::from(x - off)));
            }
            Shape::Tilted(tilt) => {
                let flat = self.camera.px_from_normalized(&Point2::from(x)) - pp_px;
                return Some(pp_px + flat / (1.0 + tilt.dot(&flat.component_div(&f_px))));
            }
            Shape::Fov(g) => x * (libm::atan(g * r) / (g * r).max(1e-12)),
            Shape::Division(by) => {
                let d = 2.0 * r / (1.0 + (1.0 - 4.0 * by * r * r).sqrt());
                x * (d / r.max(1e-12))
            }
            Shape::OfCamera => x,
        };
        Some(pp_px + seen.component_mul(&f_px))
    }
}

/// A lens of the family, with the angle in radians slightly beyond the picture's corner.
fn lens(family: &str, size: ImageSize, rng: &mut ChaCha8Rng) -> (Lens, f64) {
    let (width, height) = (f64::from(size.width_px), f64::from(size.height_px));
    let (longest, half) = (width.max(height), 0.5 * libm::hypot(width, height));
    loop {
        let off = Vector2::from_fn(|_, _| 0.015 * longest * normal(rng));
        let share = libm::exp(rng.random_range(libm::log(0.55)..libm::log(1.6)));
        let mut camera = Camera::pinhole(share * longest, size.centre_px() + off);
        let edge = 1.08 * half / camera.f_px.x;
        // Displacement of the corner, as a share of its height.
        let pull = if rng.random_range(0.0..1.0) < 0.8 { -1.0 } else { 0.25 }
            * rng.random_range(0.01..0.2);
        let browns = Distortion {
            k1: 1.4 * pull / edge.powi(2),
            k2: -0.4 * pull * rng.random_range(0.3..1.2) / edge.powi(4),
            ..Distortion::default()
        };
        let aside = Vector2::from_fn(|_, _| normal(rng));
        let shape = match family {
            "brown" | "tangential" | "decentred" | "tilted" => {
                camera.distortion = browns;
                match family {
                    "tangential" => {
                        (camera.distortion.p1, camera.distortion.p2) =
                            (1e-3 * aside.x, 1e-3 * aside.y);
                        Shape::OfCamera
                    }
                    "decentred" => Shape::Decentred(aside * 0.01 * longest / camera.f_px.x),
                    "tilted" => Shape::Tilted(aside * 5e-3),
                    _ => Shape::OfCamera,
                }
            }
            "fov" => Shape::Fov((3.0 * pull.abs()).sqrt() / edge),
            "division" => Shape::Division(-pull.abs() / (edge * (1.0 - pull.abs())).powi(2)),
            "fisheye" => {
                let field = rng.random_range(0.8..1.5);
                camera.f_px = Vector2::repeat(half / field);
                camera.distortion = Distortion {
                    kind: LensKind::Fisheye,
                    k1: rng.random_range(-0.06..0.04),
                    k2: rng.random_range(-0.015..0.015),
                    ..Distortion::default()
                };
                Shape::OfCamera
            }
            _ => Shape::OfCamera,
        };
        let lens = Lens { camera, shape };
        // Up to the corner, points further from the axis must be imaged further out.
        let (mut last_px, mut angle) = (0.0, 0.0);
        while last_px < 1.1 * (half + off.norm()) && angle < 1.7 {
            angle += 0.01;
            let ray = Point3::new(libm::sin(angle), 0.0, libm::cos(angle));
            let seen_px = lens.project(&ray).map_or(0.0, |px| (px - camera.pp_px).norm());
            if seen_px <= last_px {
                break;
            }
            last_px = seen_px;
        }
        if last_px >= 1.1 * (half + off.norm()) {
            return (lens, angle);
        }
    }
}

fn normal(rng: &mut impl Rng) -> f64 {
    StandardNormal.sample(rng)
}

/// Kind and size of a session's flaw.
#[derive(Clone, Copy)]
struct Flaw {
    kind: usize,
    /// Relative: of the aspect, of the focal length.
    share: f64,
    bend_m: f64,
    shear_px: f64,
    /// First view after the change.
    from: usize,
    /// Offset of a second camera, in pixels.
    off_px: Vector2<f64>,
}

impl Flaw {
    /// Size: relative, or in metres or pixels.
    fn size(&self) -> f64 {
        [self.share, self.bend_m, self.shear_px].map(f64::abs).into_iter().fold(0.0, f64::max)
    }
}

struct Came {
    seed: u64,
    lens: usize,
    noise: usize,
    flaw: usize,
    size: f64,
    views: usize,
    error_px: f64,
    bound_px: f64,
    goal_px: f64,
    verdict: Verdict,
    /// True bend of the board.
    bend_m: f64,
    /// Named causes; those between which a finding can't tell.
    named: Vec<&'static str>,
    unclear: Vec<&'static str>,
    findings: Vec<&'static str>,
    model: String,
}

fn session(seed: u64, planted: Option<(usize, f64)>) -> Option<Came> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let rng = &mut rng;
    let (of_lens, of_noise) = (seed as usize % LENSES.len(), seed as usize / 8 % NOISES.len());
    let kind = if rng.random_range(0.0..1.0) < 0.5 { 0 } else { rng.random_range(1..FLAWS.len()) };
    let (kind, times) = planted.unwrap_or((kind, 1.0));
    let (width_px, height_px) = *SIZES.choose(rng)?;
    let size = ImageSize { width_px, height_px };
    let (columns, rows) = *BOARDS.choose(rng)?;
    let board = Board::new(columns, rows, SQUARE_M).ok()?;
    let (lens, widest) = lens(LENSES[of_lens], size, rng);
    let noise_px = libm::exp(rng.random_range(libm::log(0.03)..libm::log(0.3)))
        * f64::from(width_px.max(height_px))
        / 1280.0;
    let count = rng.random_range(8..25);
    let sign = if rng.random_range(0.0..1.0) < 0.5 { -1.0 } else { 1.0 };
    let flaw = Flaw {
        kind,
        share: sign
            * times
            * match FLAWS[kind] {
                "print" | "pixels" => rng.random_range(1e-3..5e-3),
                "focus" => rng.random_range(3e-3..2e-2),
                "breathing" => rng.random_range(5e-4..4e-3),
                "two cameras" => rng.random_range(0.01..0.1),
                _ => 0.0,
            },
        bend_m: sign
            * times
            * if FLAWS[kind] == "bend" { rng.random_range(3e-4..1.5e-3) } else { 0.0 },
        shear_px: times * if FLAWS[kind] == "shutter" { rng.random_range(1.0..6.0) } else { 0.0 },
        from: rng.random_range(count / 3..2 * count / 3),
        off_px: Vector2::from_fn(|_, _| 0.02 * f64::from(width_px) * normal(rng)),
    };
    let mut of_other: Vec<bool> = (0..count).map(|view| view >= flaw.from).collect();
    if rng.random_range(0.0..1.0) < 0.5 {
        rand::seq::SliceRandom::shuffle(of_other.as_mut_slice(), rng);
    }
    let (printed, bend_m) = printed(&board, &flaw, rng);
    let is_guided = rng.random_range(0.0..1.0) < 0.5;
    let (mut views, mut distances_m) = (Vec::new(), Vec::new());
    let errors = Errors::of(of_noise, noise_px, &board);
    for (view, is_others) in of_other.iter().enumerate() {
        let own = libm::exp(if NOISES[of_noise] == "per view" { 0.6 * normal(rng) } else { 0.0 });
        let shear_px = Vector2::from_fn(|_, _| flaw.shear_px * normal(rng));
        let seen = (0..200).find_map(|_| {
            let pose = pose(&lens, size, &board, widest, is_guided.then_some(view), rng);
            let see = |point: &Point3<f64>| -> Option<Point2<f64>> {
                let at = pose * point;
                let far = libm::atan2(at.xy().coords.norm(), at.z);
                let px = lens.project(&at).filter(|_| far < widest)?;
                let off = px - lens.camera.pp_px;
                let row = px.y / f64::from(height_px) - 0.5;
                let px = match FLAWS[flaw.kind] {
                    "pixels" => px + Vector2::new(0.0, flaw.share * off.y),
                    "shutter" => px + shear_px * row,
                    "focus" if view >= flaw.from => px + off * flaw.share,
                    "breathing" => px + off * (flaw.share * nearness(pose.translation.z)),
                    "two cameras" if *is_others => px + off * flaw.share + flaw.off_px,
                    _ => px,
                };
                let inside = |at: f64, end: u32| at > EDGE_PX && at < f64::from(end) - EDGE_PX;
                (inside(px.x, width_px) && inside(px.y, height_px)).then_some(px)
            };
            Some((printed.iter().map(see).collect::<Option<Vec<_>>>()?, pose.translation.z))
        });
        let (seen, distance_m) = seen?;
        distances_m.push(distance_m);
        let errors = errors.draw(own, rng);
        let corner =
            |(px, error): (&Point2<f64>, &Vector2<f64>)| Corner::isotropic(px + error, 0.05);
        views.push(seen.iter().zip(&errors).map(corner).collect::<Vec<_>>());
    }
    let found = calibrate(&views, &board, size, &CalibrationParams::default()).ok()?;
    let boards = outlines(&board, &views);
    let is_covered = |px: &Point2<f64>| boards.iter().any(|board| board.covers(px));
    // After a change of the camera, the truth is its final state or either; for a focus following
    // the board, its state in any view.
    let changes = match FLAWS[flaw.kind] {
        "breathing" => distances_m.into_iter().map(nearness).collect(),
        _ => vec![0.0, 1.0],
    };
    let truths = changes.into_iter().map(|changed| {
        move |point: &Point3<f64>| {
            let px = lens.project(point)?;
            let off = px - lens.camera.pp_px;
            Some(match FLAWS[flaw.kind] {
                "pixels" => px + Vector2::new(0.0, flaw.share * off.y),
                "focus" | "breathing" => px + off * (flaw.share * changed),
                "two cameras" => px + (off * flaw.share + flaw.off_px) * changed,
                _ => px,
            })
        }
    });
    let error_px = truths
        .filter_map(|truth| {
            Some(rms_px(&differences_px(&found.camera, &truth, size, &is_covered)?))
        })
        .fold(f64::INFINITY, f64::min);
    let unclear = found.findings.iter().filter_map(|finding| match finding.code {
        FindingCode::CauseUnclear { candidates, .. } => Some(candidates),
        _ => None,
    });
    let codes = |of: &dyn Fn(&str, Severity) -> bool| -> Vec<&'static str> {
        let all = found.findings.iter().map(|it| (it.code.code(), it.severity));
        all.filter(|(code, severity)| of(code, *severity)).map(|(code, _)| code).collect()
    };
    Some(Came {
        seed,
        lens: of_lens,
        noise: of_noise,
        flaw: kind,
        size: flaw.size(),
        views: count,
        error_px,
        bound_px: found.covered_bound_px?,
        goal_px: found.valid_area.goal_px,
        verdict: found.verdict,
        bend_m,
        named: codes(&|code, _| CAUSES.contains(&code)),
        unclear: unclear.flatten().flatten().collect(),
        findings: codes(&|_, severity| severity != Severity::Info),
        model: format!("{:?}", found.model),
    })
}

/// Share of the change at 30 cm shown by a focus following the board.
fn nearness(distance_m: f64) -> f64 {
    0.3 / distance_m
}

/// Printed and glued board, and the bend: ink 20 µm off, stretched squares, slightly bent.
fn printed(board: &Board, flaw: &Flaw, rng: &mut ChaCha8Rng) -> (Vec<Point3<f64>>, f64) {
    let of_print = if FLAWS[flaw.kind] == "print" { flaw.share } else { 2e-4 * normal(rng) };
    let bend_m = if FLAWS[flaw.kind] == "bend" { flaw.bend_m } else { 1e-4 * normal(rng) };
    let points = board.corners_in_board_m();
    let half_m = points.iter().map(|point| point.coords.norm()).fold(0.0, f64::max);
    let along = rng.random_range(0.0..TAU);
    let as_printed = points.iter().map(|point| {
        let u = (point.x * libm::cos(along) + point.y * libm::sin(along)) / half_m;
        let ink = Vector2::from_fn(|_, _| 2e-5 * normal(rng));
        Point3::new(point.x + ink.x, point.y * (1.0 + of_print) + ink.y, bend_m * (1.0 - u * u))
    });
    (as_printed.collect(), bend_m)
}

/// Hand-held pose: guided ones tilt in opposed directions.
fn pose(
    lens: &Lens,
    size: ImageSize,
    board: &Board,
    widest: f64,
    guided: Option<usize>,
    rng: &mut ChaCha8Rng,
) -> Isometry3<f64> {
    let (tilt_deg, azimuth): (f64, f64) = match guided {
        Some(view) => (
            42.0 + 4.0 * normal(rng),
            [0.0, 4.0, 2.0, 6.0, 1.0, 5.0, 3.0, 7.0][view % 8] * TAU / 8.0 + 0.07 * normal(rng),
        ),
        None => (rng.random_range(5.0..50.0), rng.random_range(0.0..TAU)),
    };
    let aside = if guided.is_some_and(|view| view < 8) { 0.15 } else { 0.75 };
    let (far, around) = (widest * aside * rng.random_range(0.0..1.0), rng.random_range(0.0..TAU));
    let ray = Vector3::new(
        libm::sin(far) * libm::cos(around),
        libm::sin(far) * libm::sin(around),
        libm::cos(far),
    );
    let facing = UnitQuaternion::rotation_between(&Vector3::z(), &ray).unwrap_or_default();
    let tilt = Vector3::new(libm::sin(azimuth), -libm::cos(azimuth), 0.0) * tilt_deg.to_radians();
    let roll = Vector3::z() * (0.15 * normal(rng));
    let turn =
        facing * UnitQuaternion::from_scaled_axis(tilt) * UnitQuaternion::from_scaled_axis(roll);
    let wide_m = (board.columns() - 1) as f64 * SQUARE_M;
    let fill = rng.random_range(0.25..0.8) * f64::from(size.width_px.min(size.height_px));
    let distance_m = lens.camera.f_px.x * wide_m / fill;
    Isometry3::from_parts(Translation3::from(ray * distance_m), turn)
}

/// Errors of the corners of a view.
struct Errors {
    kind: usize,
    noise_px: f64,
    /// Of errors shared by neighbours.
    shared: DMatrix<f64>,
}

impl Errors {
    fn of(kind: usize, noise_px: f64, board: &Board) -> Self {
        let points = board.corners_in_board_m();
        let half_m =
            points.iter().map(|point| point.x.abs().max(point.y.abs())).fold(0.0, f64::max);
        let shared = DMatrix::from_fn(points.len(), points.len(), |i, j| {
            let apart = (points[i] - points[j]).norm() / (0.6 * half_m);
            libm::exp(-0.5 * apart * apart) + if i == j { 1e-6 } else { 0.0 }
        });
        let shared = shared.cholesky().map_or_else(|| DMatrix::zeros(0, 0), Cholesky::unpack);
        Self { kind, noise_px, shared }
    }

    fn draw(&self, own: f64, rng: &mut ChaCha8Rng) -> Vec<Vector2<f64>> {
        let count = self.shared.nrows();
        let mut column = |of: &dyn Fn(&mut ChaCha8Rng) -> f64| {
            DVector::from_fn(count, |_, _| self.noise_px * own * of(rng))
        };
        let mut coordinate = || match NOISES[self.kind] {
            "correlated" => {
                0.6 * column(&|rng| normal(rng)) + &self.shared * (0.8 * column(&|rng| normal(rng)))
            }
            "heavy tails" => {
                column(&|rng| StudentT::new(3.0).map_or(0.0, |it| it.sample(rng) / 3.0_f64.sqrt()))
            }
            _ => column(&|rng| normal(rng)),
        };
        let (x, y) = (coordinate(), coordinate());
        x.iter().zip(&y).map(|(x, y)| Vector2::new(*x, *y)).collect()
    }
}

impl Came {
    fn is_inside(&self) -> bool {
        self.error_px <= self.bound_px
    }

    fn is_good(&self) -> bool {
        self.verdict == Verdict::Good
    }

    fn is_wrong(&self) -> bool {
        self.is_good() && self.error_px > 2.0 * self.bound_px
    }

    /// True if the camera changed after a while.
    fn is_of_two_lenses(&self) -> bool {
        ["focus", "two cameras"].contains(&FLAWS[self.flaw])
    }

    /// Causes named by findings but not present.
    fn false_causes(&self) -> impl Iterator<Item = &'static str> + '_ {
        let exists = |code: &str| {
            RIGHT[self.flaw].contains(&code)
                || STRETCHED.contains(&code)
                || (code == "BOARD-BENT" && self.bend_m.abs() >= BENT_M)
                || (code == "LENS-OTHER" && OUTSIDE.contains(&LENSES[self.lens]))
        };
        self.named.iter().copied().filter(move |code| !exists(code))
    }

    /// Comparison of the named causes with the flaw.
    fn told(&self) -> &'static str {
        if self.false_causes().next().is_some() {
            "false"
        } else if self.named.iter().any(|code| RIGHT[self.flaw].contains(code)) {
            "right"
        } else if self.unclear.is_empty() {
            "silent"
        } else {
            "not clear"
        }
    }
}

fn table<C: Borrow<Came>>(title: &str, all: &[C], names: &[&str], which: fn(&Came) -> usize) {
    println!(
        "\n| {title} | sessions | inside | GOOD / CARE / other | GOOD beyond 2 bounds | error / bound, median |"
    );
    println!("|---|---|---|---|---|---|");
    for (index, name) in names.iter().enumerate() {
        let these: Vec<&Came> =
            all.iter().map(Borrow::borrow).filter(|came| which(came) == index).collect();
        let count = |is: &dyn Fn(&Came) -> bool| these.iter().filter(|came| is(came)).count();
        let mut ratios: Vec<f64> = these.iter().map(|it| it.error_px / it.bound_px).collect();
        ratios.sort_by(f64::total_cmp);
        println!(
            "| {name} | {} | {:.1} % | {} / {} / {} | {} | {:.2} |",
            these.len(),
            100.0 * count(&Came::is_inside) as f64 / these.len().max(1) as f64,
            count(&Came::is_good),
            count(&|came| came.verdict == Verdict::Care),
            count(&|came| !matches!(came.verdict, Verdict::Good | Verdict::Care)),
            count(&Came::is_wrong),
            ratios.get(ratios.len() / 2).copied().unwrap_or(f64::NAN),
        );
    }
}

/// Frequency of naming the cause, by the flaw's size.
fn power(mut all: Vec<Came>) {
    println!("\n| size | sessions | named | not clear | inside | GOOD | GOOD beyond 2 bounds |");
    println!("|---|---|---|---|---|---|---|");
    all.sort_by(|a, b| a.size.total_cmp(&b.size));
    for these in all.chunks(all.len().div_ceil(SHARES).max(1)) {
        let count = |is: &dyn Fn(&Came) -> bool| these.iter().filter(|came| is(came)).count();
        println!(
            "| {:.2e} to {:.2e} | {} | {} | {} | {} | {} | {} |",
            these[0].size,
            these[these.len() - 1].size,
            these.len(),
            count(&|it| it.named.iter().any(|code| RIGHT[it.flaw].contains(code))),
            count(&|it| !it.unclear.is_empty()),
            count(&Came::is_inside),
            count(&Came::is_good),
            count(&Came::is_wrong),
        );
    }
}

fn main() -> anyhow::Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let count = arguments.first().map_or(Ok(200), |count| count.parse::<u64>())?;
    let first = arguments.get(1).map_or(Ok(0), |first| first.parse::<u64>())?;
    let times = arguments.get(3).map_or(Ok(1.0), |times| times.parse::<f64>())?;
    let flaw = arguments.get(2).and_then(|name| FLAWS.iter().position(|flaw| flaw == name));
    let planted = flaw.map(|flaw| (flaw, times));
    let (next, came) = (Mutex::new(first..first + count), Mutex::new(Vec::new()));
    let work = || {
        while let Some(seed) = next.lock().ok().and_then(|mut seeds| seeds.next()) {
            let of_seed = session(seed, planted);
            if let (Some(of_seed), Ok(mut came)) = (of_seed, came.lock()) {
                came.push(of_seed);
            }
        }
    };
    thread::scope(|scope| {
        let other = thread::Builder::new().name("sessions".into()).spawn_scoped(scope, work);
        work();
        drop(other);
    });
    let mut all = came.into_inner().unwrap_or_default();
    all.sort_by_key(|came| came.seed);
    for it in
        all.iter().filter(|it| arguments.get(2).is_some_and(|it| it == "each") || !it.is_inside())
    {
        println!(
            "{} {} {} {} {:.2e} {} views {} {:?} error {:.3} bound {:.3} goal {:.2} named {:?} unclear {:?} {:?}",
            it.seed,
            LENSES[it.lens],
            NOISES[it.noise],
            FLAWS[it.flaw],
            it.size,
            it.views,
            it.model,
            it.verdict,
            it.error_px,
            it.bound_px,
            it.goal_px,
            it.named,
            it.unclear,
            it.findings,
        );
    }
    println!("\n{} of {count} sessions have a result", all.len());
    table("flaw", &all, &FLAWS, |came| came.flaw);
    // No bound holds two lenses at once.
    let of_one: Vec<&Came> = all.iter().filter(|came| !came.is_of_two_lenses()).collect();
    table("one lens", &of_one, &["all"], |_| 0);
    table("one lens, by its family", &of_one, &LENSES, |came| came.lens);
    table("one lens, by the noise", &of_one, &NOISES, |came| came.noise);
    println!("\n| flaw | right | not clear | silent | false | false causes |");
    println!("|---|---|---|---|---|---|");
    for (flaw, name) in FLAWS.iter().enumerate() {
        let these = || all.iter().filter(|came| came.flaw == flaw);
        let told = |how: &str| these().filter(|came| came.told() == how).count();
        let mut instead = BTreeMap::new();
        for code in these().flat_map(Came::false_causes) {
            *instead.entry(code).or_insert(0) += 1;
        }
        println!(
            "| {name} | {} | {} | {} | {} | {instead:?} |",
            told("right"),
            told("not clear"),
            told("silent"),
            told("false")
        );
    }
    if planted.is_some() {
        power(all);
    }
    Ok(())
}
