//! Fits the edge model to every corner of the full-size picture, and checks that the corners form one board.

use image::GrayImage;
use nalgebra::Point2;

use super::{
    bent_edges::BentEdges,
    edge_model::{self, EdgeFit, Known},
    motion::motion_px,
    outcome::{Detection, Miss, Quality},
    params::DetectorParams,
};
use crate::board::Checkerboard;

/// Blur above this fraction of a square leaves no plateau between its edges.
const BLUR_LIMIT_SQUARES: f64 = 0.25;
/// Least brightness step of a corner, as a fraction of the board's median; small, because light is uneven.
const LEAST_OF_MEDIAN: f64 = 0.04;
/// Corners whose residual exceeds this multiple of the board's median are dropped: noise affects all corners, clutter
/// only some.
const RESIDUAL_OVER_MEDIAN: f64 = 1.6;

/// Refines all corners of a board. Reuses its buffers.
#[derive(Clone, Debug, Default)]
pub(super) struct Refiner {
    fits: Vec<Option<EdgeFit>>,
    sorted: Vec<f64>,
    scratch: edge_model::Scratch,
    bent_edges: BentEdges,
}

impl Refiner {
    /// Measures the board whose corners are near `rough` (pixels of the full-size picture, row by row).
    ///
    /// # Errors
    ///
    /// [`Miss`] if a corner can't be measured, or if the corners don't form one board.
    pub(super) fn refine(
        &mut self,
        image: &GrayImage,
        board: &Checkerboard,
        rough: &[[f64; 2]],
        params: &DetectorParams,
        keep_on: &dyn Fn() -> bool,
    ) -> Result<Detection, Miss> {
        let columns = board.columns();
        let mut shortest_px = f64::MAX;
        self.fits.clear();
        for index in 0..rough.len() {
            if index % columns == 0 && !keep_on() {
                return Err(Miss::OutOfTime);
            }
            let window = Window::around(rough, columns, index);
            shortest_px = shortest_px.min(window.side_px);
            self.fits.push(window.fit(image, rough[index], Known::Nothing, &mut self.scratch));
        }
        let needed_px = params.min_square_px;
        if shortest_px < needed_px {
            return Err(Miss::TooSmall { square_px: shortest_px, needed_px });
        }
        let median_residual = self.median(|_, fit| fit.residual).unwrap_or(0.0);
        let limit = (RESIDUAL_OVER_MEDIAN * median_residual).clamp(params.max_residual, 1.0);
        // Positive if the squares between the board's axes at corner 0 are light.
        let median_step =
            self.median(|index, fit| fit.step() * sign(index, columns)).unwrap_or(0.0);
        for (index, fit) in self.fits.iter_mut().enumerate() {
            let step = median_step * sign(index, columns);
            *fit = fit.take().filter(|fit| fit.residual <= limit && agrees(fit, step));
        }
        let median_blur_px = self.median(|_, fit| fit.blur_px());
        self.retry(image, rough, columns, (limit, median_step), median_blur_px);
        let (found, wanted) = (self.fits.iter().flatten().count(), rough.len());
        let blur_px = self.median(|_, fit| fit.blur_px()).unwrap_or(params.max_blur_px);
        let limit_px = params.max_blur_px.min(BLUR_LIMIT_SQUARES * shortest_px);
        if blur_px > params.max_blur_px || (found < wanted && blur_px > limit_px) {
            return Err(Miss::Blurred { blur_px, limit_px });
        }
        if found < wanted {
            return Err(Miss::PartialBoard { found, wanted, cut_off_by: None });
        }
        let contrast = self.median(|_, fit| fit.contrast()).unwrap_or(0.0);
        if contrast < params.min_contrast {
            return Err(Miss::LowContrast { contrast, needed: params.min_contrast });
        }
        if !smooth(&self.fits, columns) {
            return Err(Miss::NoBoard);
        }
        let fits = || self.fits.iter().flatten();
        let glare = fits().filter(|fit| fit.light() >= 252.0).count() as f64 / wanted as f64;
        let mut corners = Vec::with_capacity(wanted);
        corners.extend(fits().map(|fit| fit.corner));
        self.bent_edges.correct(&self.fits, columns, &mut corners);
        corners.iter_mut().for_each(|corner| *corner = corner.in_few_digits());
        let motion_px = motion_px(image, &self.fits, &mut self.scratch);
        Ok(Detection { corners, quality: Quality { blur_px, contrast, glare, motion_px } })
    }

