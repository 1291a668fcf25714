//! Choice of the reflected pair of poses that covers most of what no board has covered, or makes projection best known
//! there. There the lens is extrapolated. Source: `docs/method.md`, section 3.4.

use nalgebra::{Isometry3, Point2, Vector2};

use super::{
    beyond_edge::pairs_beyond_edge,
    candidates::{Pair, candidates, free_directions_rad},
    information::{CORNER_SIGMA_PX, corner_weight, information_in_picture, reflected},
    params::GuidanceParams,
    view::{LensEstimate, View},
    wanted_pose::{WantedPose, place_board, seen_px},
    worth::accepted_information,
};
use boresight_geometry::{
    BoardOutline, board::Checkerboard, corner_coverage, coverage, frame::ImageSize,
};

/// A picture corner counts as covered from this share of its cells.
const CLOSED: f64 = 0.5;
/// Directions searched over the full turn for a pair in opposite corners …
const DIRECTIONS: u32 = 24;
/// … with the tilt that is always asked for, and with this one: a flatter board reaches farther into a corner …
const FLAT_RAD: f64 = 20.0 * std::f64::consts::PI / 180.0;
/// … and the distance of its middle from the picture's, in shares of width and height: the farther, the smaller the
/// board.
const SHARES: [f64; 5] = [0.0, 0.1, 0.17, 0.23, 0.28];
/// Among pairs whose variance is at most this multiple of the least, coverage decides.
const ALMOST_LEAST: f64 = 1.15;

/// The pose that, with its reflected partner, covers most of the picture's cells that no view has covered; a part of the board
/// may lie beyond the picture's edge. `None` if no pose covers more.
pub(super) fn most_covering_pair(
    accepted: &[View],
    board: &Checkerboard,
    lens_estimate: &LensEstimate,
    params: &GuidanceParams,
) -> Option<Pair> {
    let wanted = candidates(accepted, lens_estimate, params);
    let whole = whole_boards(wanted, board, lens_estimate, params);
    let pairs = whole.chain(pairs_beyond_edge(accepted, board, lens_estimate, params));
    Covering::new(accepted, board, lens_estimate).most(pairs, coverage)
}

