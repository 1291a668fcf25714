//! Corners spread evenly over the picture, or a board that fills the picture.

use nalgebra::Isometry3;
use rand_chacha::ChaCha8Rng;

use super::sample;
use crate::guidance::situation::Situation;
use boresight_guide::guidance::wanted_pose::seen_px;

const COLUMNS: usize = 8;
const ROWS: usize = 6;

/// Among sixty random poses, the pose with corners in the emptiest cells.
pub(super) fn wish(situation: &Situation<'_>, rng: &mut ChaCha8Rng) -> Option<Isometry3<f64>> {
    let mut counts = [0_u32; COLUMNS * ROWS];
    for corner in situation.shown.iter().flatten() {
        counts[cell(situation, corner.px.x, corner.px.y)] += 1;
    }
    let emptiness = |pose: &Isometry3<f64>| -> f64 {
        seen_px(pose, situation.board, situation.lens_estimate)
            .iter()
            .map(|px| 1.0 / f64::from(1 + counts[cell(situation, px.x, px.y)]))
            .sum()
    };
    sample::random(situation, ([0.02, 0.7], [0.3, 0.7]), 60, rng)
        .into_iter()
        .max_by(|a, b| emptiness(a).total_cmp(&emptiness(b)))
}

/// Board as large as the picture allows, tilted up to 30°.
pub(super) fn wish_full_view(
    situation: &Situation<'_>,
    rng: &mut ChaCha8Rng,
) -> Option<Isometry3<f64>> {
    sample::random(situation, ([0.02, 0.52], [0.8, 0.95]), 1, rng).pop()
}

fn cell(situation: &Situation<'_>, x: f64, y: f64) -> usize {
    let size = situation.lens_estimate.image_size;
    let place = |at: f64, size: u32, count: usize| {
        ((at / f64::from(size) * count as f64).max(0.0) as usize).min(count - 1)
    };
    place(y, size.height_px, ROWS) * COLUMNS + place(x, size.width_px, COLUMNS)
}
