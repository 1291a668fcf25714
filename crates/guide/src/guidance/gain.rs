//! Gain of a view beside the accepted views, and the least gain to accept over time.
//!
//! The gain of a view is the precision added to the requested quantities: projection over the
//! picture, in its corners, and the principal point, each in units of its goal, under the richest
//! of the usual lens models, from the seen corners with their errors. Tilt, size, place, blur and
//! motion have no limits: they are prices inside the gain. Source: `docs/method.md`, section 3.1.

use nalgebra::{Isometry3, Point2};

use super::{
    information::{
        CORNER_SIGMA_PX, CornerError, LensMatrix, ProjectionWeights, information_of, pp_places,
        prior_information, reflected,
    },
    params::GuidanceParams,
    view::{LensEstimate, View},
    wanted_pose::planned_poses,
};
use boresight_calibrate::{ALIKE_WIDTHS, common_error::places_on_board};
use boresight_geometry::{Corner, boards::Board, fit_pose};

/// Share of the best pose's gain needed by a frame at first …
const FIRST_SHARE: f64 = 0.6;
/// … or this many times the share of the view before, if less …
const TIMES_SHOWN: f64 = 4.0;
/// … and time with a board in the picture after which any positive gain is accepted.
const SERVED_AFTER_SECS: f64 = 5.0;
/// Views in [`Knowledge::ahead`].
const PLANNED_VIEWS: f64 = 4.0;
/// Error of a corner beside its stated covariance: prints, lens models and compression aren't
/// perfect.
pub(super) const UNSTATED_PX: f64 = 0.05;

/// Least share of the best pose's gain to accept a frame, after a board has been in the picture for
/// `waited_secs` since the last view, which had the share `shown`. Decreases with `shown`.
pub fn wanted_share(waited_secs: f64, shown: Option<f64>) -> f64 {
    let first = shown.map_or(FIRST_SHARE, |shown| (TIMES_SHOWN * shown).min(FIRST_SHARE));
    first * (1.0 - waited_secs / SERVED_AFTER_SECS).clamp(0.0, 1.0).powi(4)
}

/// True if a view of that `worth` meets the share `wanted`. A view that tells nothing never does.
pub(crate) fn is_enough(worth: f64, wanted: f64) -> bool {
    worth > 0.0 && worth >= wanted
}

/// Distance of corners from an accepted view's, in picture widths, above which most of their
/// information is new.
const NEW_WIDTHS: f64 = 0.03;

/// Share of new information in a view beside the `accepted` views. Errors of board and lens outside
/// the models, such as a bend or a fold, are the same in similar views. 1 without any.
pub(crate) fn newness(view: &View, accepted: &[View], width_px: f64) -> f64 {
    1.0 - libm::exp(-nearest_widths2(view, accepted, width_px) / (NEW_WIDTHS * NEW_WIDTHS))
}

/// True if a calibration counts the view and an accepted one as one.
pub(crate) fn is_copy(view: &View, accepted: &[View], width_px: f64) -> bool {
    nearest_widths2(view, accepted, width_px) < ALIKE_WIDTHS * ALIKE_WIDTHS
}

/// Mean square distance of the corners from those of the most similar accepted view, in picture
/// widths. Infinite without any.
fn nearest_widths2(view: &View, accepted: &[View], width_px: f64) -> f64 {
    let apart_widths2 = |other: &View| {
        let pairs = view.corners.iter().zip(&other.corners);
        let both = pairs.filter(|(one, other)| one.is_seen() && other.is_seen());
        let (sum, count) = both.fold((0.0, 0.0), |(sum, count), (one, other)| {
            (sum + (one.px - other.px).norm_squared(), count + 1.0)
        });
        if count > 0.0 { sum / (count * width_px * width_px) } else { f64::INFINITY }
    };
    accepted.iter().map(apart_widths2).fold(f64::INFINITY, f64::min)
}

