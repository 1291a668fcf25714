//! Facts that frames have shown beside the views taken from them.

use super::accepted::AcceptedView;
use crate::guidance::{
    GuidanceParams, LensEstimate, Precision, Readout, Scatter, Target, View,
    params::FAR_SPAN_FRACTION,
};
use boresight_detect::Track;
use boresight_geometry::{Corner, board::Checkerboard, frame::ImageSize, target::PartTells};

/// Degrees of freedom from which the measured noise is known to 3 %.
const NOISE_FREEDOM: f64 = 600.0;
/// Least tilt at which the focal length of a single view is used.
const FOCAL_TILT_RAD: f64 = 12.0 * std::f64::consts::PI / 180.0;
/// A focal length whose relative standard deviation is below this …
const FOCAL_SIGMA: f64 = 0.12;
/// … and that differs from the guess by more than this share draws ghosts from then on.
const FOCAL_CHANGE: f64 = 0.12;
/// No goal is asked for that this camera's corners can't reach: projection in the picture's corners needn't be known better
/// than this many times the error of a measured corner …
const CORNER_TO_NOISE: f64 = 5.0;
/// … and the principal point no better than this many times.
const PP_TO_NOISE: f64 = 20.0;
/// Size of a ghost after it recedes, relative to before, and how often it may recede before a view is taken.
const RECEDING: f64 = 0.95;
const MOST_RECEDED: u32 = 14;
/// A board spanning less than `TOO_SMALL` of the ghost, this many times in a row, is treated as far …
const SMALL_ENOUGH_TIMES: u32 = 2;
const TOO_SMALL: f64 = 0.6;
/// … and the ghost then spans at most this multiple of the largest share seen.
const A_LITTLE_LARGER: f64 = 1.1;

/// Facts that frames have shown; they change the next request.
#[derive(Clone, Debug, Default)]
pub(super) struct Seen {
    /// How long the sensor takes to read its rows.
    pub(super) readout: Readout,
    /// What corners strayed from the common motion of a board that was held still.
    pub(super) noise: Scatter,
    /// Focal length, in pixels, from single views before the first was accepted, if it isn't the usual one.
    pub(super) first_f_px: Option<f64>,
    /// Sum of weights and of weighted focal lengths of such views, and the smallest relative deviation.
    focal: (f64, f64, Option<f64>),
    /// Cap on the share of the picture that the board is asked to span, because it doesn't come nearer.
    pub(super) span_cap: Option<f64>,
    /// True if a board that stays small has shown no further view for so long that none will come.
    pub(super) given_up: bool,
    /// Directions of poses that couldn't be shown since the last view.
    pub(super) tried_rad: Vec<f64>,
    /// Whether no more poses beyond the picture's edge can be shown.
    pub(super) stays_inside: bool,
    /// Frames with a board that came soon enough after the one before to identify a part, less the other frames.
    followed: i32,
    /// True if a part was told in one of the others: not by following it.
    tells_parts: bool,
    /// Number of views in a row that were much smaller than their ghosts, and the largest share that they spanned.
    small_in_a_row: Option<(u32, f64)>,
    /// Number of times that the ghost of the pose asked for has receded.
    receded: u32,
}

impl Seen {
    /// Noise of one corner per axis; `None` until enough was seen.
    pub(super) fn noise_px(&self) -> Option<f64> {
        self.noise.corner_sigma_px(NOISE_FREEDOM)
    }

