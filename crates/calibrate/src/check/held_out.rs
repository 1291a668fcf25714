//! Predicts the last views from the lens of the others.

use crate::solve::bundle::{Bundle, Observations};
use boresight_geometry::{Corner, LENS_PARAMETERS, fit_pose};

/// Different views that must remain when one is held out.
pub(crate) const VIEWS_NEEDED: usize = 5;

/// The view that the others predict worst.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct HeldOutView {
    pub(crate) view: usize,
    pub(crate) rms_px: f64,
    pub(super) expected_px: f64,
}

/// Predicts each of the last views, a fifth of all, from the lens of the other views. Returns the one with the largest
/// ratio of observed to expected residual.
///
/// The lens without a view is computed to first order; only the pose of the view is fitted. The expected residual comes
/// from the noise and the uncertainty of the lens without the view.
pub(crate) fn check(
    observations: &Observations,
    bundle: &Bundle,
    views: &[Vec<Corner>],
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
            let seen = || views[view].iter().filter(|corner| corner.is_seen());
            let corners = seen().count() as f64;
            let sigma2 = seen().map(|c| c.sigma_px().powi(2)).sum::<f64>() / corners;
            // Expected sum of whitened squares: noise of 2n coordinates less 6 for the pose, and the error of the lens.
            let squares = noise_factor * noise_factor * (2.0 * corners - 6.0)
                + (information * covariance).trace();
            let expected_px = (squares * sigma2 / (2.0 * corners)).sqrt();
            let rms_px = fit.rms_px / std::f64::consts::SQRT_2;
            Some(HeldOutView { view, rms_px, expected_px })
        })
        .max_by(|a, b| (a.rms_px / a.expected_px).total_cmp(&(b.rms_px / b.expected_px)))
}
