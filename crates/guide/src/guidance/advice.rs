//! Advice: the next action for the person.

use nalgebra::Vector2;
use serde::Serialize;

use super::{refusal::Refusal, slots::direction_difference_rad, target::Target, view::View};
use boresight_geometry::Corner;

/// The next action, as data; module `text` has the sentences.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case", tag = "do")]
pub enum Advice {
    /// Bring the whole board into the picture.
    ShowBoard,
    /// Bring the whole board into the picture first. The requested pose leaves the picture, and a
    /// part of a board can be identified only by following the board there.
    ShowWholeFirst,
    /// Make the board recede towards another direction.
    TipTowards {
        /// Direction in which the board recedes now; `None` if it faces the camera.
        #[serde(rename = "slot_rad")]
        tilt_azimuth_rad: Option<f64>,
        /// Requested direction.
        wanted_rad: f64,
    },
    /// Change the tilt.
    Tilt {
        /// Tilt of the newest frame.
        tilt_rad: f64,
        /// Tilt of the requested pose.
        wanted_rad: f64,
        /// Requested direction of receding.
        #[serde(rename = "slot_rad")]
        tilt_azimuth_rad: f64,
    },
    /// Change the distance.
    Distance {
        /// Share of the picture spanned by the corners now.
        #[serde(rename = "fill")]
        span_fraction: f64,
        /// Share of the picture spanned by the requested pose.
        wanted: f64,
    },
    /// Shift the board in the picture.
    Shift {
        /// Distance to the right, in pixels; negative to the left.
        right_px: f64,
        /// Distance down, in pixels; negative up.
        down_px: f64,
    },
    /// Stop moving the board.
    HoldStill {
        /// Root mean square speed of the corners; `None` without an earlier frame to compare with.
        speed_px_per_s: Option<f64>,
        /// Highest accepted speed.
        wanted_px_per_s: f64,
    },
    /// Rest the arms or lean the board on something: holding it freely hasn't been steady enough
    /// for a while.
    SteadyTheBoard,
    /// Keep still until the view is taken.
    Holding {
        /// Share of the hold passed.
        progress: f64,
    },
    /// Remove the cause of the refusal.
    Mend {
        /// The refusal.
        refusal: Refusal,
    },
    /// Nothing: no further view is requested.
    Finished,
}

/// Share of the requested tilt below which a board counts as flat, without an edge away from the
/// camera; and the lack of a flat board, as a multiple of the least notable one.
const FLAT: (f64, f64) = (0.25, 2.0);
/// Least notable differences from the requested pose: of direction, of tilt and of size as factors,
/// and of place, as a share of the board's own size.
const OFF_RAD: f64 = 22.5 * std::f64::consts::PI / 180.0;
const TILTED: f64 = 1.4;
const SIZED: f64 = 1.3;
const SHIFTED: f64 = 0.2;
/// Share of the least notable difference below which the pose counts as shown: only the refusal
/// remains.
const SHOWN: f64 = 0.5;

/// State of a person's hand, as far as advice depends on it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Hand {
    /// True if the board moves no more than in a calm hand: the person has arrived, or believes so.
    pub has_stopped: bool,
    /// True after a long time in a good pose without holding steadily.
    pub needs_support: bool,
}

