//! Why corners of a board are missing: cut off by the edge of the picture, or saturated.

use image::GrayImage;

use super::{
    lattice::{BESIDE, Lattice, axes, height},
    outcome::Side,
    reduce::sample,
};

/// Brightness from which a square counts as saturated, in grey levels.
const SATURATED: f32 = 248.0;

/// The edge of the picture that the grid runs into, if any: beyond it, the next corners would lie outside.
pub(super) fn cut_off_by(image: &GrayImage, lattice: &Lattice) -> Option<Side> {
    let (width, height) = (image.width() as f32, image.height() as f32);
    let mut outside = [(Side::Left, 0), (Side::Right, 0), (Side::Top, 0), (Side::Bottom, 0)];
    for (i, j) in lattice.nodes() {
        for node in BESIDE.map(|(di, dj)| (i + di, j + dj)) {
            if lattice.contains(node) {
                continue;
            }
            let Some((guess, _)) = lattice.predict(node) else { continue };
            let margin = 6.0;
            outside[0].1 += usize::from(guess[0] < margin);
            outside[1].1 += usize::from(guess[0] > width - margin);
            outside[2].1 += usize::from(guess[1] < margin);
            outside[3].1 += usize::from(guess[1] > height - margin);
        }
    }
    let (side, count) = outside.into_iter().max_by_key(|(_, count)| *count)?;
    (count >= 2).then_some(side)
}

/// Whether the grid ends where the picture is saturated: at least one in eight of the next three nodes beyond each end
/// of a line.
pub(super) fn glaring(image: &GrayImage, lattice: &Lattice) -> bool {
    let (mut missing, mut bright) = (0, 0);
    for &(i, j) in lattice.nodes() {
        let Some((here, (u, v))) =
            lattice.get((i, j)).and_then(|here| Some((here, axes(lattice, (i, j), here)?)))
        else {
            continue;
        };
        for (di, dj) in BESIDE {
            if lattice.contains((i + di, j + dj)) {
                continue;
            }
            let step: [f32; 2] = std::array::from_fn(|k| u[k] * di as f32 + v[k] * dj as f32);
            let reach = 0.3 * height((u, v));
            for ahead in [1.0, 2.0, 3.0] {
                let at = [here[0] + ahead * step[0], here[1] + ahead * step[1]];
                missing += 1;
                let glares = |dx: f32, dy: f32| sample(image, at[0] + dx, at[1] + dy) >= SATURATED;
                let across = [-reach, 0.0, reach];
                bright +=
                    usize::from(across.iter().all(|dx| across.iter().all(|dy| glares(*dx, *dy))));
            }
        }
    }
    bright >= 3 && 8 * bright >= missing
}
