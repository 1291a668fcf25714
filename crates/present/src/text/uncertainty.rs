//! Standard deviations in words, where known.

use boresight_calibrate::Calibration;

/// Note in place of unknown standard deviations.
pub const SD_UNKNOWN: &str = "not known yet: fewer than four different views";

/// True if the standard deviations of a calibration with findings of these codes are credible. With
/// fewer than four different views they come out too small, because the weak priors on the lens are
/// taken at face value.
pub fn is_sd_known<'a>(codes: impl IntoIterator<Item = &'a str>) -> bool {
    codes.into_iter().all(|code| code != "VIEWS-FEW")
}

/// [`is_sd_known`] of a calibration.
pub fn knows_sd(calibration: &Calibration) -> bool {
    is_sd_known(calibration.findings.iter().map(|finding| finding.code.code()))
}

/// Standard deviation of `calibration`; a question mark if unknown.
pub(super) fn sd_of(calibration: &Calibration, sd: String) -> String {
    if knows_sd(calibration) { sd } else { "?".into() }
}

/// Estimate of `calibration` with standard deviation, both with the same number of decimals:
/// "653.41 ± 0.20".
pub fn measured(calibration: &Calibration, value: f64, sd: f64, decimals: usize) -> String {
    format!("{value:.decimals$} ± {}", sd_of(calibration, format!("{sd:.decimals$}")))
}

/// Typical error: the standard deviation of projection over the picture.
pub fn projection(calibration: &Calibration) -> String {
    let sd = &calibration.projection_sd;
    if knows_sd(calibration) {
        format!("{:.3} px (1 sd), {:.3} px at worst", sd.mean_px, sd.max_px)
    } else {
        SD_UNKNOWN.into()
    }
}
