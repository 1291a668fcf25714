//! Predicts the last views from the lens of the others.

use crate::solve::bundle::{Bundle, Observations};
use boresight_geometry::{Corner, LENS_PARAMETERS, fit_pose};

/// Number of distinct views that must remain besides a held-out view.
pub(crate) const VIEWS_NEEDED: usize = 5;

/// View with the worst prediction by the others.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct HeldOutView {
    pub(crate) view: usize,
    pub(crate) rms_px: f64,
    pub(super) expected_px: f64,
}

/// Predicts each of the last views, a fifth of all, from the lens of the other views. Returns the
/// view with the largest ratio of observed to expected residual.
///
/// The lens without a view is computed to first order; only the pose of the view is fitted. The
/// expected residual is that of the same view in the adjustment, so that a noisy view is not
/// reported, plus the uncertainty of the lens without it: `inflation` times the variance left by
/// independent corners.
pub(crate) fn check(
    observations: &Observations,
    bundle: &Bundle,
    views: &[Vec<Corner>],
    inflation: f64,
) -> Option<HeldOutView> {
    let count = views.len();
    let held = (count / 5).max(1);
    let noise_factor = bundle.noise_factor();
    (count - held..count)
        .filter_map(|view| {
            let (shift, covariance) = bundle.without_view(view, noise_factor)?;
            let mut lens = bundle.state.camera.lens_parameters();
            for i in 0..LENS_PARAMETERS {
                lens[i] += shift[i];
            }
            let camera = bundle.state.camera.with_lens_parameters(&lens);
            let fit = fit_pose(&camera, observations.board_m(), &views[view]).ok()?;
            let (information, _) = bundle.view_information().get(view)?;
            let pose = bundle.state.cam_from_board.get(view)?;
            let own_px = observations.view_residual_rms_px(view, &bundle.state.camera, pose);
            let seen = || views[view].iter().filter(|corner| corner.is_seen());
            let corners = seen().count() as f64;
            let sigma2 = seen().map(|c| c.sigma_px().powi(2)).sum::<f64>() / corners;
            let of_lens_px2 =
                inflation * (information * covariance).trace() * sigma2 / (2.0 * corners);
            let expected_px = (own_px * own_px + of_lens_px2).sqrt();
            let rms_px = fit.rms_px / std::f64::consts::SQRT_2;
            Some(HeldOutView { view, rms_px, expected_px })
        })
        .max_by(|a, b| (a.rms_px / a.expected_px).total_cmp(&(b.rms_px / b.expected_px)))
}
