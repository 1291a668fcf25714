//! Acceptance of a shown view, by the rules of each strategy's source.

use nalgebra::{Isometry3, Point2};

use super::{hand::Wish, situation::Situation};
use boresight_geometry::{
    Camera, Corner,
    boards::Board,
    fit_pose,
    frame::{CaptureTime, FrameId},
};
use boresight_guide::guidance::{Role, View, measure, role_of};

/// Acceptance rule for a view with all corners found. In addition, every strategy waits for the
/// same hold.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Accept {
    /// Always: the person decides, or the source has no rule.
    Found,
    /// Role required: a new direction, or the partner of a view.
    Role,
    /// Minimum overlap of the seen and the requested board's outlines, as a share of the union.
    Overlap(f64),
    /// Mean distance of the corners from the requested corners below the widest seen square.
    WithinASquare,
    /// Minimum difference in X, Y, size and skew from every earlier view, summed over all four.
    Novel(f64),
}

/// Judgement of a view.
pub(super) enum Judged {
    /// Counted view; the measured view has a principal line unless the board faces the camera.
    Taken(Option<Box<View>>),
    /// Refused: the person tries the same pose again, more carefully.
    Refused,
    /// Unwanted pose.
    Unwanted,
}

impl Accept {
    /// True if the first ghost is redrawn with the focal length of the live picture, as in the
    /// sources of these rules.
    pub(super) fn follows_the_live_picture(self) -> bool {
        matches!(self, Self::Overlap(_) | Self::WithinASquare)
    }

    /// Judges the `corners` seen at `secs` after a request of one of `wishes`: more than one if the
    /// ghost was redrawn in between.
    pub(super) fn judge(
        self,
        wishes: &[Wish],
        corners: &[Corner],
        secs: f64,
        situation: &Situation<'_>,
    ) -> Judged {
        let Situation { lens_estimate, views, shown, board, params, .. } = *situation;
        let taken = || {
            let frame = (FrameId(shown.len() as u64), CaptureTime { nanos: (secs * 1e9) as u64 });
            measure(frame, corners, SHARP_PX, board, lens_estimate)
        };
        let counts = match self {
            Self::Found => true,
            Self::Role => {
                let Ok(mut view) = taken() else { return Judged::Refused };
                return match role_of(&view, views, lens_estimate, params) {
                    Ok(role) => {
                        if let Role::Partner { of } = role {
                            view.partner_frame = Some(views[of].frame_id);
                        }
                        Judged::Taken(Some(Box::new(view)))
                    }
                    Err(_) => Judged::Refused,
                };
            }
            Self::Overlap(wanted) => {
                wishes.iter().any(|wish| overlap(wish, corners, situation) > wanted)
            }
            Self::WithinASquare => {
                let within_px = widest_square_px(corners, board);
                wishes.iter().any(|wish| {
                    let ghost = corners.iter().zip(&wish.ghost_px);
                    let off_px: f64 = ghost.map(|(corner, px)| (corner.px - px).norm()).sum();
                    off_px < within_px * corners.len() as f64
                })
            }
            Self::Novel(least) => {
                let bars = Bars::of(situation, corners);
                let novel =
                    shown.iter().all(|earlier| Bars::of(situation, earlier).differ(&bars) > least);
                if !novel {
                    return Judged::Unwanted;
                }
                true
            }
        };
        if counts { Judged::Taken(taken().ok().map(Box::new)) } else { Judged::Refused }
    }
}

/// Blur of every view; corners are computed, not detected.
const SHARP_PX: f64 = 0.8;

/// X, Y, size and skew of a view, each from 0 to 1. Source: ROS `camera_calibration`,
/// `get_parameters`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Bars(pub(super) [f64; 4]);

impl Bars {
    pub(super) fn of(situation: &Situation<'_>, corners: &[Corner]) -> Self {
        let size = situation.lens_estimate.image_size;
        let (width, height) = (f64::from(size.width_px), f64::from(size.height_px));
        let [first, right, far, left] =
            situation.board.target().rim().map(|index| corners[index].px);
        let area = 0.5 * (far - first).perp(&(left - right)).abs();
        let border = area.sqrt();
        let mean = boresight_geometry::mean_px(corners);
        let (back, on) = (first - right, far - right);
        let corner_rad = back.angle(&on);
        let place = |at: f64, size: f64| ((at - 0.5 * border) / (size - border)).clamp(0.0, 1.0);
        Self([
            place(mean.x, width),
            place(mean.y, height),
            (area / (width * height)).sqrt(),
            (2.0 * (std::f64::consts::FRAC_PI_2 - corner_rad).abs()).min(1.0),
        ])
    }

