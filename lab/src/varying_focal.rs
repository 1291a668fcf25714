//! Effect of a focal length that changes between views. (Chuang et al. 2021.)

use nalgebra::{Point2, Vector2};

use super::{
    estimate::{View, adjusted, view},
    outcome::{Check, Claim, Figure, Outcome, Table, Verdict, Within},
    parallel,
    params::Params,
    setup::{Corners, Setup, chance},
    statistics,
};
use boresight_calibrate::LensModel;
use boresight_geometry::{Camera, PrincipalLine, intersect_weighted};
use boresight_present::chart::{Plot, Series};
use rand_distr::{Distribution, StandardNormal};

/// Standard deviations of the views' focal lengths, as shares.
const SHARES: [f64; 7] = [0.0, 0.0025, 0.005, 0.01, 0.02, 0.03, 0.05];
/// Errors of the principal point at 1 % and 3 %, `docs/method.md`, section 0: lines, bundle
/// adjustment.
const KNOWN: [(f64, f64, f64); 2] = [(0.01, 1.7, 4.0), (0.03, 1.8, 16.4)];

/// Draw: errors of the principal point by lines and by bundle adjustment, and of the focal lengths
/// per view, given the lines' principal point.
struct Draw {
    lines_px: f64,
    radial_px: f64,
    tangential_px: f64,
    f_percent: Vec<f64>,
}

const QUANTITIES: [&str; 4] =
    ["pp_lines_px", "pp_bundle_k1k2_px", "pp_bundle_k1k2p1p2_px", "f_per_view_percent"];

/// Runs the experiment with `params`.
pub fn outcome(params: &Params) -> Outcome {
    let mut table = Table::new(
        "varying_focal",
        &["sd_percent", "draws", "quantity", "rms", "median", "low", "high"],
    );
    // Root mean squares per quantity, a value per share.
    let mut curves: [Vec<(f64, f64)>; 4] = Default::default();
    for (which, share) in SHARES.iter().enumerate() {
        let draws: Vec<Draw> =
            parallel::map(params.focal_trials, |trial| draw(params, *share, which, trial))
                .into_iter()
                .flatten()
                .collect();
        let columns: [Vec<f64>; 4] = [
            draws.iter().map(|draw| draw.lines_px).collect(),
            draws.iter().map(|draw| draw.radial_px).collect(),
            draws.iter().map(|draw| draw.tangential_px).collect(),
            draws.iter().flat_map(|draw| draw.f_percent.iter().copied()).collect(),
        ];
        for (k, values) in columns.iter().enumerate() {
            let median = statistics::median(values).unwrap_or(f64::NAN);
            let (low, high) = statistics::median_interval(values).unwrap_or((f64::NAN, f64::NAN));
            let rms = statistics::rms(values).unwrap_or(f64::NAN);
            table.push(&[
                &(100.0 * share),
                &draws.len(),
                &QUANTITIES[k],
                &rms,
                &median,
                &low,
                &high,
            ]);
            curves[k].push((100.0 * share, rms));
        }
    }
    let at = |k: usize, share: f64| {
        let found = curves[k].iter().find(|(at, _)| *at == 100.0 * share);
        found.map_or(f64::NAN, |(_, rms)| *rms)
    };
    let mut checks = Vec::new();
    for (share, lines_px, bundle_px) in KNOWN {
        let what = |who: &str| {
            format!("f varies by {:.0} %, principal point by {who}: rms error (px)", 100.0 * share)
        };
        // 95 % interval of a root mean square of two coordinates per draw, and the reference's last
        // digit.
        let spread = |rms: f64| 1.96 * rms / (4.0 * params.focal_trials as f64).sqrt() + 0.05;
        let (lines, radial, tangential) = (at(0, share), at(1, share), at(2, share));
        checks.push(Check {
            what: what("lines"),
            reference: lines_px,
            measured: lines,
            within: Within::Interval(lines - spread(lines), lines + spread(lines)),
        });
        // The reference doesn't name the adjusted lens model.
        checks.push(Check {
            what: what("bundle adjustment, between k1 k2 and k1 k2 p1 p2"),
            reference: bundle_px,
            measured: 0.5 * (radial + tangential),
            within: Within::Interval(radial - spread(radial), tangential + spread(tangential)),
        });
    }
    let row = |k: usize| format!("{:.2}, {:.2}, {:.2}", at(k, 0.0), at(k, 0.01), at(k, 0.03));
    let holds = at(0, 0.03) < 1.5 * at(0, 0.0) && at(1, 0.03) > 3.0 * at(0, 0.03);
    let claim = Claim {
        claim: "The principal point from principal lines needs no common focal length; each view gives its own.".into(),
        measured: format!(
            "At 0, 1 and 3 % change the lines' PP errs by {} px, bundle adjustment with a common f by {} px (k1 k2) and {} px (k1 k2 p1 p2). Each view's own focal length errs by {} %.",
            row(0), row(1), row(2), row(3)
        ),
        verdict: if holds { Verdict::Holds } else { Verdict::Partly },
    };
    let [lines, radial, tangential, f] = curves;
    Outcome {
        name: "varying-focal".into(),
        title: "A focal length that changes between views".into(),
        method: format!(
            "Eight views about the optical axis, the board a quarter of the picture wide, f = {F_PX} px, corner noise {} px; each view's focal length is off by a normal share. Lines are intersected without a common focal length; bundle adjustment assumes one. {} draws a share.",
            params.noise_px, params.focal_trials
        ),
        claims: vec![claim],
        checks,
        tables: vec![table],
        figures: vec![
            Figure {
                name: "varying_focal".into(),
                caption: "Root mean square error of the principal point against the change of the focal length.".into(),
                svg: Plot::new("Principal point", "sd of f (%)", "rms error (px)", vec![
                    Series::line("principal lines", lines),
                    Series::line("bundle, k1 k2", radial),
                    Series::line("bundle, k1 k2 p1 p2", tangential),
                ]).svg(),
            },
            Figure {
                name: "varying_focal_f".into(),
                caption: "Root mean square error of each view's own focal length, which the lines give without any other view's.".into(),
                svg: Plot::new("Focal length of each view", "sd of f (%)", "rms error (%)", vec![Series::line("as seen", f)]).svg(),
            },
        ],
    }
}

