//! Places a part of a board on the whole, weighed in bits.
//!
//! Every turn and shift that puts the part inside the board is a hypothesis. The evidence behind
//! the part's ends supports white or more squares there, colours support the turn, and the track,
//! or the board's printed code, supports the place. A place is accepted if it leads all others by
//! [`LEAD`] bits, and only if the track or the code shows that the part is of this board, because
//! other boards may have such squares and ends.

use image::GrayImage;
use nalgebra::Point2;

use super::{
    colours::{dark_outside, inside},
    lattice::{Lattice, Node, axes, height, is_at_end},
    missing::{Behind, LEAD, ONE_IS_OTHER, PLAIN, SIDES, behind},
    plane::Plane,
    printed_code::is_named_by_code,
    track::Expected,
};
use boresight_geometry::{boards::Board, frame::ImageSize};

/// Least number of corners of a part, and of rows and columns.
pub(super) const LEAST_CORNERS: usize = 12;
const LEAST_LINES: i32 = 3;
/// Least number of corners in a row or column at the end of a part: fewer may be chance corners
/// beside the board.
pub(super) const LEAST_IN_LINE: usize = 3;
/// Binary logarithm of the number of frames per frame away from the track, if the board was moved
/// while unseen, or another object is seen.
const ASTRAY_BITS: f32 = 14.0;
/// Bits against a track if all tracked corners vanish at once. Hands cover a board little by
/// little; a cut or a jump takes many corners in one frame.
const VANISHED_BITS: f32 = 28.0;
/// Distance from the edge of the picture, in squares, within which a corner may be lost.
const LOST_TO_EDGE: f32 = 0.75;

/// Map from a node `(i, j)` to column and row: `[column, row] = turn · [i, j] + shift`. Never a
/// mirror image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Placement {
    pub(super) turn: [[i32; 2]; 2],
    pub(super) shift: [i32; 2],
}

/// Quarter turns.
pub(super) const TURNS: [[[i32; 2]; 2]; 4] =
    [[[1, 0], [0, 1]], [[0, 1], [-1, 0]], [[-1, 0], [0, -1]], [[0, -1], [1, 0]]];

impl Placement {
    pub(super) fn place(&self, (i, j): Node) -> [i32; 2] {
        std::array::from_fn(|k| self.turn[k][0] * i + self.turn[k][1] * j + self.shift[k])
    }

    /// Node of a column and row.
    pub(super) fn node(&self, place: [i32; 2]) -> Node {
        let off: [i32; 2] = std::array::from_fn(|k| place[k] - self.shift[k]);
        // The inverse of a turn is its transpose.
        let along = |k: usize| self.turn[0][k] * off[0] + self.turn[1][k] * off[1];
        (along(0), along(1))
    }

    /// Fractional node of a place in squares from the board's top-left corner.
    fn node_at(&self, (x, y): (f64, f64)) -> Point2<f64> {
        let off = [x - 1.0 - f64::from(self.shift[0]), y - 1.0 - f64::from(self.shift[1])];
        let along =
            |k: usize| f64::from(self.turn[0][k]) * off[0] + f64::from(self.turn[1][k]) * off[1];
        Point2::new(along(0), along(1))
    }

    /// Writes the board's corners to `into`, row by row; `None` for corners missing from the grid.
    pub(super) fn write(&self, lattice: &Lattice, board: &Board, into: &mut Vec<Option<[f32; 2]>>) {
        let (columns, rows) = (board.columns() as i32, board.rows() as i32);
        let all = (0..rows).flat_map(|row| (0..columns).map(move |column| [column, row]));
        into.clear();
        into.extend(all.map(|place| lattice.get(self.node(place))));
    }

    /// Quarter turns of the board, clockwise from the grid's axes.
    pub(super) fn quarter_turns(&self) -> usize {
        TURNS.iter().position(|turn| *turn == self.turn).unwrap_or_default()
    }

