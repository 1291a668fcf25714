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
use crate::{
    board::Checkerboard,
    geometry::{Corner, expect_unseen},
};

/// Blur above this fraction of a square leaves no plateau between its edges.
const BLUR_LIMIT_SQUARES: f64 = 0.25;
/// Least brightness step of a corner, as a fraction of the board's median; small, because light is uneven.
const LEAST_OF_MEDIAN: f64 = 0.04;
/// Corners whose residual exceeds this multiple of the board's median are dropped: noise affects all corners, clutter
/// only some.
const RESIDUAL_OVER_MEDIAN: f64 = 1.6;

/// A corner is vague if its standard deviation exceeds this multiple of the board's median, and this many pixels.
const VAGUE_OVER_MEDIAN: f64 = 20.0;
const VAGUE_FROM_PX: f64 = 0.3;
/// How far a corner may be off the place between its neighbours: in squares, or in standard deviations.
const OFF_SQUARES: f64 = 0.1;
const OFF_SIGMAS: f64 = 5.0;
/// Largest residual, as a fraction of the contrast, of a corner that is fitted again.
const AGAIN_RESIDUAL: f64 = 0.5;
/// A corner beside one that isn't seen may fit so much worse than the median, in residual and standard deviation.
const TOUCHED_RESIDUAL: f64 = 1.5;
const TOUCHED_SIGMA: f64 = 3.0;
/// Fewer corners don't make a board, and not if more than one in so many of those looked at can't be measured.
const LEAST_CORNERS: usize = 12;
const LOST_SHARE: usize = 8;
const LOST_SHARE_OF_PART: usize = 3;
/// The same where markers say which corners are seen.
const LEAST_CORNERS_WITH_MARKERS: usize = 6;
const LOST_SHARE_WITH_MARKERS: usize = 2;

/// Refines the corners of a board. Reuses its buffers.
#[derive(Clone, Debug, Default)]
pub(super) struct Refiner {
    fits: Vec<Option<EdgeFit>>,
    sorted: Vec<f64>,
    scratch: edge_model::Scratch,
    bent_edges: BentEdges,
    /// Distance of markers from the edges of their squares; infinite without markers.
    gap_squares: f64,
}

impl Refiner {
    /// Measures the board whose corners are near `rough` (pixels of the full-size picture, row by row; `None` where a
    /// corner isn't seen). Corners that can't be measured well are unseen, too.
    ///
    /// # Errors
    ///
    /// [`Miss`] if too many corners can't be measured, or if the corners don't form one board.
    pub(super) fn refine(
        &mut self,
        image: &GrayImage,
        board: &Checkerboard,
        rough: &[Option<[f64; 2]>],
        params: &DetectorParams,
        keep_on: &dyn Fn() -> bool,
    ) -> Result<Detection, Miss> {
        let columns = board.columns();
        let gap = board.markers().map_or(f64::INFINITY, |it| (1.0 - it.side_squares) / 2.0);
        self.gap_squares = gap;
        let mut shortest_px = f64::MAX;
        self.fits.clear();
        for index in 0..rough.len() {
            if index % columns == 0 && !keep_on() {
                return Err(Miss::OutOfTime);
            }
            let fit = rough[index].zip(Window::around(rough, columns, index)).and_then(
                |(start, window)| {
                    shortest_px = shortest_px.min(window.side_px);
                    window.fit(image, start, (Known::Nothing, gap), &mut self.scratch)
                },
            );
            self.fits.push(fit);
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
        self.drop_doubtful(image, rough, columns, median_blur_px);
        let tried = rough.iter().flatten().count();
        if self.fits.iter().any(Option::is_none) {
            self.drop_touched(image, columns, median_residual, board.markers().is_some());
            self.drop_strays(rough, columns);
        }
        let (found, wanted) = (self.fits.iter().flatten().count(), rough.len());
        let blur_px = self.median(|_, fit| fit.blur_px()).unwrap_or(params.max_blur_px);
        let limit_px = params.max_blur_px.min(BLUR_LIMIT_SQUARES * shortest_px);
        if blur_px > params.max_blur_px || (found < tried && blur_px > limit_px) {
            return Err(Miss::Blurred { blur_px, limit_px });
        }
        // At the rim of what covers a part, more are lost.
        let (share, least) = match (board.markers().is_some(), tried < wanted) {
            (true, _) => (LOST_SHARE_WITH_MARKERS, LEAST_CORNERS_WITH_MARKERS),
            (false, true) => (LOST_SHARE_OF_PART, LEAST_CORNERS),
            (false, false) => (LOST_SHARE, LEAST_CORNERS),
        };
        if found < least.min(wanted) || share * (tried - found) > tried {
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
        let glare = fits().filter(|fit| fit.light() >= 252.0).count() as f64 / found as f64;
        let nowhere = Corner::unseen(Point2::new(f64::NAN, f64::NAN));
        let mut corners = Vec::with_capacity(wanted);
        corners.extend(self.fits.iter().map(|fit| fit.as_ref().map_or(nowhere, |fit| fit.corner)));
        if found < wanted {
            expect_unseen(&board.corners_in_board_m(), &mut corners);
            // Without a plane, it's no board.
            if corners.iter().any(|corner| !corner.px.x.is_finite()) {
                return Err(Miss::PartialBoard { found, wanted, cut_off_by: None });
            }
        }
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
        rough: &[Option<[f64; 2]>],
        columns: usize,
        (limit, median_step): (f64, f64),
        median_blur_px: Option<f64>,
    ) {
        for index in 0..rough.len() {
            let Some(expected) = expected_px(&self.fits, columns, index) else { continue };
            let window = rough[index].and_then(|_| Window::around(rough, columns, index));
            let Some(window) = window else { continue };
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
                    .fit(image, expected, (known, self.gap_squares), &mut self.scratch)
                    .filter(|fit| fit.residual <= limit && off_px(fit) <= allowed_px)
                    .filter(|fit| agrees(fit, median_step * sign(index, columns)))
            });
            if again.is_some() {
                self.fits[index] = again;
            }
        }
    }