const F_PX: f64 = 1400.0;

fn draw(params: &Params, share: f64, which: usize, trial: usize) -> Option<Draw> {
    let mut rng = chance(params.seed, 4000 + 100_000 * which as u64 + trial as u64);
    let mut setup = Setup::new(&params.setup, params.setup.square_m);
    let (width_px, height_px) = (1920, 1080);
    setup.image_size = boresight_geometry::frame::ImageSize { width_px, height_px };
    setup.camera = Camera::pinhole(F_PX, setup.image_size.centre_px() + Vector2::new(60.0, -40.0));
    setup.distance_m = 1.3;
    setup.tilt_rad = std::f64::consts::FRAC_PI_4;
    let noise = Corners::Noisy { sigma_px: params.noise_px };
    let mut focal_px = Vec::new();
    let views: Option<Vec<View>> = setup
        .slot_poses(&Vector2::zeros(), &Vector2::zeros())
        .iter()
        .map(|pose| {
            let change: f64 = StandardNormal.sample(&mut rng);
            let f_px = F_PX * (1.0 + share * change);
            focal_px.push(f_px);
            let own = Setup { camera: Camera::pinhole(f_px, setup.camera.pp_px), ..setup };
            let seen = noise.seen(&own.corners_px(pose)?, &mut rng);
            view(&setup.board, &seen, setup.image_size.centre_px(), params.noise_px)
        })
        .collect();
    let views = views?;
    let lines: Option<Vec<PrincipalLine>> = views.iter().map(|view| view.line.clone()).collect();
    let lines = lines?;
    let point = intersect_weighted(&lines).ok()?;
    let bundle = |model: LensModel| {
        Some(adjusted(&setup.board, &views, &setup.camera, model)?.state.camera.pp_px)
    };
    let (radial, tangential) = (bundle(LensModel::K1K2)?, bundle(LensModel::K1K2P1P2)?);
    let off = |px: Point2<f64>| (px - setup.camera.pp_px).norm();
    let f_percent = lines
        .iter()
        .zip(&focal_px)
        .filter_map(|(line, f_px)| {
            let seen = line.focal_length(&point.px, &point.covariance_px2).ok()?;
            Some(100.0 * (seen.f_px - f_px).abs() / f_px)
        })
        .collect();
    Some(Draw {
        lines_px: off(point.px),
        radial_px: off(radial),
        tangential_px: off(tangential),
        f_percent,
    })
}
