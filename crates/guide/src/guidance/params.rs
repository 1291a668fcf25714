//! Limits of the planner, and how they scale with the picture.

use boresight_geometry::frame::ImageSize;

/// Share of the picture below which boards count as far.
pub const FAR_SPAN_FRACTION: f64 = 0.45;

/// Most reflected pairs of boards that leave the picture.
pub const PAIRS_BEYOND_EDGE: usize = 3;

/// Number of views to ask for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Plan {
    /// Two opposed pairs, 45° apart: the fewest views that fix the principal point.
    Quick,
    /// Four opposed pairs, 45° apart.
    Full,
    /// Opposed pairs 45° apart until the wanted precision; after four pairs the most informative reflected ones.
    Adaptive,
}

impl Plan {
    /// Slots of [`super::slots_deg`] that the plan asks for before anything else.
    pub fn slots(self) -> usize {
        match self {
            Self::Quick => 4,
            Self::Full | Self::Adaptive => 8,
        }
    }
}

/// Turn of the board about the optical axis, from slot to slot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BoardRoll {
    /// The board stays upright and tips in eight directions: easy by hand, and it fills the picture.
    Upright,
    /// The board turns with the slot, as in the source paper.
    Turn,
}

/// Limits of the planner. Angles in radians, lengths in pixels or as a share of the picture.
///
/// The tilt limits, as in `config/default.toml`:
///
/// | key | degrees | meaning |
/// |---|---|---|
/// | `min_tilt_deg` | 10 | least tilt accepted |
/// | `target_tilt_deg` | 40 | tilt asked for; 5° more with a wide lens, 5° less with a long one |
/// | `max_tilt_deg` | 65 | largest tilt accepted |
///
/// Lengths in pixels are tuned for a picture 1280 pixels wide; [`Self::for_image`] scales them.
/// Source: `docs/method.md`, section 3.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GuidanceParams {
    /// Plan, which sets the number of views.
    pub plan: Plan,
    /// Turn of the board about the optical axis.
    pub board_roll: BoardRoll,
    /// Least tilt accepted.
    pub min_tilt_rad: f64,
    /// Largest tilt accepted.
    pub max_tilt_rad: f64,
    /// Tilt asked for.
    pub target_tilt_rad: f64,
    /// Largest standard deviation of the principal line's direction.
    pub max_sigma_phi_rad: f64,
    /// Least share of the picture's width or height that the corners must span.
    pub min_span_fraction: f64,
    /// Largest share asked for; boards are asked for as large as the picture allows up to this.
    pub target_span_fraction: f64,
    /// Least distance of a corner from the picture's edge.
    pub margin_px: f64,
    /// Least distance from the picture's edge of the corners asked for, as a share of the shorter side. The
    /// outer squares may leave the picture.
    pub target_margin_fraction: f64,
    /// Largest angle by which a direction asked for may leave its slot to keep clear of accepted ones.
    pub max_slot_error_rad: f64,
    /// Least angle between independent principal lines.
    pub independent_rad: f64,
    /// Least angle between independent principal lines, in standard deviations of that angle.
    pub independent_sigmas: f64,
    /// Largest deviation of a partner's direction from exactly opposed.
    pub partner_slot_rad: f64,
    /// Largest distance of a partner's centre from the reflected one while the lens is unknown.
    pub partner_offset_px: f64,
    /// Widest blur of the board's edges.
    pub max_blur_px: f64,
    /// Time for which the board must be still.
    pub hold_secs: f64,
    /// Longest smear of a corner during the exposure.
    pub max_smear_px: f64,
    /// Fastest motion that counts as still at any exposure, in picture widths per second.
    pub still_widths_per_sec: f64,
    /// Largest standard deviation of the principal point, worse axis, at which to stop.
    pub stop_pp_sigma_px: f64,
    /// Largest mean standard deviation of projection over the picture at which to stop.
    pub stop_projection_sigma_px: f64,
    /// Largest standard deviation of projection anywhere in the picture at which to stop without boards that leave it.
    /// `None` keeps boards in the picture.
    pub stop_corner_sigma_px: Option<f64>,
    /// Most reflected pairs of boards that leave the picture.
    pub pairs_beyond_edge: usize,
    /// Fewest views before the session may stop.
    pub min_views: usize,
    /// Most views that are asked for.
    pub max_views: usize,
}

impl Default for GuidanceParams {
    /// The values of `config/default.toml`.
    fn default() -> Self {
        Self {
            plan: Plan::Adaptive,
            board_roll: BoardRoll::Upright,
            min_tilt_rad: 10_f64.to_radians(),
            max_tilt_rad: 65_f64.to_radians(),
            target_tilt_rad: 40_f64.to_radians(),
            max_sigma_phi_rad: 2_f64.to_radians(),
            min_span_fraction: 0.05,
            target_span_fraction: 1.0,
            margin_px: 13.0,
            target_margin_fraction: 0.042,
            max_slot_error_rad: 15_f64.to_radians(),
            independent_rad: 20_f64.to_radians(),
            independent_sigmas: 4.0,
            partner_slot_rad: 20_f64.to_radians(),
            partner_offset_px: 50.0,
            max_blur_px: 3.5,
            hold_secs: 0.3,
            max_smear_px: 0.35,
            still_widths_per_sec: 0.1,
            stop_pp_sigma_px: 1.0,
            stop_projection_sigma_px: 0.3,
            stop_corner_sigma_px: Some(0.04),
            pairs_beyond_edge: PAIRS_BEYOND_EDGE,
            min_views: 4,
            max_views: 24,
        }
    }
}