/// Corner errors of a board shown as requested, with the given camera and hand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UsualError {
    /// Mean variance, per axis, of a corner's own error.
    variance_px2: f64,
    /// Standard deviation of the common error of a moving board's rows, a picture's height from the
    /// middle row.
    shear_px: f64,
}

impl UsualError {
    /// Errors of a still board, before any observation.
    const GUESS: Self = Self { variance_px2: CORNER_SIGMA_PX * CORNER_SIGMA_PX, shear_px: 0.0 };

    /// Errors of the seen corners in a picture `height_px` high; `None` without any.
    fn of<'a>(corners: impl Iterator<Item = &'a Corner>, height_px: f64) -> Option<Self> {
        let (mut variance_px2, mut common_px2, mut rows2, mut count) = (0.0, 0.0, 0.0, 0.0);
        for corner in corners.filter(|corner| corner.is_seen()) {
            variance_px2 += 0.5 * corner.covariance_px2.trace();
            common_px2 += corner.common_px.powi(2);
            rows2 += (corner.px.y / height_px - 0.5).powi(2);
            count += 1.0;
        }
        let shear_px = (common_px2 / rows2.max(f64::MIN_POSITIVE)).sqrt();
        (count > 0.0).then(|| Self { variance_px2: variance_px2 / count, shear_px })
    }

    /// The smaller errors of both.
    fn or(self, other: Self) -> Self {
        Self {
            variance_px2: self.variance_px2.min(other.variance_px2),
            shear_px: self.shear_px.min(other.shear_px),
        }
    }
}

/// Information about the lens from the accepted views and weak priors.
#[derive(Clone, Debug)]
pub struct Knowledge {
    information: LensMatrix,
    /// Information of the plan's first four views. A gain above less information would be known by
    /// the end.
    ahead: LensMatrix,
    /// Weight of the lens's covariance in [`Self::variance`]: one over the goals.
    weight: LensMatrix,
    /// Expected variance in units of the goals.
    variance: f64,
    /// Expected variance with the plan's first four views added.
    variance_ahead: f64,
    /// Errors in the accepted views; `None` without any.
    usual: Option<UsualError>,
    /// [`UsualError::shear_px`] of a calm hand.
    calm_shear_px: f64,
    points_m: Vec<Point2<f64>>,
    lens_estimate: LensEstimate,
}

impl Knowledge {
    /// Information of the seen corners in the `accepted` views.
    pub fn new(
        accepted: &[View],
        board: &Board,
        lens_estimate: &LensEstimate,
        params: &GuidanceParams,
    ) -> Self {
        let mut knowledge = Self {
            information: prior_information(lens_estimate),
            ahead: LensMatrix::zeros(),
            weight: weight(lens_estimate, params),
            variance: f64::INFINITY,
            variance_ahead: f64::INFINITY,
            usual: None,
            calm_shear_px: f64::INFINITY,
            points_m: board.corners_in_board_m(),
            lens_estimate: lens_estimate.clone(),
        };
        let told = accepted.iter().map(|view| knowledge.seen(&view.corners, true));
        let told: Vec<LensMatrix> = told.collect();
        knowledge.information = told.iter().fold(knowledge.information, |sum, more| sum + more);
        let corners = accepted.iter().flat_map(|view| &view.corners);
        knowledge.usual = UsualError::of(corners, knowledge.height_px());
        let usual = knowledge.usual(None);
        let planned = planned_poses(board, lens_estimate, params);
        knowledge.ahead = planned.map(|pose| knowledge.at(&pose, usual)).sum();
        knowledge.variance = knowledge.variance_with(&LensMatrix::zeros());
        knowledge.variance_ahead = knowledge.variance_with(&knowledge.ahead);
        knowledge
    }

    /// Caps the common error of rows, a picture's height from the middle row, at the value of a
    /// calm hand.
    #[must_use]
    pub(crate) fn held_calmly(mut self, calm_shear_px: f64) -> Self {
        self.calm_shear_px = calm_shear_px;
        self
    }

