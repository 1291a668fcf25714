//! Reasons for missing corners of a board, and evidence behind the ends of a grid.

use image::GrayImage;

use super::{
    lattice::{BESIDE, Lattice, Node, axes, height, is_at_end},
    outcome::Side,
    reduce::sample,
};

/// Least step from dark to light squares, in grey levels.
const LEAST_STEP: f32 = 8.0;

/// Brightness from which a square counts as saturated, in grey levels.
const SATURATED: f32 = 248.0;

/// Reason for missing corners of a board.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Why {
    /// Corners beyond the given edge of the picture.
    CutOff(Side),
    /// Saturated picture.
    Glare,
    /// Corners apparently covered.
    Covered,
}

impl Why {
    /// Edge of the picture, if the board is cut off.
    pub(super) fn cut_off_by(self) -> Option<Side> {
        match self {
            Self::CutOff(side) => Some(side),
            Self::Glare | Self::Covered => None,
        }
    }
}

/// Distance from the edge of the picture within which no corner is found, in pixels.
const MARGIN_PX: f32 = 6.0;
/// Least number of places for a reason, as a single place may be chance.
const LEAST_PLACES: usize = 2;
/// Places of possible glare ahead of the last corner, in squares: it also hides corners around the
/// saturated place.
const AHEAD: [f32; 2] = [1.0, 2.0];

/// Reason for most of the missing places beside a grid. A board of known `size` has none beyond
/// those ends of the grid between which it's as long as the board. A missing corner needs `reach`
/// squares around its place.
pub(super) fn why_missing(
    image: &GrayImage,
    lattice: &Lattice,
    size: Option<[i32; 2]>,
    reach: f32,
) -> Why {
    use Side::{Bottom, Left, Right, Top};
    let Some((low, high)) = lattice.extent() else { return Why::Covered };
    let span = lattice.size().map(|span| span as i32);
    let ways = size.into_iter().flat_map(|[columns, rows]| [[columns, rows], [rows, columns]]);
    let mut ways = ways.filter(|way| span[0] <= way[0] && span[1] <= way[1]).peekable();
    let is_any = ways.peek().is_none();
    let is_longer = ways.fold([is_any; 2], |longer, way| {
        [longer[0] || way[0] > span[0], longer[1] || way[1] > span[1]]
    });
    let (width, height) = (image.width() as f32, image.height() as f32);
    let mut places = [
        (Why::CutOff(Left), 0),
        (Why::CutOff(Right), 0),
        (Why::CutOff(Top), 0),
        (Why::CutOff(Bottom), 0),
        (Why::Glare, 0),
    ];
    // Light never ends along a row: it's the white around a board.
    let is_straight = |node: Node, out: Node| {
        let is_at = |node: Node| is_at_end((low, high), out, node);
        let count = lattice.nodes().iter().filter(|node| is_at(**node)).count();
        is_at(node) && count as i32 == span[usize::from(out.0 != 0)]
    };
    for &(i, j) in lattice.nodes() {
        for (di, dj) in BESIDE {
            let next = (i + di, j + dj);
            let is_within = |at: i32, low: i32, high: i32| (low..=high).contains(&at);
            let may_be = (is_longer[0] || is_within(next.0, low.0, high.0))
                && (is_longer[1] || is_within(next.1, low.1, high.1));
            if !may_be || lattice.contains(next) {
                continue;
            }
            let Some(([x, y], side)) = lattice.predict(next) else { continue };
            let margin_px = MARGIN_PX.max(reach * side);
            let outside = [x, width - x, y, height - y].map(|off_px| off_px < margin_px);
            let is_glare = !outside.contains(&true)
                && glares(image, lattice, (i, j), (di, dj))
                && !is_straight((i, j), (di, dj));
            for (place, explains) in places.iter_mut().zip(outside.into_iter().chain([is_glare])) {
                place.1 += usize::from(explains);
            }
        }
    }
    let most = places.into_iter().rev().max_by_key(|(_, count)| *count);
    most.filter(|(_, count)| *count >= LEAST_PLACES).map_or(Why::Covered, |(why, _)| why)
}

/// True if the picture is saturated ahead of a corner.
fn glares(image: &GrayImage, lattice: &Lattice, node: Node, (di, dj): Node) -> bool {
    let axes = lattice.get(node).and_then(|here| Some((here, axes(lattice, node, here)?)));
    let Some((here, (u, v))) = axes else { return false };
    let reach = 0.3 * height((u, v));
    AHEAD.iter().any(|ahead| {
        let at: [f32; 2] =
            std::array::from_fn(|k| here[k] + ahead * (u[k] * di as f32 + v[k] * dj as f32));
        let across = [-reach, 0.0, reach];
        let is_bright = |dx: f32, dy: f32| sample(image, at[0] + dx, at[1] + dy) >= SATURATED;
        across.iter().all(|dx| across.iter().all(|dy| is_bright(*dx, *dy)))
    })
}

/// Outward steps through each side of a grid.
pub(super) const SIDES: [Node; 4] = [(-1, 0), (1, 0), (0, -1), (0, 1)];
/// Sampling distances from a corner of the rim, in squares: twice in the outer square, and in the
/// inner one, on a board without markers.
pub(super) const PLAIN: [f32; 3] = [0.4, 0.75, 0.5];
/// Sampling distances behind the outer square, before a printed code.
const BEHIND: [f32; 2] = [1.18, 1.34];
/// Sampling places between two corners of the rim.
const ALONG: [f32; 3] = [0.3, 0.5, 0.7];
/// Largest difference between an outer square and the nearest inner square of the same colour, as a
/// share of the step from dark to light squares.
const UNEVEN_TO: f32 = 0.35;

