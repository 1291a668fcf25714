//! Poses chosen by people without guidance: moderate tilts, anywhere, at a comfortable distance.

use nalgebra::Isometry3;
use rand_chacha::ChaCha8Rng;

use super::sample;
use crate::guidance::situation::Situation;

/// Random pose: tilt 0 to 35°, a third to six tenths of the picture.
pub(super) fn wish(situation: &Situation<'_>, rng: &mut ChaCha8Rng) -> Option<Isometry3<f64>> {
    sample::random(situation, ([0.02, 0.61], [0.33, 0.6]), 1, rng).pop()
}
