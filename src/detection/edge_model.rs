//! Fits two blurred edges to the full-size picture around a corner.
//!
//! ```text
//! I(x, y) = (b + a erf(d1/s) erf(d2/s)) (1 + gx dx + gy dy)
//! ```
//! `d1`, `d2`: signed distances from the two edge lines through the corner; nine parameters: corner,
//! two directions, log of the blur `s`, contrast `a`, mean `b`, gradient of the light. Levenberg–Marquardt
//! over a patch that reaches almost halfway into the squares around the corner, sheared as they are. The
//! covariance of the corner is `σ² (JᵀJ)⁻¹` with `σ²` from the residuals, so that clutter and noise both
//! count.
//!
//! Assumes edges blurred by a Gaussian and straight within the patch.

use image::GrayImage;
use nalgebra::{Matrix2, Point2, SMatrix, SVector};

use super::edge_pixels::{Evaluated, Patch, Pixels};
use crate::geometry::Corner;

pub(super) const PARAMETERS: usize = 9;
/// Rounds on the thinned patch, and on the pixels that tell.
const ROUNDS: usize = 15;
const FINE_ROUNDS: usize = 6;
/// Rounds that tell the blur of the one edge from that of the other.
const SPLIT_ROUNDS: usize = 3;
/// A corner that moves less is settled, on the thinned patch and in the end.
const ROUGH_PX: f64 = 0.02;
const SETTLED_PX: f64 = 3e-4;
/// The patch: squares to each side of the corner, at least so many pixels, at most so many.
const REACH_SQUARES: f64 = 0.48;
const LEAST_REACH_PX: f64 = 3.0;
const RADIUS_LIMIT_PX: i32 = 24;
/// Least share of the patch that must lie in the picture.
const LEAST_VISIBLE: f64 = 0.5;
/// What lies nearer to the edge of the picture is not seen from all sides.
const MARGIN_PX: f64 = 2.0;
/// Fewer pixels say too little about nine parameters.
const LEAST_PIXELS: usize = 24;
/// No corner is known better than this: pixels are not points, nor printed squares perfect.
const SIGMA_FLOOR_PX: f64 = 0.0055;
const CORRELATION_POWER: f64 = 0.4;

pub(super) type Vector = SVector<f64, PARAMETERS>;
pub(super) type Matrix = SMatrix<f64, PARAMETERS, PARAMETERS>;

/// What the fit says of a corner.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct EdgeFit {
    pub(super) corner: Corner,
    /// Root mean square residual over the contrast.
    pub(super) residual: f64,
    /// The nine parameters, and the patch that they were fitted to.
    at: Vector,
    patch: Patch,
}

impl EdgeFit {
    /// Standard deviation of the Gaussian blur: `erf(d/s)` is a step blurred by a Gaussian of `s/√2`.
    pub(super) fn blur_px(&self) -> f64 {
        self.at[4].exp() / std::f64::consts::SQRT_2
    }

    /// Half the brightness step, positive if the squares between the two axes are light.
    pub(super) fn step(&self) -> f64 {
        self.at[5]
    }

    /// Half the brightness step.
    pub(super) fn contrast(&self) -> f64 {
        self.step().abs()
    }

    /// Brightness of the light squares.
    pub(super) fn light(&self) -> f64 {
        self.at[6] + self.contrast()
    }
}

/// Variances of the Gaussians that blur the first and the second edge, each by itself.
pub(super) fn edge_variances_px2(
    image: &GrayImage,
    fit: &EdgeFit,
    scratch: &mut Scratch,
) -> [f64; 2] {
    let pixels = &mut scratch.fine;
    pixels.gather_telling(image, &fit.patch, &fit.at);
    let mut log_s = [fit.at[4]; 2];
    for _ in 0..SPLIT_ROUNDS {
        let step = pixels.split_step(&fit.at, log_s);
        for k in 0..2 {
            log_s[k] = (log_s[k] + step[k].clamp(-0.5, 0.5)).clamp(-1.6, 2.5);
        }
    }
    log_s.map(|log_s| 0.5 * (2.0 * log_s).exp())
}