/// Pair chosen as by [`most_covering_pair`], but the corners of the picture come first, and a board may be as small as
/// it must to reach them.
pub(super) fn corner_covering_pair(
    accepted: &[View],
    board: &Checkerboard,
    lens_estimate: &LensEstimate,
    params: &GuidanceParams,
) -> Option<Pair> {
    let size = lens_estimate.image_size;
    let size_px = Vector2::new(f64::from(size.width_px), f64::from(size.height_px));
    let usual_rad = params.wanted_tilt_rad(lens_estimate.f_to_width());
    let flat_rad = FLAT_RAD.max(1.3 * params.min_tilt_rad).min(usual_rad);
    let mut wanted = Vec::new();
    for tilt_azimuth_rad in free_directions_rad(accepted, DIRECTIONS, params) {
        for tilt_rad in [usual_rad, flat_rad] {
            // The reflected views stand at the other half of the places.
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
    let whole = whole_boards(wanted, board, lens_estimate, params);
    let pairs = whole.chain(pairs_beyond_edge(accepted, board, lens_estimate, params));
    Covering::new(accepted, board, lens_estimate).most(pairs, reached)
}

/// Pair that leaves the picture and makes projection best known in the picture's corners; among pairs that make it
/// about as well known, the one that covers most. `None` if none fits.
pub(super) fn best_pair_beyond_edge(
    accepted: &[View],
    board: &Checkerboard,
    lens_estimate: &LensEstimate,
    params: &GuidanceParams,
) -> Option<Pair> {
    let known = accepted_information(accepted, board, lens_estimate);
    let weight = corner_weight(lens_estimate)?;
    let information =
        |pose: &Isometry3<f64>| information_in_picture(pose, board, lens_estimate, CORNER_SIGMA_PX);
    let judged: Vec<(f64, Pair)> = pairs_beyond_edge(accepted, board, lens_estimate, params)
        .into_iter()
        .filter_map(|(wanted, pose)| {
            let pair = information(&pose)? + information(&reflected(&pose))?;
            let covariance = (known + pair).cholesky()?.inverse();
            Some(((weight * covariance).trace(), (wanted, pose)))
        })
        .collect();
    let (least, best) = judged.iter().min_by(|one, other| one.0.total_cmp(&other.0)).copied()?;
    let almost = judged.into_iter().filter(|(variance, _)| *variance <= ALMOST_LEAST * least);
    let pairs = almost.map(|(_, pair)| pair);
    Covering::new(accepted, board, lens_estimate).most(pairs, reached).or(Some(best))
}

fn whole_boards(
    wanted: Vec<WantedPose>,
    board: &Checkerboard,
    lens_estimate: &LensEstimate,
    params: &GuidanceParams,
) -> impl Iterator<Item = Pair> {
    wanted
        .into_iter()
        .filter_map(|wanted| Some((wanted, place_board(&wanted, board, lens_estimate, params)?)))
}

/// Score of the boards' coverage: the corners of the picture, each up to 1, plus the share of the whole.
fn reached(outlines: &[BoardOutline], image_size: ImageSize) -> f64 {
    let corners = corner_coverage(outlines, image_size);
    let closed: f64 = corners.into_iter().map(|share| (share / CLOSED).min(1.0)).sum();
    closed + coverage(outlines, image_size)
}

/// New cover of the seen part of `view` beyond the `accepted` ones, corners first, as a share of the new cover of the
/// ghost's part in the picture. 1 if the ghost covers nothing more.
pub fn covering_share(
    view: &View,
    ghost_px: &[Point2<f64>],
    accepted: &[View],
    board: &Checkerboard,
    image_size: ImageSize,
) -> f64 {
    let mut outlines = outlines(accepted, board);
    let before = reached(&outlines, image_size);
    let mut gain = |more: Option<BoardOutline>| {
        let Some(more) = more else { return 0.0 };
        outlines.push(more);
        let after = reached(&outlines, image_size);
        outlines.pop();
        after - before
    };
    let wanted = gain(outline_in_picture(ghost_px, board, image_size));
    if wanted > 0.0 { gain(view.outline(board)) / wanted } else { 1.0 }
}

fn outlines(views: &[View], board: &Checkerboard) -> Vec<BoardOutline> {
    views.iter().filter_map(|view| view.outline(board)).collect()
}

/// Outline of the visible part of a ghost, once a board stands there.
fn outline_in_picture(
    ghost_px: &[Point2<f64>],
    board: &Checkerboard,
    image_size: ImageSize,
) -> Option<BoardOutline> {
    board.target().outline(ghost_px, &|index| image_size.contains(&ghost_px[index]))
}

/// Cover of the accepted views, and of pairs added to them.
struct Covering<'a> {
    outlines: Vec<BoardOutline>,
    board: &'a Checkerboard,
    lens_estimate: &'a LensEstimate,
}

impl<'a> Covering<'a> {
    fn new(accepted: &[View], board: &'a Checkerboard, lens_estimate: &'a LensEstimate) -> Self {
        Self { outlines: outlines(accepted, board), board, lens_estimate }
    }

    /// The pair of poses that gives the highest `score` of all outlines; `None` if none raises the score.
    fn most(
        mut self,
        pairs: impl Iterator<Item = Pair>,
        score: impl Fn(&[BoardOutline], ImageSize) -> f64,
    ) -> Option<Pair> {
        let image_size = self.lens_estimate.image_size;
        let taken = self.outlines.len();
        let mut most = score(&self.outlines, image_size);
        let mut best = None;
        for (wanted, pose) in pairs {
            self.outlines.truncate(taken);
            self.outlines.extend([pose, reflected(&pose)].iter().filter_map(|pose| {
                let corners_px = seen_px(pose, self.board, self.lens_estimate);
                outline_in_picture(&corners_px, self.board, image_size)
            }));
            let now = score(&self.outlines, image_size);
            if now > most {
                most = now;
                best = Some((wanted, pose));
            }
        }
        best
    }
}
