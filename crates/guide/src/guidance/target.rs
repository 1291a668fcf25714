//! Choice of the next pose, and its ghost on the screen.

use std::f64::consts::PI;

use nalgebra::{Isometry3, Point2, Vector2, Vector3};

use super::{
    gain::{Knowledge, pose_of},
    independence::lacks_partner,
    information::reflected,
    params::GuidanceParams,
    poses::{best_pair, is_tried},
    view::{LensEstimate, View, bounds_px},
    wanted_pose::{WantedPose, place_board, seen_px},
};
use boresight_geometry::{Corner, Homography, boards::Board, frame::ImageSize};

/// Error of a person in a place near the picture's edge, as a share of the picture's shorter side.
const LEEWAY: f64 = 0.05;
/// Share of the largest fitting board below which an accepted view counts as small.
const SMALL: f64 = 0.6;

/// Purpose of a requested pose.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case", tag = "purpose")]
pub enum Purpose {
    /// The opposed partner of an accepted view, by index.
    Partner {
        /// Index of the accepted view.
        of: usize,
    },
    /// A view of the reflected pair with the most gain for its effort.
    MostInformative,
    /// A view of such a pair of boards beyond the picture's edge.
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
    /// Requested pixels of the inner corners, in numbering order, distorted by the lens.
    pub ghost_px: Vec<Point2<f64>>,
    /// True if a part of the board is requested beyond the picture's edge.
    pub leaves_picture: bool,
}

