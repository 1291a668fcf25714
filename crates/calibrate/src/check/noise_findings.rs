//! Compares the noise of the fit with the noise of a board held still.

use super::finding::{Finding, FindingCode, Severity};

/// Ratios of the fit's noise to the measured noise. Below the first, the fit is overconfident;
/// above the second, the residuals aren't mainly noise. Conventions: both numbers are known to
/// about 10 %, and real prints and lenses leave residuals of two or three times the noise of the
/// picture.
const UNDERSTATED: f64 = 0.5;
const EXCEEDED: f64 = 4.0;
/// Noise in pixels below which no comparison is made: the detector's own errors are of this size.
const LEAST_PX: f64 = 0.01;

/// Compares the standard deviation of a corner coordinate by the fit, `fit_px`, with `measured_px`,
/// the scatter of a board held still. `None` if they agree, or if `measured_px` isn't a positive
/// number.
///
/// A fit with much less noise has absorbed errors shared by the corners, so it understates its
/// uncertainty. A fit with much more has an error constant from picture to picture: the print, the
/// flatness of the board or the lens model. Its covariance includes that, see `noise_inflation`.
pub(crate) fn noise_finding(fit_px: f64, measured_px: f64) -> Option<Finding> {
    let is_measured = measured_px.is_finite() && measured_px > 0.0;
    if !is_measured || fit_px.max(measured_px) < LEAST_PX {
        return None;
    }
    if fit_px < UNDERSTATED * measured_px {
        let code = FindingCode::NoiseUnderstated { noise_px: fit_px, measured_px };
        Some(Finding { code, severity: Severity::Care })
    } else if fit_px > EXCEEDED * measured_px.max(LEAST_PX) {
        let code = FindingCode::NoiseExceeded { noise_px: fit_px, measured_px };
        Some(Finding { code, severity: Severity::Info })
    } else {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_a_clear_difference_is_a_finding() {
        let code = |fit_px, measured_px| {
            noise_finding(fit_px, measured_px).map(|finding| finding.code.code())
        };
        assert_eq!(code(0.05, 0.06), None);
        assert_eq!(code(0.15, 0.05), None);
        assert_eq!(code(0.02, 0.1), Some("NOISE-UNDERSTATED"));
        assert_eq!(code(0.5, 0.1), Some("NOISE-EXCEEDED"));
        assert_eq!([code(0.1, 0.0), code(0.1, f64::NAN), code(0.001, 0.008)], [None; 3]);
    }
}
