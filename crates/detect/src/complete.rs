//! Fills gaps of a grid, and adds surrounding corners, if confirmed by the picture.

use image::GrayImage;

use super::{
    colours::{FAR_SQUARES, colour_step_within, inside},
    lattice::{BESIDE, Lattice, Node, axes, height},
    saddle::settle,
};

/// Largest distance of an added corner from the prediction, in squares, if the picture is sampled
/// [`FAR_SQUARES`] around it; and in pixels, for any smaller distance.
const OFF_SQUARES: f32 = 0.25;
const OFF_PX: f32 = 1.5;
/// Least colour step of a corner, as a fraction of the neighbours', and in grey levels.
const LEAST_OF_NEXT: f32 = 0.35;
const LEAST_STEP: f32 = 3.0;

/// Expected squares around the corners of a grid.
pub(super) struct Squares<'a> {
    /// Reach of the plain part of a corner's squares, in squares: up to a marker.
    pub(super) far: f32,
    /// Expected colour step of a corner, with sign.
    pub(super) step: &'a dyn Fn(Node) -> f32,
}

impl Squares<'_> {
    /// True if the squares around a member show a corner.
    pub(super) fn show(&self, image: &GrayImage, lattice: &Lattice, node: Node) -> bool {
        let value = |node: Node| colour_step_within(image, lattice, node, self.far);
        // Light is uneven: neighbours predict the step better than the whole board does.
        let (i, j) = node;
        let beside =
            BESIDE.iter().filter_map(|(di, dj)| Some(value((i + di, j + dj))?.value.abs()));
        let expected = (self.step)(node);
        let near = beside.fold(expected.abs(), f32::min);
        value(node).is_some_and(|step| {
            step.clean && step.value * expected.signum() > (LEAST_OF_NEXT * near).max(LEAST_STEP)
        })
    }
}

/// Adds nodes inside the grid and in a row around the grid where the picture shows the right
/// colours, as long as `may` allows.
pub(super) fn complete(
    image: &GrayImage,
    lattice: &mut Lattice,
    squares: &Squares<'_>,
    may: impl Fn(&Lattice, Node) -> bool,
) {
    loop {
        let Some((low, high)) = lattice.extent() else { return };
        let before = lattice.len();
        for i in low.0 - 1..=high.0 + 1 {
            for j in low.1 - 1..=high.1 + 1 {
                let node = (i, j);
                let beside = || BESIDE.iter().any(|(di, dj)| lattice.contains((i + di, j + dj)));
                if lattice.contains(node) || !beside() || !may(lattice, node) {
                    continue;
                }
                let Some((guess, side)) = lattice.predict(node) else { continue };
                let side = axes(lattice, node, guess).map_or(side, |axes| side.min(height(axes)));
                let reach = side * squares.far / FAR_SQUARES;
                let most_px = (OFF_SQUARES * reach).max(OFF_PX);
                if let Some(centred) = settle(image, guess, reach, most_px)
                    && lattice.insert(node, centred)
                    && !squares.show(image, lattice, node)
                {
                    lattice.take_back();
                }
            }
        }
        if lattice.len() == before {
            return;
        }
    }
}

/// Interpolates the last missing corners of an otherwise complete board, at most `most`. Blur and
/// noise can hide a corner from every stage before the edge fit, which must then confirm it.
pub(super) fn interpolate_last(
    image: &GrayImage,
    lattice: &mut Lattice,
    (low, high): (Node, Node),
    most: usize,
) {
    let places = ((high.0 - low.0 + 1) * (high.1 - low.1 + 1)) as usize;
    if lattice.len() == places || lattice.len() + most < places {
        return;
    }
    for i in low.0..=high.0 {
        for j in low.1..=high.1 {
            if !lattice.contains((i, j))
                && let Some((guess, side)) = lattice.predict((i, j))
                && inside(image, guess, 0.2 * side)
            {
                lattice.insert((i, j), guess);
            }
        }
    }
}

/// Drops members without a neighbour along both axes.
pub(super) fn prune(lattice: &mut Lattice) {
    loop {
        let before = lattice.len();
        lattice.retain(|lattice, (i, j)| {
            let has = |di: i32, dj: i32| lattice.contains((i + di, j + dj));
            (has(1, 0) || has(-1, 0)) && (has(0, 1) || has(0, -1))
        });
        if lattice.len() == before {
            return;
        }
    }
}
