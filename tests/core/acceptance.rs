//! What a person is promised in their own unit holds: the true error of a length, and of projection, stays inside the
//! printed 95 % interval in 90 to 99 of 100 sessions, whatever the noise of the corners is like.
//!
//! `BORESIGHT_SESSIONS=1000` runs that many sessions of each kind of noise; a sample of them runs by default.

use boresight::{
    calibration::{
        Acceptance, AcceptanceGoal, Calibration, CalibrationParams, acceptance::acceptance,
        calibrate,
    },
    geometry::{Camera, Corner, Distortion},
};
use nalgebra::{
    DMatrix, DVector, Isometry3, Matrix2, Point2, Point3, Translation3, UnitQuaternion, Vector2,
    Vector3,
};
use rand::RngExt;

use crate::{
    trust::{Pose, SIZE, Scene, board},
    verdict_monte_carlo::{Lens, POLYNOMIAL, best_turn, px},
};

/// Lenses that the models contain, and one that they don't.
const LENSES: [(&str, Lens); 4] = [
    ("k1k2", Lens::Polynomial(Distortion { k1: -0.2, k2: 0.08, ..POLYNOMIAL })),
    ("k1k2k3", Lens::Polynomial(Distortion { k1: -0.3, k2: 0.2, k3: -0.05, ..POLYNOMIAL })),
    (
        "tangential",
        Lens::Polynomial(Distortion { k1: -0.2, k2: 0.08, p1: 5e-4, p2: -4e-4, k3: 0.0 }),
    ),
    ("fov", Lens::Fov(0.8)),
];

/// Noise of the corners of one view: a part that is independent from corner to corner, and a part that varies smoothly
/// over the picture, with correlation `exp(−d²/2ℓ²)` at distance d.
#[derive(Clone, Copy, Debug)]
struct Noise {
    name: &'static str,
    smooth_variance: f64,
    length_px: f64,
}

const NOISES: [Noise; 5] = [
    Noise { name: "independent", smooth_variance: 0.0, length_px: 1.0 },
    Noise { name: "60 px", smooth_variance: 1.0, length_px: 60.0 },
    Noise { name: "200 px", smooth_variance: 1.0, length_px: 200.0 },
    Noise { name: "half 60 px", smooth_variance: 0.5, length_px: 60.0 },
    Noise { name: "half 200 px", smooth_variance: 0.5, length_px: 200.0 },
];

/// Relative standard deviation of the board's square size.
const SCALE_SD: f64 = 1e-3;

/// Directions in which the boards recede, in opposed pairs.
const SLOTS_DEG: [f64; 4] = [67.5, 112.5, 157.5, 22.5];

/// Opposed pairs tilted by 40°, as large as fits, by a hand that errs.
fn poses(scene: &mut Scene, views: usize) -> Vec<Isometry3<f64>> {
    let mut poses = Vec::with_capacity(views);
    for pair in 0..views.div_ceil(2) {
        let pose = Pose {
            tilt_deg: 40.0 + scene.normal(3.0),
            slot_deg: SLOTS_DEG[pair % 4] + scene.normal(4.0),
            fill: 0.85 + scene.normal(0.03),
            off: [scene.normal(0.015), scene.normal(0.015)],
        };
        let first = scene.cam_from_board(&pose);
        // R' = Z R Z, t' = Z t with Z = diag(−1, −1, 1).
        let mut axis = first.rotation.scaled_axis();
        axis = Vector3::new(-axis.x, -axis.y, axis.z) + Vector3::from_fn(|_, _| scene.normal(0.05));
        let at = first.translation.vector;
        let mut away = Vector3::new(-at.x, -at.y, at.z * (1.0 + scene.normal(0.02)));
        away += Vector3::new(scene.normal(0.01), scene.normal(0.01), 0.0) * at.z;
        let rotation = UnitQuaternion::from_scaled_axis(axis);
        let mut second = Isometry3::from_parts(Translation3::from(away), rotation);
        while !scene.is_whole(&second) {
            second.translation.vector.z *= 1.02;
            second.translation.vector.x *= 0.97;
            second.translation.vector.y *= 0.97;
        }
        poses.extend([first, second]);
    }
    poses.truncate(views);
    poses
}

