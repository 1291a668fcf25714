//! Which reflected pair of poses covers most of what no board has covered: there the lens is extrapolated.
//! Source: `docs/method.md`, section 3.4.

use nalgebra::{Isometry3, Vector2};

use super::{
    candidates::{candidates, free_directions_rad},
    information::reflected,
    params::GuidanceParams,
    view::{LensEstimate, View},
    wanted_pose::{WantedPose, place_board, seen_px},
};
use crate::{
    board::Checkerboard,
    frame::ImageSize,
    geometry::{BoardOutline, corner_coverage, coverage},
};

/// A corner of the picture is closed once boards cover this share of its cells.
const CLOSED: f64 = 0.5;
/// Directions searched over the full turn for a pair in opposite corners …
const DIRECTIONS: u32 = 24;
/// … with the tilt that is always asked for, and with this one: a flatter board reaches farther into a corner …
const FLAT_RAD: f64 = 20.0 * std::f64::consts::PI / 180.0;
/// … and how far its middle stands from the picture's, in shares of width and height: the farther, the smaller the board.
const SHARES: [f64; 5] = [0.0, 0.1, 0.17, 0.23, 0.28];

/// The feasible pose that, with its reflected partner, covers most of the picture's cells that no view has
/// covered. `None` if no pose covers more.
pub(super) fn most_covering_pair(
    accepted: &[View],
    board: &Checkerboard,
    lens_estimate: &LensEstimate,
    params: &GuidanceParams,
) -> Option<(WantedPose, Isometry3<f64>)> {
    let size = lens_estimate.image_size;
    let wanted = candidates(accepted, lens_estimate, params);
    best_pair(accepted, board, (lens_estimate, params), wanted, |all| coverage(all, size))
}

/// As [`most_covering_pair`], but the corners of the picture come first, and a board may be as small as it must to reach
/// them.
pub(super) fn corner_covering_pair(
    accepted: &[View],
    board: &Checkerboard,
    lens_estimate: &LensEstimate,
    params: &GuidanceParams,
) -> Option<(WantedPose, Isometry3<f64>)> {
    let size = lens_estimate.image_size;
    let size_px = Vector2::new(f64::from(size.width_px), f64::from(size.height_px));
    let usual_rad = params.wanted_tilt_rad(lens_estimate.f_to_width());
    let flat_rad = FLAT_RAD.max(1.3 * params.min_tilt_rad).min(usual_rad);
    let mut wanted = Vec::new();
    for tilt_azimuth_rad in free_directions_rad(accepted, DIRECTIONS, params) {
        for tilt_rad in [usual_rad, flat_rad] {
            // The other half of the places is that of the reflected views.
            let places = SHARES.into_iter().flat_map(|across| {
                SHARES.into_iter().flat_map(move |down| [(across, down), (across, -down)])
            });
            wanted.extend(places.map(|(across, down)| WantedPose {
                tilt_azimuth_rad,
                tilt_rad,
                offset_px: size_px.component_mul(&Vector2::new(across, down)),
                is_reflected: true,
            }));
        }
    }
    best_pair(accepted, board, (lens_estimate, params), wanted, |all| reached(all, size))
}

/// What boards have reached: the corners of the picture, each up to 1, and the share of the whole.
fn reached(outlines: &[BoardOutline], image_size: ImageSize) -> f64 {
    let corners = corner_coverage(outlines, image_size);
    let closed: f64 = corners.into_iter().map(|share| (share / CLOSED).min(1.0)).sum();
    closed + coverage(outlines, image_size)
}

/// What `view` would cover that none of the `accepted` ones does, corners first, as a share of what the ghost would.
/// 1 if the ghost covers nothing more.
pub fn covering_share(
    view: &View,
    ghost: &BoardOutline,
    accepted: &[View],
    columns: usize,
    image_size: ImageSize,
) -> f64 {
    let mut outlines = outlines(accepted, columns);
    let before = reached(&outlines, image_size);
    let mut gain = |more: Option<BoardOutline>| {
        let Some(more) = more else { return 0.0 };
        outlines.push(more);
        let after = reached(&outlines, image_size);
        outlines.pop();
        after - before
    };
    let wanted = gain(Some(*ghost));
    if wanted > 0.0 { gain(outline(view, columns)) / wanted } else { 1.0 }
}

fn outlines(views: &[View], columns: usize) -> Vec<BoardOutline> {
    views.iter().filter_map(|view| outline(view, columns)).collect()
}

fn outline(view: &View, columns: usize) -> Option<BoardOutline> {
    let corners: Vec<_> = view.corners.iter().map(|corner| corner.px).collect();
    BoardOutline::of(&corners, columns)
}

/// The feasible pose whose view, with its reflection, gives the highest `score` of all outlines; `None` if none gives
/// more than there is.
fn best_pair(
    accepted: &[View],
    board: &Checkerboard,
    (lens_estimate, params): (&LensEstimate, &GuidanceParams),
    wanted: Vec<WantedPose>,
    score: impl Fn(&[BoardOutline]) -> f64,
) -> Option<(WantedPose, Isometry3<f64>)> {
    let mut outlines = outlines(accepted, board.columns());
    let taken = outlines.len();
    let mut most = score(&outlines);
    let mut best = None;
    for wanted in wanted {
        let Some(pose) = place_board(&wanted, board, lens_estimate, params) else { continue };
        let pair = [pose, reflected(&pose)];
        outlines.truncate(taken);
        outlines.extend(pair.iter().filter_map(|pose| {
            BoardOutline::of(&seen_px(pose, board, lens_estimate), board.columns())
        }));
        let now = score(&outlines);
        if now > most {
            most = now;
            best = Some((wanted, pose));
        }
    }
    best
}
