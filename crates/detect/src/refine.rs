//! Fits the edge model to every corner of the full-size picture, and checks the consistency of the
//! board.

use image::GrayImage;
use nalgebra::Point2;

use super::{
    bent_edges::BentEdges,
    edge_model::{self, EdgeFit, Known},
    motion::motion_px,
    neighbours::{Lines, expected_px, smooth},
    outcome::{Detection, Miss, Quality},
    params::DetectorParams,
};
use boresight_geometry::{Corner, boards::Board, expect_unseen};

/// Blur, as a fraction of a square, above which there is no plateau between the edges.
const BLUR_LIMIT_SQUARES: f64 = 0.25;
/// Least brightness step of a corner, as a fraction of the board's median; small, because light is
/// uneven.
const LEAST_OF_MEDIAN: f64 = 0.04;
/// Largest ratio of a corner's residual to the board's median: noise affects all corners, clutter
/// only some.
const RESIDUAL_OVER_MEDIAN: f64 = 1.6;

/// Ratio of a corner's standard deviation to the board's median above which the corner carries no
/// information, and least such standard deviation in pixels.
const VAGUE_OVER_MEDIAN: f64 = 20.0;
const VAGUE_FROM_PX: f64 = 0.3;
/// Largest distance of a corner from the neighbours' prediction: in squares, or in standard
/// deviations.
const OFF_SQUARES: f64 = 0.1;
const OFF_SIGMAS: f64 = 5.0;
/// Largest ratios to the medians of residual and standard deviation for a corner beside an unseen
/// corner.
const TOUCHED_RESIDUAL: f64 = 1.5;
const TOUCHED_SIGMA: f64 = 3.0;
/// Least number of corners of a board, and reciprocal of the largest share of failed fits:
/// `LOST_SHARE`, or `LOST_SHARE_OF_PART` on a partly seen board.
const LEAST_CORNERS: usize = 12;
pub(super) const LOST_SHARE: usize = 8;
pub(super) const LOST_SHARE_OF_PART: usize = 3;
/// Both limits if markers identify the seen corners.
const LEAST_CORNERS_WITH_MARKERS: usize = 6;
const LOST_SHARE_WITH_MARKERS: usize = 2;

/// Refines the corners of a board. Reuses its buffers.
#[derive(Clone, Debug, Default)]
pub(super) struct Refiner {
    fits: Vec<Option<EdgeFit>>,
    sorted: Vec<f64>,
    scratch: edge_model::Scratch,
    bent_edges: BentEdges,
}

/// Approximate corners.
#[derive(Clone, Copy)]
struct Rough<'a> {
    /// Positions in pixels of the full-size picture, row by row; `None` for unseen corners.
    corners_px: &'a [Option<[f64; 2]>],
    lines: Lines,
    /// Distance of markers from the edges of the squares; infinite without markers in light
    /// squares.
    gap_squares: f64,
    /// Sampled share of a shorter step around a corner: the frame of a tag ends sooner if it's
    /// narrow.
    share: f64,
}