    /// Repeats failed fits at the position that the neighbours predict: blur can hide the edges of a small square
    /// from a fit that starts elsewhere.
    fn retry(
        &mut self,
        image: &GrayImage,
        rough: &[[f64; 2]],
        columns: usize,
        (limit, median_step): (f64, f64),
        median_blur_px: Option<f64>,
    ) {
        for index in 0..rough.len() {
            let Some(expected) = expected_px(&self.fits, columns, index) else { continue };
            let window = Window::around(rough, columns, index);
            let allowed_px = 0.08 * window.side_px + 0.3;
            let off_px = |fit: &EdgeFit| {
                (fit.corner.px.x - expected[0]).hypot(fit.corner.px.y - expected[1])
            };
            if self.fits[index].as_ref().is_some_and(|fit| off_px(fit) <= allowed_px) {
                continue;
            }
            let helped =
                median_blur_px.map(|blur_px| [Known::Blur(blur_px), Known::BlurAndEdges(blur_px)]);
            let all = [Known::Nothing].into_iter().chain(helped.into_iter().flatten());
            let again = all.into_iter().find_map(|known| {
                window
                    .fit(image, expected, known, &mut self.scratch)
                    .filter(|fit| fit.residual <= limit && off_px(fit) <= allowed_px)
                    .filter(|fit| agrees(fit, median_step * sign(index, columns)))
            });
            if again.is_some() {
                self.fits[index] = again;
            }
        }
    }

    /// Median over the fitted corners of `value(index, fit)`.
    fn median(&mut self, value: impl Fn(usize, &EdgeFit) -> f64) -> Option<f64> {
        self.sorted.clear();
        let fits = self.fits.iter().enumerate();
        self.sorted.extend(fits.filter_map(|(index, fit)| Some(value(index, fit.as_ref()?))));
        self.sorted.sort_unstable_by(f64::total_cmp);
        self.sorted.get(self.sorted.len() / 2).copied()
    }
}

/// +1 or −1: the colours around corners alternate.
fn sign(index: usize, columns: usize) -> f64 {
    if (index % columns + index / columns).is_multiple_of(2) { 1.0 } else { -1.0 }
}

/// Whether a corner has the sign of `step` and enough of its contrast not to be a reflection of a corner.
fn agrees(fit: &EdgeFit, step: f64) -> bool {
    fit.step() * step > 0.0 && fit.contrast() > LEAST_OF_MEDIAN * step.abs()
}

/// Axes and size of the neighbourhood of a corner.
struct Window {
    axes_px: [[f64; 2]; 2],
    side_px: f64,
}

impl Window {
    /// Local axes, in pixels per square, and the side of the squares around a corner of the rough grid.
    fn around(rough: &[[f64; 2]], columns: usize, index: usize) -> Self {
        let rows = rough.len() / columns;
        let (column, row) = (index % columns, index / columns);
        let at = |column: usize, row: usize| rough[row * columns + column];
        let (left, right) = (column.saturating_sub(1), (column + 1).min(columns - 1));
        let (above, below) = (row.saturating_sub(1), (row + 1).min(rows - 1));
        let per_square = |from: [f64; 2], to: [f64; 2], steps: usize| {
            [(to[0] - from[0]) / steps as f64, (to[1] - from[1]) / steps as f64]
        };
        let u = per_square(at(left, row), at(right, row), right - left);
        let v = per_square(at(column, above), at(column, below), below - above);
        let (long, wide) = (u[0].hypot(u[1]), v[0].hypot(v[1]));
        let height = (u[0] * v[1] - u[1] * v[0]).abs() / long.max(wide).max(1e-9);
        Self { axes_px: [u, v], side_px: long.min(wide).min(height) }
    }

    fn fit(
        &self,
        image: &GrayImage,
        start: [f64; 2],
        known: Known,
        scratch: &mut edge_model::Scratch,
    ) -> Option<EdgeFit> {
        edge_model::fit(image, start, self.axes_px, known, scratch)
    }
}

/// Position of a corner predicted by the fitted neighbours in its row and column; `None` if there are too few.
fn expected_px(fits: &[Option<EdgeFit>], columns: usize, index: usize) -> Option<[f64; 2]> {
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

/// Whether all rows and columns are smooth: the third difference of any four corners in line stays below 0.45 of a
/// square plus half a pixel.
fn smooth(fits: &[Option<EdgeFit>], columns: usize) -> bool {
    let at = |index: usize| fits[index].as_ref().map(|fit| fit.corner.px);
    // Third difference of four in line: zero for any parabola.
    let bends = |first: usize, stride: usize| -> Option<bool> {
        let [a, b, c, d]: [Point2<f64>; 4] =
            [at(first)?, at(first + stride)?, at(first + 2 * stride)?, at(first + 3 * stride)?];
        let off = (d - a) - (c - b) * 3.0;
        Some(off.norm() < 0.45 * (c - b).norm() + 0.5)
    };
    let along = |index: usize| index % columns + 3 >= columns || bends(index, 1) == Some(true);
    let down =
        |index: usize| index + 3 * columns >= fits.len() || bends(index, columns) == Some(true);
    (0..fits.len()).all(|index| along(index) && down(index))
}
