//! Which corners of a board with markers a grid has, by the markers in its squares.
//!
//! Corners that contradict the markers are dropped, and those beside that the picture shows are added.

use image::GrayImage;

use super::{
    colours::{FAR_SQUARES, colour_step_within, inside},
    lattice::{Lattice, Node, axes, height},
    marker_cells::Polarity,
    marker_votes::{Candidate, Reading, Verdict, place},
    missing::why_missing,
    outcome::Miss,
    saddle::settle,
};
use boresight_geometry::{board::Checkerboard, markers::Markers};

/// It's another board if at least this many markers don't match, or if this many corners have no marker beside them.
const LEAST_OTHER: usize = 3;
const LEAST_PLAIN: usize = 12;
/// How far a corner may be from where its neighbours put it, in squares.
const OFF_SQUARES: f32 = 0.4;
/// Rounds in which corners beside known ones are added.
const ROUNDS: usize = 30;
/// How far a corner that is added may be from its prediction, in squares.
const NEAR_SQUARES: f32 = 0.12;
/// Least colour step of a corner, as a fraction of the others'.
const LEAST_OF_TYPICAL: f32 = 0.35;
/// Share of the gap between a square's edge and its marker in which colours are compared.
const GAP_SHARE: f32 = 0.9;
const LEAST_CORNERS: usize = 4;

/// Writes the grid's corners to `into`, by the `readings` of its squares, row by row in the board's numbering, with those beside them that the picture
/// shows; `None` for those that aren't seen. Returns the polarity of the board.
///
/// # Errors
///
/// [`Miss::OtherMarkers`] if there are markers, but not the board's, or none; [`Miss::OtherSquares`] if they are the
/// board's, but elsewhere; [`Miss::PartialBoard`] if too few are seen.
pub(super) fn name_corners(
    image: &GrayImage,
    lattice: &mut Lattice,
    readings: &[Reading],
    board: &Checkerboard,
    markers: Markers,
    into: &mut Vec<Option<[f32; 2]>>,
) -> Result<Polarity, Miss> {
    let size = [board.columns() as i32, board.rows() as i32];
    let partial = |lattice: &Lattice| Miss::PartialBoard {
        found: lattice.len().min(board.corner_count()),
        wanted: board.corner_count(),
        cut_off_by: why_missing(image, lattice, Some(size), 0.0).cut_off_by(),
    };
    let best = match place(readings, lattice, board, markers) {
        Verdict::Clear(best) => best,
        Verdict::Ambiguous => return Err(partial(lattice)),
        Verdict::OtherSquares => return Err(Miss::OtherSquares { markers: readings.len() }),
        Verdict::Unexplained => {
            let seen = readings.iter().filter(|reading| reading.is_sure).count();
            let is_other = seen >= LEAST_OTHER || (seen == 0 && lattice.len() >= LEAST_PLAIN);
            return Err(if is_other {
                Miss::OtherMarkers { markers: seen }
            } else {
                partial(lattice)
            });
        }
    };
    keep_agreeing(lattice, readings, &best, board, markers);
    let far = (GAP_SHARE * markers.gap_steps() as f32).min(FAR_SQUARES);
    let Some(typical) = keep_coloured(image, lattice, &best, board, far) else {
        return Err(partial(lattice));
    };
    keep_in_line(lattice);
    add_beside(image, lattice, &best, board, (far, typical));
    keep_in_line(lattice);
    if lattice.len() < LEAST_CORNERS {
        return Err(partial(lattice));
    }
    best.placement.write(lattice, board, into);
    Ok(best.polarity)
}

