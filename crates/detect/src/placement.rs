//! Where a part of a board lies on it.
//!
//! Every turn and shift that puts the part inside the board is looked at. It must have white where the part ends in white,
//! squares where they go on, the board's colours, and lie where the board was last seen, or beside the printed code that names
//! the board. The part is used only if exactly one place is left; never by its squares alone, for others may look like them.
//! (Boards that look the same upside down keep two where they were last seen; then, as for whole boards, the first corner is
//! the one nearest to the top left. Their code tells.)

use image::GrayImage;
use nalgebra::Point2;

use super::{
    colours::dark_outside,
    lattice::{Lattice, Node, axes, height},
    missing::{Beyond, SIDES, beyond},
    printed_code::{Plane, is_named_by_code},
};
use boresight_geometry::{Corner, Homography, board::Checkerboard, frame::ImageSize};

/// Corners of a part, and its rows and columns, that tell enough.
const LEAST_CORNERS: usize = 12;
const LEAST_LINES: i32 = 3;
/// A row or column at the end of a part with fewer corners may be chance corners beside the board.
const LEAST_IN_LINE: usize = 3;
/// Largest root mean square distance of corners from where they are expected, in squares. A shift that keeps the colours is
/// at least 1.4 squares, any shift at least one.
const NEAR: f32 = 0.35;

/// Maps a node `(i, j)` to column and row: `[column, row] = turn · [i, j] + shift`. Never a mirror image.
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

    /// The node of a column and row.
    pub(super) fn node(&self, place: [i32; 2]) -> Node {
        let off: [i32; 2] = std::array::from_fn(|k| place[k] - self.shift[k]);
        // The inverse of a turn is its transpose.
        let along = |k: usize| self.turn[0][k] * off[0] + self.turn[1][k] * off[1];
        (along(0), along(1))
    }

    /// The node, between nodes, of a place in squares from the board's top-left corner.
    fn node_at(&self, (x, y): (f64, f64)) -> Point2<f64> {
        let off = [x - 1.0 - f64::from(self.shift[0]), y - 1.0 - f64::from(self.shift[1])];
        let along =
            |k: usize| f64::from(self.turn[0][k]) * off[0] + f64::from(self.turn[1][k]) * off[1];
        Point2::new(along(0), along(1))
    }

    fn is_upright(&self) -> bool {
        self.turn[0][0] != 0
    }
}

/// Writes the part's corners by their numbers on `board` to `into`, `None` for those that aren't seen. `false` if the part
/// is too small, or if neither a prediction nor the board's code says where on the board it is. `expected` has all corners
/// where they were predicted, or none.
pub(super) fn place_part(
    image: &GrayImage,
    lattice: &mut Lattice,
    board: &Checkerboard,
    expected: &[[f32; 2]],
    into: &mut Vec<Option<[f32; 2]>>,
) -> bool {
    drop_thin_ends(lattice);
    let Some((low, high)) = lattice.extent() else { return false };
    let shortest = (high.0 - low.0).min(high.1 - low.1) + 1;
    if lattice.len() < LEAST_CORNERS || shortest < LEAST_LINES {
        return false;
    }
    let all = placements(image, lattice, board);
    let by_track = by_track(all.clone(), lattice, board, expected);
    let Some(placement) = by_track.or_else(|| by_code(all, image, lattice, board)) else {
        return false;
    };
    let (columns, rows) = (board.columns() as i32, board.rows() as i32);
    let all = (0..rows).flat_map(|row| (0..columns).map(move |column| [column, row]));
    into.clear();
    into.extend(all.map(|place| lattice.get(placement.node(place))));
    true
}

/// The placement whose corners are `expected` where they lie. `None` without a prediction.
fn by_track(
    placements: impl Iterator<Item = Placement>,
    lattice: &Lattice,
    board: &Checkerboard,
    expected: &[[f32; 2]],
) -> Option<Placement> {
    if expected.is_empty() {
        return None;
    }
    let columns = board.columns() as i32;
    let mut near = placements.filter(|it| is_near(lattice, it, columns, expected));
    let one = near.next()?;
    match (near.next(), near.next()) {
        (None, _) => Some(one),
        (Some(other), None) if board.looks_the_same_upside_down() => {
            let is_one = first_is_nearer(lattice, [&one, &other])?;
            Some(if is_one { one } else { other })
        }
        _ => None,
    }
}

/// The placement with the board's printed code beside it.
fn by_code(
    placements: impl Iterator<Item = Placement>,
    image: &GrayImage,
    lattice: &Lattice,
    board: &Checkerboard,
) -> Option<Placement> {
    let pair = |&(i, j): &Node| {
        let [x, y] = lattice.get((i, j))?.map(f64::from);
        Some((Point2::new(f64::from(i), f64::from(j)), Point2::new(x, y)))
    };
    let pairs = lattice.nodes().iter().filter_map(pair);
    let plane = Plane::through(&pairs, ImageSize::of(image))?;
    let mut named = placements.filter(|placement| {
        let px_of = |place| plane.px(&placement.node_at(place));
        is_named_by_code(image, board, &px_of)
    });
    let only = named.next()?;
    named.next().is_none().then_some(only)
}

