//! Views that the stop rule did not need, predicted from the others.

use crate::{
    calibration::solve::bundle::{Bundle, Observations},
    geometry::{Camera, Corner, LENS_PARAMETERS, fit_pose},
};

/// Different views that stay when one is held out.
pub(in crate::calibration) const VIEWS_NEEDED: usize = 5;

/// The view that the others predict worst.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::calibration) struct HeldOutView {
    pub(in crate::calibration) view: usize,
    pub(in crate::calibration) rms_px: f64,
    pub(super) expected_px: f64,
}

/// Predicts each of the last views, a fifth of all, from the lens that the other views give.
///
/// The lens without a view is taken to first order; the view's own pose is fitted anew. Expected is the
/// view's residual when it takes part, inflated by what leaving it out makes the lens uncertain.
pub(in crate::calibration) fn check(
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
            let camera = Camera::from_lens_parameters(&lens);
            let fit = fit_pose(&camera, observations.board_m(), &views[view]).ok()?;
            let (own, _) = bundle.view_information().get(view)?;
            let corners = views[view].len() as f64;
            let sigma2 = views[view].iter().map(|c| c.sigma_px().powi(2)).sum::<f64>() / corners;
            // Whitened squares: noise of 2n coordinates, and the lens's error as this view sees it.
            let squares =
                noise_factor * noise_factor * (2.0 * corners - 6.0) + (own * covariance).trace();
            let expected_px = (squares * sigma2 / (2.0 * corners)).sqrt();
            let rms_px = fit.rms_px / std::f64::consts::SQRT_2;
            Some(HeldOutView { view, rms_px, expected_px })
        })
        .max_by(|a, b| (a.rms_px / a.expected_px).total_cmp(&(b.rms_px / b.expected_px)))
}