/// Drops corners outside of the board, and those that touch only squares with other markers than the board's.
fn keep_agreeing(
    lattice: &mut Lattice,
    readings: &[Reading],
    best: &Candidate,
    board: &Checkerboard,
    markers: Markers,
) {
    let agrees = |reading: &Reading| best.agrees(reading, board, markers);
    let size = [board.columns() as i32, board.rows() as i32];
    lattice.retain(|_, (i, j)| {
        let place = best.placement.place((i, j));
        let touching = || {
            readings.iter().filter(move |reading| {
                let (a, b) = reading.node;
                (a == i || a + 1 == i) && (b == j || b + 1 == j)
            })
        };
        let is_other = touching().any(|reading| reading.is_sure && !agrees(reading))
            && !touching().any(agrees);
        (0..2).all(|k| (0..size[k]).contains(&place[k])) && !is_other
    });
}

/// Drops corners that aren't where the others put them, the farthest off first: without a marker beside it, a corner of
/// something else can be in a corner's place.
fn keep_in_line(lattice: &mut Lattice) {
    for _ in 0..lattice.len() {
        let off_squares = |node: &Node| {
            let at = lattice.get(*node)?;
            let (expected, side) = lattice.predict(*node)?;
            Some(libm::hypotf(at[0] - expected[0], at[1] - expected[1]) / side)
        };
        let off = lattice.nodes().iter().filter_map(|node| Some((off_squares(node)?, *node)));
        let worst = off.max_by(|a, b| a.0.total_cmp(&b.0));
        let Some((_, worst)) = worst.filter(|(off, _)| *off > OFF_SQUARES) else { return };
        lattice.retain(|_, node| node != worst);
    }
}

/// +1 if the square towards higher steps along both axes is light, −1 if it's dark.
fn sign(best: &Candidate, node: Node, board: &Checkerboard) -> f32 {
    if best.is_light(node, board) { 1.0 } else { -1.0 }
}

/// Drops corners around which the colours are wrong; returns the others' mean colour step. `None` if few are left.
fn keep_coloured(
    image: &GrayImage,
    lattice: &mut Lattice,
    best: &Candidate,
    board: &Checkerboard,
    far: f32,
) -> Option<f32> {
    let step = |lattice: &Lattice, node: Node| {
        let step = colour_step_within(image, lattice, node, far)?.value;
        Some(step * sign(best, node, board))
    };
    let steps: Vec<f32> = lattice.nodes().iter().filter_map(|node| step(lattice, *node)).collect();
    let positive = || steps.iter().filter(|step| **step > 0.0);
    let count = positive().count();
    if count < LEAST_CORNERS || 4 * count < 3 * steps.len() {
        return None;
    }
    let typical = positive().sum::<f32>() / count as f32;
    lattice.retain(|lattice, node| {
        step(lattice, node).is_some_and(|step| step > LEAST_OF_TYPICAL * typical)
    });
    Some(typical)
}

/// Adds corners of the board beside known ones where the picture shows one.
fn add_beside(
    image: &GrayImage,
    lattice: &mut Lattice,
    best: &Candidate,
    board: &Checkerboard,
    (far, typical): (f32, f32),
) {
    let (columns, rows) = (board.columns() as i32, board.rows() as i32);
    for _ in 0..ROUNDS {
        let before = lattice.len();
        for row in 0..rows {
            for column in 0..columns {
                let node = best.placement.node([column, row]);
                if lattice.contains(node) {
                    continue;
                }
                let Some((guess, side)) = lattice.predict(node) else { continue };
                let side = axes(lattice, node, guess).map_or(side, |axes| side.min(height(axes)));
                if !inside(image, guess, 2.0) {
                    continue;
                }
                // The window reaches 0.3 of what it's given: only to the marker.
                let found = settle(image, guess, far * side / 0.3);
                let moved = libm::hypotf(found[0] - guess[0], found[1] - guess[1]);
                if moved > (NEAR_SQUARES * side).max(1.5) || !lattice.insert(node, found) {
                    continue;
                }
                let is_seen = colour_step_within(image, lattice, node, far).is_some_and(|step| {
                    step.clean && step.value * sign(best, node, board) > LEAST_OF_TYPICAL * typical
                });
                if !is_seen {
                    lattice.take_back();
                }
            }
        }
        if lattice.len() == before {
            return;
        }
    }
}