    /// Sets the error of corners of future boards to `noise_px` per axis, if known.
    #[must_use]
    pub(super) fn with_noise(mut self, noise_px: Option<f64>) -> Self {
        if let Some(noise_px) = noise_px {
            let variance_px2 = noise_px * noise_px;
            self.usual = Some(UsualError { variance_px2, ..self.usual(None) });
        }
        self
    }

    /// Adds the information of a board at the given pose, and at its reflection.
    #[must_use]
    pub(super) fn with_pair(mut self, cam_from_board: &Isometry3<f64>) -> Self {
        let usual = self.usual(None);
        for pose in [*cam_from_board, reflected(cam_from_board)] {
            self.information += self.at(&pose, usual);
        }
        self.variance = self.variance_with(&LensMatrix::zeros());
        self.variance_ahead = self.variance_with(&self.ahead);
        self
    }

    /// Expected standard deviations now: of the principal point, worse axis, and of projection,
    /// mean over the picture. Infinite if the views and the priors don't fix the lens.
    pub(super) fn sigmas_px(&self) -> (f64, f64) {
        let Some(cholesky) = self.information.cholesky() else {
            return (f64::INFINITY, f64::INFINITY);
        };
        let covariance = cholesky.inverse();
        let everywhere = ProjectionWeights::new(&self.lens_estimate).everywhere;
        let projection_px2 = 0.5 * (everywhere * covariance).trace();
        let [x, y] = pp_places();
        let pp_px2 = covariance[(x, x)].max(covariance[(y, y)]);
        (pp_px2.max(0.0).sqrt(), projection_px2.max(0.0).sqrt())
    }

    /// Expected variance in units of the goals: 1 where a goal is just met.
    pub fn variance(&self) -> f64 {
        self.variance
    }

    /// The board's corners, in metres.
    pub fn points_m(&self) -> &[Point2<f64>] {
        &self.points_m
    }

    /// Precision in units of the goals added by `more` information; not negative. Source:
    /// `docs/method.md`, section 3.1.
    pub fn gain(&self, more: &LensMatrix) -> f64 {
        (1.0 / self.variance_with(more) - 1.0 / self.variance).max(0.0)
    }

    /// Precision added by `more` information on top of the plan's first four views.
    pub fn gain_by_the_end(&self, more: &LensMatrix) -> f64 {
        let after = self.variance_with(&(self.ahead + more));
        (1.0 / after - 1.0 / self.variance_ahead).max(0.0)
    }

    /// Gain of the plan's first four views, per view.
    pub(crate) fn planned_gain(&self) -> f64 {
        self.gain_by_the_end(&(self.ahead / PLANNED_VIEWS))
    }

    /// Information of the seen `corners`, as moved or as if still; zero if the corners fit no
    /// board.
    pub fn seen(&self, corners: &[Corner], as_moved: bool) -> LensMatrix {
        let Some(pose) = pose_of(corners, &self.points_m, &self.lens_estimate) else {
            return LensMatrix::zeros();
        };
        let error_of = |index: usize, _: &Point2<f64>| {
            let corner = corners.get(index).filter(|corner| corner.is_seen())?;
            let variance_px2 = 0.5 * corner.covariance_px2.trace() + UNSTATED_PX * UNSTATED_PX;
            let common_px = if as_moved { corner.common_px } else { 0.0 };
            Some(CornerError { variance_px2, common_px })
        };
        let seen = corners.iter().filter(|corner| corner.is_seen()).map(|corner| &corner.px);
        let on_board = places_on_board(seen);
        information_of(&pose, &self.points_m, &self.lens_estimate.camera, on_board, error_of)
            .unwrap_or_else(LensMatrix::zeros)
    }

