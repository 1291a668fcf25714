//! Fits a grid to the known board, fills gaps it can verify in the picture, and numbers the corners.

use image::GrayImage;

use super::{
    Miss, Side,
    lattice::{Lattice, Node, predict},
    reduce::sample,
};
use crate::board::Checkerboard;

/// Corners beside a board that may be there by chance.
const MOST_CHANCE_CORNERS: usize = 2;

/// All corners of the board at search size, numbered.
pub(super) type NumberedCorners = Vec<[f32; 2]>;

/// Completes `lattice` to the board and numbers its corners row by row.
///
/// # Errors
///
/// [`Miss::OtherBoard`] if the grid is larger than the board, [`Miss::PartialBoard`] if corners are missing.
pub(super) fn match_board(
    image: &GrayImage,
    mut lattice: Lattice,
    board: &Checkerboard,
) -> Result<NumberedCorners, Miss> {
    prune(&mut lattice);
    let (columns, rows) = (board.columns() as i32, board.rows() as i32);
    complete(image, &mut lattice, columns.max(rows));
    prune(&mut lattice);
    trim(&mut lattice, (columns, rows));
    let Some((low, high)) = extent(&lattice) else {
        return Err(Miss::NoBoard);
    };
    let (width, height) = (high.0 - low.0 + 1, high.1 - low.1 + 1);
    let fits = (width, height) == (columns, rows) || (width, height) == (rows, columns);
    let whole = lattice.len() as i32 == width * height;
    if !fits && whole && width.min(height) >= 3 && width * height > columns * rows {
        let (columns, rows) = (width.max(height) as usize, width.min(height) as usize);
        return Err(Miss::OtherBoard { columns, rows });
    }
    if !(fits && whole) {
        let (found, wanted) = (lattice.len(), board.corner_count());
        return Err(Miss::PartialBoard { found, wanted, cut_off_by: cut_off_by(image, &lattice) });
    }
    number(image, &lattice, low, (columns, rows), (width, height)).ok_or(Miss::NoBoard)
}

/// Drops members that hang on by a single neighbour.
fn prune(lattice: &mut Lattice) {
    loop {
        let loose: Vec<Node> = lattice
            .keys()
            .filter(|(i, j)| {
                let has = |di: i32, dj: i32| lattice.contains_key(&(i + di, j + dj));
                let across = has(1, 0) || has(-1, 0);
                let down = has(0, 1) || has(0, -1);
                !(across && down)
            })
            .copied()
            .collect();
        if loose.is_empty() {
            return;
        }
        for node in loose {
            lattice.remove(&node);
        }
    }
}

/// Drops an outer row or column of one or two corners while the grid is larger than the board: chance
/// corners beside it. More are a larger board.
fn trim(lattice: &mut Lattice, (columns, rows): (i32, i32)) {
    while let Some((low, high)) = extent(lattice) {
        let (width, height) = (high.0 - low.0 + 1, high.1 - low.1 + 1);
        let larger = (width > columns || height > rows) && (width > rows || height > columns);
        if !larger {
            return;
        }
        let on_side = |side: usize, node: &Node| match side {
            0 => node.0 == low.0,
            1 => node.0 == high.0,
            2 => node.1 == low.1,
            _ => node.1 == high.1,
        };
        let count = |side: usize| lattice.keys().filter(|node| on_side(side, node)).count();
        let Some(thinnest) = (0..4).min_by_key(|side| count(*side)) else { return };
        if count(thinnest) > MOST_CHANCE_CORNERS {
            return;
        }
        lattice.retain(|node, _| !on_side(thinnest, node));
    }
}

fn extent(lattice: &Lattice) -> Option<(Node, Node)> {
    let first = *lattice.keys().next()?;
    Some(lattice.keys().fold((first, first), |(low, high), &(i, j)| {
        ((low.0.min(i), low.1.min(j)), (high.0.max(i), high.1.max(j)))
    }))
}