    /// The limits for a board that comes no nearer than it has, leaves the picture only if parts of it can be told, and whose
    /// corners are measured with errors of `noise_px`.
    pub(super) fn limits(
        &self,
        guidance: &GuidanceParams,
        board: &Checkerboard,
        accepted: &[AcceptedView],
        noise_px: Option<f64>,
    ) -> GuidanceParams {
        let cap = self.span_cap.unwrap_or(1.0);
        let beyond_edge = accepted.iter().filter(|taken| taken.was_beyond_edge).count();
        let tells_parts = match board.target().part_tells() {
            PartTells::EachPoint => true,
            PartTells::WhenFollowed => self.tells_parts || self.followed > 0,
            PartTells::Nothing => false,
        };
        let may_leave = tells_parts && !self.stays_inside;
        let within = within_reach(guidance, noise_px);
        GuidanceParams {
            target_span_fraction: guidance.target_span_fraction.min(cap),
            pairs_beyond_edge: guidance.pairs_beyond_edge.saturating_sub(beyond_edge),
            stop_corner_sigma_px: within.stop_corner_sigma_px.filter(|_| may_leave),
            ..within
        }
    }

    /// True if projection is known too badly in the picture's corners, for this camera's `noise_px` of a corner, although
    /// the plan asks for it: whether or not boards beyond the edge are asked for any more.
    pub(super) fn lacks_corners(
        guidance: &GuidanceParams,
        precision: Option<&Precision>,
        noise_px: Option<f64>,
    ) -> bool {
        let wanted = within_reach(guidance, noise_px);
        precision.is_some_and(|precision| precision.lacks_corners(&wanted))
    }

    /// Notes a frame of a video in which a board was found, `step_secs` after the frame before.
    pub(super) fn note_found(&mut self, corners: &[Corner], step_secs: Option<f64>) {
        let Some(step_secs) = step_secs else { return };
        if Track::names_corners_after(step_secs) {
            self.followed += 1;
        } else {
            self.followed -= 1;
            self.tells_parts |= !corners.iter().all(Corner::is_seen);
        }
    }

    /// Notes that a view was removed: the person, who had given up, may want another one, and a small one may have been
    /// the reason why the board seemed unable to come nearer.
    pub(super) fn note_removed(&mut self) {
        self.given_up = false;
        self.stays_inside = false;
        self.tried_rad.clear();
        self.span_cap = None;
        self.small_in_a_row = None;
    }

    /// `limits` for a ghost one step smaller than `target`'s.
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

    /// Lets the ghost recede by another step; false if it has receded enough.
    pub(super) fn recede(&mut self) -> bool {
        let may = self.receded < MOST_RECEDED;
        self.receded += u32::from(may);
        may
    }

    /// Notes the focal length of a view that was seen before any was accepted. Returns true if the believed one should
    /// change.
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

    /// Notes that the board comes no nearer, if it has spanned only a small share of the picture while `target` was
    /// asked for. Returns true if so.
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

    /// Notes the size of an accepted view, and the pose that was asked for. A board that is much smaller twice in a row
    /// comes no nearer; one that has come nearer may be asked to do so again.
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

/// The goals that a camera can reach whose corners are measured with errors of `noise_px`; those set, while that isn't known.
fn within_reach(guidance: &GuidanceParams, noise_px: Option<f64>) -> GuidanceParams {
    let noise_px = noise_px.unwrap_or(0.0);
    let coarse = |limit_px: f64| limit_px.max(CORNER_TO_NOISE * noise_px);
    GuidanceParams {
        stop_pp_sigma_px: guidance.stop_pp_sigma_px.max(PP_TO_NOISE * noise_px),
        stop_corner_sigma_px: guidance.stop_corner_sigma_px.map(coarse),
        ..*guidance
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Point2;

    use super::*;
    use boresight_geometry::markers::Markers;

    #[test]
    fn boards_leave_the_picture_only_where_a_part_can_be_told() {
        let board = Checkerboard::new(9, 6, 0.025).expect("valid");
        let dictionary = "4x4_50".parse().expect("known");
        let marked = board.with_markers(Markers::sized(dictionary, None)).expect("enough markers");
        let may_leave = |seen: &Seen, board: &Checkerboard| {
            seen.limits(&GuidanceParams::default(), board, &[], None).stop_corner_sigma_px.is_some()
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