/// Least lead of an accepted explanation over all others, in bits.
pub(super) const LEAD: f32 = 8.0;
/// Bits for more squares by a corner beyond a board: one place in three beside a board resembles a
/// corner.
pub(super) const CORNER_BITS: f32 = 1.6;
/// Standard deviation of a place's brightness, as a share of the step from dark to light squares,
/// and range of any other content's brightness.
const SPREAD: f32 = 0.15;
const RANGE: f32 = 2.5;
/// Reciprocal of the share of places, squares or sides with other content.
pub(super) const ONE_IS_OTHER: f32 = 16.0;
/// Effective number of independent places behind a square.
const INDEPENDENT: f32 = 2.0;

/// Evidence behind the outer squares on a side of a grid: bits for the white around the board, and
/// for more squares, compared with any other content.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Behind {
    pub(super) white: f32,
    pub(super) squares: f32,
}

impl Behind {
    /// True if white follows.
    pub(super) fn ends(self) -> bool {
        self.white >= LEAD + self.squares.max(0.0)
    }

    /// True if more squares follow.
    pub(super) fn goes_on(self) -> bool {
        self.squares >= LEAD + self.white.max(0.0)
    }
}

/// Evidence behind the outer squares in the direction `out`; squares have their own colour at
/// [`PLAIN`] places, or in the gap around a marker. A dark square is followed by light in either
/// case; behind a light one, white or a dark square decides. Places outside of the picture are no
/// evidence.
pub(super) fn behind(
    image: &GrayImage,
    lattice: &Lattice,
    out: Node,
    own_colour: [f32; 3],
) -> Behind {
    let mut bits = Behind::default();
    let Some(extent) = lattice.extent() else { return bits };
    for &(i, j) in lattice.nodes() {
        let beside = (i + out.1.abs(), j + out.0.abs());
        if !is_at_end(extent, out, (i, j)) || !lattice.contains(beside) {
            continue;
        }
        let Some(seen) = outer_square(image, lattice, [(i, j), beside], out, own_colour) else {
            continue;
        };
        let bits_of = |brightness: f32| {
            let Some((_, behind)) = seen else { return -libm::log2f(ONE_IS_OTHER) };
            let places = behind.map(|seen| log2_likelihood(seen - brightness, SPREAD));
            let mean = places.iter().sum::<f32>() / places.len() as f32;
            libm::log2f(
                libm::exp2f(INDEPENDENT * mean) * (1.0 - 1.0 / ONE_IS_OTHER) + 1.0 / ONE_IS_OTHER,
            )
        };
        bits.white += bits_of(1.0);
        bits.squares += bits_of(seen.map_or(1.0, |(is_light, _)| f32::from(u8::from(!is_light))));
    }
    bits
}

/// Bits for a place `off` the expected brightness, as a share of the step from dark to light
/// squares; `spread` is its standard deviation, if larger than the usual.
pub(super) fn log2_likelihood(off: f32, spread: f32) -> f32 {
    let spread = spread.max(SPREAD);
    let peak = RANGE / (spread * std::f32::consts::TAU.sqrt());
    let likely = peak * libm::expf(-0.5 * (off / spread).powi(2));
    libm::log2f(likely * (1.0 - 1.0 / ONE_IS_OTHER) + 1.0 / ONE_IS_OTHER)
}

/// Colour of the outer square beyond two neighbouring corners of the rim (`true`: light), and the
/// brightness of places behind it, from 0 for dark squares to 1 for light ones, or `None` without a
/// square; `None` outside of the picture.
fn outer_square(
    image: &GrayImage,
    lattice: &Lattice,
    corners: [Node; 2],
    (di, dj): Node,
    [near, far, inside]: [f32; 3],
) -> Option<Option<(bool, [f32; 6])>> {
    let between = |from: [f32; 2], to: [f32; 2], share: f32| -> [f32; 2] {
        std::array::from_fn(|k| from[k] + share * (to[k] - from[k]))
    };
    let rim = |(i, j): Node| {
        let here = lattice.get((i, j))?;
        Some((lattice.get((i - di, j - dj))?, here, lattice.predict((i + di, j + dj))?.0))
    };
    let [one, other] = [rim(corners[0])?, rim(corners[1])?];
    let (right, bottom) = (image.width() as f32 - 2.0, image.height() as f32 - 2.0);
    let level = |steps: f32, along: f32| {
        let at = |(inner, here, out)| match steps < 0.0 {
            true => between(here, inner, -steps),
            false => between(here, out, steps),
        };
        let [x, y] = between(at(one), at(other), along);
        let is_inside = (1.0..right).contains(&x) && (1.0..bottom).contains(&y);
        is_inside.then(|| sample(image, x, y))
    };
    let (inside, next) = (level(-inside, 0.5)?, level(-1.0 - inside, 0.5)?);
    let outer = [level(near, 0.5)?, level(far, 0.5)?];
    let is_square = outer.iter().all(|at| (at - next).abs() <= UNEVEN_TO * (inside - next).abs());
    let outside = 0.5 * (outer[0] + outer[1]);
    let (dark, light) = (inside.min(outside), inside.max(outside));
    let step = light - dark;
    if step < LEAST_STEP || !is_square {
        return Some(None);
    }
    let share = |level: f32| (level - dark) / step;
    let mut places = [0.0; 6];
    let all = BEHIND.into_iter().flat_map(|steps| ALONG.map(|along| (steps, along)));
    for (place, (steps, along)) in places.iter_mut().zip(all) {
        *place = share(level(steps, along)?);
    }
    Some(Some((outside > inside, places)))
}
