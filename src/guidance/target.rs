//! Which pose next, and where its ghost stands on the screen.

use std::f64::consts::PI;

use nalgebra::{Isometry3, Point2};

use super::{
    independence::partner_of,
    information::{most_covering_pair, most_informative_pair},
    params::{GuidanceParams, Plan},
    slots::SLOTS_DEG,
    stop::Precision,
    view::{LensEstimate, View},
    wanted_pose::{WantedPose, place_board, seen_px},
};
use crate::board::Checkerboard;

/// Why a pose is asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case", tag = "purpose")]
pub enum Purpose {
    /// The opposed partner of an accepted view, by index.
    Partner {
        /// Index of that view.
        of: usize,
    },
    /// An empty slot of the plan.
    Slot,
    /// One view of the most informative reflected pair.
    MostInformative,
    /// One view of the reflected pair that covers most of the picture not yet covered.
    Coverage,
}

/// A pose to show.
#[derive(Clone, Debug, PartialEq)]
pub struct Target {
    /// See [`Purpose`].
    pub purpose: Purpose,
    /// Direction in the picture in which the board recedes, clockwise from the right.
    pub tilt_azimuth_rad: f64,
    /// Tilt of the board.
    pub tilt_rad: f64,
    /// Where every inner corner should appear, in numbering order, distorted as the lens shows it.
    pub ghost_px: Vec<Point2<f64>>,
}

/// The pose to ask for next: the partner of the newest view that has none, else the first empty slot, else
/// one view of the most informative reflected pair or, once only coverage is missing, of the pair that covers
/// most. Source: `docs/method.md`, section 3.4.
///
/// `None` if the plan has no further pose, or the board can't be placed in the picture as the limits ask.
pub fn next_target(
    accepted: &[View],
    board: &Checkerboard,
    lens_estimate: &LensEstimate,
    precision: Option<&Precision>,
    params: &GuidanceParams,
) -> Option<Target> {
    let unpaired = (0..accepted.len()).rev().find(|&index| partner_of(index, accepted).is_none());
    if let Some(of) = unpaired {
        return Some(partner_target(of, &accepted[of], lens_estimate));
    }
    let slots = params.plan.slots();
    let open = SLOTS_DEG[..slots]
        .iter()
        .find_map(|slot| free_direction_rad(slot.to_radians(), accepted, params));
    if let Some(tilt_azimuth_rad) = open
        && accepted.len() < slots
    {
        let wanted = WantedPose {
            tilt_azimuth_rad,
            tilt_rad: params.target_tilt_rad,
            span_fraction: params.target_span_fraction,
            along_px: 0.0,
        };
        return place_board(&wanted, board, lens_estimate, params)
            .map(|pose| target(Purpose::Slot, &wanted, &pose, board, lens_estimate));
    }
    if params.plan != Plan::Adaptive {
        return None;
    }
    let only_coverage = precision.is_some_and(|precision| {
        precision.trusted && !precision.covered && precision.is_reached(params)
    });
    let (purpose, (wanted, pose)) = if only_coverage {
        (Purpose::Coverage, most_covering_pair(accepted, board, lens_estimate, params)?)
    } else {
        (Purpose::MostInformative, most_informative_pair(accepted, board, lens_estimate, params)?)
    };
    Some(target(purpose, &wanted, &pose, board, lens_estimate))
}

/// The direction nearest to a slot that is independent of all accepted principal lines, with a tenth of the
/// limit to spare because a person misses it by some degrees; `None` if the slot is taken.
fn free_direction_rad(slot_rad: f64, accepted: &[View], params: &GuidanceParams) -> Option<f64> {
    let wanted_rad = 1.1 * params.independent_rad;
    let steps = 6;
    (0..=2 * steps)
        .map(|i| {
            // 0, +1, −1, +2, −2, … steps away from the slot.
            let away = f64::from((i + 1) / 2) * if i % 2 == 1 { 1.0 } else { -1.0 };
            slot_rad + away * params.max_slot_error_rad / f64::from(steps)
        })
        .find(|direction_rad| {
            accepted.iter().all(|view| {
                (view.tilt_azimuth_rad() - direction_rad).sin().abs().asin() >= wanted_rad
            })
        })
        .map(|direction_rad| direction_rad.rem_euclid(2.0 * PI))
}

/// The point reflection about the principal point of the view *as accepted*, not as asked for: `R' = ZRZ`,
/// `t' = Zt`, `Z = diag(−1, −1, 1)`. Exact in the picture for every radially symmetric lens.
fn partner_target(of: usize, view: &View, lens_estimate: &LensEstimate) -> Target {
    let pp = lens_estimate.camera.pp_px;
    Target {
        purpose: Purpose::Partner { of },
        tilt_azimuth_rad: (view.tilt_azimuth_rad() + PI).rem_euclid(2.0 * PI),
        tilt_rad: view.tilt_rad.unwrap_or(0.0),
        ghost_px: view
            .corners
            .iter()
            .rev()
            .map(|corner| Point2::from(pp.coords * 2.0 - corner.px.coords))
            .collect(),
    }
}

fn target(
    purpose: Purpose,
    wanted: &WantedPose,
    cam_from_board: &Isometry3<f64>,
    board: &Checkerboard,
    lens_estimate: &LensEstimate,
) -> Target {
    let ghost_px = seen_px(cam_from_board, board, lens_estimate);
    let WantedPose { tilt_azimuth_rad, tilt_rad, .. } = *wanted;
    Target { purpose, tilt_azimuth_rad, tilt_rad, ghost_px }
}
