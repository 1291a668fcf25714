//! Matches a grid to the known board, fills gaps confirmed by the picture, and numbers the corners.

use image::GrayImage;

use super::{
    colours::{ColourStep, FAR_SQUARES, alternating, colour_step, colours},
    complete::{Squares, complete, interpolate_last, prune},
    lattice::{BESIDE, Lattice, Node, is_at_end},
    missing::{CORNER_BITS, LEAD, PLAIN, SIDES, Why, behind, log2_likelihood, why_missing},
    outcome::{Miss, OtherBoard, Side},
    placement::{LEAST_CORNERS, LEAST_IN_LINE, drop_ends, drop_thin_ends, place_part, place_whole},
    track::Expected,
};
use boresight_geometry::boards::Board;

/// Least number of corners on the shorter side of a named board.
const LEAST_SIDE: usize = 3;
/// Reciprocal of the least share of the board's corners in a grid worth completing.
const LEAST_SHARE: usize = 4;
/// Largest number of corners searched beyond the named board along a side, to name the larger
/// board.
const MOST_BEYOND: usize = 4;
/// Reciprocal of the largest share of corners interpolated and confirmed by the edge fit.
const INTERPOLATED_SHARE: usize = 18;

/// Completes `lattice` to the board and writes the corners to `into`, row by row; `None` for unseen
/// corners.
///
/// # Errors
///
/// [`Miss::OtherBoard`] if the grid is larger than the board, a whole smaller one with white on all
/// sides, or the size of a board named by its squares; [`Miss::PartialBoard`] if corners are
/// missing, [`Miss::Glare`] if they are missing where the picture is saturated, [`Miss::NoBoard`]
/// if the colours don't match.
pub(super) fn match_board(
    image: &GrayImage,
    lattice: &mut Lattice,
    board: &Board,
    expected: &Expected,
    into: &mut Vec<Option<[f32; 2]>>,
) -> Result<(), Miss> {
    let wanted = board.corner_count();
    prune(lattice);
    if lattice.len() * LEAST_SHARE < wanted {
        let whole = whole_board(image, lattice).map(Miss::OtherBoard);
        return Err(whole.unwrap_or_else(|| partial(lattice, wanted, None)));
    }
    let [columns, rows] = [board.columns(), board.rows()];
    fill(image, lattice, columns.max(rows));
    prune(lattice);
    // A longer row beyond the board belongs to a larger board.
    let is_larger = |lattice: &Lattice| {
        let [width, height] = lattice.size();
        (width > columns || height > rows) && (width > rows || height > columns)
    };
    drop_ends(lattice, |lattice, _, count| is_larger(lattice) && count < LEAST_IN_LINE);
    let Some(ends) = lattice.extent() else {
        return Err(Miss::NoBoard);
    };
    let size = lattice.size();
    let fits = size == [columns, rows] || size == [rows, columns];
    if fits {
        interpolate_last(image, lattice, ends, wanted / INTERPOLATED_SHARE);
    }
    let whole = lattice.is_full();
    if fits && whole {
        is_no_part(image, lattice)?;
        // Few corners may be chance.
        if wanted < LEAST_CORNERS && whole_board(image, lattice).is_none() {
            return Err(Miss::NoBoard);
        }
    }
    if !(fits && whole) {
        if !fits && let Some(other) = whole_board(image, lattice) {
            // Behind what's as light as white, rows may go on.
            if is_no_part(image, lattice).is_ok() {
                return Err(Miss::OtherBoard(other));
            }
            prune(lattice);
        }
        // A few corners in line that don't show squares are in something else.
        let drop_strange = |lattice: &mut Lattice, needed: &dyn Fn(&Lattice) -> bool| {
            drop_ends(lattice, |lattice, out, count| {
                let ends = lattice.extent().unwrap_or(ends);
                needed(lattice)
                    && count < lattice.size()[usize::from(out.0 != 0)]
                    && corner_bits(image, lattice, |node| is_at_end(ends, out, node)) < LEAD
            });
        };
        if is_larger(lattice) {
            drop_strange(lattice, &is_larger);
            return Err(match lattice.size() == size {
                true => larger(image, lattice),
                false => partial(lattice, wanted, None),
            });
        }
        let wanted_size = Some([columns, rows].map(|side| side as i32));
        let why = why_missing(image, lattice, wanted_size, 0.0);
        // One row and one column fewer, none hidden: the board was named by its squares.
        let is_smaller = [[columns - 1, rows - 1], [rows - 1, columns - 1]].contains(&size);
        let is_miscounted = is_smaller && expected.corners.is_empty() && why == Why::Covered;
        let is_miscounted = is_miscounted && is_all_seen(image, lattice);
        if place_part(image, lattice, board, expected, into) {
            return Ok(());
        }
        drop_strange(lattice, &|_| true);
        return Err(match why {
            _ if is_miscounted => Miss::OtherBoard(plain(size)),
            Why::Glare => Miss::Glare { found: lattice.len(), wanted },
            _ => partial(lattice, wanted, why.cut_off_by()),
        });
    }
    place_whole(image, lattice, board, expected, into).then_some(()).ok_or(Miss::NoBoard)
}

