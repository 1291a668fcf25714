//! What was weighed for a picture: the grids that were held against the board, and the bits that decided.

use image::GrayImage;

use super::{
    lattice::{Lattice, Node},
    missing::{Behind, SIDES, behind},
    outcome::{Miss, Side},
    placement::{Weighed, places},
    reduce::Halved,
    track::Expected,
};
use boresight_geometry::board::Checkerboard;

/// Most places of a grid that are listed.
pub(super) const PLACES: usize = 3;

/// How a picture was searched.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Searched {
    /// Pixels of the picture in each pixel that was searched.
    pub scale: f64,
    /// Whether dark or light squares were grown first, because they might not touch.
    pub grown: bool,
}

/// A grid of corners, or of circles, that was held against the board.
#[derive(Clone, Debug, PartialEq)]
pub struct WeighedGrid {
    /// How the picture was searched.
    pub searched: Searched,
    /// The grid's corners, or the middles of its ellipses, in pixels of the picture.
    pub corners_px: Vec<[f64; 2]>,
    /// How many corners it is long and wide, as far as it reaches; not all of them need be seen. If every second row of circles
    /// is shifted, along the diagonals in which circles are nearest neighbours.
    pub size: [usize; 2],
    /// What lies behind its ends, by where they are in the picture. None for boards with markers, which are named by these, nor
    /// for circles.
    pub ends: Vec<WeighedEnd>,
    /// Where on the board it may lie: the places with most bits, best first. None for boards with markers, nor for circles.
    pub places: Vec<WeighedPlace>,
    /// What the markers in its squares say. `None` for boards without any.
    pub markers: Option<WeighedMarkers>,
    /// What came of it.
    pub outcome: GridOutcome,
}

/// What lies behind an end of a grid: bits against anything else that may be there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WeighedEnd {
    /// Where the end is, seen from the grid's middle.
    pub side: Side,
    /// Bits for the white around a board.
    pub white_bits: f64,
    /// Bits for more squares.
    pub squares_bits: f64,
}

/// A place where a grid may lie on the board.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WeighedPlace {
    /// Column and row, from 0, of the corner of the grid that's first on the board.
    pub first: [usize; 2],
    /// Quarter turns of the board, clockwise from the grid's own axes.
    pub quarter_turns: usize,
    /// Bits for it by what lies behind the ends, by the squares' colours, and by where the frames before lead.
    pub bits: [f64; 3],
    /// Whether the code in the board's margin is there.
    pub has_code: bool,
}

/// What the markers in the squares of a grid say.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct WeighedMarkers {
    /// What was read, square by square.
    pub read: Vec<ReadMarker>,
    /// Where on the board they put the grid: the places with most bits, best first.
    pub places: Vec<VotedPlace>,
}

/// What was read in a square, held against the likeliest place.
#[derive(Clone, Debug, PartialEq)]
pub struct ReadMarker {
    /// The square's column and row of squares on the board, from 0; beyond the board if the grid is there. `None` if the
    /// markers speak for no place.
    pub square: Option<[i32; 2]>,
    /// Number of the marker that the board has there.
    pub marker: Option<usize>,
    /// The cells in the marker's rows, from its top left, without its frame: true where it's white.
    pub is_white: Vec<bool>,
    /// Cells that differ from that marker's.
    pub wrong: usize,
    /// Bits by which it agrees beyond chance; none if too many cells are wrong.
    pub bits: Option<f64>,
}

/// A place where the markers put a grid on the board.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VotedPlace {
    /// Column and row, from 0, of the corner of the grid that's first on the board; negative beyond the board's first.
    pub first: [i32; 2],
    /// Quarter turns of the board, clockwise from the grid's own axes.
    pub quarter_turns: usize,
    /// Bits of all markers that agree.
    pub bits: f64,
    /// How many agree.
    pub agreeing: usize,
    /// How many don't, of those in squares that are surely the grid's.
    pub conflicts: usize,
    /// Corners of the grid that it would put beyond the board's ends.
    pub outside: usize,
}

/// What came of a grid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum GridOutcome {
    /// So many of its corners are the board's.
    Named(usize),
    /// It has round dark shapes: a grid of circles.
    Circles,
    /// It isn't the board, or not clearly.
    Missed(Miss),
}

impl WeighedGrid {
    /// The grid in `lattice` of a plain board, with what was found out about it in `image`.
    pub(super) fn of(
        image: &GrayImage,
        lattice: &mut Lattice,
        board: &Checkerboard,
        expected: &Expected,
        outcome: GridOutcome,
    ) -> Self {
        let ends = SIDES.map(|out| {
            let Behind { white, squares } = behind(image, lattice, out);
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

    /// The grid in `lattice` of a board with markers.
    pub(super) fn marked(lattice: &Lattice, says: WeighedMarkers, outcome: GridOutcome) -> Self {
        Self { markers: Some(says), ..Self::seen(lattice, outcome) }
    }

    /// Says how the picture was searched in which the grid was found, and takes its corners to the picture's own pixels.
    pub(super) fn was_searched(&mut self, searched: Searched, halved: Halved) {
        self.searched = searched;
        for at in &mut self.corners_px {
            *at = halved.full_px(at.map(|at| at as f32));
        }
    }

    /// The grid in `lattice` of nothing but places: what lies behind its ends isn't weighed.
    pub(super) fn seen(lattice: &Lattice, outcome: GridOutcome) -> Self {
        let seen = lattice.nodes().iter().filter_map(|node| lattice.get(*node));
        let size = lattice.extent().map_or([0; 2], |(low, high)| {
            [high.0 - low.0, high.1 - low.1].map(|span| span as usize + 1)
        });
        Self {
            searched: Searched::default(),
            corners_px: seen.map(|at| at.map(f64::from)).collect(),
            size,
            ends: Vec::new(),
            places: Vec::new(),
            markers: None,
            outcome,
        }
    }
}

/// Where in the picture the end of a grid in the direction `out` is, seen from its middle.
fn side_of(lattice: &Lattice, (di, dj): Node) -> Side {
    let along = |(i, j): Node| (i * di + j * dj) as f32;
    let count = lattice.len().max(1) as f32;
    let middle = lattice.nodes().iter().map(|node| along(*node)).sum::<f32>() / count;
    // The direction in the picture in which the nodes' numbers grow.
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
