//! Which placement of a grid on a board the markers in its light squares speak for.
//!
//! Every marker that is read votes for the turns and shifts of the grid that put a similar marker there. A placement is
//! used if the cells that agree with it could hardly agree by chance, and no other comes near. So a few squares anywhere on
//! the board are enough, turned in any way, and a wrong cell here and there does no harm.

use image::GrayImage;

use super::{
    explain::{PLACES, ReadMarker, VotedPlace, WeighedMarkers},
    lattice::{Lattice, Node},
    marker_cells::{Polarity, read_cells},
    placement::{Placement, TURNS},
};
use boresight_geometry::{
    board::Checkerboard,
    markers::{Layout, Markers},
};

/// One in this many cells of a marker may be read wrongly.
const WRONG_SHARE: usize = 7;
/// With up to one wrong cell in this many, a reading is ambiguous and ignored.
const BLURRED_SHARE: usize = 4;
/// Bits by which the cells must agree beyond chance: once in four million, and more than with any other placement.
const LEAST_BITS: f64 = 22.0;
const BITS_AHEAD: f64 = 12.0;
/// Placements with most votes that are looked at.
const MOST_PLACEMENTS: usize = 8;
/// A placement is out if it puts this many corners more than another beyond the board's ends: a whole row or column, as a
/// rule.
const MORE_OUTSIDE: usize = 4;
/// Least number of markers that agree for each one that doesn't.
const AGREEING_PER_CONFLICT: usize = 2;
/// It's another board, one with another number of columns or rows as a rule, if this many markers of the dictionary are
/// where it has others or none.
const LEAST_OTHERS: usize = 2;

/// A marker that was read in a square of the grid.
pub(super) struct Reading {
    /// The square's node with the lowest steps along both axes.
    pub(super) node: Node,
    polarity: Polarity,
    /// White cells in the grid's axes, and in those turned by each of [`TURNS`].
    codes: [u64; 4],
    /// Whether the grid has at least three of the square's corners.
    pub(super) is_sure: bool,
}

/// A placement, and how well it explains what was read.
#[derive(Clone, Copy, Debug)]
pub(super) struct Candidate {
    pub(super) polarity: Polarity,
    turn: usize,
    pub(super) placement: Placement,
    layout: Layout,
    votes: usize,
    /// Bits of agreement beyond chance.
    bits: f64,
    agreeing: usize,
    conflicts: usize,
    /// Other markers of the dictionary than the board has there, cell by cell.
    others: usize,
    /// Corners of the grid that would lie beyond the board's ends.
    outside: usize,
}

impl Candidate {
    /// Whether the board has the marker that was read where it was read.
    pub(super) fn agrees(&self, reading: &Reading, board: &Checkerboard, markers: Markers) -> bool {
        let cells = markers.dictionary.side_cells().pow(2);
        wrong_cells(self, reading, board, markers).is_some_and(|wrong| wrong <= cells / WRONG_SHARE)
    }

    /// The square in which a marker was read, in columns and rows of squares; `None` before the board's first.
    fn square_of(&self, reading: &Reading) -> Option<[usize; 2]> {
        let [column, row] = square_at(&self.placement, reading.node);
        Some([usize::try_from(column).ok()?, usize::try_from(row).ok()?])
    }

    /// Whether the square towards higher steps along both axes is light in the picture.
    pub(super) fn is_light(&self, node: Node, board: &Checkerboard) -> bool {
        let has_marker = self.layout.is_light(square_at(&self.placement, node), board.squares()[1]);
        has_marker == (self.polarity == Polarity::Positive)
    }
}

/// Whether one placement explains what was read.
pub(super) enum Verdict {
    Clear(Candidate),
    /// Several explain it as well: with an even number of rows, both layouts have the same markers but for the first and
    /// last columns.
    Ambiguous,
    /// Some markers are where the board has them, but others aren't.
    OtherSquares,
    Unexplained,
}

/// Reads the squares inside the grid and those around it: those of the polarity that most of them have.
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

