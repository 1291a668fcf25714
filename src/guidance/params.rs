//! Limits of the planner, and how they scale with the picture.

use crate::frame::ImageSize;

/// How many views to ask for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Plan {
    /// Two opposed pairs at right angles: the fewest views that fix the principal point.
    Quick,
    /// Four opposed pairs, 45° apart.
    Full,
    /// Two opposed pairs, then the most informative reflected pairs until the wanted precision.
    Adaptive,
}

impl Plan {
    /// Slots of [`super::SLOTS_DEG`] that the plan asks for before anything else.
    pub fn slots(self) -> usize {
        match self {
            Self::Quick | Self::Adaptive => 4,
            Self::Full => 8,
        }
    }
}

/// How the board turns about the optical axis from slot to slot.
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
/// | `min_tilt_deg` | 30 | least tilt accepted |
/// | `target_tilt_deg` | 42 | tilt asked for |
/// | `max_tilt_deg` | 55 | largest tilt accepted |
///
/// Lengths in pixels are tuned for a picture 1280 pixels wide; [`Self::for_image`] scales them.
/// Source: `docs/method.md`, section 3.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GuidanceParams {
    /// How many views.
    pub plan: Plan,
    /// How the board is held.
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
    /// Share asked for.
    pub target_span_fraction: f64,
    /// Least distance of a corner from the picture's edge.
    pub margin_px: f64,
    /// Largest deviation from a slot's direction.
    pub max_slot_error_rad: f64,
    /// Least angle between independent principal lines.
    pub independent_rad: f64,
    /// The same, in standard deviations of that angle.
    pub independent_sigmas: f64,
    /// Largest deviation of a partner's direction from exactly opposed.
    pub partner_slot_rad: f64,
    /// Largest distance of a partner's centre from the reflected one while the lens is unknown.
    pub partner_offset_px: f64,
    /// Widest blur of the board's edges.
    pub max_blur_px: f64,
    /// How long the board must be still.
    pub hold_secs: f64,
    /// Fastest corner that counts as still, in picture widths per second.
    pub still_widths_per_sec: f64,
    /// Largest standard deviation of the principal point, worse axis, at which to stop.
    pub stop_pp_sigma_px: f64,
    /// Largest mean standard deviation of projection over the picture at which to stop.
    pub stop_projection_sigma_px: f64,
    /// Fewest views.
    pub min_views: usize,
    /// Most views.
    pub max_views: usize,
}

impl Default for GuidanceParams {
    /// The values of `config/default.toml`.
    fn default() -> Self {
        Self {
            plan: Plan::Adaptive,
            board_roll: BoardRoll::Upright,
            min_tilt_rad: 30_f64.to_radians(),
            max_tilt_rad: 55_f64.to_radians(),
            target_tilt_rad: 42_f64.to_radians(),
            max_sigma_phi_rad: 2_f64.to_radians(),
            min_span_fraction: 0.5,
            target_span_fraction: 0.72,
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

impl GuidanceParams {
    /// These limits for pictures of `image_size`: lengths in pixels grow with the width, as [`width_scale`] says.
    ///
    /// The precision at which to stop is what the person asked for and stays.
    #[must_use]
    pub fn for_image(self, image_size: ImageSize) -> Self {
        let scale = width_scale(image_size);
        Self {
            margin_px: scale * self.margin_px,
            partner_offset_px: scale * self.partner_offset_px,
            max_blur_px: scale * self.max_blur_px,
            ..self
        }
    }
}

/// Width of the pictures for which lengths in pixels were tuned.
const TUNED_WIDTH_PX: f64 = 1280.0;

/// By how much lengths in pixels grow in a picture of `image_size`: 1 up to a width of 1280, then with the width.
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
    fn lengths_grow_with_the_picture_and_never_shrink() {
        let sized = |width_px| {
            let image_size = ImageSize { width_px, height_px: width_px * 9 / 16 };
            let params = GuidanceParams::default().for_image(image_size);
            [params.margin_px, params.partner_offset_px, params.max_blur_px]
        };
        assert_eq!(sized(1280), [8.0, 25.0, 3.5]);
        assert_eq!(sized(3840), [24.0, 75.0, 10.5]);
        assert_eq!(sized(320), [8.0, 25.0, 3.5]);
    }
}
