//! Gate: judges if a view is good enough to be used at all.

use super::{params::GuidanceParams, refusal::Refusal, view::View};
use boresight_geometry::Corner;

/// Checks what does not depend on the other views: margin, size, tilt, direction and blur. Source:
/// `docs/method.md`, section 3.1.
///
/// # Errors
///
/// The first [`Refusal`] that applies, in the order in which a person would put things right.
pub fn gate(view: &View, params: &GuidanceParams) -> Result<(), Refusal> {
    // A cut-off board has corners at the edge of the picture; its seen corners are measured well.
    let is_whole = view.corners.iter().all(Corner::is_seen);
    if is_whole && view.margin_px < params.margin_px {
        return Err(Refusal::AtTheEdge { margin_px: view.margin_px, wanted_px: params.margin_px });
    }
    if view.span_fraction < params.min_span_fraction {
        let (span_fraction, wanted) = (view.span_fraction, params.min_span_fraction);
        return Err(Refusal::TooFar { span_fraction, wanted });
    }
    let tilt_rad = view.tilt_rad.unwrap_or(0.0);
    if tilt_rad < params.min_tilt_rad {
        return Err(Refusal::TooFlat { tilt_rad, wanted_rad: params.min_tilt_rad });
    }
    if tilt_rad > params.max_tilt_rad {
        return Err(Refusal::TooSteep { tilt_rad, wanted_rad: params.max_tilt_rad });
    }
    let sigma_rad = view.line.sigma_phi_rad();
    if sigma_rad > params.max_sigma_phi_rad {
        return Err(Refusal::Unclear { sigma_rad, wanted_rad: params.max_sigma_phi_rad });
    }
    if view.blur_px > params.max_blur_px {
        return Err(Refusal::Blurred { blur_px: view.blur_px, wanted_px: params.max_blur_px });
    }
    Ok(())
}