/// The cells of a marker seen along axes that `turn` maps the grid's axes to.
fn turned(code: u64, side: usize, turn: [[i32; 2]; 2]) -> u64 {
    let (count, last) = (side * side, side as i32 - 1);
    let mut result = 0;
    for place in 0..count {
        if code >> (count - 1 - place) & 1 == 0 {
            continue;
        }
        // From the middle, in half cells.
        let from = [2 * (place % side) as i32 - last, 2 * (place / side) as i32 - last];
        let [column, row] = turn.map(|[a, b]| ((a * from[0] + b * from[1] + last) / 2) as usize);
        result |= 1 << (count - 1 - (row * side + column));
    }
    result
}

/// The square of the board, in columns and rows of squares, at a square of the grid.
fn square_at(placement: &Placement, (i, j): Node) -> [i32; 2] {
    let ends = [placement.place((i, j)), placement.place((i + 1, j + 1))];
    // Inner corner (0, 0) is the far corner of square (0, 0).
    std::array::from_fn(|k| ends[0][k].min(ends[1][k]) + 1)
}

/// The placement that explains the readings and has the grid's corners on the board.
pub(super) fn place(
    readings: &[Reading],
    lattice: &Lattice,
    board: &Checkerboard,
    markers: Markers,
) -> Verdict {
    let (mut candidates, searched) = judged(readings, lattice, board, markers);
    let most_bits = candidates.iter().map(|it| it.bits).fold(0.0, f64::max);
    candidates.retain(|it| most_bits - it.bits < BITS_AHEAD);
    let is_certain = |it: &Candidate| it.bits - libm::log2(searched.max(1) as f64) >= LEAST_BITS;
    let has_others = |it: &Candidate| it.others >= LEAST_OTHERS;
    let is_other = candidates.iter().any(|it| is_certain(it) && has_others(it));
    candidates.retain(|it| !has_others(it));
    let explains =
        |it: &&Candidate| is_certain(it) && it.agreeing >= AGREEING_PER_CONFLICT * it.conflicts;
    candidates.sort_by_key(|candidate| candidate.outside);
    let Some(first) = candidates.iter().find(explains) else {
        return if is_other { Verdict::OtherSquares } else { Verdict::Unexplained };
    };
    let near = candidates.iter().filter(|it| it.outside < first.outside + MORE_OUTSIDE).count();
    if near == 1 { Verdict::Clear(*first) } else { Verdict::Ambiguous }
}

/// The placements with most votes, and how many have some.
fn judged(
    readings: &[Reading],
    lattice: &Lattice,
    board: &Checkerboard,
    markers: Markers,
) -> (Vec<Candidate>, usize) {
    let mut candidates = vote(readings, board, markers);
    candidates.sort_by_key(|candidate| std::cmp::Reverse(candidate.votes));
    let searched = candidates.len();
    candidates.truncate(MOST_PLACEMENTS);
    for candidate in &mut candidates {
        judge(candidate, readings, board, markers);
        candidate.outside = outside(candidate, lattice, board);
    }
    (candidates, searched)
}

/// What [`place`] weighs, for whoever asks why.
pub(super) fn votes(
    readings: &[Reading],
    lattice: &Lattice,
    board: &Checkerboard,
    markers: Markers,
) -> WeighedMarkers {
    let (mut candidates, _) = judged(readings, lattice, board, markers);
    candidates.sort_by(|one, other| other.bits.total_cmp(&one.bits));
    let cells = markers.dictionary.side_cells().pow(2);
    let best = candidates.first();
    let read = |reading: &Reading| {
        let code = reading.codes[best.map_or(0, |it| it.turn)];
        let wrong = best.and_then(|it| wrong_cells(it, reading, board, markers));
        let fits = wrong.filter(|wrong| *wrong <= cells / WRONG_SHARE);
        ReadMarker {
            square: best.map(|it| square_at(&it.placement, reading.node)),
            marker: best
                .and_then(|it| it.layout.marker_at(it.square_of(reading)?, board.squares())),
            is_white: (0..cells).rev().map(|cell| code >> cell & 1 == 1).collect(),
            wrong: wrong.unwrap_or_default(),
            bits: fits.map(|wrong| bits_beyond_chance(cells, wrong)),
        }
    };
    let (low, high) = lattice.extent().unwrap_or_default();
    let place = |it: &Candidate| {
        let ends = [it.placement.place(low), it.placement.place(high)];
        VotedPlace {
            first: std::array::from_fn(|k| ends[0][k].min(ends[1][k])),
            quarter_turns: it.placement.quarter_turns(),
            bits: it.bits,
            agreeing: it.agreeing,
            conflicts: it.conflicts,
            outside: it.outside,
        }
    };
    WeighedMarkers {
        read: readings.iter().map(read).collect(),
        places: candidates.iter().take(PLACES).map(place).collect(),
    }
}

