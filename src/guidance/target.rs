//! Which pose next, and where its ghost stands on the screen.

use std::f64::consts::PI;

use nalgebra::{Isometry3, Point2, Point3, Translation3, Unit, UnitQuaternion, Vector3};

use super::{
    BoardRoll, GuidanceParams, LensEstimate, Plan, SLOTS_DEG, View,
    independence::partner_of,
    information::{most_covering_pair, most_informative_pair},
    stop::Precision,
    view::bounds_px,
};
use crate::{board::Checkerboard, frame::ImageSize};

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
    /// Half of the reflected pair that tells most.
    MostInformative,
    /// Half of the reflected pair that covers most of what no board has covered.
    Coverage,
}

/// A pose to show.
#[derive(Clone, Debug, PartialEq)]
pub struct Target {
    /// See [`Purpose`].
    pub purpose: Purpose,
    /// Direction in which the board recedes.
    pub slot_rad: f64,
    /// Tilt of the board.
    pub tilt_rad: f64,
    /// Where every inner corner should appear, in the board's numbering order, as the lens shows it.
    pub ghost_px: Vec<Point2<f64>>,
}

/// A pose in the planner's own terms.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct PoseWish {
    pub(super) slot_rad: f64,
    pub(super) tilt_rad: f64,
    /// Share of the picture that the corners should span.
    pub(super) fill: f64,
    /// Shift of the board's centre from the principal point along the slot's direction.
    pub(super) along_px: f64,
}

/// The pose to ask for next, METHOD section 3.4: the partner of a view that has none, else the first
/// empty slot, else half of the reflected pair that tells most; once nothing but coverage
/// is wanting, of the pair that covers most of what no board has covered. `None` if the plan has no further pose.
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
    let slots = match params.plan {
        Plan::Quick | Plan::Adaptive => 4,
        Plan::Full => 8,
    };
    let open = SLOTS_DEG[..slots]
        .iter()
        .find_map(|slot| free_direction_rad(slot.to_radians(), accepted, params));
    if let Some(slot_rad) = open
        && accepted.len() < slots
    {
        let wish = PoseWish {
            slot_rad,
            tilt_rad: params.target_tilt_rad,
            fill: params.target_fill,
            along_px: 0.0,
        };
        return aimed(&wish, board, lens_estimate, params)
            .map(|pose| target(Purpose::Slot, &wish, &pose, board, lens_estimate));
    }
    if params.plan != Plan::Adaptive {
        return None;
    }
    let only_coverage = precision.is_some_and(|precision| {
        precision.trusted && !precision.covered && precision.is_reached(params)
    });
    let (purpose, (wish, pose)) = if only_coverage {
        (Purpose::Coverage, most_covering_pair(accepted, board, lens_estimate, params)?)
    } else {
        (Purpose::MostInformative, most_informative_pair(accepted, board, lens_estimate, params)?)
    };
    Some(target(purpose, &wish, &pose, board, lens_estimate))
}

/// The direction nearest to a slot that is independent of all accepted principal lines, with room for
/// the errors of a hand; `None` if the slot is taken.
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
            accepted
                .iter()
                .all(|view| (view.slot_rad() - direction_rad).sin().abs().asin() >= wanted_rad)
        })
        .map(|direction_rad| direction_rad.rem_euclid(2.0 * PI))
}

