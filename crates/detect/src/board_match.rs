//! Matches a grid to the known board, fills gaps that the picture confirms, and numbers the corners.

use image::GrayImage;

use super::{
    colours::{colour_step, colours, dark_outside, inside, skips_squares},
    lattice::{BESIDE, Lattice, Node, axes, height},
    missing::{SIDES, behind, cut_off_by, glaring},
    outcome::Miss,
    placement::place_part,
    saddle::settle,
    track::Expected,
};
use boresight_geometry::board::Checkerboard;

/// An outer row with at most this many corners is clutter.
const MOST_CHANCE_CORNERS: usize = 2;
/// A grid with less than one in this many of the board's corners is not worth completing.
const LEAST_SHARE: usize = 4;
/// Least colour step of a corner that is filled in, as a fraction of its neighbours', and in grey levels.
const LEAST_OF_NEXT: f32 = 0.35;
const LEAST_STEP: f32 = 3.0;
/// Corners beyond the named board that are looked for along a side, to name the larger one.
const MOST_BEYOND: i32 = 4;
/// Corners beyond the named board that aren't there by chance: in all, and side by side in one row. Photographs of boards
/// have up to two, which may be side by side.
const LEAST_BEYOND: usize = 5;
const LEAST_BEYOND_IN_ROW: i32 = MOST_CHANCE_CORNERS as i32 + 1;
/// Two side by side are enough if the four squares around both look as those of their neighbours do: least colour step, as
/// a share of theirs (and of it, theirs), and largest difference on a diagonal, as a share of the step. What lies behind a
/// narrow margin has edges, too, but rarely the same grey levels.
const LEAST_OF_CLEAR: f32 = 0.8;
const MOST_UNEVEN: f32 = 0.5;
/// At most one in this many corners may be interpolated and confirmed by the edge fit.
const INTERPOLATED_SHARE: usize = 18;

/// Completes `lattice` to the board and writes its corners to `into`, row by row; `None` where a part of the board isn't
/// seen.
///
/// # Errors
///
/// [`Miss::OtherBoard`] if the grid is larger than the board, a whole smaller one that ends in white on all sides, or as
/// large as one whose squares were counted; [`Miss::PartialBoard`] if corners are missing,
/// [`Miss::Glare`] if they are missing where the picture is saturated, [`Miss::NoBoard`] if the colours don't match.
pub(super) fn match_board(
    image: &GrayImage,
    lattice: &mut Lattice,
    board: &Checkerboard,
    expected: &Expected,
    into: &mut Vec<Option<[f32; 2]>>,
) -> Result<(), Miss> {
    let wanted = board.corner_count();
    prune(lattice);
    if lattice.len() * LEAST_SHARE < wanted {
        let partial = Miss::PartialBoard { found: lattice.len(), wanted, cut_off_by: None };
        return Err(whole_board(image, lattice).map_or(partial, other_board));
    }
    let (columns, rows) = (board.columns() as i32, board.rows() as i32);
    complete(image, lattice, columns.max(rows));
    prune(lattice);
    trim(lattice, (columns, rows));
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
        if let Some(size) = goes_on(image, lattice, (low, high)) {
            return Err(other_board(size));
        }
        is_no_part(image, lattice)?;
    }
    if !(fits && whole) {
        if !fits && let Some(size) = whole_board(image, lattice) {
            return Err(other_board(size));
        }
        let found = lattice.len().min(wanted);
        let cut_off_by = cut_off_by(image, lattice);
        let is_glaring = cut_off_by.is_none() && glaring(image, lattice);
        // Cut off, a larger board would be given a wrong number of corners.
        let larger = !fits && whole && width.min(height) >= 3 && width * height > columns * rows;
        // One row and one column fewer, and neither cut off: whoever named the board has counted its squares.
        let smaller = [(columns - 1, rows - 1), (rows - 1, columns - 1)].contains(&(width, height));
        let miscounted = smaller && whole && expected.corners.is_empty() && !is_glaring;
        if place_part(image, lattice, board, expected, into) {
            return Ok(());
        }
        if (larger || miscounted) && cut_off_by.is_none() {
            return Err(other_board((width, height)));
        }
        if is_glaring {
            return Err(Miss::Glare { found, wanted });
        }
        return Err(Miss::PartialBoard { found, wanted, cut_off_by });
    }
    number(image, lattice, low, (columns, rows), (width, height), into)
        .then_some(())
        .ok_or(Miss::NoBoard)
}