/// Advice about a frame refused for `refusal`, on the way to `target`. `view` is the frame's
/// measurement, if any. Of direction, tilt, size and place, the largest lack is named, also during
/// a hold: only the requested pose, or a `hand` at rest, is asked to hold still.
/// [`Advice::Finished`] without a target.
pub(crate) fn advise(
    view: Option<&View>,
    refusal: &Refusal,
    target: Option<&Target>,
    hand: Hand,
) -> Advice {
    let Some(target) = target else { return Advice::Finished };
    match *refusal {
        Refusal::NotFound if target.leaves_picture => return Advice::ShowWholeFirst,
        Refusal::NotFound => return Advice::ShowBoard,
        Refusal::Moving { .. } if hand.needs_support => return Advice::SteadyTheBoard,
        refusal @ (Refusal::OutsideLens { .. } | Refusal::CameraNotReady) => {
            return Advice::Mend { refusal };
        }
        _ => {}
    }
    let wanted_rad = target.tilt_azimuth_rad;
    let Some(view) = view else {
        return Advice::TipTowards { tilt_azimuth_rad: None, wanted_rad };
    };
    let off = Difference::of(view, target);
    let (tilt_rad, tilt_azimuth_rad) = (off.tilt_rad, view.tilt_azimuth_rad());
    let (span_fraction, ratio) = (view.span_fraction, off.size_ratio);
    let tilt = Advice::Tilt { tilt_rad, wanted_rad: target.tilt_rad, tilt_azimuth_rad: wanted_rad };
    let size = Advice::Distance { span_fraction, wanted: (span_fraction * ratio).min(1.0) };
    let place = Advice::Shift { right_px: off.shift_px.x, down_px: off.shift_px.y };
    let tipped = if off.is_flat() {
        [(FLAT.1, Advice::TipTowards { tilt_azimuth_rad: None, wanted_rad }); 2]
    } else {
        let tilt_azimuth_rad = Some(tilt_azimuth_rad);
        [
            (off.turn_rad.abs() / OFF_RAD, Advice::TipTowards { tilt_azimuth_rad, wanted_rad }),
            (libm::log(tilt_rad / target.tilt_rad).abs() / libm::log(TILTED), tilt),
        ]
    };
    let [direction, tilt] = tipped;
    let size = (libm::log(ratio).abs() / libm::log(SIZED), size);
    let place = (off.shift_px.norm() / (SHIFTED * off.radius_px), place);
    let (most, advice) =
        [tilt, size, place].into_iter().fold(direction, |a, b| if b.0 > a.0 { b } else { a });
    match *refusal {
        Refusal::Holding { progress } if most <= SHOWN || hand.has_stopped => {
            Advice::Holding { progress }
        }
        _ if most > SHOWN => advice,
        // Don't stop a hand on its way.
        Refusal::Moving { speed_px_per_s, wanted_px_per_s } => {
            Advice::HoldStill { speed_px_per_s, wanted_px_per_s }
        }
        refusal => Advice::Mend { refusal },
    }
}

/// Difference of a held board from the requested pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Difference {
    /// Turn from the board's direction to the requested direction.
    pub(crate) turn_rad: f64,
    /// Tilt of the board, and the requested tilt.
    pub(crate) tilt_rad: f64,
    pub(crate) wanted_tilt_rad: f64,
    /// Requested size over the board's size.
    pub(crate) size_ratio: f64,
    /// Shift to the requested place.
    pub(crate) shift_px: Vector2<f64>,
    /// Root mean square distance of the corners from their middle.
    radius_px: f64,
}

impl Difference {
    pub(crate) fn of(view: &View, target: &Target) -> Self {
        let corners_px: Vec<_> = view.corners.iter().map(|corner| corner.px).collect();
        let is_whole = view.corners.iter().all(Corner::is_seen);
        // The middle of a part isn't the board's middle.
        let board_px = if is_whole { view.mean_px } else { middle_px(&corners_px) };
        let radius_px = rms_radius_px(&corners_px);
        Self {
            turn_rad: direction_difference_rad(target.tilt_azimuth_rad, view.tilt_azimuth_rad()),
            tilt_rad: view.tilt_rad.unwrap_or(0.0),
            wanted_tilt_rad: target.tilt_rad,
            size_ratio: rms_radius_px(&target.ghost_px) / radius_px,
            shift_px: middle_px(&target.ghost_px) - board_px,
            radius_px,
        }
    }

    /// True if no edge is notably away.
    pub(crate) fn is_flat(&self) -> bool {
        self.tilt_rad < FLAT.0 * self.wanted_tilt_rad
    }
}

fn middle_px(points: &[nalgebra::Point2<f64>]) -> nalgebra::Point2<f64> {
    let sum = points.iter().fold(nalgebra::Vector2::zeros(), |sum, p| sum + p.coords);
    nalgebra::Point2::from(sum / points.len().max(1) as f64)
}

/// Root mean square distance of the points from their middle.
fn rms_radius_px(points: &[nalgebra::Point2<f64>]) -> f64 {
    let middle = middle_px(points);
    let sum: f64 = points.iter().map(|p| (p - middle).norm_squared()).sum();
    (sum / points.len().max(1) as f64).sqrt().max(1e-9)
}
