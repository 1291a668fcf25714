//! The colours of the squares around the corners of a grid.

use image::GrayImage;

use super::{
    lattice::{Lattice, Node, axes},
    reduce::sample,
};
use boresight_geometry::board::Checkerboard;

/// The squares around a corner.
pub(super) struct ColourStep {
    /// Half the brightness difference between the two diagonals' squares.
    pub(super) value: f32,
    /// Larger brightness difference between the two squares on a diagonal.
    pub(super) uneven: f32,
    /// True if the squares on each diagonal agree.
    pub(super) clean: bool,
}

/// Sampling distance of a corner's squares, in squares, on a plain board.
pub(super) const FAR_SQUARES: f32 = 0.36;

/// Compares the four squares around a member.
pub(super) fn colour_step(image: &GrayImage, lattice: &Lattice, node: Node) -> Option<ColourStep> {
    colour_step_within(image, lattice, node, FAR_SQUARES)
}

/// Compares the four squares around a member, up to `far` squares from it.
pub(super) fn colour_step_within(
    image: &GrayImage,
    lattice: &Lattice,
    node: Node,
    far: f32,
) -> Option<ColourStep> {
    let here = lattice.get(node)?;
    let (u, v) = axes(lattice, node, here)?;
    let scale = far / FAR_SQUARES;
    let mean = |su: f32, sv: f32| {
        [(0.3, 0.3), (0.2, 0.36), (0.36, 0.2)]
            .iter()
            .map(|(p, q)| {
                let (p, q) = (p * su * scale, q * sv * scale);
                sample(image, here[0] + p * u[0] + q * v[0], here[1] + p * u[1] + q * v[1])
            })
            .sum::<f32>()
            / 3.0
    };
    let (one, two) = (mean(1.0, 1.0), mean(-1.0, -1.0));
    let (three, four) = (mean(1.0, -1.0), mean(-1.0, 1.0));
    let value = 0.25 * (one + two - three - four);
    let uneven = (one - two).abs().max((three - four).abs());
    Some(ColourStep { value, uneven, clean: uneven < 1.4 * value.abs() })
}

/// Mean colour step of the members at even nodes, with its sign; `None` if the colours don't alternate.
pub(super) fn colours(image: &GrayImage, lattice: &Lattice) -> Option<f32> {
    let steps = || {
        lattice.nodes().iter().filter_map(|&(i, j)| {
            let step = colour_step(image, lattice, (i, j))?.value;
            Some(if (i + j) % 2 == 0 { step } else { -step })
        })
    };
    let count = steps().count();
    let light = steps().filter(|step| *step > 0.0).count();
    let sign = if 2 * light > count { 1.0 } else { -1.0 };
    let agree = light.max(count - light);
    if count < 4 || agree * 10 < count * 8 {
        return None;
    }
    let typical = steps().map(|step| (step * sign).max(0.0)).sum::<f32>() / agree as f32;
    (typical > 3.0).then_some(sign * typical)
}

/// True if the square beyond the corner at `node` towards lower columns and rows is dark, if columns run along the
/// first axis (`upright`) or the second. `None` if its squares can't be seen.
pub(super) fn dark_outside(
    image: &GrayImage,
    lattice: &Lattice,
    node: Node,
    upright: bool,
) -> Option<bool> {
    let step = colour_step(image, lattice, node)?;
    // `value` compares the diagonal through (+u, +v) of the grid; a quarter turn exchanges it.
    Some(if upright { step.value < 0.0 } else { step.value > 0.0 })
}

/// Sampling distance close to a corner, in squares, and the largest colour step there of discs, as a share of that at
/// [`FAR_SQUARES`]: squares meet in their corners, so that any blur leaves a quarter; between discs there's nothing.
const CLOSE_SQUARES: f32 = 0.18;
const MOST_OF_DISCS: f32 = 0.15;

/// True if the dark and light areas don't meet in the corners of the grid: the gaps between the discs of a circle grid look
/// like corners from afar.
pub(super) fn are_discs(image: &GrayImage, lattice: &Lattice) -> bool {
    let sum = |far: f32| {
        let steps = lattice.nodes().iter().filter_map(|&(i, j)| {
            let step = colour_step_within(image, lattice, (i, j), far)?.value;
            Some(if (i + j) % 2 == 0 { step } else { -step })
        });
        steps.sum::<f32>()
    };
    let far = sum(FAR_SQUARES);
    sum(CLOSE_SQUARES) * far.signum() < MOST_OF_DISCS * far.abs()
}