impl Target {
    /// Larger of the shares of the picture's width and height spanned by the ghost's corners in the
    /// picture.
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

/// The next pose to request: the partner of the newest view without a partner, else a view of the
/// reflected pair with the most gain for its effort. Skips poses in the impossible directions
/// `tried_rad`. Source: `docs/method.md`, section 3.4.
///
/// `None` if no direction is left, or if the board can't be placed in the picture.
pub fn next_target(
    accepted: &[View],
    tried_rad: &[f64],
    board: &Board,
    knowledge: &Knowledge,
    lens_estimate: &LensEstimate,
    params: &GuidanceParams,
) -> Option<Target> {
    let unpaired = (0..accepted.len()).rev().filter(|&i| lacks_partner(i, accepted));
    let mut partners =
        unpaired.map(|of| partner_target(of, &accepted[of], board, lens_estimate, params));
    partners.find(|partner| !is_tried(partner.tilt_azimuth_rad, tried_rad)).or_else(|| {
        let best = best_pair(accepted, tried_rad, board, knowledge, lens_estimate, params);
        best.map(|(wanted, pose)| target(&wanted, &pose, board, lens_estimate))
    })
}

/// Point reflection about the principal point of the view *as accepted*, not as requested: `R' =
/// ZRZ`, `t' = Zt`, `Z = diag(−1, −1, 1)`. Exact in the picture for every radially symmetric lens.
/// If the view shows a much smaller board than fits, the partner is requested as large as fits, at
/// the reflected place.
fn partner_target(
    of: usize,
    view: &View,
    board: &Board,
    lens_estimate: &LensEstimate,
    params: &GuidanceParams,
) -> Target {
    if let Some(partner) = partner_of_part(of, view, board, lens_estimate) {
        let size = lens_estimate.image_size;
        return if params.leaves_picture() {
            Target { leaves_picture: leaves(&partner.ghost_px, size), ..partner }
        } else {
            within_picture(partner, size)
        };
    }
    let pp_px = lens_estimate.camera.pp_px;
    let purpose = Purpose::Partner { of };
    let wanted = WantedPose {
        tilt_azimuth_rad: (view.tilt_azimuth_rad() + PI).rem_euclid(2.0 * PI),
        tilt_rad: params.wanted_tilt_rad(lens_estimate.f_to_width()),
        offset_px: pp_px - view.mean_px,
        is_reflected: false,
        leaves_picture: false,
    };
    if let Some(pose) = place_board(&wanted, board, lens_estimate, params) {
        let large = Target { purpose, ..target(&wanted, &pose, board, lens_estimate) };
        let (low, high) = bounds_px(large.ghost_px.iter().copied());
        let ImageSize { width_px, height_px } = lens_estimate.image_size;
        let span_fraction =
            ((high.x - low.x) / f64::from(width_px)).max((high.y - low.y) / f64::from(height_px));
        if view.span_fraction < SMALL * span_fraction {
            return large;
        }
    }
    // A receding ghost shrinks about its middle.
    let scale = (params.target_span_fraction / view.span_fraction).min(1.0);
    let middle_px = pp_px.coords * 2.0 - view.mean_px.coords;
    let reflected = |px: Point2<f64>| {
        let px = pp_px.coords * 2.0 - px.coords;
        Point2::from(middle_px + (px - middle_px) * scale)
    };
    let turned_px = half_turned_px(view, board);
    Target {
        purpose,
        tilt_azimuth_rad: wanted.tilt_azimuth_rad,
        tilt_rad: view.tilt_rad.unwrap_or(0.0),
        ghost_px: turned_px.into_iter().map(reflected).collect(),
        leaves_picture: false,
    }
}

/// Pixels of the points of a view's board, turned upside down in its plane.
fn half_turned_px(view: &View, board: &Board) -> Vec<Point2<f64>> {
    let turn = |index| view.corners.get(board.target().half_turn(index)?).map(|corner| corner.px);
    let points_m = board.corners_in_board_m();
    let turned: Option<Vec<Point2<f64>>> = (0..points_m.len()).map(turn).collect();
    // Points without a turned counterpart lie between others, where the board's plane is good
    // enough.
    let in_plane = || {
        let plane = Homography::fit(&points_m, &view.corners).ok()?;
        points_m.iter().map(|point| plane.map(&-point)).collect()
    };
    turned.or_else(in_plane).unwrap_or_default()
}

/// Partner of a partly seen view: the expected places of unseen corners are too rough a guess to
/// reflect. `None` for a whole view.
fn partner_of_part(
    of: usize,
    view: &View,
    board: &Board,
    lens_estimate: &LensEstimate,
) -> Option<Target> {
    if view.corners.iter().all(Corner::is_seen) {
        return None;
    }
    let pose = reflected(&pose_of(&view.corners, &board.corners_in_board_m(), lens_estimate)?);
    let ghost_px = seen_px(&pose, board, lens_estimate);
    (ghost_px.len() == board.corner_count()).then(|| Target {
        purpose: Purpose::Partner { of },
        tilt_azimuth_rad: (view.tilt_azimuth_rad() + PI).rem_euclid(2.0 * PI),
        tilt_rad: view.tilt_rad.unwrap_or(0.0),
        ghost_px,
        leaves_picture: false,
    })
}

/// The target with a ghost shrunk about its middle until within the picture: the reflection of a
/// view at an edge may lie beyond the opposite edge.
fn within_picture(mut target: Target, image_size: ImageSize) -> Target {
    let ImageSize { width_px, height_px } = image_size;
    let last = [f64::from(width_px) - 1.0, f64::from(height_px) - 1.0];
    let count = target.ghost_px.len().max(1) as f64;
    let middle = target.ghost_px.iter().map(|px| px.coords).sum::<Vector2<f64>>() / count;
    let margin_px = LEEWAY * f64::from(width_px.min(height_px));
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

/// Request for the board at `cam_from_board`. `None` if a corner has no place in the lens's field.
pub(crate) fn target_at(
    cam_from_board: &Isometry3<f64>,
    board: &Board,
    lens_estimate: &LensEstimate,
) -> Option<Target> {
    let ghost_px = seen_px(cam_from_board, board, lens_estimate);
    // The normal leans against the direction in which the board recedes.
    let normal = cam_from_board.rotation * Vector3::z();
    (ghost_px.len() == board.corner_count()).then(|| Target {
        purpose: Purpose::MostInformative,
        tilt_azimuth_rad: libm::atan2(-normal.y, -normal.x).rem_euclid(2.0 * PI),
        tilt_rad: libm::acos(normal.z.clamp(-1.0, 1.0)),
        ghost_px,
        leaves_picture: false,
    })
}

fn target(
    wanted: &WantedPose,
    cam_from_board: &Isometry3<f64>,
    board: &Board,
    lens_estimate: &LensEstimate,
) -> Target {
    let WantedPose { tilt_azimuth_rad, tilt_rad, leaves_picture, .. } = *wanted;
    Target {
        purpose: if leaves_picture { Purpose::BeyondEdge } else { Purpose::MostInformative },
        tilt_azimuth_rad,
        tilt_rad,
        ghost_px: seen_px(cam_from_board, board, lens_estimate),
        leaves_picture,
    }
}