    fn is_upright(&self) -> bool {
        self.turn[0][0] != 0
    }
}

/// Writes the part's corners by index on `board` to `into`, `None` for unseen corners. Returns
/// `false` if the part is too small, or if neither a prediction nor the board's code clearly
/// determines its place on the board.
pub(super) fn place_part(
    image: &GrayImage,
    lattice: &mut Lattice,
    board: &Board,
    expected: &Expected,
    into: &mut Vec<Option<[f32; 2]>>,
) -> bool {
    drop_thin_ends(lattice);
    let Some((low, high)) = lattice.extent() else { return false };
    let shortest = (high.0 - low.0).min(high.1 - low.1) + 1;
    if lattice.len() < LEAST_CORNERS || shortest < LEAST_LINES {
        return false;
    }
    let ends = SIDES.map(|out| behind(image, lattice, out, PLAIN));
    let all = weigh(image, lattice, board, expected, ends);
    let tracked = leading(all.clone().map(|it| (it.placement, it.bits(), it.is_tracked)));
    let named = || {
        let by_code = by_code(image, lattice, board)?;
        let most = all.clone().map(|it| it.by_picture()).fold(f32::NEG_INFINITY, f32::max);
        let fits = |it: &Weighed| it.by_picture() > most - LEAD && by_code(&it.placement);
        leading(all.clone().filter(fits).map(|it| (it.placement, it.by_picture(), true)))
    };
    let Some(placement) = tracked.or_else(named) else { return false };
    placement.write(lattice, board, into);
    true
}

/// Writes the corners of a grid as large as `board`, with the same ends in each place. The colours
/// determine the turn. If they can't, the track does, or else the first corner is the nearest to
/// the picture's top left. Returns `false` if the colours aren't the board's.
pub(super) fn place_whole(
    image: &GrayImage,
    lattice: &Lattice,
    board: &Board,
    expected: &Expected,
    into: &mut Vec<Option<[f32; 2]>>,
) -> bool {
    let from_top_left =
        |it: &Weighed| lattice.get(it.placement.node([0, 0])).map_or(f32::INFINITY, |[x, y]| x + y);
    let best = weigh(image, lattice, board, expected, [Behind::default(); 4])
        .filter(|it| it.colours > 0.0 || board.looks_the_same_upside_down())
        .max_by(|a, b| {
            a.track.total_cmp(&b.track).then(from_top_left(b).total_cmp(&from_top_left(a)))
        });
    let Some(best) = best else { return false };
    best.placement.write(lattice, board, into);
    true
}

/// Place of a grid on the board, with bits: by the ends, by the colours, and by the track.
#[derive(Clone, Copy, Debug)]
pub(super) struct Weighed {
    pub(super) placement: Placement,
    pub(super) ends: f32,
    pub(super) colours: f32,
    pub(super) track: f32,
    /// True if the track leads here, and so identifies the board.
    is_tracked: bool,
}

impl Weighed {
    fn by_picture(&self) -> f32 {
        self.ends + self.colours
    }

    fn bits(&self) -> f32 {
        self.by_picture() + self.track
    }
}

/// Possible places on `board` of a grid with the given `ends`.
fn weigh<'a>(
    image: &'a GrayImage,
    lattice: &'a Lattice,
    board: &'a Board,
    expected: &'a Expected,
    ends: [Behind; 4],
) -> impl Iterator<Item = Weighed> + Clone + 'a {
    let extent = lattice.extent().unwrap_or_default();
    let colours = [false, true].map(|is_upright| of_colours(image, lattice, board, is_upright));
    inside_board(extent, board).map(move |placement| {
        let colours = colours[usize::from(placement.is_upright())];
        let is_even = placement.shift.iter().sum::<i32>() % 2 == 0;
        let (near, vanished) = track(image, lattice, &placement, board, expected);
        let track = either(near - VANISHED_BITS * vanished, -ASTRAY_BITS);
        let has_track = !expected.corners.is_empty();
        Weighed {
            placement,
            ends: of_ends(&placement, extent, board, ends),
            colours: if is_even { colours } else { -colours },
            track: if has_track { track } else { 0.0 },
            is_tracked: has_track && near > LEAD - ASTRAY_BITS,
        }
    })
}

