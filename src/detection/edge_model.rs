//! Fits two blurred edges to the full-size picture around a corner.
//!
//! ```text
//! I(x, y) = (b + a erf(d1/s) erf(d2/s)) (1 + gx dx + gy dy)
//! ```
//! `d1`, `d2`: signed distances from the two edge lines through the corner; nine parameters: corner,
//! two directions, log of the blur `s`, contrast `a`, mean `b`, gradient of the light. Levenberg–Marquardt
//! over a disc of up to 20 px or 0.42 of the square. The covariance of the corner is
//! `σ² (JᵀJ)⁻¹` with `σ²` from the residuals, so that clutter and noise both count.
//!
//! Assumes edges blurred by a Gaussian and straight within the disc.

use image::GrayImage;
use nalgebra::{Matrix2, Point2, SMatrix, SVector};

use super::simd;
use crate::geometry::Corner;

const PARAMETERS: usize = 9;
/// Rounds on the thinned disc, and on the pixels that tell.
const ROUNDS: usize = 15;
const FINE_ROUNDS: usize = 6;
/// Rounds that tell the blur of the one edge from that of the other.
const SPLIT_ROUNDS: usize = 4;
/// A corner that moves less is settled, on the thinned disc and in the end.
const ROUGH_PX: f64 = 0.02;
const SETTLED_PX: f64 = 3e-4;
/// Widest disc.
pub(super) const RADIUS_LIMIT_PX: i32 = 20;
/// No corner is known better than this: pixels are not points, nor printed squares perfect.
const SIGMA_FLOOR_PX: f64 = 0.006;
const CORRELATION_POWER: f64 = 0.5;

type Vector = SVector<f64, PARAMETERS>;
type Matrix = SMatrix<f64, PARAMETERS, PARAMETERS>;

/// What the fit says of a corner.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct EdgeFit {
    pub(super) corner: Corner,
    /// Standard deviation of the Gaussian blur.
    pub(super) blur_px: f64,
    /// Half the brightness step.
    pub(super) contrast: f64,
    /// The same with a sign: positive if the squares between the two axes are light.
    pub(super) step: f64,
    /// Brightness of the light squares.
    pub(super) light: f64,
    /// Root mean square residual over the contrast.
    pub(super) residual: f64,
    /// The nine parameters, and the disc that they were fitted to.
    at: Vector,
    centre_px: (i32, i32),
    radius_px: i32,
}

/// Variances of the Gaussians that blur the first and the second edge, each by itself.
pub(super) fn edge_variances_px2(
    image: &GrayImage,
    fit: &EdgeFit,
    scratch: &mut Scratch,
) -> [f64; 2] {
    let pixels = &mut scratch.fine;
    let disc = Disc { image, centre_px: fit.centre_px, radius_px: fit.radius_px };
    pixels.gather_telling(&disc, &fit.at);
    let mut log_s = [fit.at[4]; 2];
    for _ in 0..SPLIT_ROUNDS {
        let step = simd::widest(Splitting { pixels, at: &fit.at, log_s });
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
/// First on a quarter of the disc's pixels, then on those that tell: the edges in full, the plain squares
/// thinned out.
///
/// What [`Known`] gives is not estimated, nor is the light's gradient then.
///
/// `None` if the disc leaves the picture, or the fit runs away or stays poor.
pub(super) fn fit(
    image: &GrayImage,
    start: [f64; 2],
    axes_px: [[f64; 2]; 2],
    radius_px: i32,
    known: Known,
    scratch: &mut Scratch,
) -> Option<EdgeFit> {
    let centre = [start[0].round(), start[1].round()];
    let (cx, cy) = (centre[0] as i32, centre[1] as i32);
    let inside = cx >= radius_px
        && cy >= radius_px
        && cx + radius_px < image.width() as i32
        && cy + radius_px < image.height() as i32;
    if !inside {
        return None;
    }
    let disc = Disc { image, centre_px: (cx, cy), radius_px };
    let Scratch { coarse, fine } = scratch;
    let thin = if radius_px > 6 { 2 } else { 1 };
    coarse.gather(&disc, |dx, dy| dx % thin == 0 && dy % thin == 0);
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
    fine.gather_telling(&disc, &rough);
    let (at, now) = settle(fine, rough, held, FINE_ROUNDS, SETTLED_PX)?;
    let pixels = fine.count;
    let freedom = pixels as f64 - PARAMETERS as f64;
    let variance = now.cost / freedom * correlation_excess(now.next_products / now.cost);
    let covariance = now.normal_matrix.cholesky()?.inverse() * variance;
    let moved = (at[0] - begin[0]).hypot(at[1] - begin[1]);
    let contrast = at[5].abs();
    let residual = (now.cost / pixels as f64).sqrt() / contrast;
    if !(moved < 0.5 * f64::from(radius_px) && residual.is_finite() && contrast > 1.0) {
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
    // erf(d/s) is a step blurred by a Gaussian of standard deviation s/√2.
    let blur_px = at[4].exp() / std::f64::consts::SQRT_2;
    let light = at[6] + contrast;
    let centre_px = (cx, cy);
    Some(EdgeFit {
        corner,
        blur_px,
        contrast,
        step: at[5],
        light,
        residual,
        at,
        centre_px,
        radius_px,
    })
}

/// By how much neighbouring residuals that are alike, as those of clutter and shadows are and those of
/// noise are not, make a fit worse than as many independent ones: `((1+ρ)/(1−ρ))²` for a correlation `ρ` of
/// next pixels that falls off exponentially in both directions.
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
        let next = evaluate(&tried);
        // Sums are of single precision: at the minimum the cost no longer falls measurably.
        if next.cost <= now.cost * (1.0 + 1e-6) {
            (at, now) = (tried, next);
            damping *= 0.1;
            if moved < settled_px {
                break;
            }
        } else if damping > 1e4 {
            break;
        } else {
            damping *= 10.0;
        }
    }
    Some((at, now))
}

/// A disc of the picture around a corner.
struct Disc<'a> {
    image: &'a GrayImage,
    /// Pixel in its middle; the disc lies wholly in the picture.
    centre_px: (i32, i32),
    radius_px: i32,
}