/// Adds places inside the grid and one row around it where the picture shows the right colours, while
/// the grid stays within `longest` corners a side.
fn complete(image: &GrayImage, lattice: &mut Lattice, longest: i32) {
    let at = |point: [f32; 2]| point;
    let Some(typical) = colours(image, lattice) else { return };
    for _ in 0..12 {
        let Some((low, high)) = extent(lattice) else { return };
        let mut added = Vec::new();
        for i in low.0 - 1..=high.0 + 1 {
            for j in low.1 - 1..=high.1 + 1 {
                let node = (i, j);
                let too_long = high.0.max(i) - low.0.min(i) >= longest
                    || high.1.max(j) - low.1.min(j) >= longest;
                let neighbours = [(1, 0), (-1, 0), (0, 1), (0, -1)]
                    .iter()
                    .filter(|(di, dj)| lattice.contains_key(&(i + di, j + dj)))
                    .count();
                if lattice.contains_key(&node) || too_long || neighbours == 0 {
                    continue;
                }
                let Some((guess, side)) = predict(lattice, node, &at) else { continue };
                let centred = settle(image, guess, side);
                let moved = (centred[0] - guess[0]).hypot(centred[1] - guess[1]);
                if moved > 0.25 * side {
                    continue;
                }
                let mut with = lattice.clone();
                with.insert(node, centred);
                let expected = if (i + j) % 2 == 0 { typical } else { -typical };
                let seen = colour_step(image, &with, node);
                let strong = |step: ColourStep| {
                    step.clean && step.value * expected.signum() > 0.35 * expected.abs()
                };
                if seen.is_some_and(strong) {
                    added.push((node, centred));
                }
            }
        }
        if added.is_empty() {
            return;
        }
        lattice.extend(added);
    }
}

/// The saddle of brightness nearest to `guess`, by gradients: at a corner every gradient is perpendicular
/// to the way there (Förstner & Gülch 1987).
fn settle(image: &GrayImage, guess: [f32; 2], side: f32) -> [f32; 2] {
    let reach = (0.3 * side).clamp(2.0, 8.0) as i32;
    let mut at = guess;
    for _ in 0..6 {
        let (mut a, mut b, mut c, mut u, mut v) = (0.0_f32, 0.0_f32, 0.0_f32, 0.0_f32, 0.0_f32);
        for dy in -reach..=reach {
            for dx in -reach..=reach {
                let (px, py) = (dx as f32, dy as f32);
                let (x, y) = (at[0] + px, at[1] + py);
                let gx = sample(image, x + 1.0, y) - sample(image, x - 1.0, y);
                let gy = sample(image, x, y + 1.0) - sample(image, x, y - 1.0);
                a += gx * gx;
                b += gx * gy;
                c += gy * gy;
                u += gx * gx * px + gx * gy * py;
                v += gx * gy * px + gy * gy * py;
            }
        }
        let determinant = a * c - b * b;
        if determinant <= 1e-3 * (a + c) * (a + c) {
            return at;
        }
        let step = [(c * u - b * v) / determinant, (a * v - b * u) / determinant];
        at = [at[0] + step[0], at[1] + step[1]];
        if step[0].hypot(step[1]) < 0.02 {
            break;
        }
    }
    at
}

struct ColourStep {
    /// Half the difference between the squares on the one and on the other diagonal.
    value: f32,
    /// Whether squares of one diagonal agree.
    clean: bool,
}

