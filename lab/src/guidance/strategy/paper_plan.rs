//! The source paper's plan: eight slots, the board rotated with them about the picture's centre,
//! tilt 45°.

use nalgebra::Isometry3;
use rand_chacha::ChaCha8Rng;

use super::sample::{Wanted, pose};
use crate::{guidance::situation::Situation, setup::slot_rad};

/// Paper's pose with the board as large as fits.
pub(super) fn wish(situation: &Situation<'_>, _: &mut ChaCha8Rng) -> Option<Isometry3<f64>> {
    slot(situation, 1.0)
}

/// Paper's pose with a board of 36 % of the picture's width.
pub(super) fn wish_small(situation: &Situation<'_>, _: &mut ChaCha8Rng) -> Option<Isometry3<f64>> {
    slot(situation, 0.36)
}

fn slot(situation: &Situation<'_>, fill: f64) -> Option<Isometry3<f64>> {
    let slot_rad = slot_rad(situation.asked % 8);
    let tilt_rad = std::f64::consts::FRAC_PI_4;
    pose(situation, &Wanted { slot_rad, tilt_rad, roll_rad: slot_rad, centre: [0.5, 0.5], fill })
}
