//! Choice of the next pose, and its ghost on the screen.

use std::f64::consts::PI;

use nalgebra::{Isometry3, Point2, Vector2};

use super::{
    candidates::most_informative_pair,
    covering::{best_pair_beyond_edge, corner_covering_pair, most_covering_pair},
    independence::partner_of,
    information::reflected,
    params::{GuidanceParams, Plan},
    reach::{place_first, wanted_poses},
    slots::slots_deg,
    stop::Precision,
    view::{LensEstimate, View, bounds_px},
    wanted_pose::{WantedPose, place_board, seen_px},
    worth::pose_of,
};
use boresight_geometry::{Corner, board::Checkerboard, frame::ImageSize};

/// Angle between the second pair's lines and the first's: 45° and some degrees by which a person misses it. Two pairs
/// 41° apart are the closest that span the plane well enough for a verdict without a finding.
const SECOND_PAIR_RAD: f64 = 52.0 * PI / 180.0;
/// Distance by which a person misses a place near the picture's edge, as a share of the picture's shorter side.
const LEEWAY: f64 = 0.02;
/// Share of the largest board that fits below which an accepted view counts as small.
const SMALL: f64 = 0.6;

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
    /// View of the most informative reflected pair.
    MostInformative,
    /// View of the reflected pair that covers most of the picture not yet covered.
    Coverage,
    /// View of the reflected pair of boards that leave the picture, after which projection is known best in its
    /// corners.
    BeyondEdge,
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
    /// Pixels at which the inner corners should appear, in numbering order, distorted as the lens shows them.
    pub ghost_px: Vec<Point2<f64>>,
    /// True if a part of the board is wanted beyond the picture's edge.
    pub leaves_picture: bool,
}

impl Target {
    /// Larger of the shares of the picture's width and height that the ghost's corners in the picture span.
    pub fn span_fraction(&self, image_size: ImageSize) -> f64 {
        let ImageSize { width_px, height_px } = image_size;
        let last = Point2::new(f64::from(width_px) - 1.0, f64::from(height_px) - 1.0);
        let (low, high) = bounds_px(
            self.ghost_px
                .iter()
                .map(|px| Point2::new(px.x.clamp(0.0, last.x), px.y.clamp(0.0, last.y))),
        );
        ((high.x - low.x) / f64::from(width_px)).max((high.y - low.y) / f64::from(height_px))
    }
}

