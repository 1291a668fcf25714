//! Settings of the planner.

use boresight_calibrate::DEFAULT_TYPICAL_GOAL_PX;
use boresight_geometry::frame::ImageSize;

/// Share of the picture below which boards count as far.
pub(crate) const FAR_SPAN_FRACTION: f64 = 0.45;

/// Most reflected pairs of boards beyond the picture's edge.
pub const PAIRS_BEYOND_EDGE: usize = 3;

/// Number of views to ask for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Plan {
    /// Two opposed pairs, 45° apart: the fewest views to fix the principal point.
    Quick,
    /// Four opposed pairs, 45° apart.
    Full,
    /// Opposed pairs until the precision goal.
    Adaptive,
}

impl Plan {
    /// Number of views of the complete plan; `None` if dependent on the precision.
    ///
    /// ```
    /// # use boresight_guide::guidance::Plan;
    /// assert_eq!(Plan::Full.views(), Some(8));
    /// assert_eq!(Plan::Adaptive.views(), None);
    /// ```
    pub fn views(self) -> Option<usize> {
        match self {
            Self::Quick => Some(4),
            Self::Full => Some(8),
            Self::Adaptive => None,
        }
    }
}

/// Turn of the board about the optical axis from direction to direction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BoardRoll {
    /// The board stays upright and tips in all directions: easy by hand, and the board fills the
    /// picture.
    Upright,
    /// The board turns with the direction, as in the source paper.
    Turn,
}

/// Settings of the planner. Angles in radians, lengths in pixels or as a share of the picture.
///
/// Source: `docs/method.md`, section 3.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GuidanceParams {
    /// Plan, for the number of views.
    pub plan: Plan,
    /// Turn of the board about the optical axis.
    pub board_roll: BoardRoll,
    /// Requested tilt: 40°; 5° more with a wide lens, 5° less with a long one.
    pub target_tilt_rad: f64,
    /// Largest requested share of the picture's width or height; boards are requested as large as
    /// the picture allows up to this.
    pub target_span_fraction: f64,
    /// Least distance of the requested corners from the picture's edge, as a share of the shorter
    /// side. The outer squares may leave the picture.
    pub target_margin_fraction: f64,
    /// Least angle between independent principal lines, in standard deviations of the angle.
    pub independent_sigmas: f64,
    /// Largest deviation of a partner's direction from exactly opposed.
    pub partner_slot_rad: f64,
    /// Duration of a hold.
    pub hold_secs: f64,
    /// Largest standard deviation of the principal point, worse axis, at which to stop.
    pub stop_pp_sigma_px: f64,
    /// Largest mean standard deviation of projection over the picture at which to stop.
    pub stop_projection_sigma_px: f64,
    /// Largest standard deviation of projection anywhere in the picture at which to stop without
    /// boards beyond the edge. `None` keeps boards in the picture.
    pub stop_corner_sigma_px: Option<f64>,
    /// Most reflected pairs of boards beyond the picture's edge.
    pub pairs_beyond_edge: usize,
    /// Fewest views before the session may stop.
    pub min_views: usize,
    /// Most requested views.
    pub max_views: usize,
}

impl Default for GuidanceParams {
    /// The values of `config/default.toml`.
    fn default() -> Self {
        Self {
            plan: Plan::Adaptive,
            board_roll: BoardRoll::Upright,
            target_tilt_rad: 40_f64.to_radians(),
            target_span_fraction: 1.0,
            target_margin_fraction: 0.042,
            independent_sigmas: 4.0,
            partner_slot_rad: 20_f64.to_radians(),
            hold_secs: 0.3,
            stop_pp_sigma_px: 1.0,
            stop_projection_sigma_px: DEFAULT_TYPICAL_GOAL_PX,
            stop_corner_sigma_px: Some(0.25),
            pairs_beyond_edge: PAIRS_BEYOND_EDGE,
            min_views: 4,
            max_views: 24,
        }
    }
}

impl GuidanceParams {
    /// Goal of the principal point's standard deviation for a lens of the given focal length: noise
    /// fixes it less well the longer the lens, by the square of `f / width`, whatever the poses.
    ///
    /// ```
    /// # use boresight_guide::guidance::GuidanceParams;
    /// let params = GuidanceParams::default();
    /// assert!(params.pp_goal_px(2.0) >= params.pp_goal_px(0.8));
    /// ```
    pub fn pp_goal_px(&self, f_to_width: f64) -> f64 {
        self.stop_pp_sigma_px * f_to_width.powi(2).max(1.0)
    }

    /// True if boards stay small in the picture, as in front of an installed camera: see `reach`.
    pub fn is_far(&self) -> bool {
        self.target_span_fraction < FAR_SPAN_FRACTION
    }

    /// True if boards beyond the picture's edge may be requested.
    pub fn leaves_picture(&self) -> bool {
        let is_adaptive = self.plan == Plan::Adaptive;
        let matters = self.stop_corner_sigma_px.is_some() && self.pairs_beyond_edge > 0;
        is_adaptive && matters && !self.is_far()
    }

    /// Requested tilt: steeper boards don't fit into the picture of a long lens, and flatter ones
    /// give a wide lens less information.
    ///
    /// ```
    /// # use boresight_guide::guidance::GuidanceParams;
    /// let tilt = |f_to_width| GuidanceParams::default().wanted_tilt_rad(f_to_width);
    /// assert!(tilt(0.5) > tilt(1.0) && tilt(1.0) > tilt(2.0));
    /// ```
    pub fn wanted_tilt_rad(&self, f_to_width: f64) -> f64 {
        let step_rad = 5_f64.to_radians();
        if f_to_width < 0.6 {
            self.target_tilt_rad + step_rad
        } else if f_to_width > 1.5 {
            self.target_tilt_rad - step_rad
        } else {
            self.target_tilt_rad
        }
    }
}

/// Width of the pictures behind lengths stated in pixels.
const TUNED_WIDTH_PX: f64 = 1280.0;

/// Growth factor of lengths in pixels in a picture of `image_size`: 1 up to a width of 1280, then
/// with the width.
///
/// They don't shrink in smaller pictures: a pixel's own width blurs an edge by as much there, and a
/// hand following the screen errs by whole pixels of the display.
pub(crate) fn width_scale(image_size: ImageSize) -> f64 {
    (f64::from(image_size.width_px) / TUNED_WIDTH_PX).max(1.0)
}
