//! Chooses the placement of a grid on a board by the markers in the light squares.
//!
//! Every reading votes for the turns and shifts of the grid that put a similar marker there. The
//! readings are weighed in bits for each placement, for a board with such markers in other places,
//! and for any other cells; the leading placement is chosen. A few squares anywhere on the board
//! are therefore enough, turned in any way, and single wrong cells do no harm.

use image::GrayImage;

use super::{
    explain::{PLACES, VotedPlace, WeighedMarkers},
    lattice::{Lattice, Node},
    marker_cells::{Polarity, read_cells},
    missing::{Behind, CORNER_BITS, LEAD, ONE_IS_OTHER},
    placement::{Placement, TURNS, of_ends},
};
use boresight_geometry::{
    boards::Board,
    markers::{Layout, Markers},
};

/// Reciprocal of the share of misread cells.
const ONE_IS_MISREAD: f64 = 32.0;
/// Binary logarithm of the number of pictures without the board per picture with as many matching
/// markers.
const BY_CHANCE_BITS: f64 = 14.0;
/// Most placements weighed, by votes.
const MOST_PLACEMENTS: usize = 8;

/// Marker read in a square of the grid.
pub(super) struct Reading {
    /// Node of the square with the lowest steps along both axes.
    pub(super) node: Node,
    polarity: Polarity,
    /// White cells in the grid's axes, and in axes turned by each of [`TURNS`].
    codes: [u64; 4],
    /// True if the grid has at least three of the square's corners.
    pub(super) is_sure: bool,
}

/// Placement with evidence from the readings.
#[derive(Clone, Copy, Debug)]
pub(super) struct Candidate {
    pub(super) polarity: Polarity,
    turn: usize,
    pub(super) placement: Placement,
    layout: Layout,
    votes: usize,
    /// Bits for the board in the given place, compared with any cells.
    bits: f64,
    /// Bits by which a board with such markers in other places explains more.
    elsewhere: f64,
}

impl Candidate {
    /// True if the reading is the board's marker rather than any cells.
    pub(super) fn agrees(&self, reading: &Reading, board: &Board, markers: Markers) -> bool {
        self.bits_of(reading, board, markers) > 0.0
    }

    /// Bits for the board's marker at a reading.
    fn bits_of(&self, reading: &Reading, board: &Board, markers: Markers) -> f64 {
        let cells = markers.dictionary.side_cells().pow(2);
        let wrong = self.wrong_cells(reading, board, markers);
        wrong.map_or(-libm::log2(ONE_IS_OTHER.into()), |wrong| bits_of(cells, wrong))
    }

    /// Number of cells that differ between a reading and the expected marker; `None` if none is
    /// expected.
    fn wrong_cells(&self, reading: &Reading, board: &Board, markers: Markers) -> Option<usize> {
        let square = self.square_of(reading)?;
        let code = markers.code_at(self.layout, square, board.squares())?;
        Some((reading.codes[self.turn] ^ code).count_ones() as usize)
    }

    /// Square of a reading, in columns and rows of squares; `None` before the board's first.
    fn square_of(&self, reading: &Reading) -> Option<[usize; 2]> {
        let [column, row] = square_at(&self.placement, reading.node);
        Some([usize::try_from(column).ok()?, usize::try_from(row).ok()?])
    }

    /// True if the square towards higher steps along both axes is light in the picture.
    pub(super) fn is_light(&self, node: Node, board: &Board) -> bool {
        let has_marker = self.layout.is_light(square_at(&self.placement, node), board.squares()[1]);
        has_marker == (self.polarity == Polarity::Positive)
    }

    /// Number of the grid's corners beyond the board's ends.
    fn outside(&self, lattice: &Lattice, board: &Board) -> usize {
        let size = [board.columns() as i32, board.rows() as i32];
        let is_outside = |node: &&Node| {
            let place = self.placement.place(**node);
            (0..2).any(|k| !(0..size[k]).contains(&place[k]))
        };
        lattice.nodes().iter().filter(is_outside).count()
    }
}

/// Result of weighing the placements.
pub(super) enum Verdict {
    Clear(Candidate),
    /// Best of several equally good placements: with an even number of rows, both layouts have the
    /// same markers except for the first and last columns.
    Ambiguous(Candidate),
    /// Some markers are in the board's places, but others aren't.
    OtherSquares,
    Unexplained,
}