/// The pose to ask for next: the partner of the newest view that has none, else the first open slot, else one view of
/// the most informative reflected pair or, once only coverage is missing, of the pair that covers most. Source:
/// `docs/method.md`, section 3.4.
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
        return Some(partner_target(of, &accepted[of], board, lens_estimate, params));
    }
    // Boards at the picture's edge carry information that no others have, so they come before further directions.
    let wants_edge = params.plan == Plan::Adaptive
        && accepted.len() >= params.min_views
        && precision.is_some_and(|precision| {
            precision.trusted && precision.is_reached(params) && precision.lacks_corners(params)
        });
    if wants_edge {
        let params = params.for_coverage();
        let pair = best_pair_beyond_edge(accepted, board, lens_estimate, &params);
        if let Some((wanted, pose)) = pair {
            return Some(target(Purpose::BeyondEdge, &wanted, &pose, board, lens_estimate));
        }
        if precision.is_some_and(|precision| precision.covered) {
            return None;
        }
    }
    let slots = params.plan.slots();
    if accepted.len() < slots
        && let Some(tilt_azimuth_rad) = open_direction_rad(accepted, lens_estimate, params)
    {
        let wanted = wanted_poses(tilt_azimuth_rad, accepted.len() / 2, lens_estimate, params);
        return place_first(&wanted, board, lens_estimate, params)
            .map(|(wanted, pose)| target(Purpose::Slot, &wanted, &pose, board, lens_estimate));
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

/// Target for a person who wants more than the plan does: a view of the reflected pair that closes most of the
/// picture's corners that boards have hardly reached, and covers most of the rest; otherwise of the most informative
/// pair. The partner of a view that has none comes first.
///
/// `None` if no pose in a new direction fits.
pub fn covering_target(
    accepted: &[View],
    board: &Checkerboard,
    lens_estimate: &LensEstimate,
    params: &GuidanceParams,
) -> Option<Target> {
    let unpaired = (0..accepted.len()).rev().find(|&index| partner_of(index, accepted).is_none());
    if let Some(of) = unpaired {
        let partner = partner_target(of, &accepted[of], board, lens_estimate, params);
        let may_leave = partner.leaves_picture;
        let size = lens_estimate.image_size;
        return Some(if may_leave { partner } else { within_picture(partner, size, params) });
    }
    let (wanted, pose) = corner_covering_pair(accepted, board, lens_estimate, params)
        .or_else(|| most_informative_pair(accepted, board, lens_estimate, params))?;
    Some(target(Purpose::Coverage, &wanted, &pose, board, lens_estimate))
}

/// Direction of the first slot that is well clear of every accepted principal line, moved away from them if that helps;
/// otherwise of the first that is just clear. `None` once all slots are covered.
fn open_direction_rad(
    accepted: &[View],
    lens_estimate: &LensEstimate,
    params: &GuidanceParams,
) -> Option<f64> {
    let slots_rad = slots_deg(lens_estimate.image_size).map(f64::to_radians);
    let clear_by_rad = |direction_rad: f64| {
        let off_rad = |view: &View| (view.tilt_azimuth_rad() - direction_rad).sin().abs().asin();
        accepted.iter().map(off_rad).fold(f64::INFINITY, f64::min)
    };
    let steps = 6;
    // 0, +1, −1, +2, −2, … steps away from the slot.
    let away = |i: i32| f64::from((i + 1) / 2) * if i % 2 == 1 { 1.0 } else { -1.0 };
    let step_rad = params.max_slot_error_rad / f64::from(steps);
    let clear_by_at_least = |clear_rad: f64| {
        slots_rad
            .into_iter()
            .flat_map(|slot_rad| (0..=2 * steps).map(move |i| slot_rad + away(i) * step_rad))
            .find(|direction_rad| clear_by_rad(*direction_rad) >= clear_rad)
    };
    // A person misses a direction by some degrees; leave room so that the view still counts, and so that two pairs
    // still span the plane well.
    let second_rad = if accepted.len() <= 2 { SECOND_PAIR_RAD } else { 0.0 };
    let (well_rad, just_rad) = (1.5 * params.independent_rad, 1.1 * params.independent_rad);
    [second_rad.max(well_rad), well_rad, just_rad]
        .into_iter()
        .find_map(clear_by_at_least)
        .map(|direction_rad| direction_rad.rem_euclid(2.0 * PI))
}

/// Point reflection about the principal point of the view *as accepted*, not as asked for: `R' = ZRZ`, `t' = Zt`, `Z =
/// diag(−1, −1, 1)`. Exact in the picture for every radially symmetric lens. If the view shows a much smaller board
/// than fits, the partner is asked for as large as fits, at the reflected place.
fn partner_target(
    of: usize,
    view: &View,
    board: &Checkerboard,
    lens_estimate: &LensEstimate,
    params: &GuidanceParams,
) -> Target {
    if let Some(partner) = partner_of_part(of, view, board, lens_estimate) {
        let size = lens_estimate.image_size;
        return if params.stop_corner_sigma_px.is_some() {
            Target { leaves_picture: leaves(&partner.ghost_px, size), ..partner }
        } else {
            within_picture(partner, size, params)
        };
    }
    let pp_px = lens_estimate.camera.pp_px;
    let purpose = Purpose::Partner { of };
    let wanted = WantedPose {
        tilt_azimuth_rad: (view.tilt_azimuth_rad() + PI).rem_euclid(2.0 * PI),
        tilt_rad: params.wanted_tilt_rad(lens_estimate.f_to_width()),
        offset_px: pp_px - view.mean_px,
        is_reflected: false,
    };
    if let Some(pose) = place_board(&wanted, board, lens_estimate, params) {
        let large = target(purpose, &wanted, &pose, board, lens_estimate);
        let (low, high) = bounds_px(large.ghost_px.iter().copied());
        let ImageSize { width_px, height_px } = lens_estimate.image_size;
        let span_fraction =
            ((high.x - low.x) / f64::from(width_px)).max((high.y - low.y) / f64::from(height_px));
        if view.span_fraction < SMALL * span_fraction {
            return large;
        }
    }
    // A ghost that recedes shrinks about its middle.
    let scale = (params.target_span_fraction / view.span_fraction).min(1.0);
    let middle_px = pp_px.coords * 2.0 - view.mean_px.coords;
    let reflected = |corner: &Corner| {
        let px = pp_px.coords * 2.0 - corner.px.coords;
        Point2::from(middle_px + (px - middle_px) * scale)
    };
    let turned = (0..board.corner_count())
        .filter_map(|index| view.corners.get(board.target().half_turn(index)));
    Target {
        purpose,
        tilt_azimuth_rad: wanted.tilt_azimuth_rad,
        tilt_rad: view.tilt_rad.unwrap_or(0.0),
        ghost_px: turned.map(reflected).collect(),
        leaves_picture: false,
    }
}

/// Partner of a partly seen view: the expected places of its unseen corners are too rough a guess to reflect. `None`
/// for a whole view.
fn partner_of_part(
    of: usize,
    view: &View,
    board: &Checkerboard,
    lens_estimate: &LensEstimate,
) -> Option<Target> {
    if view.corners.iter().all(Corner::is_seen) {
        return None;
    }
    let pose = reflected(&pose_of(&view.corners, board, lens_estimate)?);
    let ghost_px = seen_px(&pose, board, lens_estimate);
    (ghost_px.len() == board.corner_count()).then(|| Target {
        purpose: Purpose::Partner { of },
        tilt_azimuth_rad: (view.tilt_azimuth_rad() + PI).rem_euclid(2.0 * PI),
        tilt_rad: view.tilt_rad.unwrap_or(0.0),
        ghost_px,
        leaves_picture: false,
    })
}

/// The target with its ghost shrunk about its middle until it lies in the picture: the reflection of a view at one edge
/// may lie beyond the other.
fn within_picture(mut target: Target, image_size: ImageSize, params: &GuidanceParams) -> Target {
    let ImageSize { width_px, height_px } = image_size;
    let last = [f64::from(width_px) - 1.0, f64::from(height_px) - 1.0];
    let count = target.ghost_px.len().max(1) as f64;
    let middle = target.ghost_px.iter().map(|px| px.coords).sum::<Vector2<f64>>() / count;
    let margin_px = params.margin_px + LEEWAY * f64::from(width_px.min(height_px));
    let mut scale = 1.0_f64;
    for px in &target.ghost_px {
        let off = px.coords - middle;
        for axis in 0..2 {
            let room = if off[axis] > 0.0 { last[axis] - middle[axis] } else { middle[axis] };
            scale = scale.min((room - margin_px).max(0.0) / off[axis].abs().max(1e-9));
        }
    }
    for px in &mut target.ghost_px {
        px.coords = middle + (px.coords - middle) * scale;
    }
    target
}

/// True if a part of the ghost lies outside of the picture.
fn leaves(ghost_px: &[Point2<f64>], image_size: ImageSize) -> bool {
    !ghost_px.iter().all(|px| image_size.contains(px))
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
    let leaves_picture = leaves(&ghost_px, lens_estimate.image_size);
    Target { purpose, tilt_azimuth_rad, tilt_rad, ghost_px, leaves_picture }
}
