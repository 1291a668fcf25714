//! Calibrations of many lenses, noises and numbers of views: the true error stays inside the stated
//! bound, and no wrong result is called good.
//!
//! `BORESIGHT_SESSIONS=1000` runs all of them.

use boresight_calibrate::{Calibration, CalibrationParams, Verdict, calibrate};
use boresight_geometry::{Camera, Distortion, LensKind, cell_centres_px};
use boresight_testkit::trust::{SIZE, Scene, board};
use nalgebra::{Matrix2x3, Matrix3, Point2, Point3, UnitQuaternion, Vector2, Vector3};
use rand::RngExt;

/// A possible lens of a camera, in the models or not.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Lens {
    /// Of OpenCV's model.
    Polynomial(Distortion),
    /// Radial with k1 and k2, about a centre beside the principal point.
    OffCentre(Distortion, f64),
    /// `r = atan(2 r tan(ω/2))/ω`, scaled to 1 in the middle.
    Fov(f64),
    /// Barrel inside, pincushion outside: r², r⁴, r⁶, r⁸.
    Mustache([f64; 4]),
}

pub(crate) const POLYNOMIAL: Distortion = Distortion {
    kind: LensKind::Perspective,
    k1: 0.0,
    k2: 0.0,
    p1: 0.0,
    p2: 0.0,
    k3: 0.0,
    k4: 0.0,
    k5: 0.0,
    k6: 0.0,
};

const LENSES: [(&str, Lens); 9] = [
    ("none", Lens::Polynomial(POLYNOMIAL)),
    ("k1", Lens::Polynomial(Distortion { k1: -0.12, ..POLYNOMIAL })),
    ("k1k2", Lens::Polynomial(Distortion { k1: -0.28, k2: 0.1, ..POLYNOMIAL })),
    ("k1k2k3", Lens::Polynomial(Distortion { k1: -0.3, k2: 0.2, k3: -0.1, ..POLYNOMIAL })),
    (
        "tangential",
        Lens::Polynomial(Distortion { k1: -0.2, k2: 0.08, p1: 1e-3, p2: -7e-4, ..POLYNOMIAL }),
    ),
    ("centre 10 px off", Lens::OffCentre(Distortion { k1: -0.2, k2: 0.08, ..POLYNOMIAL }, 10.0)),
    ("centre 40 px off", Lens::OffCentre(Distortion { k1: -0.2, k2: 0.08, ..POLYNOMIAL }, 40.0)),
    ("fov", Lens::Fov(0.8)),
    ("mustache", Lens::Mustache([-0.15, 0.25, -0.05, -0.08])),
];

pub(crate) fn px(camera: &Camera, lens: &Lens, in_cam: &Point3<f64>) -> Point2<f64> {
    let ideal = Point2::new(in_cam.x / in_cam.z, in_cam.y / in_cam.z);
    let f_px = camera.f_px.x;
    match *lens {
        Lens::Polynomial(distortion) => Camera { distortion, ..*camera }.px_from_normalized(&ideal),
        Lens::OffCentre(distortion, off_px) => {
            let off = Vector2::new(off_px * 0.8, -off_px * 0.6);
            let centre = Camera { distortion, pp_px: camera.pp_px + off, ..*camera };
            centre.px_from_normalized(&(ideal - off / f_px))
        }
        Lens::Fov(omega) => {
            let (r, slope) = (ideal.coords.norm(), 2.0 * (omega / 2.0).tan());
            let scale = if r < 1e-9 { 1.0 } else { (r * slope).atan() / (slope * r) };
            camera.pp_px + ideal.coords * (scale * f_px)
        }
        Lens::Mustache(k) => {
            let r2 = ideal.coords.norm_squared();
            let scale = 1.0 + r2 * (k[0] + r2 * (k[1] + r2 * (k[2] + r2 * k[3])));
            camera.pp_px + ideal.coords * (scale * f_px)
        }
    }
}

/// Best-fitting rotation of the found camera over the grid of the picture, and the remaining root
/// mean square distance per axis between both cameras.
pub(crate) fn best_turn(
    camera: &Camera,
    lens: &Lens,
    found: &Camera,
) -> Option<(UnitQuaternion<f64>, f64)> {
    let seen: Vec<(Point2<f64>, Vector3<f64>)> = cell_centres_px(SIZE)
        .filter_map(|px| found.normalized_from_px(&px).map(|ideal| (px, ideal.to_homogeneous())))
        .collect();
    let mut turn = UnitQuaternion::identity();
    let mut error = f64::INFINITY;
    for _ in 0..8 {
        let (mut normal, mut pull, mut squares) = (Matrix3::zeros(), Vector3::zeros(), 0.0);
        for (at, ray) in &seen {
            let see = |turn: &UnitQuaternion<f64>| px(camera, lens, &Point3::from(turn * ray));
            let here = see(&turn);
            let column = |axis: usize| {
                let mut step = Vector3::zeros();
                step[axis] = 1e-6;
                (see(&(UnitQuaternion::from_scaled_axis(step) * turn)) - here) / 1e-6
            };
            let slope = Matrix2x3::from_columns(&[column(0), column(1), column(2)]);
            normal += slope.transpose() * slope;
            pull += slope.transpose() * (at - here);
            squares += (at - here).norm_squared();
        }
        error = (squares / (2.0 * seen.len() as f64)).sqrt();
        turn = UnitQuaternion::from_scaled_axis(normal.try_inverse()? * pull) * turn;
    }
    Some((turn, error))
}