/// What the rest of the board tells of a corner whose squares are hardly larger than the blur, so that
/// their own pixels do not tell blur, contrast and directions from each other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Known {
    Nothing,
    /// Standard deviation of the Gaussian blur in pixels.
    Blur(f64),
    /// And the edges have the directions of the board's axes.
    BlurAndEdges(f64),
}

/// Buffers of the fit, kept between corners and frames.
#[derive(Clone, Debug, Default)]
pub(super) struct Scratch {
    coarse: Pixels,
    fine: Pixels,
}

/// Fits around `start`, with the board's axes `u` and `v` in pixels per square there.
///
/// First on a quarter or a ninth of the patch's pixels, then on those that tell: the edges in full, the
/// plain squares thinned out.
///
/// What [`Known`] gives is not estimated, nor is the light's gradient then.
///
/// `None` if the corner or most of the patch lies outside the picture, or the fit runs away or stays poor.
pub(super) fn fit(
    image: &GrayImage,
    start: [f64; 2],
    axes_px: [[f64; 2]; 2],
    known: Known,
    scratch: &mut Scratch,
) -> Option<EdgeFit> {
    let limits = (REACH_SQUARES, LEAST_REACH_PX, RADIUS_LIMIT_PX);
    let patch = Patch::around(start, axes_px, limits)?;
    let centre = [f64::from(patch.centre_px.0), f64::from(patch.centre_px.1)];
    let Scratch { coarse, fine } = scratch;
    let thin = match patch.half_px {
        half if half > 13.0 => 3,
        half if half > 6.5 => 2,
        _ => 1,
    };
    coarse.gather(image, &patch, |dx, dy| dx % thin == 0 && dy % thin == 0);
    let whole = patch.area_px() / f64::from(thin * thin);
    if coarse.count < LEAST_PIXELS || (coarse.count as f64) < LEAST_VISIBLE * whole {
        return None;
    }
    let [u, v] = axes_px;
    let begin = [start[0] - centre[0], start[1] - centre[1]];
    let mut guess = first_guess(coarse, begin, u[1].atan2(u[0]), v[1].atan2(v[0]));
    let (known_blur_px, held): (_, &[usize]) = match known {
        Known::Nothing => (None, &[]),
        Known::Blur(blur_px) => (Some(blur_px), &[4, 7, 8]),
        Known::BlurAndEdges(blur_px) => (Some(blur_px), &[2, 3, 4, 7, 8]),
    };
    if let Some(blur_px) = known_blur_px {
        guess[4] = (blur_px * std::f64::consts::SQRT_2).ln();
    }
    let (rough, _) = settle(coarse, guess, held, ROUNDS, ROUGH_PX)?;
    fine.gather_telling(image, &patch, &rough);
    let (at, now) = settle(fine, rough, held, FINE_ROUNDS, SETTLED_PX)?;
    let pixels = fine.count;
    let freedom = (pixels as f64 - PARAMETERS as f64).max(1.0);
    let variance = now.cost / freedom * correlation_excess(now.next_products / now.cost);
    let covariance = now.normal_matrix.cholesky()?.inverse() * variance;
    let moved = (at[0] - begin[0]).hypot(at[1] - begin[1]);
    let contrast = at[5].abs();
    let residual = (now.cost / pixels as f64).sqrt() / contrast;
    if !(moved < 0.5 * patch.half_px && residual.is_finite() && contrast > 1.0) {
        return None;
    }
    let inside = |at: f64, size: u32| at >= MARGIN_PX && at <= f64::from(size) - 1.0 - MARGIN_PX;
    if !(inside(centre[0] + at[0], image.width()) && inside(centre[1] + at[1], image.height())) {
        return None;
    }
    let floor = Matrix2::from_diagonal_element(SIGMA_FLOOR_PX * SIGMA_FLOOR_PX);
    let corner = Corner {
        px: Point2::new(centre[0] + at[0], centre[1] + at[1]),
        // An inverse is symmetric but for rounding; a recording holds three numbers, not four.
        covariance_px2: Matrix2::new(
            covariance[(0, 0)],
            covariance[(1, 0)],
            covariance[(1, 0)],
            covariance[(1, 1)],
        ) + floor,
    };
    Some(EdgeFit { corner, residual, at, patch })
}