    /// Information of a board at a pose, from the corners in the picture, with the `usual` errors;
    /// zero if any is behind the camera.
    pub fn at(&self, cam_from_board: &Isometry3<f64>, usual: UsualError) -> LensMatrix {
        let Self { points_m, lens_estimate: LensEstimate { camera, image_size, .. }, .. } = self;
        let in_picture: Option<Vec<Point2<f64>>> =
            points_m.iter().map(|point| camera.px_from_board(cam_from_board, point)).collect();
        let Some(mut in_picture) = in_picture else { return LensMatrix::zeros() };
        in_picture.retain(|px| image_size.contains(px));
        let height_px = self.height_px();
        let variance_px2 = usual.variance_px2 + UNSTATED_PX * UNSTATED_PX;
        let error_of = |_, px: &Point2<f64>| {
            let common_px = usual.shear_px * (px.y / height_px - 0.5);
            image_size.contains(px).then_some(CornerError { variance_px2, common_px })
        };
        let on_board = places_on_board(in_picture.iter());
        information_of(cam_from_board, points_m, camera, on_board, error_of)
            .unwrap_or_else(LensMatrix::zeros)
    }

    /// Errors of a board shown as requested, if `view` is the newest frame's: as in the accepted
    /// views, unless camera and hand do better now.
    pub fn usual(&self, view: Option<&View>) -> UsualError {
        let now = view.and_then(|view| UsualError::of(view.corners.iter(), self.height_px()));
        let seen = [self.usual, now].into_iter().flatten();
        let usual = seen.reduce(UsualError::or).unwrap_or(UsualError::GUESS);
        UsualError { shear_px: usual.shear_px.min(self.calm_shear_px), ..usual }
    }

    fn height_px(&self) -> f64 {
        f64::from(self.lens_estimate.image_size.height_px)
    }

    /// Expected variance in units of the goals, with `more` information; infinite if the sum isn't
    /// positive definite.
    fn variance_with(&self, more: &LensMatrix) -> f64 {
        let covariance = (self.information + more).cholesky().map(|cholesky| cholesky.inverse());
        covariance.map_or(f64::INFINITY, |covariance| (self.weight * covariance).trace())
    }
}

/// Weights of the goals: mean variance of projection over the picture, in its corners if those
/// matter, and of the principal point, each per axis.
fn weight(lens_estimate: &LensEstimate, params: &GuidanceParams) -> LensMatrix {
    let projection = ProjectionWeights::new(lens_estimate);
    let goal = |goal_px: f64| 0.5 / (goal_px * goal_px);
    let mut weight = projection.everywhere * goal(params.stop_projection_sigma_px);
    if let (Some(corners), Some(goal_px)) = (projection.corners, params.stop_corner_sigma_px)
        && params.leaves_picture()
    {
        weight += corners * goal(goal_px);
    }
    if !params.is_far() {
        for index in pp_places() {
            weight[(index, index)] += goal(params.pp_goal_px(lens_estimate.f_to_width()));
        }
    }
    weight
}

/// Pose of the board with `points_m` seen at `corners`; `None` if the corners fit no board.
pub(crate) fn pose_of(
    corners: &[Corner],
    points_m: &[Point2<f64>],
    lens_estimate: &LensEstimate,
) -> Option<Isometry3<f64>> {
    Some(fit_pose(&lens_estimate.camera, points_m, corners).ok()?.cam_from_board)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn less_is_enough_the_longer_nothing_came() {
        assert_eq!(wanted_share(0.0, None), FIRST_SHARE);
        assert!(wanted_share(2.5, Some(1.0)) <= 0.25 * FIRST_SHARE);
        assert_eq!(wanted_share(SERVED_AFTER_SECS, None), 0.0);
        assert!(is_enough(1e-6, 0.0) && !is_enough(0.0, 0.0), "whatever tells something");
        assert_eq!(wanted_share(0.0, Some(0.001)), 0.004);
    }
}