/// Pixels of a disc, filled up to whole groups of lanes with some that have no weight.
#[derive(Clone, Debug, Default)]
struct Pixels {
    /// Offset from the disc's centre, brightness, weight.
    x: Vec<f32>,
    y: Vec<f32>,
    value: Vec<f32>,
    weight: Vec<f32>,
    count: usize,
}

/// Sums run in so many lanes on every processor, so that all get the same bits.
const LANES: usize = 8;
/// Pixels that are worked on together, so that their derivatives stay in the nearest cache.
const CHUNK: usize = 16 * LANES;
const SUMS: usize = (PARAMETERS + 1) * (PARAMETERS + 2) / 2;

impl Pixels {
    fn gather(&mut self, disc: &Disc<'_>, wanted: impl Fn(i32, i32) -> bool) {
        for row in [&mut self.x, &mut self.y, &mut self.value, &mut self.weight] {
            row.clear();
        }
        let radius_px = disc.radius_px;
        let (cx, cy) = disc.centre_px;
        let width = disc.image.width() as usize;
        let raw = disc.image.as_raw();
        for dy in -radius_px..=radius_px {
            let reach = ((radius_px * radius_px - dy * dy) as f32).sqrt() as i32;
            let row = (cy + dy) as usize * width;
            for dx in -reach..=reach {
                if wanted(dx, dy) {
                    self.x.push(dx as f32);
                    self.y.push(dy as f32);
                    self.value.push(f32::from(raw[row + (cx + dx) as usize]));
                }
            }
        }
        self.count = self.x.len();
        let filled = self.count.next_multiple_of(LANES);
        self.weight.resize(self.count, 1.0);
        for row in [&mut self.x, &mut self.y, &mut self.value, &mut self.weight] {
            row.resize(filled, 0.0);
        }
    }

    /// The pixels that tell where the edges are, and a quarter of the others.
    fn gather_telling(&mut self, disc: &Disc<'_>, rough: &Vector) {
        let (s1, c1) = (rough[2].sin() as f32, rough[2].cos() as f32);
        let (s2, c2) = (rough[3].sin() as f32, rough[3].cos() as f32);
        let (x, y) = (rough[0] as f32, rough[1] as f32);
        let band_px = 2.5 * rough[4].exp() as f32 + 1.0;
        self.gather(disc, |dx, dy| {
            let (fx, fy) = (dx as f32 - x, dy as f32 - y);
            (fy * c1 - fx * s1).abs() < band_px
                || (fy * c2 - fx * s2).abs() < band_px
                || (dx % 2 == 0 && dy % 2 == 0)
        });
    }