/// By how much neighbouring residuals that are alike, as those of clutter and shadows are and those of
/// noise are not, make a fit worse than as many independent ones: `((1+ρ)/(1−ρ))^0.4` for a correlation
/// `ρ` of next pixels: between none and what a falling correlation along a line costs, as measured on
/// rendered pictures; residuals that are alike on both sides of an edge do not move the corner.
fn correlation_excess(correlation: f64) -> f64 {
    let rho = correlation.clamp(0.0, 0.9);
    ((1.0 + rho) / (1.0 - rho)).powf(CORRELATION_POWER)
}

fn first_guess(pixels: &Pixels, corner: [f64; 2], first_rad: f64, second_rad: f64) -> Vector {
    let each = || {
        let places = pixels.x.iter().zip(&pixels.y).zip(&pixels.value).take(pixels.count);
        places.map(|((x, y), value)| [f64::from(*x), f64::from(*y), f64::from(*value)])
    };
    let count = pixels.count as f64;
    let mean = each().map(|[_, _, value]| value).sum::<f64>() / count;
    let (s1, c1) = first_rad.sin_cos();
    let (s2, c2) = second_rad.sin_cos();
    let contrast = each()
        .map(|[x, y, value]| {
            let (dx, dy) = (x - corner[0], y - corner[1]);
            let side = (-dx * s1 + dy * c1) * (-dx * s2 + dy * c2);
            (value - mean) * side.signum()
        })
        .sum::<f64>()
        / count;
    Vector::from([
        corner[0],
        corner[1],
        first_rad,
        second_rad,
        1.5_f64.ln(),
        contrast,
        mean,
        0.0,
        0.0,
    ])
}

/// Levenberg–Marquardt until the corner moves by less than `settled_px`; `held` parameters stay.
fn settle(
    pixels: &Pixels,
    start: Vector,
    held: &[usize],
    rounds: usize,
    settled_px: f64,
) -> Option<(Vector, Evaluated)> {
    let mut at = start;
    let mut damping = 1e-3;
    let evaluate = |at: &Vector| {
        let mut evaluated = pixels.evaluate(at);
        for &i in held {
            evaluated.normal_matrix.row_mut(i).fill(0.0);
            evaluated.normal_matrix.column_mut(i).fill(0.0);
            evaluated.normal_matrix[(i, i)] = 1.0;
            evaluated.gradient[i] = 0.0;
        }
        evaluated
    };
    let mut now = evaluate(&at);
    for _ in 0..rounds {
        let mut damped = now.normal_matrix;
        for i in 0..PARAMETERS {
            damped[(i, i)] += damping * (now.normal_matrix[(i, i)] + 1e-9);
        }
        let step = damped.cholesky()?.solve(&now.gradient);
        let mut tried = at + step;
        // A blur of a quarter pixel is a step to a camera; one of eight is no corner any more.
        tried[4] = tried[4].clamp(-1.05, 2.08);
        let moved = step[0].abs().max(step[1].abs());
        if moved < settled_px {
            at = tried;
            break;
        }
        let next = evaluate(&tried);
        // Sums are of single precision: at the minimum the cost no longer falls measurably.
        if next.cost <= now.cost * (1.0 + 1e-6) {
            (at, now) = (tried, next);
            damping *= 0.1;
        } else if damping > 1e4 {
            break;
        } else {
            damping *= 10.0;
        }
    }
    Some((at, now))
}
