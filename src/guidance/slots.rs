//! Directions of the plan.

use std::f64::consts::PI;

/// The eight slots of the plan in the order in which they are asked for: each is followed by its opposite.
/// Degrees clockwise from the right, as directions in the picture.
pub const SLOTS_DEG: [f64; 8] = [0.0, 180.0, 90.0, 270.0, 45.0, 225.0, 135.0, 315.0];

/// Signed difference `a − b` of two directions, in `(-π, π]`.
pub fn direction_difference_rad(a: f64, b: f64) -> f64 {
    let difference = (a - b).rem_euclid(2.0 * PI);
    if difference > PI { difference - 2.0 * PI } else { difference }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_differ_the_short_way_round() {
        assert!((direction_difference_rad(0.1, 2.0 * PI - 0.1) - 0.2).abs() < 1e-12);
        assert!((direction_difference_rad(PI + 0.1, 0.0) + (PI - 0.1)).abs() < 1e-12);
        assert_eq!(direction_difference_rad(PI, 0.0), PI);
    }
}
