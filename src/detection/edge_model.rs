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
use wide::f32x8;

use crate::geometry::Corner;

const PARAMETERS: usize = 9;
/// Rounds on the thinned disc, and on the pixels that tell.
const ROUNDS: usize = 15;
const FINE_ROUNDS: usize = 6;
/// A corner that moves less is settled, on the thinned disc and in the end.
const ROUGH_PX: f64 = 0.02;
const SETTLED_PX: f64 = 3e-4;
/// Widest disc.
pub(super) const RADIUS_LIMIT_PX: i32 = 20;
/// No corner is known better than this: pixels are not points, nor printed squares perfect.
const SIGMA_FLOOR_PX: f64 = 0.008;

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
    /// Brightness of the light squares.
    pub(super) light: f64,
    /// Root mean square residual over the contrast.
    pub(super) residual: f64,
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
/// With `known_blur_px` the blur is not estimated, nor the light's gradient: for squares hardly larger
/// than the blur, whose own pixels do not tell them from the contrast.
///
/// `None` if the disc leaves the picture, or the fit runs away or stays poor.
pub(super) fn fit(
    image: &GrayImage,
    start: [f64; 2],
    axes_px: [[f64; 2]; 2],
    radius_px: i32,
    known_blur_px: Option<f64>,
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
    if let Some(blur_px) = known_blur_px {
        guess[4] = (blur_px * std::f64::consts::SQRT_2).ln();
    }
    let held: &[usize] = if known_blur_px.is_some() { &[4, 7, 8] } else { &[] };
    let (rough, _) = settle(coarse, guess, held, ROUNDS, ROUGH_PX)?;
    fine.gather_telling(&disc, &rough);
    let (at, now) = settle(fine, rough, held, FINE_ROUNDS, SETTLED_PX)?;
    let pixels = fine.count;
    let freedom = pixels as f64 - PARAMETERS as f64;
    let variance = now.cost / freedom;
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
    Some(EdgeFit { corner, blur_px, contrast, light: at[6] + contrast, residual })
}

