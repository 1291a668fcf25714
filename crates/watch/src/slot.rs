//! Estimates of a few hours, which count as one.

use nalgebra::Vector4;

/// Estimates closer than this aren't independent: a camera's sway lasts for hours.
pub(crate) const SLOT_SECS: f64 = 6.0 * 3600.0;

/// The median of each part; zero without values.
pub(crate) fn median4(values: &[Vector4<f64>]) -> Vector4<f64> {
    Vector4::from_fn(|i, _| {
        let mut all: Vec<f64> = values.iter().map(|v| v[i]).collect();
        crate::fit::median(&mut all).unwrap_or(0.0)
    })
}