/// Corners with noise of standard deviation `scene.noise_px`, which is also what they claim.
fn seen(
    scene: &mut Scene,
    poses: &[Isometry3<f64>],
    lens: &Lens,
    noise: Noise,
) -> Vec<Vec<Corner>> {
    let board_m = board().corners_in_board_m();
    let camera = scene.camera;
    poses
        .iter()
        .map(|pose| {
            let exact: Vec<Point2<f64>> = board_m
                .iter()
                .map(|p| px(&camera, lens, &(pose * Point3::new(p.x, p.y, 0.0))))
                .collect();
            let count = exact.len();
            let covariance = DMatrix::from_fn(count, count, |i, j| {
                let apart = (exact[i] - exact[j]).norm() / noise.length_px;
                let own = if i == j { 1.0 - noise.smooth_variance + 1e-8 } else { 0.0 };
                own + noise.smooth_variance * (-0.5 * apart * apart).exp()
            });
            let factor = covariance.cholesky().expect("positive definite").l();
            let mut draw = || &factor * DVector::from_fn(count, |_, _| scene.normal(1.0));
            let (x, y) = (draw(), draw());
            let noise_px = scene.noise_px;
            (0..count)
                .map(|i| {
                    Corner::isotropic(exact[i] + noise_px * Vector2::new(x[i], y[i]), noise_px)
                })
                .collect()
        })
        .collect()
}

/// Normalised coordinates of a pixel under the true lens.
fn true_ray(camera: &Camera, lens: &Lens, at: &Point2<f64>) -> Point2<f64> {
    let see = |ray: &Point2<f64>| px(camera, lens, &Point3::new(ray.x, ray.y, 1.0));
    let pinhole = Camera::pinhole(camera.f_px.x, camera.pp_px);
    let start = camera.normalized_from_px(at).or_else(|| pinhole.normalized_from_px(at));
    let mut ray = start.expect("a pinhole sees everything");
    for _ in 0..50 {
        let here = see(&ray);
        let h = 1e-6;
        let slope = Matrix2::from_columns(&[
            (see(&(ray + Vector2::new(h, 0.0))) - here) / h,
            (see(&(ray + Vector2::new(0.0, h))) - here) / h,
        ]);
        ray += slope.try_inverse().expect("one to one") * (at - here);
    }
    assert!((see(&ray) - at).norm() < 1e-6, "no ray");
    ray
}

/// A session's promise and what is true.
struct Trial {
    lens: usize,
    /// True error over stated bound of a length, and of projection.
    length: f64,
    projection: f64,
    /// Stated bounds, in metres and pixels.
    bounds: [f64; 2],
    found: Calibration,
}

fn true_length_error_m(
    camera: &Camera,
    lens: &Lens,
    found: &Camera,
    judged: &Acceptance,
    scale: f64,
) -> f64 {
    let AcceptanceGoal::Length { length_m, at_m, .. } = judged.goal else { panic!("a length") };
    let [from_px, to_px] = judged.bound.expect("fits").place_px;
    let (from, towards) = (true_ray(camera, lens, &from_px), true_ray(camera, lens, &to_px));
    let to = from + (towards - from).normalize() * (length_m / at_m);
    let to_px = px(camera, lens, &Point3::new(to.x, to.y, 1.0));
    let ray = |px: &Point2<f64>| found.normalized_from_px(px).expect("in the field");
    at_m * (1.0 + scale) * (ray(&to_px) - ray(&from_px)).norm() - length_m
}

fn true_projection_error_px(
    camera: &Camera,
    lens: &Lens,
    found: &Camera,
    judged: &Acceptance,
) -> Option<f64> {
    let [at, _] = judged.bound.expect("sees the picture").place_px;
    let (turn, _) = best_turn(camera, lens, found)?;
    let ray = found.normalized_from_px(&at)?.to_homogeneous();
    Some((px(camera, lens, &Point3::from(turn * ray)) - at).norm())
}

