//! Matches a grid to the known board, fills gaps that the picture confirms, and numbers the corners.

use image::GrayImage;

use super::{
    lattice::{BESIDE, Lattice, Node, axes, height},
    missing::{cut_off_by, ends_in_white, glaring},
    outcome::Miss,
    reduce::sample,
    saddle::settle,
};
use crate::board::Checkerboard;

/// Most corners in an outer row that count as chance corners beside the board.
const MOST_CHANCE_CORNERS: usize = 2;
/// A grid with less than one in this many of the board's corners is not worth completing.
const LEAST_SHARE: usize = 4;
/// Least colour step of a corner that is filled in, as a fraction of its neighbours', and in grey levels.
const LEAST_OF_NEXT: f32 = 0.35;
const LEAST_STEP: f32 = 3.0;
/// At most one in this many corners may be interpolated and confirmed by the edge fit.
const INTERPOLATED_SHARE: usize = 18;

/// Completes `lattice` to the board and writes its corners to `into`, row by row.
///
/// # Errors
///
/// [`Miss::OtherBoard`] if the grid is larger than the board, or a whole smaller one that ends in white on all sides,
/// [`Miss::PartialBoard`] if corners are missing,
/// [`Miss::Glare`] if they are missing where the picture is saturated, [`Miss::NoBoard`] if the colours don't match.
pub(super) fn match_board(
    image: &GrayImage,
    lattice: &mut Lattice,
    board: &Checkerboard,
    into: &mut Vec<[f32; 2]>,
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
    if !(fits && whole) {
        if !fits && let Some(size) = whole_board(image, lattice) {
            return Err(other_board(size));
        }
        let found = lattice.len().min(wanted);
        let cut_off_by = cut_off_by(image, lattice);
        // Cut off, a larger board would be given a wrong number of corners.
        let larger = !fits && whole && width.min(height) >= 3 && width * height > columns * rows;
        if larger && cut_off_by.is_none() {
            return Err(other_board((width, height)));
        }
        if cut_off_by.is_none() && glaring(image, lattice) {
            return Err(Miss::Glare { found, wanted });
        }
        return Err(Miss::PartialBoard { found, wanted, cut_off_by });
    }
    number(image, lattice, low, (columns, rows), (width, height), into)
        .then_some(())
        .ok_or(Miss::NoBoard)
}

fn other_board((width, height): (i32, i32)) -> Miss {
    Miss::OtherBoard { columns: width.max(height) as usize, rows: width.min(height) as usize }
}

/// Width and height of a board that is seen whole, whatever its size: a full rectangle of corners with white all around.
fn whole_board(image: &GrayImage, lattice: &Lattice) -> Option<(i32, i32)> {
    let (low, high) = lattice.extent()?;
    let (width, height) = (high.0 - low.0 + 1, high.1 - low.1 + 1);
    let whole = width.min(height) >= 3 && lattice.len() as i32 == width * height;
    (whole && ends_in_white(image, lattice)).then_some((width, height))
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

fn inside(image: &GrayImage, [x, y]: [f32; 2], margin_px: f32) -> bool {
    let (right, bottom) = (image.width() as f32 - 1.0, image.height() as f32 - 1.0);
    x.min(right - x).min(y).min(bottom - y) >= margin_px
}

/// Drops members without a neighbour along both axes.
fn prune(lattice: &mut Lattice) {
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
                let moved = (centred[0] - guess[0]).hypot(centred[1] - guess[1]);
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

struct ColourStep {
    /// Half the brightness difference between the squares on one diagonal and those on the other.
    value: f32,
    /// Whether the squares on each diagonal agree.
    clean: bool,
}

/// Compares the four squares around a member.
fn colour_step(image: &GrayImage, lattice: &Lattice, (i, j): Node) -> Option<ColourStep> {
    let here = lattice.get((i, j))?;
    let (u, v) = axes(lattice, (i, j), here)?;
    let mean = |su: f32, sv: f32| {
        [(0.3, 0.3), (0.2, 0.36), (0.36, 0.2)]
            .iter()
            .map(|(p, q)| {
                let (p, q) = (p * su, q * sv);
                sample(image, here[0] + p * u[0] + q * v[0], here[1] + p * u[1] + q * v[1])
            })
            .sum::<f32>()
            / 3.0
    };
    let (one, two) = (mean(1.0, 1.0), mean(-1.0, -1.0));
    let (three, four) = (mean(1.0, -1.0), mean(-1.0, 1.0));
    let value = 0.25 * (one + two - three - four);
    let clean = (one - two).abs() < 1.4 * value.abs() && (three - four).abs() < 1.4 * value.abs();
    Some(ColourStep { value, clean })
}

/// Mean colour step of the members at even nodes, with its sign; `None` if the colours don't alternate.
fn colours(image: &GrayImage, lattice: &Lattice) -> Option<f32> {
    let steps = || {
        lattice.nodes().iter().filter_map(|&(i, j)| {
            let step = colour_step(image, lattice, (i, j))?.value;
            Some(if (i + j) % 2 == 0 { step } else { -step })
        })
    };
    let count = steps().count();
    let light = steps().filter(|step| *step > 0.0).count();
    let sign = if 2 * light > count { 1.0 } else { -1.0 };
    let agree = light.max(count - light);
    if count < 4 || agree * 10 < count * 8 {
        return None;
    }
    let typical = steps().map(|step| (step * sign).max(0.0)).sum::<f32>() / agree as f32;
    (typical > 3.0).then_some(sign * typical)
}

/// Whether the squares around every corner of a complete board, numbered from `(0, 0)`, alternate as the board's do.
pub(super) fn all_colours_alternate(
    image: &GrayImage,
    lattice: &Lattice,
    board: &Checkerboard,
) -> bool {
    let Some(typical) = colours(image, lattice) else { return false };
    let first = lattice.get((0, 0));
    let Some((u, v)) = first.and_then(|first| axes(lattice, (0, 0), first)) else { return false };
    let upright = u[0] * v[1] - u[1] * v[0] > 0.0;
    let same_parity = board.columns() % 2 == board.rows() % 2;
    upright
        && (same_parity || typical < 0.0)
        && lattice.nodes().iter().all(|&(i, j)| {
            let expected = if (i + j) % 2 == 0 { typical } else { -typical };
            colour_step(image, lattice, (i, j))
                .is_some_and(|step| step.clean && step.value * expected > 0.0)
        })
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
    into: &mut Vec<[f32; 2]>,
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
            let dark_outside =
                colour_step(image, lattice, place(*turn, 0, 0)).is_some_and(|step| {
                    // `value` compares the diagonal through (+u, +v) of the grid; a quarter turn exchanges it.
                    if *upright { step.value < 0.0 } else { step.value > 0.0 }
                });
            same_parity || dark_outside
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
            .filter_map(|(column, row)| lattice.get(place(turn, column, row))),
    );
    true
}
