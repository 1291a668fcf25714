//! Choice of the best tilt.

use nalgebra::{Point2, Vector2};

use super::{
    estimate::{View, adjusted, view},
    outcome::{Claim, Figure, Outcome, Table, Verdict},
    parallel,
    params::Params,
    setup::{Corners, Setup, chance},
    statistics,
};
use boresight_calibrate::LensModel;
use boresight_geometry::{Camera, PrincipalLine, intersect_weighted, principal_line_and_ring};
use boresight_present::chart::{Plot, Series};

/// Errors of a draw: principal point by lines and by bundle adjustment, focal length by ring and by
/// bundle adjustment, as a share.
type Errors = [Option<f64>; 4];

const METHODS: [&str; 4] = ["pp_lines_px", "pp_bundle_px", "f_ring_percent", "f_bundle_percent"];

/// Runs the experiment with `params`.
pub fn outcome(params: &Params) -> Outcome {
    let tilts_deg: Vec<f64> = (1..=17).map(|k| 5.0 * f64::from(k)).collect();
    let mut table = Table::new(
        "tilt",
        &["tilt_deg", "quantity", "draws", "estimates", "rms_error", "worst_side_px"],
    );
    // Root mean square errors per method.
    let mut rms: [Vec<(f64, f64)>; 4] = Default::default();
    for tilt_deg in &tilts_deg {
        let setup = pinhole(params, tilt_deg.to_radians());
        let draws: Vec<Errors> = parallel::map(params.tilt_trials, |trial| {
            errors(&setup, params, trial).unwrap_or_default()
        });
        let side_px = narrowest_square_px(&setup);
        for (k, quantity) in METHODS.iter().enumerate() {
            let found: Vec<f64> = draws.iter().filter_map(|draw| draw[k]).collect();
            let value = statistics::rms(&found).unwrap_or(f64::NAN);
            table.push(&[tilt_deg, quantity, &draws.len(), &found.len(), &value, &side_px]);
            rms[k].push((*tilt_deg, value));
        }
    }
    let at = |k: usize, tilt_deg: f64| {
        rms[k].iter().find(|(at, _)| *at == tilt_deg).map_or(f64::NAN, |(_, value)| *value)
    };
    let best = |k: usize| {
        let finite = rms[k].iter().filter(|(_, value)| value.is_finite());
        finite.min_by(|a, b| a.1.total_cmp(&b.1)).copied().unwrap_or((f64::NAN, f64::NAN))
    };
    let within: Vec<f64> =
        [30.0, 35.0, 40.0, 45.0, 50.0].map(|tilt| at(1, tilt) / best(1).1).into();
    let worst = within.iter().copied().fold(0.0, f64::max);
    let steep = pinhole(params, 65_f64.to_radians());
    let plot = |name: &str, title: &str, y: &str, k: [usize; 2]| Figure {
        name: name.into(),
        caption: "Root mean square error over the draws; logarithmic scale.".into(),
        svg: Plot {
            log_y: true,
            ..Plot::new(
                title,
                "tilt (deg)",
                y,
                vec![
                    Series::line("principal lines (and ring)", rms[k[0]].clone()),
                    Series::line("bundle adjustment", rms[k[1]].clone()),
                ],
            )
        }
        .svg(),
    };
    Outcome {
        name: "tilt".into(),
        title: "Which tilt? (5° to 85°)".into(),
        method: format!(
            "Eight slots about the optical axis with the board of the setup brought to fill the picture, no distortion, corner noise {} px, {} draws per tilt.",
            params.noise_px, params.tilt_trials
        ),
        claims: vec![Claim {
            claim: "45° is the tilt to choose.".into(),
            measured: format!(
                "Between 30° and 50° the bundle's principal point is within a factor {worst:.2} of its best ({:.3} px at {:.0}°). At 10° the focal length is {:.0} times worse than at 45°; at 65° the squares are {:.0} % as wide as at 45°, which is what a detector has to live with.",
                best(1).1,
                best(1).0,
                at(3, 10.0) / at(3, 45.0),
                100.0 * narrowest_square_px(&steep)
                    / narrowest_square_px(&pinhole(params, 45_f64.to_radians()))
            ),
            verdict: if worst < 1.6 { Verdict::Holds } else { Verdict::Partly },
        }],
        checks: Vec::new(),
        tables: vec![table],
        figures: vec![
            plot("tilt_pp", "Principal point", "error (px)", [0, 1]),
            plot("tilt_f", "Focal length", "error (%)", [2, 3]),
        ],
    }
}

/// Setup without distortion, with the board spanning most of the picture's height.
fn pinhole(params: &Params, tilt_rad: f64) -> Setup {
    let setup = Setup::new(&params.setup, params.setup.square_m);
    let corners_m = setup.board.corners_in_board_m();
    let span_m = corners_m.iter().map(|m| m.coords.norm()).fold(0.0, f64::max) * 2.0;
    let height_px = f64::from(setup.image_size.height_px);
    let distance_m =
        setup.camera.f_px.x * span_m / (0.8 * height_px) + 0.5 * span_m * tilt_rad.sin();
    let camera = Camera::pinhole(setup.camera.f_px.x, setup.camera.pp_px);
    Setup { camera, tilt_rad, distance_m, ..setup }
}

fn errors(setup: &Setup, params: &Params, trial: usize) -> Option<Errors> {
    let mut rng = chance(params.seed, 3000 + trial as u64);
    let noise = Corners::Noisy { sigma_px: params.noise_px };
    let views: Option<Vec<View>> = setup
        .slot_poses(&Vector2::zeros(), &Vector2::zeros())
        .iter()
        .map(|pose| {
            let seen = noise.seen(&setup.corners_px(pose)?, &mut rng);
            view(&setup.board, &seen, setup.image_size.centre_px(), params.noise_px)
        })
        .collect();
    let views = views?;
    let (f_px, pp_px) = (setup.camera.f_px.x, setup.camera.pp_px);
    let lines: Vec<PrincipalLine> = views.iter().filter_map(|view| view.line.clone()).collect();
    let by_lines = (lines.len() == views.len()).then(|| intersect_weighted(&lines).ok()).flatten();
    let ring = principal_line_and_ring(&lines).ok();
    let bundle = adjusted(&setup.board, &views, &setup.camera, LensModel::K1K2)
        .filter(|bundle| bundle.converged)
        .map(|bundle| bundle.state.camera);
    let off = |px: Point2<f64>| (px - pp_px).norm();
    Some([
        by_lines.map(|point| off(point.px)),
        bundle.as_ref().map(|camera| off(camera.pp_px)),
        ring.map(|ring| 100.0 * (ring.f_px - f_px).abs() / f_px),
        bundle.map(|camera| 100.0 * (camera.f_px.x - f_px).abs() / f_px),
    ])
}

/// Smallest height of a square in the picture.
fn narrowest_square_px(setup: &Setup) -> f64 {
    let pose = setup.pose(0.0, &Vector2::zeros(), &Vector2::zeros());
    let Some(px) = setup.corners_px(&pose) else { return f64::NAN };
    px.iter()
        .zip(px.iter().skip(setup.board.columns()))
        .map(|(a, b)| (a - b).norm())
        .fold(f64::MAX, f64::min)
}