    /// Fits corners again, from where their neighbours predict them, that are far less certain than the others or that
    /// contradict their neighbours; drops them if that doesn't help. An edge beside a corner, or a line that crosses it
    /// at a small angle, can make such a fit.
    fn drop_doubtful(
        &mut self,
        image: &GrayImage,
        rough: &[Option<[f64; 2]>],
        columns: usize,
        median_blur_px: Option<f64>,
    ) {
        let Some(median_sigma_px) = self.median(|_, fit| fit.corner.sigma_px()) else { return };
        let is_vague = |fit: &EdgeFit| {
            let sigma_px = fit.corner.sigma_px();
            sigma_px > VAGUE_OVER_MEDIAN * median_sigma_px && sigma_px > VAGUE_FROM_PX
        };
        // The worst first: a wrong corner also makes its neighbours look wrong.
        for _ in 0..self.fits.len() / LOST_SHARE + 1 {
            let worst = (0..self.fits.len())
                .filter_map(|index| {
                    let fit = self.fits[index].as_ref()?;
                    if is_vague(fit) {
                        return Some((f64::INFINITY, index));
                    }
                    let side_px = Window::around(rough, columns, index)?.side_px;
                    let expected = between_neighbours_px(&self.fits, columns, index)?;
                    let off_px = (fit.corner.px - Point2::from(expected)).norm();
                    let allowed_px =
                        (OFF_SQUARES * side_px).max(OFF_SIGMAS * fit.corner.sigma_px()) + 0.3;
                    Some((off_px / allowed_px, index))
                })
                .max_by(|a, b| a.0.total_cmp(&b.0));
            let Some((_, index)) = worst.filter(|(ratio, _)| *ratio > 1.0) else { return };
            let before = self.fits[index].take();
            let again = expected_px(&self.fits, columns, index)
                .zip(Window::around(rough, columns, index))
                .zip(median_blur_px)
                .and_then(|((expected, window), blur_px)| {
                    let known = Known::BlurAndEdges(blur_px);
                    let fit = window.fit(
                        image,
                        expected,
                        (known, self.gap_squares),
                        &mut self.scratch,
                    )?;
                    let off_px = (fit.corner.px - Point2::from(expected)).norm();
                    let is_sound = !is_vague(&fit)
                        && off_px <= OFF_SQUARES * window.side_px + 0.3
                        && before.is_some_and(|before| before.step() * fit.step() > 0.0)
                        && fit.residual < AGAIN_RESIDUAL;
                    is_sound.then_some(fit)
                });
            self.fits[index] = again;
        }
    }