    fn differ(&self, other: &Self) -> f64 {
        self.0.iter().zip(&other.0).map(|(a, b)| (a - b).abs()).sum()
    }
}

/// Side of the widest square, between neighbours in a row or a column.
fn widest_square_px(corners: &[Corner], board: &Board) -> f64 {
    let side_px = |one: usize, other: usize| (corners[one].px - corners[other].px).norm();
    let mut widest_px = 0.0_f64;
    board.target().each_three_in_line(&mut |[a, b, c], _| {
        widest_px = widest_px.max(side_px(a, b)).max(side_px(b, c));
    });
    widest_px
}

/// Intersection over union of the requested and the seen board, both with outer squares.
fn overlap(wish: &Wish, corners: &[Corner], situation: &Situation<'_>) -> f64 {
    let ghost: Vec<Corner> =
        wish.ghost_px.iter().map(|px| Corner::isotropic(*px, situation.noise_px)).collect();
    match (board_outline_px(&ghost, situation), board_outline_px(corners, situation)) {
        (Some(asked), Some(seen)) => {
            let shared = area_px2(&clipped(&asked, &seen));
            shared / (area_px2(&asked) + area_px2(&seen) - shared)
        }
        _ => 0.0,
    }
}

/// Corners of the board's outline, outer squares included, from the inner corners as seen.
fn board_outline_px(corners: &[Corner], situation: &Situation<'_>) -> Option<Vec<Point2<f64>>> {
    let Situation { board, lens_estimate, .. } = *situation;
    let camera = &lens_estimate.camera;
    let pose = fit_pose(camera, &board.corners_in_board_m(), corners).ok()?.cam_from_board;
    let [x, y] = board.target().size_m().map(|side_m| 0.5 * side_m);
    [(-x, -y), (x, -y), (x, y), (-x, y)]
        .into_iter()
        .map(|(x, y)| camera.px_from_board(&pose, &Point2::new(x, y)))
        .collect()
}

/// Intersection of the convex polygons `a` and `b` (Sutherland & Hodgman 1974).
fn clipped(a: &[Point2<f64>], b: &[Point2<f64>]) -> Vec<Point2<f64>> {
    let turn = signed_area_px2(b).signum();
    let mut part = a.to_vec();
    for (i, from) in b.iter().enumerate() {
        let along = b[(i + 1) % b.len()] - from;
        let side = |p: &Point2<f64>| turn * along.perp(&(p - from));
        let mut kept = Vec::with_capacity(part.len() + 1);
        for (k, p) in part.iter().enumerate() {
            let before = &part[(k + part.len() - 1) % part.len()];
            let (here, there) = (side(p), side(before));
            if (here >= 0.0) != (there >= 0.0) {
                kept.push(before + (p - before) * (there / (there - here)));
            }
            if here >= 0.0 {
                kept.push(*p);
            }
        }
        part = kept;
    }
    part
}

fn signed_area_px2(polygon: &[Point2<f64>]) -> f64 {
    let next = polygon.iter().cycle().skip(1);
    0.5 * polygon.iter().zip(next).map(|(a, b)| a.coords.perp(&b.coords)).sum::<f64>()
}

fn area_px2(polygon: &[Point2<f64>]) -> f64 {
    signed_area_px2(polygon).abs()
}

/// Wish for a board at `cam_from_board`, as shown by `camera`. `None` if a corner is behind the
/// camera.
pub(super) fn wish_at(
    cam_from_board: Isometry3<f64>,
    board: &Board,
    camera: &Camera,
) -> Option<Wish> {
    let ghost_px: Option<Vec<Point2<f64>>> = board
        .corners_in_board_m()
        .iter()
        .map(|m| camera.px_from_board(&cam_from_board, m))
        .collect();
    Some(Wish { cam_from_board, ghost_px: ghost_px? })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(left: f64, top: f64, side: f64) -> Vec<Point2<f64>> {
        [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]
            .map(|(x, y)| Point2::new(left + side * x, top + side * y))
            .to_vec()
    }

    #[test]
    fn shared_area_of_squares_is_known() {
        let a = square(0.0, 0.0, 4.0);
        let mut turned = square(1.0, 1.0, 4.0);
        assert!((area_px2(&clipped(&a, &turned)) - 9.0).abs() < 1e-12);
        turned.reverse();
        assert!((area_px2(&clipped(&a, &turned)) - 9.0).abs() < 1e-12);
        assert_eq!(area_px2(&clipped(&a, &square(9.0, 9.0, 2.0))), 0.0);
        assert!((area_px2(&clipped(&square(1.0, 1.0, 1.0), &a)) - 1.0).abs() < 1e-12);
    }
}