impl Refiner {
    /// Measures the board whose corners are near `rough` (pixels of the full-size picture, row by
    /// row; `None` for unseen corners). Corners without a good measurement become unseen, too.
    ///
    /// # Errors
    ///
    /// [`Miss`] if too many corners can't be measured, or if the corners don't form one board.
    pub(super) fn refine(
        &mut self,
        image: &GrayImage,
        board: &Board,
        rough: &[Option<[f64; 2]>],
        params: &DetectorParams,
        keep_on: &dyn Fn() -> bool,
    ) -> Result<Detection, Miss> {
        let (columns, lines) = (board.columns(), Lines::of(board));
        let (gap_squares, share) = match (board, board.markers()) {
            (_, None) => (f64::INFINITY, 1.0),
            (Board::AprilGrid(_), Some(tags)) => (f64::INFINITY, (2.0 * tags.gap_steps).min(1.0)),
            (_, Some(markers)) => (markers.gap_steps, 1.0),
        };
        let rough = Rough { corners_px: rough, lines, gap_squares, share };
        let mut shortest_px = f64::MAX;
        self.fits.clear();
        for (index, start) in rough.corners_px.iter().enumerate() {
            if index % columns == 0 && !keep_on() {
                return Err(Miss::OutOfTime);
            }
            let fit = start.zip(Window::around(rough, index)).and_then(|(start, window)| {
                shortest_px = shortest_px.min(window.side_px);
                window.fit(image, start, Known::Nothing, &mut self.scratch)
            });
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
        let median_sigma_px = self.median(|_, fit| fit.corner.sigma_px()).unwrap_or(0.0);
        let vague_px = (VAGUE_OVER_MEDIAN * median_sigma_px).max(VAGUE_FROM_PX);
        for fit in &mut self.fits {
            *fit = fit.take().filter(|fit| fit.corner.sigma_px() <= vague_px);
        }
        let median_blur_px = self.median(|_, fit| fit.blur_px());
        self.retry(image, rough, (limit, median_step, vague_px), median_blur_px);
        let tried = rough.corners_px.iter().flatten().count();
        if self.fits.iter().any(Option::is_none) {
            self.drop_touched(columns, median_residual);
            self.drop_strays(rough);
        }
        let noise = self.median(|_, fit| fit.noise).unwrap_or_default();
        for fit in self.fits.iter_mut().flatten() {
            *fit = fit.with_least_noise(noise);
        }
        let (found, wanted) = (self.fits.iter().flatten().count(), rough.corners_px.len());
        let blur_px = self.median(|_, fit| fit.blur_px()).unwrap_or(params.max_blur_px);
        let limit_px = params.max_blur_px.min(BLUR_LIMIT_SQUARES * shortest_px);
        if blur_px > params.max_blur_px || (found < tried && blur_px > limit_px) {
            return Err(Miss::Blurred { blur_px, limit_px });
        }
        // More corners are lost at the rim of a covered part.
        let (share, least) = match (board.markers().is_some(), tried < wanted) {
            (true, _) => (LOST_SHARE_WITH_MARKERS, LEAST_CORNERS_WITH_MARKERS),
            (false, true) => (LOST_SHARE_OF_PART, LEAST_CORNERS),
            (false, false) => (LOST_SHARE, LEAST_CORNERS),
        };
        if found < least.min(wanted) || share * (tried - found) > tried {
            return Err(Miss::PartialBoard { found, wanted, size: [0; 2], cut_off_by: None });
        }
        let contrast = self.median(|_, fit| fit.contrast()).unwrap_or(0.0);
        if contrast < params.min_contrast {
            return Err(Miss::LowContrast { contrast, needed: params.min_contrast });
        }
        if !smooth(&self.fits, lines) {
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
                return Err(Miss::PartialBoard { found, wanted, size: [0; 2], cut_off_by: None });
            }
        }
        self.bent_edges.correct(&self.fits, lines, &mut corners);
        corners.iter_mut().for_each(|corner| *corner = corner.in_few_digits());
        let motion_px = motion_px(image, &self.fits, &mut self.scratch);
        Ok(Detection { corners, quality: Quality { blur_px, contrast, glare, motion_px } })
    }