/// Searches for more squares around a whole board: behind its ends, and as corners beyond it, which
/// are evidence where the picture is too small or noisy to tell squares from white. Removes chance
/// corners from `lattice` again.
///
/// # Errors
///
/// [`Miss::OtherBoard`] if the board is a part of a larger pattern.
pub(super) fn is_no_part(image: &GrayImage, lattice: &mut Lattice) -> Result<(), Miss> {
    let Some((low, high)) = lattice.extent() else { return Ok(()) };
    let more = SIDES.map(|out| usize::from(behind(image, lattice, out, PLAIN).goes_on()));
    let [width, height] = lattice.size();
    let seen = [width + more[0] + more[1], height + more[2] + more[3]];
    fill(image, lattice, seen[0].max(seen[1]) + MOST_BEYOND);
    let is_beyond =
        |(i, j): Node| !((low.0..=high.0).contains(&i) && (low.1..=high.1).contains(&j));
    if more == [0; 4] && corner_bits(image, lattice, is_beyond) < LEAD {
        lattice.retain(|_, node| !is_beyond(node));
        return Ok(());
    }
    let [width, height] = lattice.size();
    let seen = at_least([seen[0].max(width), seen[1].max(height)]);
    Err(Miss::OtherBoard(whole_board(image, lattice).unwrap_or(seen)))
}

/// Bits for more squares by the corners that may be `beyond` a board.
fn corner_bits(image: &GrayImage, lattice: &Lattice, is_beyond: impl Fn(Node) -> bool) -> f32 {
    let beyond = || lattice.nodes().iter().filter(|node| is_beyond(**node));
    if beyond().next().is_none() {
        return 0.0;
    }
    let spread = unevenness(image, lattice, &is_beyond);
    beyond().map(|node| CORNER_BITS + colour_bits(image, lattice, *node, spread)).sum()
}

/// Root mean square difference between like squares around a corner of a board, as a share of the
/// step from dark to light squares. Corners beyond the board don't count.
fn unevenness(image: &GrayImage, lattice: &Lattice, is_beyond: impl Fn(Node) -> bool) -> f32 {
    let inside = lattice.nodes().iter().filter(|node| !is_beyond(**node));
    let steps = inside.filter_map(|node| colour_step(image, lattice, *node));
    let (count, sum) = steps.fold((0.0, 0.0), |(count, sum), step| {
        (count + 1.0, sum + (0.5 * step.uneven / step.value.abs().max(1.0)).powi(2))
    });
    (sum / f32::max(count, 1.0)).sqrt()
}