/// The point reflection of the view *actually accepted* about the principal point: `R' = ZRZ`,
/// `t' = Zt`, `Z = diag(−1, −1, 1)`. Exact in the picture for every radially symmetric lens.
fn partner_target(of: usize, view: &View, lens_estimate: &LensEstimate) -> Target {
    let pp = lens_estimate.camera.pp_px;
    Target {
        purpose: Purpose::Partner { of },
        slot_rad: (view.slot_rad() + PI).rem_euclid(2.0 * PI),
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
    wish: &PoseWish,
    cam_from_board: &Isometry3<f64>,
    board: &Checkerboard,
    lens_estimate: &LensEstimate,
) -> Target {
    let ghost_px = seen_px(cam_from_board, board, lens_estimate);
    Target { purpose, slot_rad: wish.slot_rad, tilt_rad: wish.tilt_rad, ghost_px }
}

/// Where the inner corners would appear, in numbering order; those behind the camera are left out.
pub fn seen_px(
    cam_from_board: &Isometry3<f64>,
    board: &Checkerboard,
    lens_estimate: &LensEstimate,
) -> Vec<Point2<f64>> {
    board
        .corners_in_board_m()
        .iter()
        .filter_map(|corner| lens_estimate.camera.px_from_board(cam_from_board, corner))
        .collect()
}

/// The pose that fulfils `wish`: the board's mean corner stands at the wished place, and the board
/// with its outer squares is as large as wished, or as the picture allows.
///
/// `None` if the board cannot be fully visible at half of the wished size.
pub(super) fn aimed(
    wish: &PoseWish,
    board: &Checkerboard,
    lens_estimate: &LensEstimate,
    params: &GuidanceParams,
) -> Option<Isometry3<f64>> {
    let rotation = rotation(wish, params.board_roll);
    let (sin, cos) = wish.slot_rad.sin_cos();
    let centre_px = lens_estimate.camera.pp_px + nalgebra::Vector2::new(cos, sin) * wish.along_px;
    let corners = board.corners_in_board_m();
    let mut depth_m = f64::from(board.columns().max(board.rows()) as u32)
        * board.square_m()
        * lens_estimate.camera.f_px.x
        / (wish.fill * f64::from(lens_estimate.image_size.width_px));
    let mut best = None;
    // Distance by bisection between "too large" and "fits"; the place by fixed-point iteration.
    let (mut near_m, mut far_m) = (depth_m * 0.3, depth_m * 4.0);
    for _ in 0..18 {
        depth_m = 0.5 * (near_m + far_m);
        let pose = placed(&rotation, depth_m, &centre_px, &corners, lens_estimate);
        let fits = pose.as_ref().is_some_and(|pose| {
            fill(pose, &corners, lens_estimate).is_some_and(|fill| fill <= wish.fill)
                && outline_inside(pose, board, lens_estimate, params)
        });
        if fits {
            far_m = depth_m;
            best = pose;
        } else {
            near_m = depth_m;
        }
    }
    let pose = best?;
    fill(&pose, &corners, lens_estimate)
        .is_some_and(|got| got >= params.min_fill.max(0.5 * wish.fill))
        .then_some(pose)
}

/// A board that faces the camera, tilted by `tilt_rad` so that it recedes towards `slot_rad`.
pub fn tilted(slot_rad: f64, tilt_rad: f64) -> UnitQuaternion<f64> {
    let (sin, cos) = slot_rad.sin_cos();
    let axis = Unit::new_normalize(Vector3::new(sin, -cos, 0.0));
    UnitQuaternion::from_axis_angle(&axis, tilt_rad)
}

fn rotation(wish: &PoseWish, roll: BoardRoll) -> UnitQuaternion<f64> {
    let tilted = tilted(wish.slot_rad, wish.tilt_rad);
    match roll {
        BoardRoll::Upright => tilted,
        BoardRoll::Turn => {
            tilted * UnitQuaternion::from_axis_angle(&Vector3::z_axis(), wish.slot_rad)
        }
    }
}

/// Shifts the board at `depth_m` until its mean corner appears at `centre_px`.
fn placed(
    rotation: &UnitQuaternion<f64>,
    depth_m: f64,
    centre_px: &Point2<f64>,
    corners: &[Point2<f64>],
    lens_estimate: &LensEstimate,
) -> Option<Isometry3<f64>> {
    let mut shift_m = Vector3::new(0.0, 0.0, depth_m);
    for _ in 0..6 {
        let pose = Isometry3::from_parts(Translation3::from(shift_m), *rotation);
        let mut mean = nalgebra::Vector2::zeros();
        for corner in corners {
            mean += lens_estimate.camera.px_from_board(&pose, corner)?.coords;
        }
        let off_px = centre_px.coords - mean / corners.len() as f64;
        shift_m.x += off_px.x * depth_m / lens_estimate.camera.f_px.x;
        shift_m.y += off_px.y * depth_m / lens_estimate.camera.f_px.y;
    }
    Some(Isometry3::from_parts(Translation3::from(shift_m), *rotation))
}

fn fill(
    pose: &Isometry3<f64>,
    corners: &[Point2<f64>],
    lens_estimate: &LensEstimate,
) -> Option<f64> {
    let seen: Option<Vec<_>> =
        corners.iter().map(|corner| lens_estimate.camera.px_from_board(pose, corner)).collect();
    let (low, high) = bounds_px(seen?.into_iter());
    let ImageSize { width_px, height_px } = lens_estimate.image_size;
    Some(((high.x - low.x) / f64::from(width_px)).max((high.y - low.y) / f64::from(height_px)))
}

/// Whether the board with its outer squares, and its reflected partner, lie in the picture.
fn outline_inside(
    pose: &Isometry3<f64>,
    board: &Checkerboard,
    lens_estimate: &LensEstimate,
    params: &GuidanceParams,
) -> bool {
    let half_width = (board.columns() as f64 + 1.0) / 2.0 * board.square_m();
    let half_height = (board.rows() as f64 + 1.0) / 2.0 * board.square_m();
    let outline = [
        (-1.0, -1.0),
        (0.0, -1.0),
        (1.0, -1.0),
        (1.0, 0.0),
        (1.0, 1.0),
        (0.0, 1.0),
        (-1.0, 1.0),
        (-1.0, 0.0),
    ];
    let (width, height) = (
        f64::from(lens_estimate.image_size.width_px),
        f64::from(lens_estimate.image_size.height_px),
    );
    let inside = |p: &Point2<f64>| {
        let margin = params.margin_px;
        p.x >= margin
            && p.y >= margin
            && p.x <= width - 1.0 - margin
            && p.y <= height - 1.0 - margin
    };
    outline.iter().all(|(x, y)| {
        let in_cam = pose * Point3::new(x * half_width, y * half_height, 0.0);
        if in_cam.z <= 0.05 {
            return false;
        }
        lens_estimate.camera.project(&in_cam).is_some_and(|px| {
            let reflected = Point2::from(lens_estimate.camera.pp_px.coords * 2.0 - px.coords);
            inside(&px) && inside(&reflected)
        })
    })
}
