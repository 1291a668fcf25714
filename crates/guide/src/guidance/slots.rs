//! Directions of the plan.

use std::f64::consts::PI;

use boresight_geometry::frame::ImageSize;

/// Angle between neighbouring slots.
const TURN_DEG: f64 = 45.0;

/// The eight slots of the plan in the order of requests, each followed by its opposite. Degrees
/// clockwise from the right, as directions in the picture.
///
/// Views along the picture's axes leave one axis of the principal point to the distortion, so no
/// slot lies there. The first two pairs lie on both sides of the picture's shorter side, where the
/// tilted board has most room: with a person erring by some degrees, the standard deviations of the
/// principal point and of projection after four views are 0.55 and 0.17 px, against 0.61 and 0.26
/// px if the second pair is at right angles to the first (1920×1080, f = 1400 px, corner noise 0.3
/// px). Source: `docs/method.md`, sections 3.4 and 3.9.
pub(crate) fn slots_deg(image_size: ImageSize) -> [f64; 8] {
    let (start_deg, turn_deg) = if image_size.width_px >= image_size.height_px {
        (67.5, TURN_DEG)
    } else {
        (22.5, -TURN_DEG)
    };
    std::array::from_fn(|index| {
        let (pair, side) = ((index / 2) as f64, (index % 2) as f64);
        (start_deg + pair * turn_deg + side * 180.0).rem_euclid(360.0)
    })
}

/// Signed difference `a − b` of two directions, in `(-π, π]`.
pub fn direction_difference_rad(a: f64, b: f64) -> f64 {
    let difference = (a - b).rem_euclid(2.0 * PI);
    if difference > PI { difference - 2.0 * PI } else { difference }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn opposed_pairs_turn_by_45_degrees() {
        let landscape = slots_deg(ImageSize { width_px: 1280, height_px: 720 });
        assert_eq!(landscape, [67.5, 247.5, 112.5, 292.5, 157.5, 337.5, 202.5, 22.5]);
        // The same, seen with the picture's axes exchanged.
        let portrait = slots_deg(ImageSize { width_px: 720, height_px: 1280 });
        assert_eq!(portrait.map(|deg| (90.0 - deg).rem_euclid(360.0)), landscape);
    }

    #[test]
    fn directions_differ_the_short_way_round() {
        assert!((direction_difference_rad(0.1, 2.0 * PI - 0.1) - 0.2).abs() < 1e-12);
        assert!((direction_difference_rad(PI + 0.1, 0.0) + (PI - 0.1)).abs() < 1e-12);
        assert_eq!(direction_difference_rad(PI, 0.0), PI);
    }
}
