//! Information that a view would add about the lens to the accepted ones. Source: `docs/method.md`, sections 3.4 and
//! 3.8.

use nalgebra::Isometry3;

use super::{
    information::{
        CORNER_SIGMA_PX, LensMatrix, information_in_picture, information_of, pp_places,
        prior_information, projection_weight,
    },
    params::GuidanceParams,
    slots::direction_difference_rad,
    view::{LensEstimate, View},
};
use boresight_geometry::{Corner, board::Checkerboard, fit_pose};

/// Least share, at first, of the information of the pose asked for …
const FIRST_SHARE: f64 = 0.4;
/// … halved each time this long has passed …
const HALVED_EVERY_SECS: f64 = 0.6;
/// … and multiplied by this for each view that someone showed without following the ghost.
const UNFOLLOWED: f64 = 0.25;
/// Angle from the direction asked for within which the board of someone who follows the ghost recedes.
const FOLLOWED_WITHIN_RAD: f64 = 30.0 * std::f64::consts::PI / 180.0;
/// A view with a smaller share isn't worth a place.
const LEAST_SHARE: f64 = 0.05;

/// Information about the lens from the accepted views and weak priors.
#[derive(Clone, Debug, PartialEq)]
pub struct Knowledge {
    information: LensMatrix,
    /// Weight of the lens's covariance in [`Self::variance_with`].
    weight: LensMatrix,
    /// Expected variance without a further view.
    variance: f64,
}

impl Knowledge {
    /// Information in the seen corners of the `accepted` views, with errors of a tenth of a pixel.
    pub fn new(
        accepted: &[View],
        board: &Checkerboard,
        lens_estimate: &LensEstimate,
        params: &GuidanceParams,
    ) -> Self {
        let information = accepted_information(accepted, board, lens_estimate);
        let (projection, pixels) = projection_weight(lens_estimate);
        let mut weight =
            projection / (2.0 * pixels.max(1) as f64 * params.stop_projection_sigma_px.powi(2));
        let pp_goal_px = params.pp_goal_px(lens_estimate.f_to_width());
        for index in pp_places() {
            weight[(index, index)] += 0.5 / (pp_goal_px * pp_goal_px);
        }
        let mut knowledge = Self { information, weight, variance: f64::INFINITY };
        knowledge.variance = knowledge.variance_with(&LensMatrix::zeros()).unwrap_or(f64::INFINITY);
        knowledge
    }

    /// Expected variance in units of the goals, with `more` information: mean squared standard deviation of
    /// projection over its goal squared, plus the mean variance of the principal point per axis over its goal
    /// squared. `None` if the sum isn't positive definite.
    pub fn variance_with(&self, more: &LensMatrix) -> Option<f64> {
        let covariance = (self.information + more).cholesky()?.inverse();
        Some((self.weight * covariance).trace())
    }

    /// [`Self::variance_with`] a board at that pose, from the corners in the picture; the present variance if it adds
    /// nothing.
    pub fn variance_after(
        &self,
        cam_from_board: &Isometry3<f64>,
        board: &Checkerboard,
        lens_estimate: &LensEstimate,
    ) -> f64 {
        let more = information_in_picture(cam_from_board, board, lens_estimate, CORNER_SIGMA_PX);
        self.variance_after_more(more)
    }

    /// [`Self::variance_with`] the seen ones of `corners`; the present variance if they add nothing.
    pub fn variance_after_seen(
        &self,
        corners: &[Corner],
        board: &Checkerboard,
        lens_estimate: &LensEstimate,
    ) -> f64 {
        self.variance_after_more(seen_information(corners, board, lens_estimate))
    }

    fn variance_after_more(&self, more: Option<LensMatrix>) -> f64 {
        more.and_then(|more| self.variance_with(&more))
            .map_or(self.variance, |after| after.min(self.variance))
    }

    /// Information of a view over the information of the pose asked for, from the variances that both would leave: the
    /// smaller of their ratio, which counts at first, and of the ratio of the logarithms by which they shrink the
    /// variance, which counts once much is known. 1 if the pose asked for adds nothing.
    pub fn share(&self, after: f64, after_wanted: f64) -> f64 {
        let removed = (self.variance / after).ln();
        let removed_by_wanted = (self.variance / after_wanted).ln();
        if !(removed_by_wanted > 0.0) {
            return 1.0;
        }
        (removed / removed_by_wanted).min(after_wanted / after)
    }
}

/// Information about the lens from the seen corners of the `accepted` views, and from weak priors.
pub(super) fn accepted_information(
    accepted: &[View],
    board: &Checkerboard,
    lens_estimate: &LensEstimate,
) -> LensMatrix {
    accepted
        .iter()
        .filter_map(|view| seen_information(&view.corners, board, lens_estimate))
        .fold(prior_information(lens_estimate), |sum, view| sum + view)
}

/// Information about the lens from the seen ones of `corners`; `None` if they fit no board.
fn seen_information(
    corners: &[Corner],
    board: &Checkerboard,
    lens_estimate: &LensEstimate,
) -> Option<LensMatrix> {
    let pose = pose_of(corners, board, lens_estimate)?;
    information_of(&pose, board, &lens_estimate.camera, CORNER_SIGMA_PX, |index, _| {
        corners.get(index).is_some_and(Corner::is_seen)
    })
}

/// Pose of the board with its corners at `corners`; `None` if they fit no board.
pub fn pose_of(
    corners: &[Corner],
    board: &Checkerboard,
    lens_estimate: &LensEstimate,
) -> Option<Isometry3<f64>> {
    let fit = fit_pose(&lens_estimate.camera, &board.corners_in_board_m(), corners).ok()?;
    Some(fit.cam_from_board)
}

/// Least share at which a view is taken, after the pose has been asked for during `waited_secs` with a board in the
/// picture. `unfollowed` counts the views for which [`is_followed`] was false. Someone on the way to the
/// pose isn't interrupted; someone who doesn't follow, or can't, gets views all the same.
pub fn least_share(waited_secs: f64, unfollowed: u32) -> f64 {
    let patience = 0.5_f64.powf(waited_secs.max(0.0) / HALVED_EVERY_SECS);
    (FIRST_SHARE * patience * UNFOLLOWED.powi(unfollowed.min(20) as i32)).max(LEAST_SHARE)
}

/// True if someone who follows the ghost showed `view`: `share`, its information over that of the pose asked for, is
/// large, and the board recedes about in the direction asked for, `wanted_azimuth_rad`, if any was.
pub fn is_followed(view: &View, share: f64, wanted_azimuth_rad: Option<f64>) -> bool {
    let is_turned_away = wanted_azimuth_rad.is_some_and(|wanted_rad| {
        let off_rad = direction_difference_rad(view.tilt_azimuth_rad(), wanted_rad).abs();
        off_rad > FOLLOWED_WITHIN_RAD
    });
    share >= FIRST_SHARE && !is_turned_away
}
