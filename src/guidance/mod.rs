//! What is this view worth, and what should the person show next?
//!
//! Pure functions of numbers: equal views, lens_estimate and parameters give equal answers, live or replayed.
//! The flow, one file a stage:
//!
//! | stage | question | degenerate case |
//! |---|---|---|
//! | [`view`] | what does this picture of the board measure? | too frontal for a principal line: [`Refusal::NoLine`] |
//! | [`mod@gate`] | is it good enough to be used at all? | every answer carries what was measured and what is wanted |
//! | [`independence`] | does its principal line add anything? | an opposed pair is parallel by design and is one unit |
//! | [`stillness`] | is the board held still? | photographs are still by definition |
//! | [`target`] | which pose next, and where on the screen? | no lens_estimate yet: the picture's centre and a usual focal length |
//! | [`information`] | which reflected pair tells most? | directions used up: no target |
//! | [`stop`] | are we done? | never before every view has its partner |
//! | [`advice`] | which one thing should the person do now? | |

pub mod advice;
pub mod gate;
pub mod independence;
pub mod information;
pub mod stillness;
pub mod stop;
pub mod target;
pub mod view;

pub use advice::{Advice, advise};
pub use gate::{Refusal, gate};
pub use independence::{Role, partner_of, role_of};
pub use stillness::Hold;
pub use stop::{Progress, final_progress, forecast, progress};
pub use target::{Purpose, Target, next_target};
pub use view::{LensEstimate, View, measure};

use std::f64::consts::PI;

/// How many views to ask for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Plan {
    /// Two opposed pairs at right angles: the fewest views that fix the principal point.
    Quick,
    /// Four opposed pairs, 45° apart.
    Full,
    /// Two pairs, then reflected pairs where they tell most, until the wanted precision.
    Adaptive,
}

/// How the board is turned about the optical axis from slot to slot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BoardRoll {
    /// The board stays upright and tips in eight directions: easy by hand, fills the picture.
    Upright,
    /// The board turns with the slot, as in the source paper.
    Turn,
}

/// Limits of the planner. Angles in radians, lengths in pixels or as a share of the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GuidanceParams {
    /// How many views.
    pub plan: Plan,
    /// How the board is held.
    pub board_roll: BoardRoll,
    /// Least tilt that is accepted.
    pub min_tilt_rad: f64,
    /// Largest tilt that is accepted.
    pub max_tilt_rad: f64,
    /// Tilt that is asked for.
    pub target_tilt_rad: f64,
    /// Largest uncertainty of the principal line's direction.
    pub max_sigma_phi_rad: f64,
    /// Least share of the picture's width or height that the corners span.
    pub min_fill: f64,
    /// Share that is asked for.
    pub target_fill: f64,
    /// Least distance of a corner from the picture's edge.
    pub margin_px: f64,
    /// Largest deviation from a slot's direction.
    pub max_slot_error_rad: f64,
    /// Least angle between independent principal lines.
    pub independent_rad: f64,
    /// The same in standard deviations of that angle.
    pub independent_sigmas: f64,
    /// Largest deviation of a partner's direction from exactly opposed.
    pub partner_slot_rad: f64,
    /// Largest distance of a partner's centre from the reflected one, while nothing else is known.
    pub partner_offset_px: f64,
    /// Widest blur of the edges.
    pub max_blur_px: f64,
    /// How long the board must be still.
    pub hold_secs: f64,
    /// Fastest corner that counts as still, as a share of the picture's width per second.
    pub still_widths_per_sec: f64,
    /// Largest standard deviation of the principal point, worst axis, at which to stop.
    pub stop_pp_sigma_px: f64,
    /// Largest mean standard deviation of projection over the picture at which to stop.
    pub stop_projection_sigma_px: f64,
    /// Fewest views.
    pub min_views: usize,
    /// Most views.
    pub max_views: usize,
}

impl Default for GuidanceParams {
    /// METHOD section 3: accept 30–50° (hard limits 25–60°), ask for 42°, fill at least half of the picture.
    fn default() -> Self {
        Self {
            plan: Plan::Adaptive,
            board_roll: BoardRoll::Upright,
            min_tilt_rad: 30_f64.to_radians(),
            max_tilt_rad: 55_f64.to_radians(),
            target_tilt_rad: 42_f64.to_radians(),
            max_sigma_phi_rad: 2_f64.to_radians(),
            min_fill: 0.5,
            target_fill: 0.72,
            margin_px: 8.0,
            max_slot_error_rad: 15_f64.to_radians(),
            independent_rad: 20_f64.to_radians(),
            independent_sigmas: 4.0,
            partner_slot_rad: 20_f64.to_radians(),
            partner_offset_px: 25.0,
            max_blur_px: 3.5,
            hold_secs: 0.6,
            still_widths_per_sec: 0.02,
            stop_pp_sigma_px: 1.0,
            stop_projection_sigma_px: 0.3,
            min_views: 4,
            max_views: 16,
        }
    }
}

/// The eight slots in the order in which they are asked for: each is followed by its opposite.
pub const SLOTS_DEG: [f64; 8] = [0.0, 180.0, 90.0, 270.0, 45.0, 225.0, 135.0, 315.0];

/// Signed difference of two directions, in `(-π, π]`.
pub fn direction_difference_rad(a: f64, b: f64) -> f64 {
    let difference = (a - b).rem_euclid(2.0 * PI);
    if difference > PI { difference - 2.0 * PI } else { difference }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_differ_the_short_way_round() {
        assert!((direction_difference_rad(0.1, 2.0 * PI - 0.1) - 0.2).abs() < 1e-12);
        assert!((direction_difference_rad(PI + 0.1, 0.0) + (PI - 0.1)).abs() < 1e-12);
        assert_eq!(direction_difference_rad(PI, 0.0), PI);
    }
}
