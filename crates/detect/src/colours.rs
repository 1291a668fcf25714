//! Colours of the squares around the corners of a grid.

use image::GrayImage;

use super::{
    lattice::{Lattice, Node, axes},
    reduce::sample,
};
use boresight_geometry::boards::Board;

/// Colours of the squares around a corner.
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

/// Compares the four squares around a member, up to `far` squares from the corner.
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

/// +1 at even nodes, −1 at odd nodes.
pub(super) fn alternating((i, j): Node) -> f32 {
    if (i + j) % 2 == 0 { 1.0 } else { -1.0 }
}

/// Mean colour step of the members, after multiplication of each by a `sign`; `None` if they
/// disagree. Samples the picture up to `far` squares from a corner.
pub(super) fn colours(
    image: &GrayImage,
    lattice: &Lattice,
    far: f32,
    sign: &dyn Fn(Node) -> f32,
) -> Option<f32> {
    let steps = || {
        let step =
            |node: &Node| Some(sign(*node) * colour_step_within(image, lattice, *node, far)?.value);
        lattice.nodes().iter().filter_map(step)
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

/// True if the square beyond the corner at `node` towards lower columns and rows is dark, if
/// columns run along the first axis (`upright`) or the second. `None` if its squares can't be seen.
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

/// Sampling distance beside the edges of a grid, and sampling places along the edges, in squares:
/// at both ends and in the middle.
const BESIDE_EDGE: f32 = 0.1;
const ALONG_EDGE: [f32; 3] = [0.1, 0.5, 0.9];
/// Least step across an edge of squares at the ends and in the middle, as a share of the step
/// between squares. A blur down to the ground wave of their pattern leaves
/// `sin²(0.1 π) / sin²(0.33 π)`, 0.13, and `sin(0.1 π) / sin²(0.33 π)`, 0.42.
const LEAST_OF_STEP: [f32; 2] = [0.06, 0.3];
/// Largest difference of the places on both sides of an edge, taken together, between the ends and
/// the middle, as a share of the step: edges of squares are straight.
const MOST_BULGE: f32 = 0.45;

/// Type of the cells in a grid of corners.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Cells {
    /// Squares, as far as visible.
    Squares,
    /// Discs, whose gaps look like corners from afar.
    Discs,
    /// Several smaller squares: the grid has every third of their corners. The colours around those
    /// don't show it, because they belong to squares further away.
    Several,
}

/// Type of the cells, by the edges between the corners of a grid.
pub(super) fn cells(image: &GrayImage, lattice: &Lattice) -> Cells {
    let steps = lattice.nodes().iter().filter_map(|node| {
        Some((1.0, 2.0 * alternating(*node) * colour_step(image, lattice, *node)?.value))
    });
    let (count, sum) =
        steps.fold((0.0, 0.0), |(count, sum), (one, step)| (count + one, sum + step));
    let step: f32 = sum / f32::max(count, 1.0);
    let mut seen = Cells::Squares;
    for along in [(1, 0), (0, 1)] {
        let (mut at_ends, mut in_middle, mut bulge, mut count) = (0.0, 0.0, 0.0, 0.0);
        for &node in lattice.nodes() {
            let places = ALONG_EDGE.map(|share| beside_edge(image, lattice, node, along, share));
            let [Some(first), Some(middle), Some(last)] = places else { continue };
            let across = |[one, other]: [f32; 2]| alternating(node) * (one - other);
            at_ends += 0.5 * (across(first) + across(last));
            in_middle += across(middle);
            bulge += 0.5 * (first[0] + first[1] + last[0] + last[1]) - middle[0] - middle[1];
            count += 1.0;
        }
        let [at_ends, in_middle, bulge] =
            [at_ends, in_middle, bulge].map(|sum| sum / (count * step));
        let [least_at_ends, least_in_middle] = LEAST_OF_STEP;
        if at_ends < -least_at_ends || in_middle < -least_in_middle {
            return Cells::Several;
        }
        if at_ends < least_at_ends || in_middle < least_in_middle || bulge.abs() > MOST_BULGE {
            seen = Cells::Discs;
        }
    }
    seen
}

/// Brightness on both sides of the edge from a member to the next member `along` an axis, at a
/// `share` of the edge; first towards the other axis. `None` at the end of a row.
fn beside_edge(
    image: &GrayImage,
    lattice: &Lattice,
    node: Node,
    along: Node,
    share: f32,
) -> Option<[f32; 2]> {
    let here = lattice.get(node)?;
    let next = lattice.get((node.0 + along.0, node.1 + along.1))?;
    let (u, v) = axes(lattice, node, here)?;
    let across = if along.0 == 0 { u } else { v };
    Some([BESIDE_EDGE, -BESIDE_EDGE].map(|squares| {
        let at: [f32; 2] =
            std::array::from_fn(|k| here[k] + share * (next[k] - here[k]) + squares * across[k]);
        sample(image, at[0], at[1])
    }))
}

/// True if the squares around every corner of a complete board, numbered from `(0, 0)`, alternate
/// like the board's.
pub(super) fn all_colours_alternate(image: &GrayImage, lattice: &Lattice, board: &Board) -> bool {
    let Some(typical) = colours(image, lattice, FAR_SQUARES, &alternating) else { return false };
    let first = lattice.get((0, 0));
    let Some((u, v)) = first.and_then(|first| axes(lattice, (0, 0), first)) else { return false };
    let upright = u[0] * v[1] - u[1] * v[0] > 0.0;
    let same_parity = board.columns() % 2 == board.rows() % 2;
    upright
        && (same_parity || typical < 0.0)
        && lattice.nodes().iter().all(|&(i, j)| {
            let expected = typical * alternating((i, j));
            colour_step(image, lattice, (i, j))
                .is_some_and(|step| step.clean && step.value * expected > 0.0)
        })
}

/// True if a point is at least `margin_px` from the picture's edges.
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

    /// Grid of every `steps`-th corner along both axes.
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
                assert_eq!(cells(&cloth(), &grid(steps, turned)), Cells::Several, "{steps:?}");
            }
            assert_eq!(cells(&cloth(), &grid([1, 1], turned)), Cells::Squares, "{turned}");
        }
    }

    /// The middle between two adjacent discs of four looks like a corner.
    #[test]
    fn discs_of_any_size_are_no_squares() {
        const PITCH_PX: f32 = 24.0;
        for diameter in [0.35_f32, 0.5, 0.6, 0.7, 0.8, 0.9] {
            let drawn = GrayImage::from_fn(200, 200, |x, y| {
                let off = [x, y].map(|at| (at as f32 + 0.5).rem_euclid(PITCH_PX) - 0.5 * PITCH_PX);
                let is_disc = libm::hypotf(off[0], off[1]) < 0.5 * diameter * PITCH_PX;
                image::Luma([if is_disc { 30 } else { 210 }])
            });
            let picture = image::imageops::blur(&drawn, 0.8);
            let mut lattice = Lattice::default();
            lattice.clear(6);
            for i in 0..4 {
                for j in 0..4 {
                    let at = [i - j, i + j].map(|half| half as f32);
                    let at = [4.0 + 0.5 * at[0], 1.5 + 0.5 * at[1]];
                    lattice.insert((i, j), at.map(|at| at * PITCH_PX - 0.5));
                }
            }
            assert_eq!(cells(&picture, &lattice), Cells::Discs, "{diameter}");
            let mut light = picture;
            image::imageops::invert(&mut light);
            assert_eq!(cells(&light, &lattice), Cells::Discs, "light, {diameter}");
        }
    }
}