/// Places weighed by [`place_part`], best first, each with true if the code is there.
pub(super) fn places(
    image: &GrayImage,
    lattice: &Lattice,
    board: &Board,
    expected: &Expected,
) -> Vec<(Weighed, bool)> {
    let by_code = by_code(image, lattice, board);
    let has_code = |it: &Weighed| by_code.as_ref().is_some_and(|is_named| is_named(&it.placement));
    let ends = SIDES.map(|out| behind(image, lattice, out, PLAIN));
    let all = weigh(image, lattice, board, expected, ends);
    let mut places: Vec<_> = all.map(|it| (it, has_code(&it))).collect();
    places.sort_by(|a, b| b.0.bits().total_cmp(&a.0.bits()));
    places
}

/// Placement that leads all others, if the board is identified.
fn leading(weighed: impl Iterator<Item = (Placement, f32, bool)>) -> Option<Placement> {
    let mut best: Option<(Placement, f32, bool)> = None;
    let mut second = f32::NEG_INFINITY;
    for one in weighed {
        match best {
            Some(before) if before.1 >= one.1 => second = second.max(one.1),
            before => {
                second = before.map_or(second, |before| before.1);
                best = Some(one);
            }
        }
    }
    let (placement, bits, has_witness) = best?;
    (has_witness && bits - second >= LEAD).then_some(placement)
}

/// Bits for either of two explanations.
fn either(one: f32, other: f32) -> f32 {
    let most = one.max(other);
    most + libm::log2f(libm::exp2f(one - most) + libm::exp2f(other - most))
}

/// Turns and shifts that put the part inside the board.
fn inside_board(
    (low, high): (Node, Node),
    board: &Board,
) -> impl Iterator<Item = Placement> + Clone {
    let size = [board.columns() as i32, board.rows() as i32];
    TURNS.into_iter().flat_map(move |turn| {
        let unshifted = Placement { turn, shift: [0, 0] };
        let ends_at = [unshifted.place(low), unshifted.place(high)];
        let least: [i32; 2] = std::array::from_fn(|k| ends_at[0][k].min(ends_at[1][k]));
        let most: [i32; 2] = std::array::from_fn(|k| ends_at[0][k].max(ends_at[1][k]));
        (-least[0]..size[0] - most[0]).flat_map(move |column| {
            (-least[1]..size[1] - most[1]).map(move |row| Placement { turn, shift: [column, row] })
        })
    })
}

/// Bits for a place by the part's ends: white where the board ends, squares where it continues.
pub(super) fn of_ends(
    placement: &Placement,
    (low, high): (Node, Node),
    board: &Board,
    ends: [Behind; 4],
) -> f32 {
    let size = [board.columns() as i32, board.rows() as i32];
    let of_side = |((di, dj), end): (Node, Behind)| {
        let rim = (if di < 0 { low.0 } else { high.0 }, if dj < 0 { low.1 } else { high.1 });
        let (at, next) = (placement.place(rim), placement.place((rim.0 + di, rim.1 + dj)));
        let axis = usize::from(at[0] == next[0]);
        let is_end = !(0..size[axis]).contains(&next[axis]);
        either(if is_end { end.white } else { end.squares }, -libm::log2f(ONE_IS_OTHER))
    };
    SIDES.into_iter().zip(ends).map(of_side).sum()
}

