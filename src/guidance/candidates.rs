//! Which reflected pair of poses is best once the plan's slots are used up? Source: `docs/method.md`, section 3.4.
//!
//! Candidates are judged *in reflected pairs*: that keeps the precision of a greedy choice, and a lens model
//! that is too simple pulls the principal point two to three times less.

use nalgebra::{Isometry3, Vector2};

use super::{
    information::{pair_information, reflected},
    params::GuidanceParams,
    view::{LensEstimate, View},
    wanted_pose::{WantedPose, place_board, seen_px},
    worth::Knowledge,
};
use crate::{
    board::Checkerboard,
    geometry::{BoardOutline, coverage, open_corners},
};

/// Directions searched over the full turn.
const DIRECTIONS: u32 = 32;
/// Places along the principal line that are searched for each direction and tilt.
const OFFSETS: usize = 3;

/// The feasible pose that, with its reflected partner, leaves the least expected variance in units of the goals
/// ([`Knowledge::variance`]), among directions that are independent of all accepted ones. `None` if no direction
/// is left or no candidate fits into the picture.
pub(super) fn most_informative_pair(
    accepted: &[View],
    board: &Checkerboard,
    lens_estimate: &LensEstimate,
    params: &GuidanceParams,
) -> Option<(WantedPose, Isometry3<f64>)> {
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

/// The feasible pose that, with its reflected partner, covers most of the picture's cells that no view has
/// covered, because the lens is extrapolated where no corner was seen. `None` if no pose covers more.
pub(super) fn most_covering_pair(
    accepted: &[View],
    board: &Checkerboard,
    lens_estimate: &LensEstimate,
    params: &GuidanceParams,
) -> Option<(WantedPose, Isometry3<f64>)> {
    let size = lens_estimate.image_size;
    let wanted = candidates(accepted, lens_estimate, params);
    best_covering_pair(accepted, board, (lens_estimate, params), &wanted, |all| coverage(all, size))
}

/// As [`most_covering_pair`], but what reaches the corners of the picture comes first.
pub(super) fn corner_covering_pair(
    accepted: &[View],
    board: &Checkerboard,
    lens_estimate: &LensEstimate,
    params: &GuidanceParams,
) -> Option<(WantedPose, Isometry3<f64>)> {
    let size = lens_estimate.image_size;
    // A pair in opposite corners, smaller the farther it's from the middle.
    let size_px = Vector2::new(f64::from(size.width_px), f64::from(size.height_px));
    let shifts = [0.12, 0.17, 0.22].into_iter().flat_map(|share| {
        [Vector2::new(share, share), Vector2::new(share, -share)]
            .map(|shift| size_px.component_mul(&shift))
    });
    let straight = candidates(accepted, lens_estimate, params);
    let towards_corners = shifts.flat_map(|offset_px| {
        let along = straight.iter().step_by(OFFSETS);
        along.map(move |wanted| WantedPose { offset_px, ..*wanted })
    });
    let wanted: Vec<WantedPose> = towards_corners.chain(straight.iter().copied()).collect();
    best_covering_pair(accepted, board, (lens_estimate, params), &wanted, |all| {
        let closed = open_corners(all, size).into_iter().filter(|open| !open).count();
        closed as f64 + coverage(all, size)
    })
}

/// The feasible pose whose view, with its reflection, gives the highest `score` of all outlines; `None` if none gives
/// more than there is.
fn best_covering_pair(
    accepted: &[View],
    board: &Checkerboard,
    (lens_estimate, params): (&LensEstimate, &GuidanceParams),
    wanted: &[WantedPose],
    score: impl Fn(&[BoardOutline]) -> f64,
) -> Option<(WantedPose, Isometry3<f64>)> {
    let mut outlines: Vec<BoardOutline> = accepted
        .iter()
        .filter_map(|view| {
            let corners: Vec<_> = view.corners.iter().map(|corner| corner.px).collect();
            BoardOutline::of(&corners, board.columns())
        })
        .collect();
    let taken = outlines.len();
    let mut most = score(&outlines);
    let mut best = None;
    for wanted in wanted {
        let Some(pose) = place_board(wanted, board, lens_estimate, params) else { continue };
        let pair = [pose, reflected(&pose)];
        outlines.truncate(taken);
        outlines.extend(pair.iter().filter_map(|pose| {
            BoardOutline::of(&seen_px(pose, board, lens_estimate), board.columns())
        }));
        let now = score(&outlines);
        if now > most {
            most = now;
            best = Some((*wanted, pose));
        }
    }
    best
}

/// Directions all round, three tilts, centred and shifted along the principal line.
fn candidates(
    accepted: &[View],
    lens_estimate: &LensEstimate,
    params: &GuidanceParams,
) -> Vec<WantedPose> {
    let reach_px = 0.16 * f64::from(lens_estimate.image_size.width_px);
    // A person misses the direction by some degrees; leave room so that the view still counts.
    let spare_rad = 0.1 * params.independent_rad;
    let tilt_rad = params.wanted_tilt_rad(lens_estimate.f_to_width());
    let tilts_rad = [-10.0_f64, 0.0, 10.0]
        .map(|more| (tilt_rad + more.to_radians()).clamp(params.min_tilt_rad, params.max_tilt_rad));
    let mut wanted = Vec::new();
    for step in 0..DIRECTIONS {
        let tilt_azimuth_rad = f64::from(step) * 2.0 * std::f64::consts::PI / f64::from(DIRECTIONS);
        let free = accepted.iter().all(|view| {
            let off = (view.tilt_azimuth_rad() - tilt_azimuth_rad).sin().abs().asin();
            off >= params.independent_rad + spare_rad
        });
        if !free {
            continue;
        }
        let (sin, cos) = tilt_azimuth_rad.sin_cos();
        for tilt_rad in tilts_rad {
            let along: [f64; OFFSETS] = [-reach_px, 0.0, reach_px];
            for along_px in along {
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