/// Width and height of the board of which the grid from `low` to `high` is a part, as far as it is seen: one with more
/// squares behind an end of the grid. `None` if there is none.
fn goes_on(
    image: &GrayImage,
    lattice: &mut Lattice,
    (low, high): (Node, Node),
) -> Option<(i32, i32)> {
    let more = SIDES.map(|out| i32::from(behind(image, lattice, out).goes_on()));
    if more == [0; 4] {
        return None;
    }
    let seen = (high.0 - low.0 + 1 + more[0] + more[1], high.1 - low.1 + 1 + more[2] + more[3]);
    complete(image, lattice, seen.0.max(seen.1) + MOST_BEYOND);
    prune(lattice);
    let (low, high) = lattice.extent()?;
    Some((seen.0.max(high.0 - low.0 + 1), seen.1.max(high.1 - low.1 + 1)))
}

/// Looks for signs that the corners of a whole board are some of those of a larger pattern. Takes corners beyond the board
/// that are there by chance out of `lattice` again.
///
/// # Errors
///
/// [`Miss::OtherBoard`] if there are more corners beyond; [`Miss::NoBoard`] if there are more squares between the corners.
pub(super) fn is_no_part(image: &GrayImage, lattice: &mut Lattice) -> Result<(), Miss> {
    if skips_squares(image, lattice) {
        return Err(Miss::NoBoard);
    }
    match lattice.extent().and_then(|extent| shows_more(image, lattice, extent)) {
        Some(size) => Err(other_board(size)),
        None => Ok(()),
    }
}

/// Width and height of the grid of which the rectangle from `low` to `high` is a part, if more corners are seen beyond it
/// than chance corners beside a board; as [`goes_on`] in a picture too small or too noisy to tell squares from white.
fn shows_more(
    image: &GrayImage,
    lattice: &mut Lattice,
    (low, high): (Node, Node),
) -> Option<(i32, i32)> {
    let (width, height) = (high.0 - low.0 + 1, high.1 - low.1 + 1);
    complete(image, lattice, width.max(height) + 2);
    let (columns, rows) = (low.0..=high.0, low.1..=high.1);
    let beyond = |(i, j): Node| !(columns.contains(&i) && rows.contains(&j));
    // Where the picture or something in front of it ends the pattern, little of the next row is left.
    let begins_row = |(i, j): Node| {
        let along = if columns.contains(&i) { (1, 0) } else { (0, 1) };
        (1..LEAST_BEYOND_IN_ROW).all(|k| lattice.contains((i + k * along.0, j + k * along.1)))
    };
    let more = || lattice.nodes().iter().copied().filter(|node| beyond(*node));
    let is_clear = |node: Node| beyond(node) && is_clear(image, lattice, node);
    let begins_pair = |(i, j): Node| {
        is_clear((i, j)) && [(1, 0), (0, 1)].iter().any(|(di, dj)| is_clear((i + di, j + dj)))
    };
    if more().count() >= LEAST_BEYOND || more().any(begins_row) || more().any(begins_pair) {
        let (low, high) = lattice.extent()?;
        return Some((high.0 - low.0 + 1, high.1 - low.1 + 1));
    }
    lattice.retain(|_, node| !beyond(node));
    None
}