fn trial(noise: Noise, index: u64) -> Trial {
    let which = index as usize % LENSES.len();
    let lens = LENSES[which].1;
    let mut scene = Scene::ordinary(90_000 + index);
    scene.noise_px = 0.05 * 8_f64.powf(scene.rng.random_range(0.0..1.0));
    scene.camera.distortion = match lens {
        Lens::Polynomial(distortion) => distortion,
        _ => Distortion { k1: -0.2, k2: 0.08, ..POLYNOMIAL },
    };
    let camera = scene.camera;
    let views = 2 * scene.rng.random_range(2..6);
    let poses = poses(&mut scene, views);
    let corners = seen(&mut scene, &poses, &lens, noise);
    let found =
        calibrate(&corners, &board(), SIZE, &CalibrationParams::default()).expect("calibrates");
    let judge =
        |goal, scale_sd| acceptance(goal, &found.camera, &found.covariance_all, SIZE, scale_sd);
    // A board that is wrong by its stated error, and another whose scale matters little.
    let scale = scene.normal(SCALE_SD);
    let (scale, scale_sd) =
        if index % 8 < 4 { (scale, SCALE_SD) } else { (0.1 * scale, 0.1 * SCALE_SD) };
    let at_m = scene.rng.random_range(0.5..4.0);
    let share = scene.rng.random_range(0.1..0.7);
    let length_m = share * f64::from(SIZE.width_px) / camera.f_px.x * at_m;
    let length = judge(AcceptanceGoal::Length { length_m, at_m, within_m: 1e-3 }, scale_sd);
    let projection = judge(AcceptanceGoal::Projection { px: 0.2 }, scale_sd);
    let bounds = [length, projection].map(|judged| judged.bound.expect("can be told").total);
    Trial {
        lens: which,
        length: true_length_error_m(&camera, &lens, &found.camera, &length, scale).abs()
            / bounds[0],
        projection: true_projection_error_px(&camera, &lens, &found.camera, &projection)
            .expect("sees the picture")
            / bounds[1],
        bounds,
        found,
    }
}

fn trials(noise: Noise, count: u64) -> Vec<Trial> {
    let threads = 2;
    std::thread::scope(|scope| {
        let parts: Vec<_> = (0..threads)
            .map(|part| {
                scope.spawn(move || {
                    (part..count)
                        .step_by(threads as usize)
                        .map(|i| trial(noise, i))
                        .collect::<Vec<_>>()
                })
            })
            .collect();
        parts.into_iter().flat_map(|part| part.join().expect("no panic")).collect()
    })
}

fn share(trials: &[Trial], is: impl Fn(&Trial) -> bool) -> f64 {
    trials.iter().filter(|trial| is(trial)).count() as f64 / trials.len() as f64
}

#[test]
fn printed_intervals_cover_the_true_error() {
    let count: u64 =
        std::env::var("BORESIGHT_SESSIONS").ok().and_then(|n| n.parse().ok()).unwrap_or(100);
    let mut wrong = Vec::new();
    for noise in NOISES {
        let mut trials = trials(noise, count);
        let [length, projection] =
            [share(&trials, |t| t.length <= 1.0), share(&trials, |t| t.projection <= 1.0)];
        trials.sort_by(|a, b| a.bounds[1].total_cmp(&b.bounds[1]));
        let median_px = trials[trials.len() / 2].bounds[1];
        println!(
            "{:12} {count} sessions: length {:.1} %, projection {:.1} % inside; median bound {median_px:.3} px; good {:.0} %",
            noise.name,
            100.0 * length,
            100.0 * projection,
            100.0 * share(&trials, |t| t.found.verdict == boresight::calibration::Verdict::Good),
        );
        for (which, (name, _)) in LENSES.iter().enumerate() {
            let of: Vec<&Trial> = trials.iter().filter(|t| t.lens == which).collect();
            let part = |is: &dyn Fn(&Trial) -> bool| {
                100.0 * of.iter().filter(|t| is(t)).count() as f64 / of.len() as f64
            };
            println!(
                "    {name:12} length {:.1} %, projection {:.1} %",
                part(&|t| t.length <= 1.0),
                part(&|t| t.projection <= 1.0)
            );
        }
        let mut codes = std::collections::BTreeMap::<&str, u32>::new();
        for trial in &trials {
            for finding in &trial.found.findings {
                *codes.entry(finding.code.code()).or_default() += 1;
            }
        }
        println!("    {codes:?}");
        // Three standard deviations of chance in a small sample.
        let slack = if count >= 500 { 0.0 } else { 3.0 * (0.05 / count as f64).sqrt() };
        for (what, share) in [("length", length), ("projection", projection)] {
            if !(0.90 - slack..=0.99 + slack).contains(&share) {
                wrong.push(format!("{} {what}: {share:.3}", noise.name));
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:?}");
}
