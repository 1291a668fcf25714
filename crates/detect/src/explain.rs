//! Weighed grids of a picture: the candidates compared with the board, and the decisive bits.

use image::GrayImage;

use super::{
    lattice::{Lattice, Node},
    missing::{Behind, PLAIN, SIDES, behind},
    outcome::{Miss, Side},
    placement::{Weighed, places},
    reduce::Halved,
    track::Expected,
};
use boresight_geometry::boards::Board;

/// Most listed places of a grid.
pub(super) const PLACES: usize = 3;

/// Search of a picture.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Searched {
    /// Pixels of the full picture per searched pixel.
    pub scale: f64,
    /// True if dark or light squares were grown first, in case of gaps between the squares.
    pub grown: bool,
}

/// Grid of corners or circles compared with the board.
#[derive(Clone, Debug, PartialEq)]
pub struct WeighedGrid {
    /// Search of the picture.
    pub searched: Searched,
    /// Corners of the grid, or the middles of the ellipses, in pixels of the picture.
    pub corners_px: Vec<[f64; 2]>,
    /// Length and width of the grid in corners, over the whole extent, missing corners included. If
    /// every second row of circles is shifted, along the diagonals between nearest neighbours.
    pub size: [usize; 2],
    /// Evidence behind the ends, by side of the picture. Empty for boards with markers, whose
    /// markers name them, and for circles.
    pub ends: Vec<WeighedEnd>,
    /// Likeliest places on the board, best first. Empty for boards with markers, and for circles.
    pub places: Vec<WeighedPlace>,
    /// Evidence of the markers in the grid's squares. `None` for boards without any.
    pub markers: Option<WeighedMarkers>,
    /// Outcome for the grid.
    pub outcome: GridOutcome,
}

/// Evidence behind an end of a grid: bits against any other content.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WeighedEnd {
    /// Side of the end, from the grid's middle.
    pub side: Side,
    /// Bits for the white around a board.
    pub white_bits: f64,
    /// Bits for more squares.
    pub squares_bits: f64,
}

/// Place of a grid on the board.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WeighedPlace {
    /// Column and row, from 0, of the corner of the grid that's first on the board.
    pub first: [usize; 2],
    /// Quarter turns of the board, clockwise from the grid's own axes.
    pub quarter_turns: usize,
    /// Bits for the place by the ends, by the squares' colours, and by the previous frames.
    pub bits: [f64; 3],
    /// True if the code in the board's margin is there.
    pub has_code: bool,
}

/// Evidence of the markers in the squares of a grid.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct WeighedMarkers {
    /// Number of markers read.
    pub read: usize,
    /// Places of the grid on the board by the markers, most bits first.
    pub places: Vec<VotedPlace>,
}

/// Place of a grid on the board by the markers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VotedPlace {
    /// Column and row, from 0, of the corner of the grid that's first on the board; negative beyond
    /// the board's first.
    pub first: [i32; 2],
    /// Quarter turns of the board, clockwise from the grid's own axes.
    pub quarter_turns: usize,
    /// Bits of all agreeing markers.
    pub bits: f64,
    /// Number of agreeing markers.
    pub agreeing: usize,
    /// Number of conflicting markers in squares surely of the grid.
    pub conflicts: usize,
    /// Number of the grid's corners beyond the board's ends.
    pub outside: usize,
}

/// Outcome for a grid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum GridOutcome {
    /// Number of corners named as the board's.
    Named(usize),
    /// Round dark shapes: a grid of circles.
    Circles,
    /// Reason for rejecting the grid.
    Missed(Miss),
}

impl WeighedGrid {
    /// Sorts grids: the named one first, then those with most corners.
    pub fn likeliest_first(grids: &mut [Self]) {
        let is_refused = |grid: &Self| !matches!(grid.outcome, GridOutcome::Named(_));
        grids.sort_by_key(|grid| (is_refused(grid), std::cmp::Reverse(grid.corners_px.len())));
    }

    /// Weighed grid in `lattice` of a plain board, with the evidence in `image`.
    pub(super) fn of(
        image: &GrayImage,
        lattice: &mut Lattice,
        board: &Board,
        expected: &Expected,
        outcome: GridOutcome,
    ) -> Self {
        let ends = SIDES.map(|out| {
            let Behind { white, squares } = behind(image, lattice, out, PLAIN);
            let side = side_of(lattice, out);
            WeighedEnd { side, white_bits: white.into(), squares_bits: squares.into() }
        });
        let places = places(image, lattice, board, expected);
        let (low, high) = lattice.extent().unwrap_or_default();
        let place = |(it, has_code): &(Weighed, bool)| {
            let ends = [it.placement.place(low), it.placement.place(high)];
            WeighedPlace {
                first: std::array::from_fn(|k| ends[0][k].min(ends[1][k]) as usize),
                quarter_turns: it.placement.quarter_turns(),
                bits: [it.ends, it.colours, it.track].map(f64::from),
                has_code: *has_code,
            }
        };
        Self {
            ends: ends.to_vec(),
            places: places.iter().take(PLACES).map(place).collect(),
            ..Self::seen(lattice, outcome)
        }
    }

    /// Weighed grid in `lattice` of a board with markers.
    pub(super) fn marked(lattice: &Lattice, says: WeighedMarkers, outcome: GridOutcome) -> Self {
        Self { markers: Some(says), ..Self::seen(lattice, outcome) }
    }

    /// Records the search of the grid's picture, and converts the corners to the full picture's
    /// pixels.
    pub(super) fn was_searched(&mut self, searched: Searched, halved: Halved) {
        self.searched = searched;
        for at in &mut self.corners_px {
            *at = halved.full_px(at.map(|at| at as f32));
        }
    }

    /// Weighed grid in `lattice` with places only: its ends aren't weighed.
    pub(super) fn seen(lattice: &Lattice, outcome: GridOutcome) -> Self {
        let seen = lattice.nodes().iter().filter_map(|node| lattice.get(*node));
        Self {
            searched: Searched::default(),
            corners_px: seen.map(|at| at.map(f64::from)).collect(),
            size: lattice.size(),
            ends: Vec::new(),
            places: Vec::new(),
            markers: None,
            outcome,
        }
    }
}

/// Side of the picture with the end of a grid in the direction `out`, from the middle.
fn side_of(lattice: &Lattice, (di, dj): Node) -> Side {
    let along = |(i, j): Node| (i * di + j * dj) as f32;
    let count = lattice.len().max(1) as f32;
    let middle = lattice.nodes().iter().map(|node| along(*node)).sum::<f32>() / count;
    // Direction in the picture in which the nodes' numbers grow.
    let [x, y] = lattice.nodes().iter().fold([0.0; 2], |sum: [f32; 2], node| {
        let at = lattice.get(*node).unwrap_or_default();
        let far = along(*node) - middle;
        [sum[0] + far * at[0], sum[1] + far * at[1]]
    });
    match (x.abs() > y.abs(), x > 0.0, y > 0.0) {
        (true, true, _) => Side::Right,
        (true, false, _) => Side::Left,
        (false, _, true) => Side::Bottom,
        (false, _, false) => Side::Top,
    }
}