/// Compares the four squares around a member.
fn colour_step(image: &GrayImage, lattice: &Lattice, (i, j): Node) -> Option<ColourStep> {
    let here = *lattice.get(&(i, j))?;
    let side_at = |(i, j): Node, di: i32, dj: i32| -> Option<[f32; 2]> {
        let here = *lattice.get(&(i, j))?;
        let ahead = lattice.get(&(i + di, j + dj));
        let behind = lattice.get(&(i - di, j - dj));
        match (ahead, behind) {
            (Some(a), Some(b)) => Some([0.5 * (a[0] - b[0]), 0.5 * (a[1] - b[1])]),
            (Some(a), None) => Some([a[0] - here[0], a[1] - here[1]]),
            (None, Some(b)) => Some([here[0] - b[0], here[1] - b[1]]),
            (None, None) => None,
        }
    };
    // The first corner of a new row has no neighbour in it; the row before runs the same way.
    let side = |di: i32, dj: i32| {
        side_at((i, j), di, dj).or_else(|| {
            side_at((i + dj, j + di), di, dj).or_else(|| side_at((i - dj, j - di), di, dj))
        })
    };
    let (u, v) = (side(1, 0)?, side(0, 1)?);
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

/// Typical colour step of the members at even places, with its sign; `None` if the colours do not
/// alternate.
fn colours(image: &GrayImage, lattice: &Lattice) -> Option<f32> {
    let mut steps: Vec<f32> = lattice
        .keys()
        .filter_map(|&(i, j)| {
            let step = colour_step(image, lattice, (i, j))?.value;
            Some(if (i + j) % 2 == 0 { step } else { -step })
        })
        .collect();
    if steps.len() < 4 {
        return None;
    }
    steps.sort_by(f32::total_cmp);
    let typical = steps[steps.len() / 2];
    let agree = steps.iter().filter(|step| **step * typical > 0.0).count();
    (typical.abs() > 3.0 && agree * 10 >= steps.len() * 8).then_some(typical)
}

/// Which edge of the picture the grid runs into, if one: the next corner would lie outside.
fn cut_off_by(image: &GrayImage, lattice: &Lattice) -> Option<Side> {
    let (width, height) = (image.width() as f32, image.height() as f32);
    let at = |point: [f32; 2]| point;
    let mut outside = [(Side::Left, 0), (Side::Right, 0), (Side::Top, 0), (Side::Bottom, 0)];
    for &(i, j) in lattice.keys() {
        for node in [(i + 1, j), (i - 1, j), (i, j + 1), (i, j - 1)] {
            if lattice.contains_key(&node) {
                continue;
            }
            let Some((guess, _)) = predict(lattice, node, &at) else { continue };
            let margin = 6.0;
            outside[0].1 += usize::from(guess[0] < margin);
            outside[1].1 += usize::from(guess[0] > width - margin);
            outside[2].1 += usize::from(guess[1] < margin);
            outside[3].1 += usize::from(guess[1] > height - margin);
        }
    }
    let (side, count) = outside.into_iter().max_by_key(|(_, count)| *count)?;
    (count >= 2).then_some(side)
}

/// Maps column and row of the board, and width and height of the grid, to a place of the grid.
type Turn = fn(i32, i32, i32, i32) -> Node;

/// Corners row by row. The grid is never mirrored, so that two or four turns remain: colours choose for
/// boards of mixed parity (the square beyond the first corner, away from the others, is dark), the place
/// in the picture (first corner nearest to the top left) for the others.
fn number(
    image: &GrayImage,
    lattice: &Lattice,
    low: Node,
    (columns, rows): (i32, i32),
    (width, height): (i32, i32),
) -> Option<NumberedCorners> {
    // Each turn maps (column, row) of the board to a place of the grid.
    let turns: [(bool, Turn); 4] = [
        (true, |c, r, _, _| (c, r)),
        (true, |c, r, w, h| (w - 1 - c, h - 1 - r)),
        (false, |c, r, w, _| (w - 1 - r, c)),
        (false, |c, r, _, h| (r, h - 1 - c)),
    ];
    let mut choices = Vec::new();
    for (upright, turn) in turns {
        if ((width, height) == (columns, rows)) != upright && width != height {
            continue;
        }
        let node = |column: i32, row: i32| {
            let (i, j) = turn(column, row, width, height);
            (i + low.0, j + low.1)
        };
        let corners: Option<NumberedCorners> = (0..rows)
            .flat_map(|row| (0..columns).map(move |column| (column, row)))
            .map(|(column, row)| lattice.get(&node(column, row)).copied())
            .collect();
        let corners = corners?;
        let dark_outside = colour_step(image, lattice, node(0, 0)).is_some_and(|step| {
            // `value` compares the diagonal through (+u, +v) of the grid; a quarter turn exchanges it.
            if upright { step.value < 0.0 } else { step.value > 0.0 }
        });
        let from_top_left = corners[0][0] + corners[0][1];
        choices.push((dark_outside, from_top_left, corners));
    }
    let same_parity = columns % 2 == rows % 2;
    choices
        .into_iter()
        .filter(|(dark_outside, ..)| same_parity || *dark_outside)
        .min_by(|a, b| a.1.total_cmp(&b.1))
        .map(|(.., corners)| corners)
}