/// Sampling distance on both sides of an edge, in squares.
const BESIDE_EDGE: f32 = 0.2;

/// Sampling places along an edge, in squares: in each third of it, away from its corners.
const ALONG_EDGE: [f32; 3] = [0.25, 0.5, 0.75];

/// True if the edges between the corners of a whole grid change sides on the way, along the first or the second axis:
/// the grid has every third corner of smaller squares. The colours around its corners don't show the sides, because
/// they belong to squares further away.
pub(super) fn skips_squares(image: &GrayImage, lattice: &Lattice) -> bool {
    [(1, 0), (0, 1)].into_iter().any(|along| {
        let (mut agree, mut all) = (0, 0);
        for &node in lattice.nodes() {
            let [Some(first), Some(middle), Some(last)] =
                ALONG_EDGE.map(|share| step_across(image, lattice, node, along, share))
            else {
                continue;
            };
            all += 1;
            agree += usize::from((first + last) * middle > 0.0);
        }
        2 * agree < all
    })
}

/// Brightness difference across the edge from a member to the next one `along` an axis, at a `share` of its length, towards
/// the other axis. `None` at the end of a row.
fn step_across(
    image: &GrayImage,
    lattice: &Lattice,
    node: Node,
    along: Node,
    share: f32,
) -> Option<f32> {
    let here = lattice.get(node)?;
    let next = lattice.get((node.0 + along.0, node.1 + along.1))?;
    let (u, v) = axes(lattice, node, here)?;
    let across = if along.0 == 0 { u } else { v };
    let level = |squares: f32| {
        let at: [f32; 2] =
            std::array::from_fn(|k| here[k] + share * (next[k] - here[k]) + squares * across[k]);
        sample(image, at[0], at[1])
    };
    Some(level(BESIDE_EDGE) - level(-BESIDE_EDGE))
}

/// Whether the squares around every corner of a complete board, numbered from `(0, 0)`, alternate as the board's do.
pub(super) fn all_colours_alternate(
    image: &GrayImage,
    lattice: &Lattice,
    board: &Checkerboard,
) -> bool {
    let Some(typical) = colours(image, lattice) else { return false };
    let first = lattice.get((0, 0));
    let Some((u, v)) = first.and_then(|first| axes(lattice, (0, 0), first)) else { return false };
    let upright = u[0] * v[1] - u[1] * v[0] > 0.0;
    let same_parity = board.columns() % 2 == board.rows() % 2;
    upright
        && (same_parity || typical < 0.0)
        && lattice.nodes().iter().all(|&(i, j)| {
            let expected = if (i + j) % 2 == 0 { typical } else { -typical };
            colour_step(image, lattice, (i, j))
                .is_some_and(|step| step.clean && step.value * expected > 0.0)
        })
}

/// True if a point is at least this far from the picture's edges.
pub(super) fn inside(image: &GrayImage, [x, y]: [f32; 2], margin_px: f32) -> bool {
    let (right, bottom) = (image.width() as f32 - 1.0, image.height() as f32 - 1.0);
    x.min(right - x).min(y).min(bottom - y) >= margin_px
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Fields of 12 by 7 pixels.
    fn cloth() -> GrayImage {
        GrayImage::from_fn(150, 120, |x, y| {
            image::Luma([if (x / 12 + y / 7) % 2 == 0 { 90 } else { 130 }])
        })
    }

    /// A grid of every `steps`-th corner along both axes.
    fn grid(steps: [i32; 2], turned: bool) -> Lattice {
        let mut lattice = Lattice::default();
        lattice.clear(6);
        for i in 0..4 {
            for j in 0..4 {
                let at = [23.5 + 12.0 * (steps[0] * i) as f32, 20.5 + 7.0 * (steps[1] * j) as f32];
                let node = if turned { (j, -i) } else { (i, j) };
                lattice.insert(node, at);
            }
        }
        lattice
    }

    #[test]
    fn every_third_corner_is_no_grid() {
        for turned in [false, true] {
            for steps in [[1, 3], [3, 1], [3, 3]] {
                assert!(skips_squares(&cloth(), &grid(steps, turned)), "{steps:?}, {turned}");
            }
            assert!(!skips_squares(&cloth(), &grid([1, 1], turned)), "turned: {turned}");
        }
    }
}
