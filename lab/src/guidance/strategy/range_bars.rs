//! Bars for X, Y, size and skew, each filled by its range so far, as in ROS's camera_calibration:
//! the person is led to the extreme of the least full bar.

use nalgebra::Isometry3;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::sample::{Wanted, pose};
use crate::guidance::{accept::Bars, situation::Situation};

/// Ranges of a full bar: X, Y, size, skew. Source: `param_ranges`.
const FULL: [f64; 4] = [0.7, 0.7, 0.4, 0.5];

/// Pose at the other end of the least full bar; small boards and little skew fill none.
pub(super) fn wish(situation: &Situation<'_>, rng: &mut ChaCha8Rng) -> Option<Isometry3<f64>> {
    let seen: Vec<[f64; 4]> =
        situation.shown.iter().map(|corners| Bars::of(situation, corners).0).collect();
    let range = |k: usize| {
        let (low, high) = seen
            .iter()
            .fold((f64::MAX, f64::MIN), |(low, high), bar| (low.min(bar[k]), high.max(bar[k])));
        if k < 2 { (low, high) } else { (0.0, high) }
    };
    let share = |k: usize| {
        let (low, high) = range(k);
        if seen.is_empty() { 0.0 } else { (high - low) / FULL[k] }
    };
    let least = (0..4).min_by(|a, b| share(*a).total_cmp(&share(*b))).unwrap_or(0);
    let middle = if seen.is_empty() { 0.5 } else { 0.5 * (range(least).0 + range(least).1) };
    // Choose the farther end, with noise, because a person also moves in the other bars.
    let high = least >= 2 || middle < 0.5 || (seen.is_empty() && rng.random());
    let mut near = |centre: f64, spread: f64| centre + rng.random_range(-spread..spread);
    let end = |low: f64, top: f64| if high { top } else { low };
    let mut wanted = Wanted {
        slot_rad: near(0.0, std::f64::consts::PI),
        tilt_rad: near(0.26, 0.2),
        roll_rad: near(0.0, 0.2),
        centre: [near(0.5, 0.1), near(0.5, 0.1)],
        fill: near(0.45, 0.08),
    };
    match least {
        0 => wanted.centre[0] = end(0.2, 0.8),
        1 => wanted.centre[1] = end(0.22, 0.78),
        2 => wanted.fill = 0.8,
        _ => wanted.tilt_rad = 0.75,
    }
    pose(situation, &wanted)
}
