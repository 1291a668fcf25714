//! Facts shown by frames, beside the accepted views.

use super::accepted::AcceptedView;
use crate::guidance::{
    FAR_SPAN_FRACTION, GuidanceParams, LensEstimate, Readout, Scatter, Target, View,
};
use boresight_detect::Track;
use boresight_geometry::{Corner, boards::Board, boards::PartTells, frame::ImageSize};

/// Degrees of freedom at which the measured noise is known to 3 %.
const NOISE_FREEDOM: f64 = 600.0;
/// Minimum tilt for using the focal length of a single view.
const FOCAL_TILT_RAD: f64 = 12.0 * std::f64::consts::PI / 180.0;
/// Maximum relative standard deviation of a focal length for ghosts …
const FOCAL_SIGMA: f64 = 0.12;
/// … and minimum relative difference from the guess.
const FOCAL_CHANGE: f64 = 0.12;
/// Size of a ghost after receding, relative to before, and the maximum number of such steps before
/// a view is taken.
const RECEDING: f64 = 0.95;
const MOST_RECEDED: u32 = 14;
/// Number of successive boards below the share `TOO_SMALL` of the ghost, to be treated as far …
const SMALL_ENOUGH_TIMES: u32 = 2;
const TOO_SMALL: f64 = 0.6;
/// … and largest ghost from then on, as a multiple of the largest share seen.
const A_LITTLE_LARGER: f64 = 1.1;

/// Facts shown by frames, with an effect on the next request.
#[derive(Clone, Debug, Default)]
pub(super) struct Seen {
    /// Readout time of the sensor.
    pub(super) readout: Readout,
    /// Deviations of corners from the common motion of a board held still.
    pub(super) noise: Scatter,
    /// Focal length, in pixels, from single views before the first acceptance, if unusual.
    pub(super) first_f_px: Option<f64>,
    /// Sum of weights and of weighted logarithms of such focal lengths, and the smallest relative
    /// deviation.
    focal: (f64, f64, Option<f64>),
    /// Cap on the requested span as a share of the picture, because the board comes no nearer.
    pub(super) span_cap: Option<f64>,
    /// True if a board small in the picture has shown no further view for too long.
    pub(super) given_up: bool,
    /// Directions of impossible poses since the last view.
    pub(super) tried_rad: Vec<f64>,
    /// True if no more poses beyond the picture's edge are possible.
    pub(super) stays_inside: bool,
    /// Number of frames with a board soon enough after the frame before to identify a part, less
    /// the other frames.
    followed: i32,
    /// True if a part was identified in any of the other frames, without tracking.
    tells_parts: bool,
    /// Number of successive views much smaller than the ghosts, and the largest share spanned.
    small_in_a_row: Option<(u32, f64)>,
    /// Number of steps by which the ghost of the requested pose has receded.
    receded: u32,
}

impl Seen {
    /// Noise of a corner per axis; `None` until enough was seen.
    pub(super) fn noise_px(&self) -> Option<f64> {
        self.noise.corner_sigma_px(NOISE_FREEDOM)
    }

    /// Limits for a board no nearer than so far. The board leaves the picture only if parts of it
    /// can be identified.
    pub(super) fn limits(
        &self,
        guidance: &GuidanceParams,
        board: &Board,
        accepted: &[AcceptedView],
    ) -> GuidanceParams {
        let cap = self.span_cap.unwrap_or(1.0);
        let beyond_edge = accepted.iter().filter(|taken| taken.was_beyond_edge).count();
        let tells_parts = match board.target().part_tells() {
            PartTells::EachPoint => true,
            PartTells::WhenFollowed => self.tells_parts || self.followed > 0,
            PartTells::Nothing => false,
        };
        let is_enough = beyond_edge >= guidance.pairs_beyond_edge;
        let may_leave = tells_parts && !self.stays_inside && !is_enough;
        GuidanceParams {
            target_span_fraction: guidance.target_span_fraction.min(cap),
            stop_corner_sigma_px: guidance.stop_corner_sigma_px.filter(|_| may_leave),
            ..*guidance
        }
    }

    /// Notes a frame of a video with a board, `step_secs` after the frame before.
    pub(super) fn note_found(&mut self, corners: &[Corner], step_secs: Option<f64>) {
        let Some(step_secs) = step_secs else { return };
        if Track::names_corners_after(step_secs) {
            self.followed += 1;
        } else {
            self.followed -= 1;
            self.tells_parts |= !corners.iter().all(Corner::is_seen);
        }
    }

    /// Notes the removal of a view. A person once given up on may ask for another view, and a small
    /// removed view may have been the reason for the cap on the span.
    pub(super) fn note_removed(&mut self) {
        self.given_up = false;
        self.stays_inside = false;
        self.tried_rad.clear();
        self.span_cap = None;
        self.small_in_a_row = None;
    }