impl GuidanceParams {
    /// The limits for pictures of `image_size`: lengths in pixels grow with the width, as [`width_scale`] says.
    ///
    /// The precision at which to stop is the person's choice and stays.
    #[must_use]
    pub fn for_image(self, image_size: ImageSize) -> Self {
        let scale = width_scale(image_size);
        Self {
            margin_px: self.margin_in(image_size),
            partner_offset_px: scale * self.partner_offset_px,
            max_blur_px: scale * self.max_blur_px,
            max_smear_px: scale * self.max_smear_px,
            ..self
        }
    }

    fn margin_in(&self, image_size: ImageSize) -> f64 {
        let margin_px = self.margin_px * f64::from(image_size.width_px) / TUNED_WIDTH_PX;
        margin_px.max(self.margin_px.min(LEAST_MARGIN_PX))
    }

    /// Goal of the principal point's standard deviation for a lens of that focal length. At any poses, noise fixes it
    /// less well the longer the lens, by the square of `f / width`.
    pub fn pp_goal_px(&self, f_to_width: f64) -> f64 {
        self.stop_pp_sigma_px * f_to_width.powi(2).max(1.0)
    }

    /// The limits once `accepted` views have been taken: five lines 20° apart and more leave no open direction, so
    /// that further lines, still significantly independent, may lie closer.
    #[must_use]
    pub fn after(self, accepted: usize) -> Self {
        let closer = if accepted >= CLOSER_FROM_VIEWS { CLOSER } else { 1.0 };
        Self { independent_rad: closer * self.independent_rad, ..self }
    }

    /// The limits for views that should cover more of the picture: their direction hardly matters.
    #[must_use]
    pub fn for_coverage(self) -> Self {
        Self { independent_rad: CLOSER * self.independent_rad, ..self }
    }

    /// True if boards stay small in the picture, as in front of an installed camera: see [`mod@super::reach`].
    pub fn is_far(&self) -> bool {
        self.target_span_fraction < FAR_SPAN_FRACTION
    }

    /// Tilt to ask for: steeper boards don't fit into the picture of a long lens, and flatter ones determine a wide
    /// lens less well.
    pub fn wanted_tilt_rad(&self, f_to_width: f64) -> f64 {
        let step_rad = 5_f64.to_radians();
        let tilt_rad = if f_to_width < 0.6 {
            self.target_tilt_rad + step_rad
        } else if f_to_width > 1.5 {
            self.target_tilt_rad - step_rad
        } else {
            self.target_tilt_rad
        };
        tilt_rad.clamp(self.min_tilt_rad, self.max_tilt_rad)
    }

    /// The limits for the partner of an accepted view. Its ghost repeats that view, which may lie at a limit, and
    /// a person never meets a ghost exactly.
    #[must_use]
    pub fn for_partner(self) -> Self {
        Self {
            min_tilt_rad: 0.85 * self.min_tilt_rad,
            max_tilt_rad: (1.15 * self.max_tilt_rad).min(1.4),
            min_span_fraction: 0.85 * self.min_span_fraction,
            margin_px: 0.7 * self.margin_px,
            max_blur_px: 1.15 * self.max_blur_px,
            ..self
        }
    }
}

/// Number of views from which principal lines may lie closer, by this factor.
const CLOSER_FROM_VIEWS: usize = 10;
const CLOSER: f64 = 0.45;
/// Least distance of a corner from the picture's edge that an edge fit needs, in a picture of any size.
const LEAST_MARGIN_PX: f64 = 8.0;
/// Width of the pictures for which lengths in pixels were tuned.
const TUNED_WIDTH_PX: f64 = 1280.0;

/// Factor by which lengths in pixels grow in a picture of `image_size`: 1 up to a width of 1280, then with the width.
///
/// They don't shrink in smaller pictures: a pixel's own width blurs an edge by as much there, and a hand that
/// follows the screen errs by whole pixels of what it sees.
pub fn width_scale(image_size: ImageSize) -> f64 {
    (f64::from(image_size.width_px) / TUNED_WIDTH_PX).max(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_grow_with_the_picture_and_hardly_shrink() {
        let sized = |width_px| {
            let image_size = ImageSize { width_px, height_px: width_px * 9 / 16 };
            let params = GuidanceParams::default().for_image(image_size);
            [params.margin_px, params.partner_offset_px, params.max_blur_px]
        };
        assert_eq!(sized(1280), [13.0, 50.0, 3.5]);
        assert_eq!(sized(3840), [39.0, 150.0, 10.5]);
        assert_eq!(sized(320), [8.0, 50.0, 3.5]);
    }
}