/// Reads the squares inside and around the grid, and keeps the majority's polarity.
pub(super) fn read_markers(image: &GrayImage, lattice: &Lattice, markers: Markers) -> Vec<Reading> {
    let Some((low, high)) = lattice.extent() else { return Vec::new() };
    let side = markers.dictionary.side_cells();
    let mut readings = Vec::new();
    for i in low.0 - 1..=high.0 {
        for j in low.1 - 1..=high.1 {
            let nodes = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)];
            let known = nodes.iter().filter(|node| lattice.contains(**node)).count();
            let has_marker = lattice.steps.is_longer(0, i) && lattice.steps.is_longer(1, j);
            if known < 2 || !has_marker {
                continue;
            }
            let corner = |node: Node| lattice.get(node).or_else(|| Some(lattice.predict(node)?.0));
            let [Some(p), Some(q), Some(r), Some(s)] = nodes.map(corner) else { continue };
            if let Some((polarity, code)) = read_cells(image, [p, q, r, s], markers) {
                let codes = TURNS.map(|turn| turned(code, side, turn));
                readings.push(Reading { node: (i, j), polarity, codes, is_sure: known >= 3 });
            }
        }
    }
    let is_negative = |reading: &Reading| reading.polarity == Polarity::Negative;
    let negatives = readings.iter().filter(|reading| is_negative(reading)).count();
    let most_are_negative = 2 * negatives > readings.len();
    readings.retain(|reading| is_negative(reading) == most_are_negative);
    readings
}

/// True if most of the sure readings are markers of the dictionary, seen in a mirror.
pub(super) fn are_mirrored(readings: &[Reading], markers: Markers) -> bool {
    let sure = || readings.iter().filter(|reading| reading.is_sure);
    let side = markers.dictionary.side_cells();
    let is_mirrored =
        |reading: &&Reading| reading.codes.iter().any(|code| markers.knows(mirrored(*code, side)));
    2 * sure().filter(is_mirrored).count() > sure().count()
}

/// Cells of a marker with left and right exchanged.
fn mirrored(code: u64, side: usize) -> u64 {
    let row = |row: usize| (code >> (row * side)) & ((1 << side) - 1);
    let exchanged = |cells: u64| (0..side).fold(0, |sum, cell| sum << 1 | (cells >> cell & 1));
    (0..side).map(|at| exchanged(row(at)) << (at * side)).sum()
}

/// Cells of a marker along axes turned from the grid's axes by `turn`.
fn turned(code: u64, side: usize, turn: [[i32; 2]; 2]) -> u64 {
    let (count, last) = (side * side, side as i32 - 1);
    let mut result = 0;
    for place in 0..count {
        if code >> (count - 1 - place) & 1 == 0 {
            continue;
        }
        // Offset from the middle, in half cells.
        let from = [2 * (place % side) as i32 - last, 2 * (place / side) as i32 - last];
        let [column, row] = turn.map(|[a, b]| ((a * from[0] + b * from[1] + last) / 2) as usize);
        result |= 1 << (count - 1 - (row * side + column));
    }
    result
}

/// Square of the board, in columns and rows of squares, at a square of the grid.
fn square_at(placement: &Placement, (i, j): Node) -> [i32; 2] {
    let ends = [placement.place((i, j)), placement.place((i + 1, j + 1))];
    // Inner corner (0, 0) is the far corner of square (0, 0).
    std::array::from_fn(|k| ends[0][k].min(ends[1][k]) + 1)
}

/// Placement that explains the readings and the evidence behind the grid's `ends`, if any, and has
/// the grid's corners on the board.
pub(super) fn place(
    readings: &[Reading],
    lattice: &Lattice,
    board: &Board,
    markers: Markers,
    ends: [Behind; 4],
) -> Verdict {
    let (mut candidates, searched) = weighed(readings, lattice, board, markers);
    let extent = lattice.extent().unwrap_or_default();
    for it in &mut candidates {
        it.bits += f64::from(of_ends(&it.placement, extent, board, ends));
    }
    candidates.sort_by(|one, other| other.bits.total_cmp(&one.bits));
    let lead = f64::from(LEAD);
    let (chance, needed) = (libm::log2(searched.max(1) as f64), BY_CHANCE_BITS + lead);
    let Some(best) = candidates.first() else { return Verdict::Unexplained };
    let with_others = candidates.iter().map(|it| it.bits + it.elsewhere).fold(0.0, f64::max);
    if with_others - best.bits.max(0.0) >= needed {
        return Verdict::OtherSquares;
    }
    if best.bits - chance < needed {
        return Verdict::Unexplained;
    }
    let is_near = candidates.get(1).is_some_and(|second| best.bits - second.bits < lead);
    if is_near { Verdict::Ambiguous(*best) } else { Verdict::Clear(*best) }
}

/// Placements with most votes, best first, and the number of placements with votes.
fn weighed(
    readings: &[Reading],
    lattice: &Lattice,
    board: &Board,
    markers: Markers,
) -> (Vec<Candidate>, usize) {
    let mut candidates = vote(readings, board, markers);
    candidates.sort_by_key(|candidate| std::cmp::Reverse(candidate.votes));
    let searched = candidates.len();
    candidates.truncate(MOST_PLACEMENTS);
    let cells = markers.dictionary.side_cells().pow(2);
    let known_bits = bits_of(cells, 0) - libm::log2(markers.dictionary.count() as f64);
    for candidate in &mut candidates {
        for reading in readings {
            let bits = candidate.bits_of(reading, board, markers);
            // At a guessed square, the reading may lie beside it, but no marker of the
            // dictionary's.
            candidate.bits += if reading.is_sure { bits } else { bits.max(0.0) };
            if markers.knows(reading.codes[candidate.turn]) {
                candidate.elsewhere += (known_bits - bits).max(0.0);
            }
        }
        candidate.bits -= f64::from(CORNER_BITS) * candidate.outside(lattice, board) as f64;
    }
    candidates.sort_by(|one, other| other.bits.total_cmp(&one.bits));
    (candidates, searched)
}