/// How many corners of the grid a placement puts beyond the board's ends.
fn outside(candidate: &Candidate, lattice: &Lattice, board: &Checkerboard) -> usize {
    let size = [board.columns() as i32, board.rows() as i32];
    let is_outside = |node: &&Node| {
        let place = candidate.placement.place(**node);
        (0..2).any(|k| !(0..size[k]).contains(&place[k]))
    };
    lattice.nodes().iter().filter(is_outside).count()
}

/// Every placement for which a reading speaks.
fn vote(readings: &[Reading], board: &Checkerboard, markers: Markers) -> Vec<Candidate> {
    let [columns, rows] = board.squares();
    let layouts = markers.layouts(rows);
    let cells = markers.dictionary.side_cells().pow(2);
    let mut candidates: Vec<Candidate> = Vec::new();
    let squares = || (0..rows).flat_map(move |row| (0..columns).map(move |column| [column, row]));
    for layout in layouts {
        for square in squares() {
            let Some(code) = markers.code_at(*layout, square, [columns, rows]) else { continue };
            for reading in readings {
                for (turn, seen) in reading.codes.iter().enumerate() {
                    if (seen ^ code).count_ones() as usize > cells / WRONG_SHARE {
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
                            agreeing: 0,
                            conflicts: 0,
                            others: 0,
                            outside: 0,
                        }),
                    }
                }
            }
        }
    }
    candidates
}

fn judge(candidate: &mut Candidate, readings: &[Reading], board: &Checkerboard, markers: Markers) {
    let cells = markers.dictionary.side_cells().pow(2);
    for reading in readings {
        match wrong_cells(candidate, reading, board, markers) {
            Some(wrong) if wrong <= cells / WRONG_SHARE => {
                candidate.agreeing += 1;
                candidate.bits += bits_beyond_chance(cells, wrong);
            }
            Some(wrong) if wrong <= cells / BLURRED_SHARE => {}
            _ => {
                candidate.conflicts += usize::from(reading.is_sure);
                candidate.others += usize::from(markers.knows(reading.codes[candidate.turn]));
            }
        }
    }
}

/// Cells in which a reading differs from the marker that should be there; `None` if there should be none.
fn wrong_cells(
    candidate: &Candidate,
    reading: &Reading,
    board: &Checkerboard,
    markers: Markers,
) -> Option<usize> {
    let square = candidate.square_of(reading)?;
    let code = markers.code_at(candidate.layout, square, board.squares())?;
    Some((reading.codes[candidate.turn] ^ code).count_ones() as usize)
}

/// `−log₂` of the probability that at most `wrong` of `cells` differ by chance.
fn bits_beyond_chance(cells: usize, wrong: usize) -> f64 {
    let (mut ways, mut sum) = (1.0, 1.0);
    for k in 1..=wrong {
        ways *= (cells + 1 - k) as f64 / k as f64;
        sum += ways;
    }
    cells as f64 - libm::log2(sum)
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
    fn chance_is_counted_in_bits() {
        assert_eq!(bits_beyond_chance(16, 0), 16.0);
        assert!((bits_beyond_chance(16, 1) - (16.0 - 17_f64.log2())).abs() < 1e-12);
        assert!(bits_beyond_chance(16, 16).abs() < 1e-12);
    }
}