/// Bits by the colours for places with an even shift, and against those with an odd one: one for
/// each corner with matching colours, as boards of mixed parity have a dark outer square at their
/// first corner. No turn changes whether a corner's column and row add up to an even number.
fn of_colours(image: &GrayImage, lattice: &Lattice, board: &Board, is_upright: bool) -> f32 {
    if board.looks_the_same_upside_down() {
        return 0.0;
    }
    let of_corner = |&node: &Node| {
        let is_dark = dark_outside(image, lattice, node, is_upright)?;
        Some(if is_dark == ((node.0 + node.1) % 2 == 0) { 1.0 } else { -1.0 })
    };
    lattice.nodes().iter().filter_map(of_corner).sum()
}

/// Log-likelihood of the track for a place, in bits, at most 0, and the share of tracked corners
/// inside the picture that are now missing.
fn track(
    image: &GrayImage,
    lattice: &Lattice,
    placement: &Placement,
    board: &Board,
    expected: &Expected,
) -> (f32, f32) {
    let columns = board.columns() as i32;
    let (mut squares, mut count, mut side_px) = (0.0, 0.0_f32, 0.0);
    let (mut vanished, mut seen) = (0.0, 0.0_f32);
    for (index, &at) in expected.corners.iter().enumerate() {
        let index = index as i32;
        let node = placement.node([index % columns, index / columns]);
        let Some(found) = lattice.get(node) else { continue };
        let Some(axes) = axes(lattice, node, found) else { continue };
        let off = [found[0] - at[0], found[1] - at[1]];
        squares += (libm::hypotf(off[0], off[1]) / height(axes).max(1.0)).powi(2);
        side_px += height(axes);
        count += 1.0;
    }
    let margin_px = LOST_TO_EDGE * side_px / count.max(1.0);
    for (index, (&at, _)) in
        expected.corners.iter().zip(&expected.seen).enumerate().filter(|(_, (_, seen))| **seen)
    {
        let index = index as i32;
        if inside(image, at, margin_px) {
            seen += 1.0;
            let node = placement.node([index % columns, index / columns]);
            vanished += if lattice.contains(node) { 0.0 } else { 1.0 };
        }
    }
    let off_spreads = squares / count.max(1.0) / expected.spread_squares.powi(2);
    (-0.5 * std::f32::consts::LOG2_E * off_spreads, vanished / seen.max(1.0))
}

/// True for placements with the board's printed code alongside. `None` if no plane goes through the
/// corners.
fn by_code<'a>(
    image: &'a GrayImage,
    lattice: &Lattice,
    board: &'a Board,
) -> Option<impl Fn(&Placement) -> bool + 'a> {
    let pair = |&(i, j): &Node| {
        let [x, y] = lattice.get((i, j))?.map(f64::from);
        Some((Point2::new(f64::from(i), f64::from(j)), Point2::new(x, y)))
    };
    let pairs = lattice.nodes().iter().filter_map(pair);
    let plane = Plane::through(&pairs, ImageSize::of(image))?;
    Some(move |placement: &Placement| {
        is_named_by_code(image, board, &|place| plane.px(&placement.node_at(place)))
    })
}

/// Drops rows and columns at the ends, fewest corners first, as long as `may` allows for the grid,
/// the end and the number of its corners.
pub(super) fn drop_ends(lattice: &mut Lattice, may: impl Fn(&Lattice, Node, usize) -> bool) {
    while let Some(extent) = lattice.extent() {
        let is_at = |out: Node, node: Node| is_at_end(extent, out, node);
        let count = |out: Node| lattice.nodes().iter().filter(|node| is_at(out, **node)).count();
        let thinnest = SIDES.into_iter().min_by_key(|out| count(*out));
        let Some(thinnest) = thinnest.filter(|out| may(lattice, *out, count(*out))) else { return };
        lattice.retain(|_, node| !is_at(thinnest, node));
    }
}

/// Drops ends with too few corners to be a row.
pub(super) fn drop_thin_ends(lattice: &mut Lattice) {
    drop_ends(lattice, |_, _, count| count < LEAST_IN_LINE);
}
