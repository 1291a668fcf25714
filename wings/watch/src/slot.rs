//! Time units: an hour, a day, and a slot, whose estimates count as one.

use nalgebra::Vector4;

/// Seconds of an hour.
pub const HOUR_SECS: f64 = 3600.0;
/// Seconds of a day.
pub const DAY_SECS: f64 = 24.0 * HOUR_SECS;
/// Number of agreeing values beyond chance: one may be wrong, and two may contradict each other.
pub(crate) const SEVERAL: usize = 3;
/// Time within which estimates are dependent: a camera's sway lasts for hours.
pub(crate) const SLOT_SECS: f64 = DAY_SECS / 4.0;
/// Longest time between two pictures that counts as time lived through: a night. Clocks jump by
/// years.
const LONGEST_GAP_SECS: f64 = DAY_SECS / 2.0;

/// Time covered by pictures, oldest first.
pub(crate) fn lived_secs(times: impl IntoIterator<Item = f64>) -> f64 {
    let mut last = None;
    let gap = |at: f64| last.replace(at).map_or(0.0, |before| at - before);
    times
        .into_iter()
        .map(gap)
        .map(|gap| gap.clamp(0.0, LONGEST_GAP_SECS))
        .fold(0.0, |sum, gap| sum + gap)
}

/// Component-wise median; zero without values.
pub(crate) fn median4(values: &[Vector4<f64>]) -> Vector4<f64> {
    Vector4::from_fn(|i, _| {
        let mut all: Vec<f64> = values.iter().map(|v| v[i]).collect();
        boresight_scene::median(&mut all).unwrap_or(0.0)
    })
}