    /// Normal matrix, gradient and cost at `at`.
    ///
    /// Single precision, summed in a fixed order: the same bits on every machine.
    fn evaluate(&self, at: &Vector) -> Evaluated {
        simd::widest(Evaluation { pixels: self, at })
    }

    /// Gauss–Newton step of the logarithms of the blur of the two edges, all else held.
    #[inline(always)]
    fn split_step(&self, at: &Vector, log_s: [f64; 2]) -> [f64; 2] {
        let [x0, y0, _, _, _, a, b, gx, gy] = std::array::from_fn(|i| at[i] as f32);
        let (s1, c1) = (at[2].sin() as f32, at[2].cos() as f32);
        let (s2, c2) = (at[3].sin() as f32, at[3].cos() as f32);
        let inverse_s = log_s.map(|log_s| (-log_s).exp() as f32);
        let mut sums = [[0.0_f32; LANES]; 5];
        for start in (0..self.x.len()).step_by(LANES) {
            for lane in 0..LANES {
                let k = start + lane;
                let weight = self.weight[k];
                let (dx, dy) = (self.x[k] - x0, self.y[k] - y0);
                let d1 = (dy * c1 - dx * s1) * inverse_s[0];
                let d2 = (dy * c2 - dx * s2) * inverse_s[1];
                let (e1, bell1) = erf(d1);
                let (e2, bell2) = erf(d2);
                let light = (1.0 + gx * dx + gy * dy) * weight;
                let scaled = -light * a * std::f32::consts::FRAC_2_SQRT_PI;
                let (j1, j2) = (scaled * bell1 * e2 * d1, scaled * e1 * bell2 * d2);
                let off = self.value[k] * weight - (b + a * e1 * e2) * light;
                let terms = [j1 * j1, j1 * j2, j2 * j2, j1 * off, j2 * off];
                for (sum, term) in sums.iter_mut().zip(terms) {
                    sum[lane] += term;
                }
            }
        }
        let [n11, n12, n22, g1, g2] =
            sums.map(|sum| sum.iter().fold(0.0, |total, lane| total + f64::from(*lane)));
        let determinant = (n11 * n22 - n12 * n12).max(1e-9);
        [(n22 * g1 - n12 * g2) / determinant, (n11 * g2 - n12 * g1) / determinant]
    }

    #[inline(always)]
    fn evaluate_here(&self, at: &Vector) -> Evaluated {
        let [x0, y0, _, _, _, a, b, gx, gy] = std::array::from_fn(|i| at[i] as f32);
        let (s1, c1) = (at[2].sin() as f32, at[2].cos() as f32);
        let (s2, c2) = (at[3].sin() as f32, at[3].cos() as f32);
        let inverse_s = (-at[4]).exp() as f32;
        let slope = inverse_s * std::f32::consts::FRAC_2_SQRT_PI;
        let mut sums = [[0.0_f32; LANES]; SUMS];
        let mut next = [0.0_f32; LANES];
        let mut rows = [[0.0_f32; CHUNK]; PARAMETERS + 1];
        for start in (0..self.x.len()).step_by(CHUNK) {
            let end = (start + CHUNK).min(self.x.len());
            let (x, y) = (&self.x[start..end], &self.y[start..end]);
            let (value, weight) = (&self.value[start..end], &self.weight[start..end]);
            let [r0, r1, r2, r3, r4, r5, r6, r7, r8, r9] = &mut rows;
            let places = x.iter().zip(y).zip(value.iter().zip(weight));
            let first = r0.iter_mut().zip(r1).zip(r2.iter_mut().zip(r3)).zip(r4.iter_mut());
            let second = r5.iter_mut().zip(r6).zip(r7.iter_mut().zip(r8)).zip(r9.iter_mut());
            for (((x, y), (value, weight)), (first, second)) in places.zip(first.zip(second)) {
                let (((r0, r1), (r2, r3)), r4) = first;
                let (((r5, r6), (r7, r8)), r9) = second;
                let (dx, dy) = (x - x0, y - y0);
                let d1 = dy * c1 - dx * s1;
                let d2 = dy * c2 - dx * s2;
                let (e1, bell1) = erf(d1 * inverse_s);
                let (e2, bell2) = erf(d2 * inverse_s);
                let (g1, g2) = (slope * bell1, slope * bell2);
                let light = (1.0 + gx * dx + gy * dy) * weight;
                let product = e1 * e2;
                let pattern = (b + a * product) * weight;
                let scaled = light * a;
                let (across1, across2) = (scaled * g1 * e2, scaled * e1 * g2);
                *r0 = across1 * s1 + across2 * s2 - pattern * gx;
                *r1 = -(across1 * c1 + across2 * c2) - pattern * gy;
                *r2 = -across1 * (dx * c1 + dy * s1);
                *r3 = -across2 * (dx * c2 + dy * s2);
                *r4 = -(across1 * d1 + across2 * d2);
                *r5 = light * product;
                *r6 = light;
                *r7 = pattern * dx;
                *r8 = pattern * dy;
                *r9 = value * weight - (b + a * product) * light;
            }
            let off = &rows[PARAMETERS][..end - start];
            for (one, two) in off.chunks_exact(LANES).zip(off[1..].chunks_exact(LANES)) {
                for lane in 0..LANES {
                    next[lane] += one[lane] * two[lane];
                }
            }
            let mut sum = sums.iter_mut();
            for i in 0..=PARAMETERS {
                for j in 0..=i {
                    let Some(sum) = sum.next() else { break };
                    let one = rows[i][..end - start].chunks_exact(LANES);
                    let two = rows[j][..end - start].chunks_exact(LANES);
                    let mut total = *sum;
                    for (one, two) in one.zip(two) {
                        for lane in 0..LANES {
                            total[lane] += one[lane] * two[lane];
                        }
                    }
                    *sum = total;
                }
            }
        }
        let total =
            |lanes: &[f32; LANES]| lanes.iter().fold(0.0, |total, lane| total + f64::from(*lane));
        let next_products = total(&next);
        let mut totals = sums.iter().map(total);
        let mut next = || totals.next().unwrap_or(0.0);
        let mut normal_matrix = Matrix::zeros();
        for i in 0..PARAMETERS {
            for j in 0..=i {
                let value = next();
                (normal_matrix[(i, j)], normal_matrix[(j, i)]) = (value, value);
            }
        }
        let gradient = Vector::from_fn(|_, _| next());
        Evaluated { normal_matrix, gradient, cost: next(), next_products }
    }
}

