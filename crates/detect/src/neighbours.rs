//! Prediction of a fitted corner from the neighbours.

use super::edge_model::EdgeFit;
use boresight_geometry::boards::Board;

/// Rows and columns of a board's points.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lines {
    /// Number of points in a row.
    pub(super) columns: usize,
    /// Ratio of the first, third, fifth step in a row or column to the others, at least 1.
    longer: f64,
}

impl Lines {
    pub(super) fn of(board: &Board) -> Self {
        let [one, other] = board.target().steps_m();
        Self { columns: board.columns(), longer: one / other }
    }

    /// Distance of a place in a row or column from the first, in shorter steps.
    pub(super) fn at(&self, place: usize) -> f64 {
        (place / 2) as f64 * (1.0 + self.longer) + (place % 2) as f64 * self.longer
    }

    /// Weights of the values at `places` for the value at `place`: of the polynomial through them
    /// (Lagrange).
    fn weights<const N: usize>(&self, place: usize, places: [usize; N]) -> [f64; N] {
        let (here, at) = (self.at(place), places.map(|place| self.at(place)));
        std::array::from_fn(|k| {
            let others = || (0..N).filter(|other| *other != k);
            let above: f64 = others().map(|other| here - at[other]).product();
            let below: f64 = others().map(|other| at[k] - at[other]).product();
            above / below
        })
    }
}

/// Position of a corner predicted by the fitted neighbours in row and column; `None` if there are
/// too few.
pub(super) fn expected_px(
    fits: &[Option<EdgeFit>],
    lines: Lines,
    index: usize,
) -> Option<[f64; 2]> {
    let columns = lines.columns;
    let rows = fits.len() / columns;
    // Cubic interpolation between neighbours, parabolic extrapolation beyond them; linear if there
    // are too few.
    let along = |place: usize, count: usize, stride: usize| -> Option<([f64; 2], f64)> {
        let at = |other: usize| {
            let fit = fits[index + other * stride - place * stride].as_ref()?;
            Some([fit.corner.px.x, fit.corner.px.y])
        };
        let near = |steps: isize| {
            let other = place.checked_add_signed(steps).filter(|other| *other < count)?;
            Some((other, at(other)?))
        };
        fn mix<const N: usize>(weights: [f64; N], px: [[f64; 2]; N]) -> [f64; 2] {
            weights
                .iter()
                .zip(px)
                .fold([0.0, 0.0], |sum, (w, p)| [sum[0] + w * p[0], sum[1] + w * p[1]])
        }
        if let (Some((before, b)), Some((after, c))) = (near(-1), near(1)) {
            return Some(match (near(-2), near(2)) {
                (Some((first, a)), Some((last, d))) => {
                    let weights = lines.weights(place, [first, before, after, last]);
                    (mix(weights, [a, b, c, d]), 4.0)
                }
                _ => (mix(lines.weights(place, [before, after]), [b, c]), 2.0),
            });
        }
        [1, -1].into_iter().find_map(|way| {
            let ((one, a), (two, b)) = (near(way)?, near(2 * way)?);
            Some(match near(3 * way) {
                Some((three, c)) => (mix(lines.weights(place, [one, two, three]), [a, b, c]), 1.0),
                None => (mix(lines.weights(place, [one, two]), [a, b]), 0.5),
            })
        })
    };
    let guesses = [along(index % columns, columns, 1), along(index / columns, rows, columns)];
    let weight: f64 = guesses.iter().flatten().map(|(_, weight)| weight).sum();
    (weight > 0.0).then(|| {
        guesses.iter().flatten().fold([0.0, 0.0], |sum, (guess, w)| {
            [sum[0] + guess[0] * w / weight, sum[1] + guess[1] * w / weight]
        })
    })
}

/// True if all rows and columns are smooth: of any four seen corners in line, the last is within
/// 0.45 of the step between the middle two, plus half a pixel, of the parabola through the others.
pub(super) fn smooth(fits: &[Option<EdgeFit>], lines: Lines) -> bool {
    let columns = lines.columns;
    let at = |index: usize| fits[index].as_ref().map(|fit| fit.corner.px.coords);
    let bends = |first: usize, place: usize, stride: usize| -> Option<bool> {
        let [a, b, c, d] = [0, 1, 2, 3].map(|step| at(first + step * stride));
        let (a, b, c, d) = (a?, b?, c?, d?);
        let [one, two, three] = lines.weights(place + 3, [0, 1, 2].map(|step| place + step));
        let off = d - (a * one + b * two + c * three);
        Some(off.norm() < 0.45 * (c - b).norm() + 0.5)
    };
    let along = |index: usize| {
        let column = index % columns;
        column + 3 >= columns || bends(index, column, 1) != Some(false)
    };
    let down = |index: usize| {
        index + 3 * columns >= fits.len() || bends(index, index / columns, columns) != Some(false)
    };
    (0..fits.len()).all(|index| along(index) && down(index))
}
