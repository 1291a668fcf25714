use crate::guidance::Precision;
use boresight_calibrate::{Calibration, Finding, FindingCode};
use boresight_geometry::{LensParts, frame::ImageSize};

/// Precision of a calibration from pictures of `image_size`, in the terms of the stop rule.
pub fn precision_of(calibration: &Calibration, image_size: ImageSize) -> Precision {
    let pp = calibration.covariance.pp();
    let mut others = calibration.findings.clone();
    others.retain(|finding| !matches!(finding.code, FindingCode::ProjectionUncertain { .. }));
    let width_px = image_size.width_px.max(image_size.height_px);
    Precision {
        pp_sigma_px: pp[(0, 0)].max(pp[(1, 1)]).max(0.0).sqrt(),
        projection_sigma_px: calibration.projection_sd.mean_px,
        corner_sigma_px: calibration.projection_sd.max_px,
        f_to_width: calibration.camera.f_px.x / f64::from(width_px),
        goal_excess: calibration.acceptance.map(|judged| judged.excess()),
        trusted: !others.iter().any(Finding::calls_for_views),
        covered: others.len() == calibration.findings.len(),
        trusted_far: others.iter().all(|finding| {
            !finding.calls_for_views() || matches!(finding.code, FindingCode::PriorUsed { .. })
        }),
    }
}