struct Evaluation<'a> {
    pixels: &'a Pixels,
    at: &'a Vector,
}

impl simd::Loop for Evaluation<'_> {
    type Output = Evaluated;

    #[inline(always)]
    fn run(self) -> Evaluated {
        self.pixels.evaluate_here(self.at)
    }
}

struct Splitting<'a> {
    pixels: &'a Pixels,
    at: &'a Vector,
    log_s: [f64; 2],
}

impl simd::Loop for Splitting<'_> {
    type Output = [f64; 2];

    #[inline(always)]
    fn run(self) -> [f64; 2] {
        self.pixels.split_step(self.at, self.log_s)
    }
}

struct Evaluated {
    normal_matrix: Matrix,
    gradient: Vector,
    /// Sum of the squared residuals.
    cost: f64,
    /// Sum of the products of each residual and the next one in the row.
    next_products: f64,
}

/// `erf(x)` to 3e-7 and `exp(−x²)`. Abramowitz & Stegun 7.1.26.
#[inline(always)]
fn erf(x: f32) -> (f32, f32) {
    let size = x.abs();
    let bell = exp_negative(-(size * size));
    let t = 1.0 / (1.0 + 0.327_591_1 * size);
    let series = t
        * (0.254_829_6
            + t * (-0.284_496_74 + t * (1.421_413_7 + t * (-1.453_152 + t * 1.061_405_4))));
    ((1.0 - series * bell).copysign(x), bell)
}

/// `exp(x)` for `x <= 0`, to 2e-7 of its value; in plain operations, which vectorise.
#[inline(always)]
fn exp_negative(x: f32) -> f32 {
    // Adding 1.5·2²³ rounds to a whole number, and leaves it in the lowest bits.
    const ROUND: f32 = 12_582_912.0;
    let x = x.max(-80.0);
    let shifted = x * std::f32::consts::LOG2_E + ROUND;
    let whole = shifted - ROUND;
    // ln 2 in two parts, so that the rest is exact.
    let rest = (x - whole * 0.693_359_4) + whole * 2.121_944_4e-4;
    let series = 1.0
        + rest
            * (1.0
                + rest
                    * (0.5
                        + rest
                            * (0.166_666_55
                                + rest
                                    * (0.041_665_795
                                        + rest * (0.008_333_452 + rest * 0.001_398_2)))));
    f32::from_bits((shifted.to_bits() << 23).wrapping_add(series.to_bits()))
}
