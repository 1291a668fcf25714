//! Removal of unknown standard deviations from a page.

use std::borrow::Cow;

use super::Report;
use crate::text::{acceptance::TOO_EARLY, is_sd_known};
use boresight_formats::CalibrationFile;

/// `report` as shown on the page: if the standard deviations are unknown, without them and
/// everything derived from them. Drawings and tables then look as for a file that states none.
pub(super) fn shown(report: &Report) -> Cow<'_, Report> {
    if knows_sd(&report.calibration) {
        return Cow::Borrowed(report);
    }
    let mut shown = report.clone();
    let calibration = &mut shown.calibration;
    if let Some(lens) = &mut calibration.result {
        (lens.sigma, lens.covariance, lens.covariance_all) = (None, None, None);
    }
    if let Some(points) = &mut calibration.principal_point {
        let [weighted, unweighted, ring] =
            [&mut points.pl_weighted, &mut points.pl_unweighted, &mut points.pl_ring];
        let [free, bundle, zhang] =
            [&mut points.free_homography, &mut points.bundle, &mut points.zhang];
        for estimate in [weighted, unweighted, ring, free, bundle, zhang].into_iter().flatten() {
            (estimate.sigma_px, estimate.covariance_px2) = (None, None);
        }
    }
    for view in &mut calibration.views {
        view.focal_sigma_px = None;
    }
    (calibration.projection_sd_px, calibration.bound_px) = (None, None);
    if let Some(goal) = &mut calibration.acceptance {
        (goal.met, goal.bound, goal.lens, goal.scale) = (false, None, None, None);
        (goal.message, goal.action) = (TOO_EARLY.0.into(), TOO_EARLY.1.into());
    }
    Cow::Owned(shown)
}

/// True if the standard deviations in `calibration` are known.
pub(super) fn knows_sd(calibration: &CalibrationFile) -> bool {
    is_sd_known(calibration.findings.iter().map(|finding| finding.code.as_str()))
}