fn first_guess(pixels: &Pixels, corner: [f64; 2], first_rad: f64, second_rad: f64) -> Vector {
    let each = || {
        pixels.groups.iter().flat_map(|[x, y, value, weight]| {
            let (x, y, value, weight) =
                (x.to_array(), y.to_array(), value.to_array(), weight.to_array());
            (0..8)
                .filter(move |lane| weight[*lane] > 0.0)
                .map(move |lane| [f64::from(x[lane]), f64::from(y[lane]), f64::from(value[lane])])
        })
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
        let next = evaluate(&tried);
        let moved = step[0].abs().max(step[1].abs());
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

/// Pixels of a disc, eight at a time; places left over have no weight.
#[derive(Clone, Debug, Default)]
struct Pixels {
    /// Offset from the disc's centre, brightness, weight.
    groups: Vec<[f32x8; 4]>,
    count: usize,
    lane: [[f32; 8]; 3],
}

/// Groups that are worked on together, so that their derivatives stay in the nearest cache.
const CHUNK: usize = 16;
const SUMS: usize = (PARAMETERS + 1) * (PARAMETERS + 2) / 2;

impl Pixels {
    fn gather(&mut self, disc: &Disc<'_>, wanted: impl Fn(i32, i32) -> bool) {
        self.groups.clear();
        self.count = 0;
        let radius_px = disc.radius_px;
        let (cx, cy) = disc.centre_px;
        let width = disc.image.width() as usize;
        let raw = disc.image.as_raw();
        for dy in -radius_px..=radius_px {
            let reach = ((radius_px * radius_px - dy * dy) as f32).sqrt() as i32;
            let row = (cy + dy) as usize * width;
            for dx in -reach..=reach {
                if wanted(dx, dy) {
                    let value = raw[row + (cx + dx) as usize];
                    self.push(dx as f32, dy as f32, f32::from(value));
                }
            }
        }
        self.flush();
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

    fn push(&mut self, dx: f32, dy: f32, value: f32) {
        let lane = self.count % 8;
        (self.lane[0][lane], self.lane[1][lane], self.lane[2][lane]) = (dx, dy, value);
        self.count += 1;
        if lane == 7 {
            self.groups.push([
                self.lane[0].into(),
                self.lane[1].into(),
                self.lane[2].into(),
                f32x8::ONE,
            ]);
        }
    }

    fn flush(&mut self) {
        let left = self.count % 8;
        if left > 0 {
            let weight = std::array::from_fn(|lane| if lane < left { 1.0 } else { 0.0 });
            let [x, y, value] = self.lane.map(f32x8::from);
            self.groups.push([x, y, value, f32x8::from(weight)]);
        }
    }

    /// Normal matrix, gradient and cost at `at`.
    ///
    /// Single precision, summed in a fixed order: the same bits on every machine.
    fn evaluate(&self, at: &Vector) -> Evaluated {
        let splat = |value: f64| f32x8::splat(value as f32);
        let (s1, c1) = (splat(at[2].sin()), splat(at[2].cos()));
        let (s2, c2) = (splat(at[3].sin()), splat(at[3].cos()));
        let (x0, y0) = (splat(at[0]), splat(at[1]));
        let inverse_s = splat((-at[4]).exp());
        let slope = inverse_s * f32x8::splat(std::f32::consts::FRAC_2_SQRT_PI);
        let (a, b, gx, gy) = (splat(at[5]), splat(at[6]), splat(at[7]), splat(at[8]));
        let mut sums = [f32x8::ZERO; SUMS];
        for chunk in self.groups.chunks(CHUNK) {
            let mut rows = [[f32x8::ZERO; CHUNK]; PARAMETERS + 1];
            for (k, [x, y, value, weight]) in chunk.iter().enumerate() {
                let (dx, dy) = (*x - x0, *y - y0);
                let d1 = dy * c1 - dx * s1;
                let d2 = dy * c2 - dx * s2;
                let (e1, bell1) = erf(d1 * inverse_s);
                let (e2, bell2) = erf(d2 * inverse_s);
                let (g1, g2) = (slope * bell1, slope * bell2);
                let light = (f32x8::ONE + gx * dx + gy * dy) * *weight;
                let product = e1 * e2;
                let pattern = (b + a * product) * *weight;
                let scaled = light * a;
                let (across1, across2) = (scaled * g1 * e2, scaled * e1 * g2);
                rows[0][k] = across1 * s1 + across2 * s2 - pattern * gx;
                rows[1][k] = -(across1 * c1 + across2 * c2) - pattern * gy;
                rows[2][k] = -across1 * (dx * c1 + dy * s1);
                rows[3][k] = -across2 * (dx * c2 + dy * s2);
                rows[4][k] = -(across1 * d1 + across2 * d2);
                rows[5][k] = light * product;
                rows[6][k] = light;
                rows[7][k] = pattern * dx;
                rows[8][k] = pattern * dy;
                rows[9][k] = *value * *weight - (b + a * product) * light;
            }
            let mut sum = sums.iter_mut();
            for i in 0..=PARAMETERS {
                for j in 0..=i {
                    let products = rows[i].iter().zip(&rows[j]);
                    let products = products.fold(f32x8::ZERO, |sum, (a, b)| sum + *a * *b);
                    if let Some(sum) = sum.next() {
                        *sum += products;
                    }
                }
            }
        }
        let mut totals = sums
            .iter()
            .map(|sum| sum.to_array().iter().fold(0.0, |total, lane| total + f64::from(*lane)));
        let mut next = || totals.next().unwrap_or(0.0);
        let mut normal_matrix = Matrix::zeros();
        for i in 0..PARAMETERS {
            for j in 0..=i {
                let value = next();
                (normal_matrix[(i, j)], normal_matrix[(j, i)]) = (value, value);
            }
        }
        let gradient = Vector::from_fn(|_, _| next());
        Evaluated { normal_matrix, gradient, cost: next() }
    }
}

struct Evaluated {
    normal_matrix: Matrix,
    gradient: Vector,
    cost: f64,
}

/// `erf(x)` to 3e-7 and `exp(−x²)`. Abramowitz & Stegun 7.1.26.
fn erf(x: f32x8) -> (f32x8, f32x8) {
    let size = x.abs();
    let bell = (-(size * size)).exp();
    let splat = f32x8::splat;
    let t = f32x8::ONE / (f32x8::ONE + splat(0.327_591_1) * size);
    let series = t
        * (splat(0.254_829_6)
            + t * (splat(-0.284_496_74)
                + t * (splat(1.421_413_7) + t * (splat(-1.453_152) + t * splat(1.061_405_4)))));
    ((f32x8::ONE - series * bell).copysign(x), bell)
}