/// Whether all four squares around a corner have the colours of those around its neighbours.
fn is_clear(image: &GrayImage, lattice: &Lattice, (i, j): Node) -> bool {
    let step = |node: Node| colour_step(image, lattice, node);
    let beside = BESIDE.iter().filter_map(|(di, dj)| step((i + di, j + dj)));
    let (count, sum) =
        beside.fold((0.0, 0.0), |(count, sum), step| (count + 1.0, sum + step.value.abs()));
    step((i, j)).is_some_and(|step| {
        let (here, typical) = (step.value.abs(), sum / f32::max(count, 1.0));
        here.min(typical) > LEAST_OF_CLEAR * here.max(typical) && step.uneven < MOST_UNEVEN * here
    })
}

fn other_board((width, height): (i32, i32)) -> Miss {
    Miss::OtherBoard { columns: width.max(height) as usize, rows: width.min(height) as usize }
}

/// Width and height of a board that is seen whole, whatever its size: a full rectangle of corners with white all around.
fn whole_board(image: &GrayImage, lattice: &Lattice) -> Option<(i32, i32)> {
    let (low, high) = lattice.extent()?;
    let (width, height) = (high.0 - low.0 + 1, high.1 - low.1 + 1);
    let whole = width.min(height) >= 3 && lattice.len() as i32 == width * height;
    let ends = |out: Node| behind(image, lattice, out).ends();
    (whole && SIDES.into_iter().all(ends)).then_some((width, height))
}

/// Columns and rows of inner corners of the board that is seen whole in `lattice`, whatever its size up to `longest` a
/// side: at least as many columns as rows.
pub(super) fn count_board(
    image: &GrayImage,
    lattice: &mut Lattice,
    longest: i32,
) -> Option<(usize, usize)> {
    prune(lattice);
    complete(image, lattice, longest);
    prune(lattice);
    let (width, height) = whole_board(image, lattice)?;
    Some((width.max(height) as usize, width.min(height) as usize))
}

/// Interpolates the last missing corners of an otherwise complete board, at most `most`. Blur and noise can hide a
/// corner from every stage before the edge fit, which must then confirm it.
fn interpolate_last(
    image: &GrayImage,
    lattice: &mut Lattice,
    (low, high): (Node, Node),
    most: usize,
) {
    let places = ((high.0 - low.0 + 1) * (high.1 - low.1 + 1)) as usize;
    if lattice.len() == places || lattice.len() + most < places {
        return;
    }
    for i in low.0..=high.0 {
        for j in low.1..=high.1 {
            if !lattice.contains((i, j))
                && let Some((guess, side)) = lattice.predict((i, j))
                && inside(image, guess, 0.2 * side)
            {
                lattice.insert((i, j), guess);
            }
        }
    }
}

/// Drops members without a neighbour along both axes.
pub(super) fn prune(lattice: &mut Lattice) {
    loop {
        let before = lattice.len();
        lattice.retain(|lattice, (i, j)| {
            let has = |di: i32, dj: i32| lattice.contains((i + di, j + dj));
            (has(1, 0) || has(-1, 0)) && (has(0, 1) || has(0, -1))
        });
        if lattice.len() == before {
            return;
        }
    }
}

/// While the grid is larger than the board, drops an outer row or column of one or two corners: chance corners beside
/// the board. A longer row belongs to a larger board.
fn trim(lattice: &mut Lattice, (columns, rows): (i32, i32)) {
    while let Some((low, high)) = lattice.extent() {
        let (width, height) = (high.0 - low.0 + 1, high.1 - low.1 + 1);
        let larger = (width > columns || height > rows) && (width > rows || height > columns);
        if !larger {
            return;
        }
        let on_side = |side: usize, node: Node| match side {
            0 => node.0 == low.0,
            1 => node.0 == high.0,
            2 => node.1 == low.1,
            _ => node.1 == high.1,
        };
        let count =
            |side: usize| lattice.nodes().iter().filter(|node| on_side(side, **node)).count();
        let Some(thinnest) = (0..4).min_by_key(|side| count(*side)) else { return };
        if count(thinnest) > MOST_CHANCE_CORNERS {
            return;
        }
        lattice.retain(|_, node| !on_side(thinnest, node));
    }
}