    /// `limits` for a ghost a step smaller than the ghost of `target`.
    pub(super) fn receded_limits(
        target: &Target,
        image_size: ImageSize,
        limits: GuidanceParams,
    ) -> GuidanceParams {
        let smaller = RECEDING * target.span_fraction(image_size);
        // Receding doesn't make a near board a far one.
        let least = if limits.is_far() { 0.0 } else { FAR_SPAN_FRACTION };
        GuidanceParams { target_span_fraction: smaller.max(least), ..limits }
    }

    /// Lets the ghost recede by another step; false if already at the limit.
    pub(super) fn recede(&mut self) -> bool {
        let may = self.receded < MOST_RECEDED;
        self.receded += u32::from(may);
        may
    }

    /// Notes the focal length of a view seen before any was accepted. Returns true if the estimate
    /// should change.
    pub(super) fn note_first_focal(&mut self, view: &View, lens_estimate: &LensEstimate) -> bool {
        if !view.tilt_rad.is_some_and(|tilt_rad| tilt_rad >= FOCAL_TILT_RAD) {
            return false;
        }
        let pp_px = lens_estimate.camera.pp_px;
        let Ok(focal) = view.line.focal_length(&pp_px, &lens_estimate.pp_covariance_px2()) else {
            return false;
        };
        let relative = focal.sigma_px / focal.f_px;
        if !(relative < FOCAL_SIGMA) {
            return false;
        }
        let weight = 1.0 / (relative * relative).max(1e-6);
        let (weights, sum, least) = self.focal;
        let least = least.unwrap_or(relative).min(relative);
        self.focal = (weights + weight, sum + weight * libm::log(focal.f_px), Some(least));
        let f_px = libm::exp(self.focal.1 / self.focal.0);
        let change = libm::log(f_px / lens_estimate.camera.f_px.x).abs();
        if change <= FOCAL_CHANGE {
            return false;
        }
        self.first_f_px = Some(f_px);
        true
    }

    /// Notes the cap on the span, if the board has spanned only a small share of the picture while
    /// `target` was requested. Returns true if so.
    pub(super) fn note_small(
        &mut self,
        largest_span_fraction: f64,
        target: &Target,
        image_size: ImageSize,
    ) -> bool {
        let asked = target.span_fraction(image_size);
        if !(largest_span_fraction > 0.0 && largest_span_fraction < TOO_SMALL * asked) {
            return false;
        }
        self.span_cap = Some(A_LITTLE_LARGER * largest_span_fraction);
        true
    }

    /// Notes the size of an accepted view, and the requested pose. A board much smaller twice in a
    /// row comes no nearer; a board once nearer may be asked to come nearer again.
    pub(super) fn note_accepted(
        &mut self,
        view: &View,
        target: Option<&Target>,
        image_size: ImageSize,
    ) {
        self.receded = 0;
        self.given_up = false;
        self.tried_rad.clear();
        let span_fraction = view.board_span_fraction(image_size);
        let is_small = target.is_some_and(|target| {
            !target.leaves_picture && span_fraction < TOO_SMALL * target.span_fraction(image_size)
        });
        self.small_in_a_row = is_small.then(|| {
            let (count, largest) = self.small_in_a_row.unwrap_or_default();
            (count + 1, largest.max(span_fraction))
        });
        if let Some((SMALL_ENOUGH_TIMES.., largest)) = self.small_in_a_row {
            self.span_cap = Some(A_LITTLE_LARGER * largest);
            self.small_in_a_row = None;
        } else if self.span_cap.is_some_and(|cap| TOO_SMALL * span_fraction > cap) {
            self.span_cap = None;
        }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Point2;

    use super::*;
    use boresight_geometry::boards::{MarkerSide, Pattern};

    #[test]
    fn boards_leave_the_picture_only_where_a_part_can_be_told() {
        let board = Board::new(9, 6, 0.025).expect("valid");
        let dictionary = "4x4_50".parse().expect("known");
        let markers = Pattern::Charuco { dictionary, side: MarkerSide::Usual };
        let marked = board.with(markers).expect("enough markers");
        let may_leave = |seen: &Seen, board: &Board| {
            seen.limits(&GuidanceParams::default(), board, &[]).stop_corner_sigma_px.is_some()
        };
        let corner = Corner::isotropic(Point2::origin(), 0.1);
        let mut seen = Seen::default();
        assert!(!may_leave(&seen, &board), "nothing was seen yet");
        seen.note_found(&[corner], Some(1.0 / 30.0));
        assert!(may_leave(&seen, &board), "the board can be followed");
        for _ in 0..3 {
            seen.note_found(&[corner], Some(1.0 / 3.0));
        }
        assert!(!may_leave(&seen, &board), "three pictures a second");
        assert!(may_leave(&seen, &marked), "markers tell parts at any rate");
        let part = [corner, Corner::unseen(Point2::origin())];
        seen.note_found(&part, Some(1.0 / 3.0));
        assert!(may_leave(&seen, &board), "something told a part: the printed code, say");
    }
}