struct Trial {
    lens: usize,
    views: usize,
    noise_px: f64,
    found: Calibration,
    error_px: f64,
    /// Of the principal point, in stated sds along the worse axis.
    pp_sigmas: f64,
}

fn trial(index: u64) -> Option<Trial> {
    let which = index as usize % LENSES.len();
    let lens = LENSES[which].1;
    let mut scene = Scene::ordinary(50_000 + index);
    scene.noise_px = 0.1 * 10_f64.powf(scene.rng.random_range(0.0..1.0));
    // Boards are drawn back until this lens, about the same everywhere, sees them whole.
    scene.camera.distortion = match lens {
        Lens::Polynomial(distortion) | Lens::OffCentre(distortion, _) => distortion,
        Lens::Fov(_) => Distortion { k1: -0.2, k2: 0.08, ..POLYNOMIAL },
        Lens::Mustache(_) => Distortion { k1: -0.05, ..POLYNOMIAL },
    };
    let views = scene.rng.random_range(4..17);
    let plan = scene.plan(views);
    let poses = scene.poses(&plan);
    let camera = scene.camera;
    let seen =
        scene.seen(&poses, |_, pose, p| px(&camera, &lens, &(pose * Point3::new(p.x, p.y, 0.0))));
    let found = calibrate(&seen, &board(), SIZE, &CalibrationParams::default()).ok()?;
    let off = found.camera.pp_px - camera.pp_px;
    let covariance = found.pp_covariance_px2();
    let pp_sigmas =
        (off.x / covariance[(0, 0)].sqrt()).abs().max((off.y / covariance[(1, 1)].sqrt()).abs());
    let (_, error_px) = best_turn(&camera, &lens, &found.camera)?;
    Some(Trial { lens: which, views, noise_px: scene.noise_px, found, error_px, pp_sigmas })
}

#[test]
fn the_true_error_is_inside_the_stated_bound() {
    let count: u64 =
        std::env::var("BORESIGHT_SESSIONS").ok().and_then(|n| n.parse().ok()).unwrap_or(180);
    let (mut inside, mut all, mut wrong_but_good) = (0, 0, 0);
    let mut jac_lens = [[0_u32; 3]; LENSES.len()];
    let mut by_verdict = [[0_u32; 2]; 3];
    for index in 0..count {
        let trial = trial(index).expect("calibrates");
        let bound_px = trial.found.projection_sd.bound_px;
        let is_inside = trial.error_px <= bound_px;
        let is_good = trial.found.verdict == Verdict::Good;
        let is_wrong = trial.pp_sigmas > 5.0 || trial.error_px > 3.0 * bound_px;
        all += 1;
        inside += u32::from(is_inside);
        jac_lens[trial.lens][0] += 1;
        jac_lens[trial.lens][1] += u32::from(is_inside);
        jac_lens[trial.lens][2] += u32::from(is_good);
        by_verdict[trial.found.verdict as usize][0] += 1;
        by_verdict[trial.found.verdict as usize][1] += u32::from(is_inside);
        if is_wrong {
            let codes: Vec<_> = trial.found.findings.iter().map(|f| f.code.code()).collect();
            println!(
                "wrong #{index} {} noise {:.2} views {}: {} {} error {:.2} bound {bound_px:.2} PP {:.1} sd {codes:?}",
                LENSES[trial.lens].0,
                trial.noise_px,
                trial.views,
                trial.found.verdict.code(),
                trial.found.model.code(),
                trial.error_px,
                trial.pp_sigmas,
            );
            wrong_but_good += u32::from(is_good);
        }
    }
    for ((name, _), [all, inside, good]) in LENSES.iter().zip(jac_lens) {
        println!(
            "{name:18} {all:4} inside {inside:4} ({:.1} %) good {good}",
            100.0 * f64::from(inside) / f64::from(all)
        );
    }
    println!("by verdict {by_verdict:?}");
    println!("inside {inside} of {all}, wrong but good {wrong_but_good}");
    assert_eq!(wrong_but_good, 0);
    let share = f64::from(inside) / f64::from(all);
    assert!((0.90..=0.99).contains(&share), "{share}");
}
