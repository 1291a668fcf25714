//! Names the corners of a grid on a board with markers, by the markers in the grid's squares.
//!
//! Corners that contradict the markers are dropped, and visible corners beside them are added.

use image::GrayImage;

use super::{
    colours::{Cells, FAR_SQUARES, cells, colours},
    complete::{Squares, complete},
    lattice::{Lattice, Node},
    marker_cells::Polarity,
    marker_votes::{Candidate, Reading, Verdict, are_mirrored, place},
    missing::{Behind, SIDES, behind, why_missing},
    outcome::Miss,
};
use boresight_geometry::{boards::Board, markers::Markers};

/// Least number of mismatched markers, and of corners of a full rectangle without any, for another
/// board.
pub(super) const LEAST_OTHER: usize = 3;
const LEAST_PLAIN: usize = 12;
/// Largest deviation of a corner from the neighbours' prediction, in squares.
const OFF_SQUARES: f32 = 0.4;
/// Share of the gap between a square's edge and the marker used to compare colours.
const GAP_SHARE: f32 = 0.9;
const LEAST_CORNERS: usize = 4;

/// Writes the grid's corners to `into`, by the `readings` of the squares, row by row in the board's
/// numbering, with adjacent visible corners; `None` for unseen corners. Returns the polarity of the
/// board.
///
/// # Errors
///
/// [`Miss::OtherMarkers`] if there are markers, but not the board's, or a plain board;
/// [`Miss::Mirrored`] if they are the board's in a mirror; [`Miss::OtherSquares`] if they are the
/// board's, but elsewhere; [`Miss::PartialBoard`] if too few are seen; [`Miss::NoBoard`] if none
/// is.
pub(super) fn name_corners(
    image: &GrayImage,
    lattice: &mut Lattice,
    readings: &[Reading],
    board: &Board,
    markers: Markers,
    into: &mut Vec<Option<[f32; 2]>>,
) -> Result<Polarity, Miss> {
    let size = [board.columns() as i32, board.rows() as i32];
    let partial = |lattice: &Lattice| Miss::PartialBoard {
        found: lattice.len(),
        wanted: board.corner_count(),
        size: [0; 2],
        cut_off_by: why_missing(image, lattice, Some(size), 0.0).cut_off_by(),
    };
    let on = (board, markers);
    let best = match place(readings, lattice, board, markers, [Behind::default(); 4]) {
        Verdict::Clear(best) => best,
        // The layouts differ in the first and last columns only: white behind an end decides.
        Verdict::Ambiguous(best) => {
            fill(image, lattice, readings, &best, on);
            let gap = 0.5 * markers.gap_steps as f32;
            let end = |out| behind(image, lattice, out, [gap, 1.0 - gap, gap]);
            match place(readings, lattice, board, markers, SIDES.map(end)) {
                Verdict::Clear(best) => best,
                _ => return Err(partial(lattice)),
            }
        }
        Verdict::OtherSquares => return Err(Miss::OtherSquares { markers: readings.len() }),
        Verdict::Unexplained => {
            let seen = readings.iter().filter(|reading| reading.is_sure).count();
            let is_plain = lattice.len() >= LEAST_PLAIN
                && lattice.is_full()
                && cells(image, lattice) != Cells::Several;
            // Every second square of a board with markers has one.
            let squares: usize = lattice.size().iter().map(|side| side.saturating_sub(1)).product();
            let seen = if is_plain && 4 * seen < squares { 0 } else { seen };
            return Err(match seen {
                // Letters on a wall make grids, too.
                0 if !is_plain => Miss::NoBoard,
                LEAST_OTHER.. if are_mirrored(readings, markers) => Miss::Mirrored,
                0 | LEAST_OTHER.. => Miss::OtherMarkers { markers: seen },
                _ if lattice.len() >= board.corner_count() => Miss::OtherMarkers { markers: seen },
                _ => partial(lattice),
            });
        }
    };
    if !fill(image, lattice, readings, &best, on) || lattice.len() < LEAST_CORNERS {
        return Err(partial(lattice));
    }
    best.placement.write(lattice, board, into);
    Ok(best.polarity)
}

/// Adds the corners of the placed board that the picture shows, and drops all that it doesn't.
/// Returns `false` if the squares' colours aren't the board's.
fn fill(
    image: &GrayImage,
    lattice: &mut Lattice,
    readings: &[Reading],
    best: &Candidate,
    (board, markers): (&Board, Markers),
) -> bool {
    keep_agreeing(lattice, readings, best, board, markers);
    let far = (GAP_SHARE * markers.gap_steps as f32).min(FAR_SQUARES);
    let sign = |node: Node| if best.is_light(node, board) { 1.0 } else { -1.0 };
    let typical = colours(image, lattice, far, &sign).filter(|typical| *typical > 0.0);
    let Some(typical) = typical else { return false };
    let step = |node: Node| typical * sign(node);
    let squares = Squares { far, step: &step };
    lattice.retain(|lattice, node| squares.show(image, lattice, node));
    keep_in_line(lattice);
    let size = [board.columns() as i32, board.rows() as i32].map(|count| 0..count);
    complete(image, lattice, &squares, |_, node| {
        let place = best.placement.place(node);
        (0..2).all(|k| size[k].contains(&place[k]))
    });
    keep_in_line(lattice);
    true
}

/// Drops corners outside of the board, and corners that touch only squares with other markers than
/// the board's.
fn keep_agreeing(
    lattice: &mut Lattice,
    readings: &[Reading],
    best: &Candidate,
    board: &Board,
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

/// Drops corners away from the others' prediction, the farthest off first. Without a marker beside
/// it, a corner of another object can take a corner's place.
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