    /// Drops corners beside unseen ones that are covered, for what covers them reaches into the squares beside, and those
    /// beside the edge of the picture that fit worse than the others. On a board `with_markers`, where only narrow bands
    /// along the edges are looked at, all corners that fit as well as the others stay.
    fn drop_touched(
        &mut self,
        image: &GrayImage,
        columns: usize,
        median_residual: f64,
        with_markers: bool,
    ) {
        let Some(median_sigma_px) = self.median(|_, fit| fit.corner.sigma_px()) else { return };
        let rows = self.fits.len() / columns;
        let (right, bottom) = (f64::from(image.width()) - 1.0, f64::from(image.height()) - 1.0);
        let is_covered = |index: usize| {
            self.fits[index].is_none()
                && expected_px(&self.fits, columns, index)
                    .is_some_and(|[x, y]| (0.0..=right).contains(&x) && (0.0..=bottom).contains(&y))
        };
        let mut touched = Vec::new();
        for (index, fit) in self.fits.iter().enumerate() {
            let Some(fit) = fit else { continue };
            let (column, row) = (index % columns, index / columns);
            let beside =
                |count: usize, place: usize| place.saturating_sub(1)..(place + 2).min(count);
            let is_beside = |is: &dyn Fn(usize) -> bool| {
                beside(rows, row).any(|row| beside(columns, column).any(|c| is(row * columns + c)))
            };
            let beside_unseen = is_beside(&|index| self.fits[index].is_none());
            let fits_worse = fit.residual > TOUCHED_RESIDUAL * median_residual + 0.02
                || fit.corner.sigma_px() > TOUCHED_SIGMA * median_sigma_px + 0.02;
            if (beside_unseen && fits_worse) || (!with_markers && is_beside(&is_covered)) {
                touched.push(index);
            }
        }
        for index in touched {
            self.fits[index] = None;
        }
    }

    /// Drops corners of a part that stray from where the corners in their row and column put them; also those at its rim,
    /// which only extrapolation checks.
    fn drop_strays(&mut self, rough: &[Option<[f64; 2]>], columns: usize) {
        let strays = |index: &usize| {
            let (Some(fit), Some(expected)) =
                (&self.fits[*index], expected_px(&self.fits, columns, *index))
            else {
                return false;
            };
            let side_px = Window::around(rough, columns, *index).map_or(0.0, |it| it.side_px);
            let allowed_px = (OFF_SQUARES * side_px).max(OFF_SIGMAS * fit.corner.sigma_px()) + 0.3;
            (fit.corner.px - Point2::from(expected)).norm() > allowed_px
        };
        let found: Vec<usize> = (0..self.fits.len()).filter(strays).collect();
        for index in found {
            self.fits[index] = None;
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
    /// Local axes, in pixels per square, and the side of the squares around a corner of the rough grid. `None` if no
    /// neighbour is seen along an axis.
    fn around(rough: &[Option<[f64; 2]>], columns: usize, index: usize) -> Option<Self> {
        let rows = rough.len() / columns;
        let (column, row) = (index % columns, index / columns);
        let at = |column: usize, row: usize| rough[row * columns + column];
        let here = at(column, row);
        // From the neighbour before to the one after, or from or to the corner itself.
        let per_square = |before: Option<[f64; 2]>, after: Option<[f64; 2]>| {
            let (from, to, steps) = match (before, after) {
                (Some(before), Some(after)) => (before, after, 2.0),
                (Some(before), None) => (before, here?, 1.0),
                (None, after) => (here?, after?, 1.0),
            };
            Some([(to[0] - from[0]) / steps, (to[1] - from[1]) / steps])
        };
        let left = column.checked_sub(1).and_then(|left| at(left, row));
        let right = (column + 1 < columns).then(|| at(column + 1, row)).flatten();
        let above = row.checked_sub(1).and_then(|above| at(column, above));
        let below = (row + 1 < rows).then(|| at(column, row + 1)).flatten();
        let (u, v) = (per_square(left, right)?, per_square(above, below)?);
        let (long, wide) = (u[0].hypot(u[1]), v[0].hypot(v[1]));
        let height = (u[0] * v[1] - u[1] * v[0]).abs() / long.max(wide).max(1e-9);
        Some(Self { axes_px: [u, v], side_px: long.min(wide).min(height) })
    }

    fn fit(
        &self,
        image: &GrayImage,
        start: [f64; 2],
        (known, gap_squares): (Known, f64),
        scratch: &mut edge_model::Scratch,
    ) -> Option<EdgeFit> {
        edge_model::fit(image, start, self.axes_px, gap_squares, known, scratch)
    }
}

/// Position of a corner between four fitted neighbours in its row, or in its column, or the mean of both; `None` if they
/// aren't there.
fn between_neighbours_px(
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

/// Whether all rows and columns are smooth: the third difference of any four corners in line that are seen stays below
/// 0.45 of a square plus half a pixel.
fn smooth(fits: &[Option<EdgeFit>], columns: usize) -> bool {
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
