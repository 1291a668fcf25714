//! The next pose for the least certain parameter.
//!
//! Source: Rojtberg & Kuijper, "Efficient Pose Selection for Interactive Camera Calibration", ISMAR
//! 2018: the parameter with the largest index of dispersion decides. Pinhole parameters request
//! tilted boards in the middle, f and cx, cy about alternating axes; distortion requests boards at
//! the picture's edge, in the cells with the fewest corners.

use nalgebra::Isometry3;
use rand_chacha::ChaCha8Rng;

use super::{
    information::{covariance, known},
    sample::{Wanted, pose},
};
use crate::guidance::situation::Situation;

/// Tilts requested in turn, coarse first.
const TILTS_RAD: [f64; 6] = [0.78, 0.39, 0.6, 0.2, 0.7, 0.5];

pub(super) fn wish(situation: &Situation<'_>, _: &mut ChaCha8Rng) -> Option<Isometry3<f64>> {
    let camera = &situation.lens_estimate.camera;
    let asked = situation.asked;
    let covariance = covariance(situation, &known(situation))?;
    let dispersion = |i: usize, value: f64| covariance[(i, i)] / value.abs().max(1e-3);
    // Pixels and distortion coefficients are compared by their effect at the picture's edge.
    let radius = 0.5 * f64::from(situation.lens_estimate.image_size.width_px) / camera.f_px.x;
    let scale = camera.f_px.x * radius.powi(3);
    let pinhole = [
        dispersion(0, camera.f_px.x),
        dispersion(1, camera.pp_px.x),
        dispersion(2, camera.pp_px.y),
    ];
    let lens =
        (3..5).map(|i| covariance[(i, i)] * scale * scale / camera.f_px.x).fold(0.0, f64::max);
    let (most, largest) =
        pinhole.iter().copied().enumerate().fold((0, 0.0), |(at, high), (i, value)| {
            if value > high { (i, value) } else { (at, high) }
        });
    let turn = asked as f64;
    let wanted = if lens > largest {
        // Around the picture's edge.
        let places =
            [[0.25, 0.25], [0.75, 0.75], [0.75, 0.25], [0.25, 0.75], [0.5, 0.3], [0.5, 0.7]];
        Wanted {
            slot_rad: turn * 2.4,
            tilt_rad: 0.15,
            roll_rad: 0.0,
            centre: places[asked % places.len()],
            fill: 0.5,
        }
    } else {
        // Boards receding sideways determine cx, boards receding up or down cy, both f.
        let sideways = match most {
            1 => true,
            2 => false,
            _ => asked.is_multiple_of(2),
        };
        let quarter = if sideways { 0.0 } else { std::f64::consts::FRAC_PI_2 };
        let back = if (asked / 2).is_multiple_of(2) { 0.0 } else { std::f64::consts::PI };
        Wanted {
            slot_rad: quarter + back,
            tilt_rad: TILTS_RAD[(asked / 4) % TILTS_RAD.len()],
            roll_rad: 0.0,
            centre: [0.5, 0.5],
            fill: 0.7,
        }
    };
    pose(situation, &wanted)
}
