//! Choice of the best reflected pair of poses once the plan's slots are used up. Source: `docs/method.md`, section 3.4.
//!
//! Candidates are judged *in reflected pairs*: that keeps the precision of a greedy choice, and a lens model
//! that is too simple pulls the principal point two to three times less.

use nalgebra::{Isometry3, Vector2};

use super::{
    information::pair_information,
    params::GuidanceParams,
    view::{LensEstimate, View},
    wanted_pose::{WantedPose, place_board},
    worth::Knowledge,
};
use boresight_geometry::board::Checkerboard;

/// A reflected pair, by one of its poses.
pub(super) type Pair = (WantedPose, Isometry3<f64>);

/// Directions searched over the full turn.
const DIRECTIONS: u32 = 32;

/// The feasible pose that, with its reflected partner, leaves the least expected variance in units of the goals
/// ([`Knowledge::variance`]), among directions that are independent of all accepted ones. `None` if no direction
/// is left or no candidate fits into the picture.
pub(super) fn most_informative_pair(
    accepted: &[View],
    board: &Checkerboard,
    lens_estimate: &LensEstimate,
    params: &GuidanceParams,
) -> Option<Pair> {
    let knowledge = Knowledge::new(accepted, board, lens_estimate, params);
    let mut best: Option<(f64, WantedPose, Isometry3<f64>)> = None;
    for wanted in candidates(accepted, lens_estimate, params) {
        let Some(pose) = place_board(&wanted, board, lens_estimate, params) else { continue };
        let Some(pair) = pair_information(&pose, board, &lens_estimate.camera) else { continue };
        let Some(variance) = knowledge.variance_with(&pair) else { continue };
        if best.as_ref().is_none_or(|(least, ..)| variance < *least) {
            best = Some((variance, wanted, pose));
        }
    }
    best.map(|(_, wanted, pose)| (wanted, pose))
}

/// Directions all round, three tilts, centred and shifted along the principal line.
pub(super) fn candidates(
    accepted: &[View],
    lens_estimate: &LensEstimate,
    params: &GuidanceParams,
) -> Vec<WantedPose> {
    let reach_px = 0.16 * f64::from(lens_estimate.image_size.width_px);
    let tilt_rad = params.wanted_tilt_rad(lens_estimate.f_to_width());
    let tilts_rad = [-10.0_f64, 0.0, 10.0]
        .map(|more| (tilt_rad + more.to_radians()).clamp(params.min_tilt_rad, params.max_tilt_rad));
    let mut wanted = Vec::new();
    for tilt_azimuth_rad in free_directions_rad(accepted, DIRECTIONS, params) {
        let (sin, cos) = tilt_azimuth_rad.sin_cos();
        for tilt_rad in tilts_rad {
            for along_px in [-reach_px, 0.0, reach_px] {
                let offset_px = Vector2::new(cos, sin) * along_px;
                wanted.push(WantedPose {
                    tilt_azimuth_rad,
                    tilt_rad,
                    offset_px,
                    is_reflected: true,
                });
            }
        }
    }
    wanted
}

/// Directions, of `steps` all round, that are independent of all accepted ones.
pub(super) fn free_directions_rad(
    accepted: &[View],
    steps: u32,
    params: &GuidanceParams,
) -> Vec<f64> {
    // A person misses the direction by some degrees; leave room so that the view still counts.
    let wanted_rad = params.independent_rad + 0.1 * params.independent_rad;
    let clear = |direction_rad: &f64| {
        let off_rad = |view: &View| (view.tilt_azimuth_rad() - direction_rad).sin().abs().asin();
        accepted.iter().all(|view| off_rad(view) >= wanted_rad)
    };
    let turn_rad = 2.0 * std::f64::consts::PI / f64::from(steps);
    (0..steps).map(|step| f64::from(step) * turn_rad).filter(clear).collect()
}
