//! Prediction of a fitted corner from its neighbours.

use nalgebra::Point2;

use super::edge_model::EdgeFit;

/// Position of a corner between four fitted neighbours in its row, or in its column, or the mean of both; `None` if they
/// aren't there.
pub(super) fn between_neighbours_px(
    fits: &[Option<EdgeFit>],
    columns: usize,
    index: usize,
) -> Option<[f64; 2]> {
    let rows = fits.len() / columns;
    let (column, row) = (index % columns, index / columns);
    let between = |place: usize, count: usize, stride: usize| -> Option<[f64; 2]> {
        let two = 2 * stride;
        let is_inner = place >= 2 && place + 2 < count;
        let near = |index: usize| fits.get(index)?.as_ref().map(|fit| fit.corner.px);
        if !is_inner {
            return None;
        }
        let (first, before) = (near(index - two)?, near(index - stride)?);
        let (after, last) = (near(index + stride)?, near(index + two)?);
        let cubic = ((before.coords + after.coords) * 4.0 - first.coords - last.coords) / 6.0;
        Some([cubic.x, cubic.y])
    };
    match (between(column, columns, 1), between(row, rows, columns)) {
        (Some(a), Some(b)) => Some([(a[0] + b[0]) / 2.0, (a[1] + b[1]) / 2.0]),
        (one, other) => one.or(other),
    }
}

/// Position of a corner predicted by the fitted neighbours in its row and column; `None` if there are too few.
pub(super) fn expected_px(
    fits: &[Option<EdgeFit>],
    columns: usize,
    index: usize,
) -> Option<[f64; 2]> {
    let rows = fits.len() / columns;
    let (column, row) = ((index % columns) as isize, (index / columns) as isize);
    let at = |dc: isize, dr: isize| {
        let (column, row) = (column + dc, row + dr);
        let inside = (0..columns as isize).contains(&column) && (0..rows as isize).contains(&row);
        let fit = inside.then(|| fits[row as usize * columns + column as usize].as_ref())??;
        Some([fit.corner.px.x, fit.corner.px.y])
    };
    // Cubic interpolation between neighbours, parabolic extrapolation beyond them; linear where there are too few.
    let along = |dc: isize, dr: isize| -> Option<([f64; 2], f64)> {
        let near = |step: isize| at(step * dc, step * dr);
        let mix = |terms: &[(f64, [f64; 2])]| {
            terms.iter().fold([0.0, 0.0], |sum, (w, p)| [sum[0] + w * p[0], sum[1] + w * p[1]])
        };
        if let (Some(before), Some(after)) = (near(-1), near(1)) {
            return Some(match (near(-2), near(2)) {
                (Some(first), Some(last)) => (
                    mix(&[
                        (-1.0 / 6.0, first),
                        (4.0 / 6.0, before),
                        (4.0 / 6.0, after),
                        (-1.0 / 6.0, last),
                    ]),
                    4.0,
                ),
                _ => (mix(&[(0.5, before), (0.5, after)]), 2.0),
            });
        }
        [1, -1].into_iter().find_map(|way| {
            let (one, two) = (near(way)?, near(2 * way)?);
            Some(match near(3 * way) {
                Some(three) => (mix(&[(3.0, one), (-3.0, two), (1.0, three)]), 1.0),
                None => (mix(&[(2.0, one), (-1.0, two)]), 0.5),
            })
        })
    };
    let guesses = [along(1, 0), along(0, 1)];
    let weight: f64 = guesses.iter().flatten().map(|(_, weight)| weight).sum();
    (weight > 0.0).then(|| {
        guesses.iter().flatten().fold([0.0, 0.0], |sum, (guess, w)| {
            [sum[0] + guess[0] * w / weight, sum[1] + guess[1] * w / weight]
        })
    })
}

/// True if all rows and columns are smooth: the third difference of any four corners in line that are seen stays below
/// 0.45 of a square plus half a pixel.
pub(super) fn smooth(fits: &[Option<EdgeFit>], columns: usize) -> bool {
    let at = |index: usize| fits[index].as_ref().map(|fit| fit.corner.px);
    // Third difference of four in line: zero for any parabola.
    let bends = |first: usize, stride: usize| -> Option<bool> {
        let [a, b, c, d]: [Point2<f64>; 4] =
            [at(first)?, at(first + stride)?, at(first + 2 * stride)?, at(first + 3 * stride)?];
        let off = (d - a) - (c - b) * 3.0;
        Some(off.norm() < 0.45 * (c - b).norm() + 0.5)
    };
    let along = |index: usize| index % columns + 3 >= columns || bends(index, 1) != Some(false);
    let down =
        |index: usize| index + 3 * columns >= fits.len() || bends(index, columns) != Some(false);
    (0..fits.len()).all(|index| along(index) && down(index))
}