/// Adds nodes inside the grid and in one row around it where the picture shows the right colours, while the grid stays
/// within `longest` corners a side.
fn complete(image: &GrayImage, lattice: &mut Lattice, longest: i32) {
    let Some(typical) = colours(image, lattice) else { return };
    for _ in 0..2 * longest {
        let Some((low, high)) = lattice.extent() else { return };
        let before = lattice.len();
        for i in low.0 - 1..=high.0 + 1 {
            for j in low.1 - 1..=high.1 + 1 {
                let node = (i, j);
                let (low, high) = lattice.extent().unwrap_or((low, high));
                let too_long = high.0.max(i) - low.0.min(i) >= longest
                    || high.1.max(j) - low.1.min(j) >= longest;
                let beside = || BESIDE.iter().any(|(di, dj)| lattice.contains((i + di, j + dj)));
                if too_long || lattice.contains(node) || !beside() {
                    continue;
                }
                let Some((guess, side)) = lattice.predict(node) else { continue };
                let side = axes(lattice, node, guess).map_or(side, |axes| side.min(height(axes)));
                let centred = settle(image, guess, side);
                let moved = libm::hypotf(centred[0] - guess[0], centred[1] - guess[1]);
                if moved > 0.25 * side || !lattice.insert(node, centred) {
                    continue;
                }
                // Light is uneven: neighbours predict the step better than the whole board does.
                let beside = BESIDE.iter().filter_map(|(di, dj)| {
                    Some(colour_step(image, lattice, (i + di, j + dj))?.value.abs())
                });
                let near = beside.fold(typical.abs(), f32::min);
                let sign = if (i + j) % 2 == 0 { typical.signum() } else { -typical.signum() };
                let seen = colour_step(image, lattice, node).is_some_and(|step| {
                    step.clean && step.value * sign > (LEAST_OF_NEXT * near).max(LEAST_STEP)
                });
                if !seen {
                    lattice.take_back();
                }
            }
        }
        if lattice.len() == before {
            return;
        }
    }
}

/// Maps column and row of the board, and width and height of the grid, to a node.
type Turn = fn(i32, i32, i32, i32) -> Node;

/// Writes the corners row by row. The grid is never mirrored, so two or four rotations remain. For boards of mixed
/// parity the colours decide: the outer square at the first corner is dark. For the others the position in the
/// picture decides: the first corner is the one nearest to the top left.
fn number(
    image: &GrayImage,
    lattice: &Lattice,
    low: Node,
    (columns, rows): (i32, i32),
    (width, height): (i32, i32),
    into: &mut Vec<Option<[f32; 2]>>,
) -> bool {
    // Each rotation maps (column, row) of the board to a node.
    let turns: [(bool, Turn); 4] = [
        (true, |c, r, _, _| (c, r)),
        (true, |c, r, w, h| (w - 1 - c, h - 1 - r)),
        (false, |c, r, w, _| (w - 1 - r, c)),
        (false, |c, r, _, h| (r, h - 1 - c)),
    ];
    let place = |turn: Turn, column: i32, row: i32| {
        let (i, j) = turn(column, row, width, height);
        (i + low.0, j + low.1)
    };
    let same_parity = columns % 2 == rows % 2;
    let best = turns
        .into_iter()
        .filter(|(upright, _)| ((width, height) == (columns, rows)) == *upright || width == height)
        .filter(|(upright, turn)| {
            let first = place(*turn, 0, 0);
            same_parity || dark_outside(image, lattice, first, *upright) == Some(true)
        })
        .filter_map(|(_, turn)| {
            let [x, y] = lattice.get(place(turn, 0, 0))?;
            Some((x + y, turn))
        })
        .min_by(|a, b| a.0.total_cmp(&b.0));
    let Some((_, turn)) = best else { return false };
    into.clear();
    into.extend(
        (0..rows)
            .flat_map(|row| (0..columns).map(move |column| (column, row)))
            .map(|(column, row)| lattice.get(place(turn, column, row))),
    );
    true
}