/// Bits for the colours of the squares around a corner, relative to the neighbours' squares.
fn colour_bits(image: &GrayImage, lattice: &Lattice, (i, j): Node, spread: f32) -> f32 {
    let step = |node: Node| colour_step(image, lattice, node);
    let beside = BESIDE.iter().filter_map(|(di, dj)| step((i + di, j + dj)));
    let (count, sum) =
        beside.fold((0.0, 0.0), |(count, sum), step| (count + 1.0, sum + step.value.abs()));
    let typical = sum / f32::max(count, 1.0);
    let off = |step: ColourStep| {
        step.uneven.max(2.0 * (step.value.abs() - typical).abs()) / (2.0 * typical)
    };
    log2_likelihood(step((i, j)).map_or(f32::INFINITY, off), spread)
}

/// Part of the board, as large as the grid.
fn partial(lattice: &Lattice, wanted: usize, cut_off_by: Option<Side>) -> Miss {
    let [width, height] = lattice.size();
    let size = [width.max(height), width.min(height)];
    Miss::PartialBoard { found: lattice.len(), wanted, size, cut_off_by }
}

/// Board with more corners than the named one along an axis: of the grid's size if it's whole and
/// inside the picture, or else of that size at least.
fn larger(image: &GrayImage, lattice: &mut Lattice) -> Miss {
    fill(image, lattice, usize::MAX);
    drop_thin_ends(lattice);
    let is_whole = lattice.is_full() && !lattice.is_at_reach();
    let is_inside = || why_missing(image, lattice, None, 0.0).cut_off_by().is_none();
    let is_counted = is_whole && (whole_board(image, lattice).is_some() || is_inside());
    Miss::OtherBoard(if is_counted { plain(lattice.size()) } else { at_least(lattice.size()) })
}

fn at_least([width, height]: [usize; 2]) -> OtherBoard {
    OtherBoard::Larger { columns: width.max(height), rows: width.min(height) }
}

fn plain([width, height]: [usize; 2]) -> OtherBoard {
    OtherBoard::Plain { columns: width.max(height), rows: width.min(height) }
}

/// True for a full rectangle of corners behind whose ends no squares follow.
fn is_all_seen(image: &GrayImage, lattice: &Lattice) -> bool {
    let ends = |out: Node| behind(image, lattice, out, PLAIN).squares < 0.0;
    lattice.len() >= LEAST_CORNERS && lattice.is_full() && SIDES.into_iter().all(ends)
}

/// Whole board of any size: a full rectangle of corners with white all around.
fn whole_board(image: &GrayImage, lattice: &Lattice) -> Option<OtherBoard> {
    let size = lattice.size();
    let ends = |out: Node| behind(image, lattice, out, PLAIN).ends();
    let is_whole = size[0].min(size[1]) >= LEAST_SIDE && lattice.is_full();
    (is_whole && SIDES.into_iter().all(ends)).then(|| plain(size))
}

/// Board of any size up to `longest` a side in `lattice`.
pub(super) fn count_board(
    image: &GrayImage,
    lattice: &mut Lattice,
    longest: usize,
) -> Option<OtherBoard> {
    prune(lattice);
    fill(image, lattice, longest);
    prune(lattice);
    whole_board(image, lattice)
}

/// Completes a grid of alternating colours, up to `longest` corners a side.
fn fill(image: &GrayImage, lattice: &mut Lattice, longest: usize) {
    let Some(typical) = colours(image, lattice, FAR_SQUARES, &alternating) else { return };
    let step = |node: Node| typical * alternating(node);
    complete(image, lattice, &Squares { far: FAR_SQUARES, step: &step }, |lattice, (i, j)| {
        let (low, high) = lattice.extent().unwrap_or_default();
        let is_short = |low: i32, high: i32| ((high - low) as usize) < longest;
        is_short(low.0.min(i), high.0.max(i)) && is_short(low.1.min(j), high.1.max(j))
    });
}