/// The turns and shifts that put the part inside the board, with white, squares and colours as in the picture.
fn placements(
    image: &GrayImage,
    lattice: &Lattice,
    board: &Checkerboard,
) -> impl Iterator<Item = Placement> + Clone {
    let size = [board.columns() as i32, board.rows() as i32];
    let ends = SIDES.map(|out| beyond(image, lattice, out));
    let all = lattice.extent().into_iter().flat_map(move |(low, high)| {
        TURNS.into_iter().flat_map(move |turn| {
            let unshifted = Placement { turn, shift: [0, 0] };
            let ends_at = [unshifted.place(low), unshifted.place(high)];
            let least: [i32; 2] = std::array::from_fn(|k| ends_at[0][k].min(ends_at[1][k]));
            let most: [i32; 2] = std::array::from_fn(|k| ends_at[0][k].max(ends_at[1][k]));
            let columns = -least[0]..size[0] - most[0];
            let shifts = columns.flat_map(move |column| {
                (-least[1]..size[1] - most[1]).map(move |row| [column, row])
            });
            shifts.map(move |shift| Placement { turn, shift })
        })
    });
    all.filter(move |placement| {
        lattice.extent().is_some_and(|extent| ends_fit(placement, extent, size, ends))
            && colours_fit(image, lattice, placement, board)
    })
}

/// Drops rows and columns at the ends that have few corners.
fn drop_thin_ends(lattice: &mut Lattice) {
    while let Some((low, high)) = lattice.extent() {
        let count =
            |out: Node| lattice.nodes().iter().filter(|node| on_end(lattice, out, **node)).count();
        let Some((di, dj)) = SIDES.into_iter().find(|out| count(*out) < LEAST_IN_LINE) else {
            return;
        };
        let end = (if di < 0 { low.0 } else { high.0 }, if dj < 0 { low.1 } else { high.1 });
        lattice.retain(|_, (i, j)| if di == 0 { j != end.1 } else { i != end.0 });
    }
}

/// Whether a node is among the last ones in the direction `out`.
fn on_end(lattice: &Lattice, (di, dj): Node, (i, j): Node) -> bool {
    lattice.extent().is_some_and(|(low, high)| match (di, dj) {
        (-1, _) => i == low.0,
        (1, _) => i == high.0,
        (_, -1) => j == low.1,
        _ => j == high.1,
    })
}

/// Whether white is where the board ends, and squares where it goes on.
fn ends_fit(
    placement: &Placement,
    (low, high): (Node, Node),
    size: [i32; 2],
    ends: [Beyond; 4],
) -> bool {
    SIDES.into_iter().zip(ends).all(|((di, dj), end)| {
        let rim = (if di < 0 { low.0 } else { high.0 }, if dj < 0 { low.1 } else { high.1 });
        let (at, next) = (placement.place(rim), placement.place((rim.0 + di, rim.1 + dj)));
        let axis = usize::from(at[0] == next[0]);
        let is_end = !(0..size[axis]).contains(&next[axis]);
        match end {
            Beyond::White => is_end,
            Beyond::Squares => !is_end,
            Beyond::Unclear => true,
        }
    })
}

/// Boards of mixed parity have a dark outer square at their first corner.
fn colours_fit(
    image: &GrayImage,
    lattice: &Lattice,
    placement: &Placement,
    board: &Checkerboard,
) -> bool {
    if board.looks_the_same_upside_down() {
        return true;
    }
    let (mut agree, mut all) = (0, 0);
    for &node in lattice.nodes() {
        let Some(is_dark) = dark_outside(image, lattice, node, placement.is_upright()) else {
            continue;
        };
        let [column, row] = placement.place(node);
        all += 1;
        agree += usize::from(is_dark == ((column + row) % 2 == 0));
    }
    2 * agree > all
}

/// Whether the corners lie where they are expected.
fn is_near(lattice: &Lattice, placement: &Placement, columns: i32, expected: &[[f32; 2]]) -> bool {
    let (mut squares, mut count) = (0.0, 0.0_f32);
    for &node in lattice.nodes() {
        let [column, row] = placement.place(node);
        let at = lattice.get(node);
        let Some((at, expected)) = at.zip(expected.get((row * columns + column) as usize)) else {
            return false;
        };
        let Some(axes) = axes(lattice, node, at) else { continue };
        let off = [at[0] - expected[0], at[1] - expected[1]];
        squares += (off[0].hypot(off[1]) / height(axes).max(1.0)).powi(2);
        count += 1.0;
    }
    count > 0.0 && (squares / count).sqrt() < NEAR
}

/// Whether the first corner of the board is nearer to the top left in the first place than in the second.
fn first_is_nearer(lattice: &Lattice, places: [&Placement; 2]) -> Option<bool> {
    let point = |[x, y]: [f32; 2]| Point2::new(f64::from(x), f64::from(y));
    let (nodes, corners): (Vec<_>, Vec<_>) = lattice
        .nodes()
        .iter()
        .filter_map(|&(i, j)| {
            let corner = Corner::isotropic(point(lattice.get((i, j))?), 1.0);
            Some((Point2::new(f64::from(i), f64::from(j)), corner))
        })
        .unzip();
    let plane = Homography::fit(&nodes, &corners).ok()?;
    let [one, other] = places.map(|placement| {
        let (i, j) = placement.node([0, 0]);
        plane.map(&Point2::new(f64::from(i), f64::from(j))).map(|px| px.x + px.y)
    });
    Some(one? <= other?)
}
