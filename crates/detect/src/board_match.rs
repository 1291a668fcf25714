//! Matches a grid to the known board, fills gaps confirmed by the picture, and numbers the corners.

use image::GrayImage;

use super::{
    colours::{ColourStep, FAR_SQUARES, alternating, colour_step, colours},
    complete::{Squares, complete, interpolate_last, prune},
    lattice::{BESIDE, Lattice, Node},
    missing::{CORNER_BITS, LEAD, PLAIN, SIDES, Why, behind, log2_likelihood, why_missing},
    outcome::{Miss, OtherBoard, Side},
    placement::{LEAST_CORNERS, drop_thin_ends, place_part, place_whole},
    track::Expected,
};
use boresight_geometry::boards::Board;

/// Least number of corners on the shorter side of a named board.
const LEAST_SIDE: i32 = 3;
/// Reciprocal of the least share of the board's corners in a grid worth completing.
const LEAST_SHARE: usize = 4;
/// Largest number of corners searched beyond the named board along a side, to name the larger
/// board.
const MOST_BEYOND: i32 = 4;
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
        return Err(
            whole_board(image, lattice).map_or_else(|| partial(lattice, wanted, None), other_board)
        );
    }
    let (columns, rows) = (board.columns() as i32, board.rows() as i32);
    fill(image, lattice, columns.max(rows));
    prune(lattice);
    // A longer row beyond the board belongs to a larger board.
    drop_thin_ends(lattice, |(width, height)| {
        (width > columns || height > rows) && (width > rows || height > columns)
    });
    let Some((low, high)) = lattice.extent() else {
        return Err(Miss::NoBoard);
    };
    let (width, height) = (high.0 - low.0 + 1, high.1 - low.1 + 1);
    let fits = (width, height) == (columns, rows) || (width, height) == (rows, columns);
    if fits {
        interpolate_last(image, lattice, (low, high), wanted / INTERPOLATED_SHARE);
    }
    let whole = lattice.len() as i32 == width * height;
    if fits && whole {
        is_no_part(image, lattice)?;
        // Few corners may be chance.
        if wanted < LEAST_CORNERS && whole_board(image, lattice).is_none() {
            return Err(Miss::NoBoard);
        }
    }
    if !(fits && whole) {
        if !fits && let Some(size) = whole_board(image, lattice) {
            return Err(other_board(size));
        }
        if !((width <= columns && height <= rows) || (width <= rows && height <= columns)) {
            return Err(larger(image, lattice));
        }
        let why = why_missing(image, lattice, Some([columns, rows]), 0.0);
        // One row and one column fewer, neither cut off: the board was named by its squares.
        let smaller = [(columns - 1, rows - 1), (rows - 1, columns - 1)].contains(&(width, height));
        let is_miscounted = smaller && whole && expected.corners.is_empty() && why == Why::Covered;
        if place_part(image, lattice, board, expected, into) {
            return Ok(());
        }
        return Err(match why {
            _ if is_miscounted => other_board((width, height)),
            // Light never ends along a row: it's the white around a board.
            Why::Glare if !whole => Miss::Glare { found: lattice.len(), wanted },
            Why::CutOff(side) => partial(lattice, wanted, Some(side)),
            Why::Glare | Why::Covered => partial(lattice, wanted, None),
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
    let more = SIDES.map(|out| i32::from(behind(image, lattice, out, PLAIN).goes_on()));
    let seen = (high.0 - low.0 + 1 + more[0] + more[1], high.1 - low.1 + 1 + more[2] + more[3]);
    fill(image, lattice, seen.0.max(seen.1) + MOST_BEYOND);
    let is_beyond =
        |(i, j): Node| !((low.0..=high.0).contains(&i) && (low.1..=high.1).contains(&j));
    let beyond = || lattice.nodes().iter().filter(|node| is_beyond(**node));
    let bits = || {
        let spread = unevenness(image, lattice, is_beyond);
        beyond().map(|node| CORNER_BITS + colour_bits(image, lattice, *node, spread)).sum::<f32>()
    };
    if more == [0; 4] && (beyond().next().is_none() || bits() < LEAD) {
        lattice.retain(|_, node| !is_beyond(node));
        return Ok(());
    }
    let (low, high) = lattice.extent().unwrap_or((low, high));
    let seen = (seen.0.max(high.0 - low.0 + 1), seen.1.max(high.1 - low.1 + 1));
    Err(whole_board(image, lattice).map_or_else(|| at_least(seen), other_board))
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
    let size = lattice.extent().map_or([0; 2], |(low, high)| {
        <[usize; 2]>::from(long_by_wide((high.0 - low.0 + 1, high.1 - low.1 + 1)))
    });
    Miss::PartialBoard { found: lattice.len(), wanted, size, cut_off_by }
}

/// Board with more corners than the named one along an axis: of the grid's size if it's whole and
/// inside the picture, or else of that size at least.
fn larger(image: &GrayImage, lattice: &mut Lattice) -> Miss {
    let size = |lattice: &Lattice| {
        let (low, high) = lattice.extent().unwrap_or_default();
        (high.0 - low.0 + 1, high.1 - low.1 + 1)
    };
    let (width, height) = size(lattice);
    fill(image, lattice, width.max(height) + MOST_BEYOND);
    drop_thin_ends(lattice, |_| true);
    let (width, height) = size(lattice);
    let is_whole = lattice.len() as i32 == width * height;
    let is_inside = || why_missing(image, lattice, None, 0.0).cut_off_by().is_none();
    if is_whole && (whole_board(image, lattice).is_some() || is_inside()) {
        return other_board((width, height));
    }
    at_least((width, height))
}

fn at_least(size: (i32, i32)) -> Miss {
    let (columns, rows) = long_by_wide(size);
    Miss::OtherBoard(OtherBoard::Larger { columns, rows })
}

fn other_board(size: (i32, i32)) -> Miss {
    let (columns, rows) = long_by_wide(size);
    Miss::OtherBoard(OtherBoard::Plain { columns, rows })
}

/// Columns and rows, at least as many columns as rows.
fn long_by_wide((width, height): (i32, i32)) -> (usize, usize) {
    (width.max(height) as usize, width.min(height) as usize)
}

/// Width and height of a whole board of any size: a full rectangle of corners with white all
/// around.
fn whole_board(image: &GrayImage, lattice: &Lattice) -> Option<(i32, i32)> {
    let (low, high) = lattice.extent()?;
    let (width, height) = (high.0 - low.0 + 1, high.1 - low.1 + 1);
    let whole = width.min(height) >= LEAST_SIDE && lattice.len() as i32 == width * height;
    let ends = |out: Node| behind(image, lattice, out, PLAIN).ends();
    (whole && SIDES.into_iter().all(ends)).then_some((width, height))
}

/// Columns and rows of inner corners of the whole board in `lattice`, of any size up to `longest` a
/// side: at least as many columns as rows.
pub(super) fn count_board(
    image: &GrayImage,
    lattice: &mut Lattice,
    longest: i32,
) -> Option<(usize, usize)> {
    prune(lattice);
    fill(image, lattice, longest);
    prune(lattice);
    whole_board(image, lattice).map(long_by_wide)
}

/// Completes a grid of alternating colours, up to `longest` corners a side.
fn fill(image: &GrayImage, lattice: &mut Lattice, longest: i32) {
    let Some(typical) = colours(image, lattice, FAR_SQUARES, &alternating) else { return };
    let step = |node: Node| typical * alternating(node);
    complete(image, lattice, &Squares { far: FAR_SQUARES, step: &step }, |lattice, (i, j)| {
        let (low, high) = lattice.extent().unwrap_or_default();
        high.0.max(i) - low.0.min(i) < longest && high.1.max(j) - low.1.min(j) < longest
    });
}