    /// Repeats failed fits at the position predicted by the neighbours: blur can hide the edges of
    /// a small square from a fit that starts elsewhere.
    fn retry(
        &mut self,
        image: &GrayImage,
        rough: Rough<'_>,
        (limit, median_step, vague_px): (f64, f64, f64),
        median_blur_px: Option<f64>,
    ) {
        let columns = rough.lines.columns;
        for (index, corner) in rough.corners_px.iter().enumerate() {
            let Some(expected) = expected_px(&self.fits, rough.lines, index) else { continue };
            let Some(window) = corner.and_then(|_| Window::around(rough, index)) else { continue };
            let allowed_px = 0.08 * window.side_px + 0.3;
            let off_px = |fit: &EdgeFit| {
                libm::hypot(fit.corner.px.x - expected[0], fit.corner.px.y - expected[1])
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
                    .filter(|fit| fit.corner.sigma_px() <= vague_px)
            });
            if again.is_some() {
                self.fits[index] = again;
            }
        }
    }

    /// Drops poorly fitted corners beside unseen corners, because a cover or the edge of the
    /// picture reaches into the same squares.
    fn drop_touched(&mut self, columns: usize, median_residual: f64) {
        let Some(median_sigma_px) = self.median(|_, fit| fit.corner.sigma_px()) else { return };
        let rows = self.fits.len() / columns;
        let mut touched = Vec::new();
        for (index, fit) in self.fits.iter().enumerate() {
            let Some(fit) = fit else { continue };
            let (column, row) = (index % columns, index / columns);
            let beside =
                |count: usize, place: usize| place.saturating_sub(1)..(place + 2).min(count);
            let mut near = beside(rows, row)
                .flat_map(|row| beside(columns, column).map(move |c| row * columns + c));
            let is_beside_unseen = near.any(|near| self.fits[near].is_none());
            let fits_worse = fit.residual > TOUCHED_RESIDUAL * median_residual + 0.02
                || fit.corner.sigma_px() > TOUCHED_SIGMA * median_sigma_px + 0.02;
            if is_beside_unseen && fits_worse {
                touched.push(index);
            }
        }
        for index in touched {
            self.fits[index] = None;
        }
    }

    /// Drops corners of a part away from the prediction by row and column, and corners without a
    /// prediction: an object in front of the board may have such a corner.
    fn drop_strays(&mut self, rough: Rough<'_>) {
        let strays = |index: &usize| {
            let Some(fit) = &self.fits[*index] else { return false };
            let side_px = Window::around(rough, *index).map_or(0.0, |it| it.side_px);
            let allowed_px = (OFF_SQUARES * side_px).max(OFF_SIGMAS * fit.corner.sigma_px()) + 0.3;
            expected_px(&self.fits, rough.lines, *index)
                .is_none_or(|expected| (fit.corner.px - Point2::from(expected)).norm() > allowed_px)
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

/// Sign of a corner, +1 or −1: the colours around corners alternate.
fn sign(index: usize, columns: usize) -> f64 {
    if (index % columns + index / columns).is_multiple_of(2) { 1.0 } else { -1.0 }
}

/// True if a corner has the sign of `step` and enough contrast, unlike a reflection of a corner.
fn agrees(fit: &EdgeFit, step: f64) -> bool {
    fit.step() * step > 0.0 && fit.contrast() > LEAST_OF_MEDIAN * step.abs()
}

/// Axes and size of the neighbourhood of a corner.
struct Window {
    axes_px: [[f64; 2]; 2],
    side_px: f64,
    gap_squares: f64,
}

impl Window {
    /// Neighbourhood of a corner of the rough grid: local axes, in pixels per square (a shorter
    /// step), and the side of the squares. `None` if no neighbour is seen along an axis.
    fn around(rough: Rough<'_>, index: usize) -> Option<Self> {
        let Rough { corners_px, lines, gap_squares, share } = rough;
        let columns = lines.columns;
        let rows = corners_px.len() / columns;
        let (column, row) = (index % columns, index / columns);
        let at = |column: usize, row: usize| corners_px[row * columns + column];
        let here = at(column, row);
        // From the previous neighbour to the next, or from or to the corner.
        let per_square = |place: usize, before: Option<[f64; 2]>, after: Option<[f64; 2]>| {
            let (from, to, ends) = match (before, after) {
                (Some(before), Some(after)) => (before, after, (place - 1, place + 1)),
                (Some(before), None) => (before, here?, (place - 1, place)),
                (None, after) => (here?, after?, (place, place + 1)),
            };
            let squares = lines.at(ends.1) - lines.at(ends.0);
            Some([(to[0] - from[0]) / squares, (to[1] - from[1]) / squares])
        };
        let left = column.checked_sub(1).and_then(|left| at(left, row));
        let right = (column + 1 < columns).then(|| at(column + 1, row)).flatten();
        let above = row.checked_sub(1).and_then(|above| at(column, above));
        let below = (row + 1 < rows).then(|| at(column, row + 1)).flatten();
        let (u, v) = (per_square(column, left, right)?, per_square(row, above, below)?);
        let (long, wide) = (libm::hypot(u[0], u[1]), libm::hypot(v[0], v[1]));
        let height = (u[0] * v[1] - u[1] * v[0]).abs() / long.max(wide).max(1e-9);
        let axes_px = [u, v].map(|axis| axis.map(|px| share * px));
        Some(Self { axes_px, side_px: long.min(wide).min(height), gap_squares })
    }

    fn fit(
        &self,
        image: &GrayImage,
        start: [f64; 2],
        known: Known,
        scratch: &mut edge_model::Scratch,
    ) -> Option<EdgeFit> {
        edge_model::fit(image, start, self.axes_px, self.gap_squares, known, scratch)
    }
}