/// Evidence weighed by [`place`], for explanations.
pub(super) fn votes(
    readings: &[Reading],
    lattice: &Lattice,
    board: &Board,
    markers: Markers,
) -> WeighedMarkers {
    let (candidates, _) = weighed(readings, lattice, board, markers);
    let (low, high) = lattice.extent().unwrap_or_default();
    let place = |it: &Candidate| {
        let ends = [it.placement.place(low), it.placement.place(high)];
        let agrees = |reading: &&Reading| it.agrees(reading, board, markers);
        let disagrees = |reading: &&Reading| reading.is_sure && !agrees(reading);
        VotedPlace {
            first: std::array::from_fn(|k| ends[0][k].min(ends[1][k])),
            quarter_turns: it.placement.quarter_turns(),
            bits: it.bits,
            agreeing: readings.iter().filter(agrees).count(),
            conflicts: readings.iter().filter(disagrees).count(),
            outside: it.outside(lattice, board),
        }
    };
    WeighedMarkers {
        read: readings.len(),
        places: candidates.iter().take(PLACES).map(place).collect(),
    }
}

/// Placements with a vote of a reading.
fn vote(readings: &[Reading], board: &Board, markers: Markers) -> Vec<Candidate> {
    let [columns, rows] = board.squares();
    let cells = markers.dictionary.side_cells().pow(2);
    let speaks = |wrong: &usize| bits_of(cells, *wrong) >= f64::from(LEAD);
    let too_many = (0..cells).take_while(speaks).count();
    let mut candidates: Vec<Candidate> = Vec::new();
    let squares = || (0..rows).flat_map(move |row| (0..columns).map(move |column| [column, row]));
    for layout in markers.layouts {
        for square in squares() {
            let Some(code) = markers.code_at(*layout, square, [columns, rows]) else { continue };
            for reading in readings {
                for (turn, seen) in reading.codes.iter().enumerate() {
                    if (seen ^ code).count_ones() as usize >= too_many {
                        continue;
                    }
                    let unshifted = Placement { turn: TURNS[turn], shift: [0, 0] };
                    let from = square_at(&unshifted, reading.node);
                    let shift = std::array::from_fn(|k| square[k] as i32 - from[k]);
                    let placement = Placement { turn: TURNS[turn], shift };
                    let same = candidates
                        .iter_mut()
                        .find(|it| it.placement == placement && it.layout == *layout);
                    match same {
                        Some(candidate) => candidate.votes += 1,
                        None => candidates.push(Candidate {
                            polarity: reading.polarity,
                            turn,
                            placement,
                            layout: *layout,
                            votes: 1,
                            bits: 0.0,
                            elsewhere: 0.0,
                        }),
                    }
                }
            }
        }
    }
    candidates
}

/// Bits for a marker with `wrong` misread cells, compared with any cells.
fn bits_of(cells: usize, wrong: usize) -> f64 {
    let (right, wrong) = ((cells - wrong) as f64, wrong as f64);
    let as_read =
        right * libm::log2(1.0 - 1.0 / ONE_IS_MISREAD) - wrong * libm::log2(ONE_IS_MISREAD);
    let other = 1.0 / f64::from(ONE_IS_OTHER);
    libm::log2((1.0 - other) * libm::exp2(cells as f64 + as_read) + other)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_marker_turned_four_times_is_itself() {
        let code = 0b1011_0101_0011_0010;
        let quarter = |code| turned(code, 4, TURNS[1]);
        assert_ne!(quarter(code), code);
        assert_eq!(quarter(quarter(quarter(quarter(code)))), code);
        assert_eq!(quarter(quarter(code)), turned(code, 4, TURNS[2]));
    }

    #[test]
    fn a_marker_mirrored_twice_is_itself() {
        assert_eq!(mirrored(0b1011_0101_0011_0010, 4), 0b1101_1010_1100_0100);
        let code = 0b110_101_000_001_111_010;
        assert_eq!(mirrored(mirrored(code, 6), 6), code);
    }

    #[test]
    fn a_marker_is_weighed_against_any_cells() {
        assert!((15.0..16.0).contains(&bits_of(16, 0)));
        assert!(bits_of(16, 1) > 8.0 && bits_of(16, 3) > 0.0);
        assert!((-4.1..-3.9).contains(&bits_of(16, 16)));
    }
}
