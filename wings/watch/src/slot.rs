//! Time units: an hour, a day, and a slot, whose estimates count as one.

use nalgebra::Vector4;

pub(crate) const HOUR_SECS: f64 = 3600.0;
pub(crate) const DAY_SECS: f64 = 24.0 * HOUR_SECS;
/// Number of agreeing values beyond chance: one may be wrong, and two may contradict each other.
pub(crate) const SEVERAL: usize = 3;
/// Time within which estimates are dependent: a camera's sway lasts for hours.
pub(crate) const SLOT_SECS: f64 = DAY_SECS / 4.0;

/// Component-wise median; zero without values.
pub(crate) fn median4(values: &[Vector4<f64>]) -> Vector4<f64> {
    Vector4::from_fn(|i, _| {
        let mut all: Vec<f64> = values.iter().map(|v| v[i]).collect();
        crate::fit::median(&mut all).unwrap_or(0.0)
    })
}
