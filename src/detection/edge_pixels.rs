//! The pixels around a corner, and how the edge model disagrees with them.

use image::GrayImage;

use super::{
    edge_model::{Matrix, PARAMETERS, Vector},
    simd,
};

/// A part of the picture around a corner: a parallelogram along the board's axes, within a circle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Patch {
    /// Pixel in its middle.
    pub(super) centre_px: (i32, i32),
    radius_px: i32,
    /// Squares along both axes per pixel of offset.
    board_from_px: [[f32; 2]; 2],
    /// Half its extent in squares.
    reach_squares: f32,
    /// Half its width across the narrower axis.
    pub(super) half_px: f64,
}

impl Patch {
    /// The pixels within `reach_squares` of `start` along the axes, in pixels per square, and within
    /// `radius_px`; at least ±`least_px`. `None` if the axes are no axes.
    pub(super) fn around(
        start: [f64; 2],
        [u, v]: [[f64; 2]; 2],
        (reach_squares, least_px, radius_px): (f64, f64, i32),
    ) -> Option<Self> {
        let area_px2 = u[0] * v[1] - u[1] * v[0];
        let height_px = area_px2.abs() / u[0].hypot(u[1]).max(v[0].hypot(v[1]));
        // Also refuses NaN.
        if !(height_px > 1.0) {
            return None;
        }
        let reach_squares = reach_squares.max(least_px / height_px);
        let inverse = [[v[1], -v[0]], [-u[1], u[0]]];
        Some(Self {
            centre_px: (start[0].round() as i32, start[1].round() as i32),
            radius_px,
            board_from_px: inverse.map(|row| row.map(|value| (value / area_px2) as f32)),
            reach_squares: reach_squares as f32,
            half_px: reach_squares * height_px,
        })
    }

    /// Pixels of the whole patch, wherever the picture ends.
    pub(super) fn area_px(&self) -> f64 {
        let [[a, b], [c, d]] = self.board_from_px.map(|row| row.map(f64::from));
        let parallelogram = (2.0 * f64::from(self.reach_squares)).powi(2) / (a * d - b * c).abs();
        parallelogram.min(std::f64::consts::PI * f64::from(self.radius_px).powi(2))
    }

    /// First and last offset of a row's pixels; empty if the last is smaller.
    fn row(&self, image: &GrayImage, dy: i32) -> (i32, i32) {
        let (cx, radius_px) = (self.centre_px.0, self.radius_px);
        let round = ((radius_px * radius_px - dy * dy) as f32).sqrt();
        let (mut low, mut high) = (-round, round);
        for [p, q] in self.board_from_px {
            let middle = -q * dy as f32 / p;
            let half = (self.reach_squares / p).abs();
            if half.is_finite() {
                (low, high) = (low.max(middle - half), high.min(middle + half));
            } else if (q * dy as f32).abs() > self.reach_squares {
                return (0, -1);
            }
        }
        let (low, high) = (low.ceil() as i32, high.floor() as i32);
        (low.max(-cx), high.min(image.width() as i32 - 1 - cx))
    }
}

/// Pixels of a patch, filled up to whole groups of lanes with some that have no weight.
#[derive(Clone, Debug, Default)]
pub(super) struct Pixels {
    /// Offset from the patch's centre, brightness, weight.
    pub(super) x: Vec<f32>,
    pub(super) y: Vec<f32>,
    pub(super) value: Vec<f32>,
    weight: Vec<f32>,
    pub(super) count: usize,
}

/// Sums run in so many lanes on every processor, so that all get the same bits.
const LANES: usize = 8;
/// Pixels that are worked on together, so that their derivatives stay in the nearest cache.
const CHUNK: usize = 16 * LANES;
const SUMS: usize = (PARAMETERS + 1) * (PARAMETERS + 2) / 2;

impl Pixels {
    pub(super) fn gather(
        &mut self,
        image: &GrayImage,
        patch: &Patch,
        wanted: impl Fn(i32, i32) -> bool,
    ) {
        for row in [&mut self.x, &mut self.y, &mut self.value, &mut self.weight] {
            row.clear();
        }
        let (cx, cy) = patch.centre_px;
        let (width, height) = image.dimensions();
        let top = (-patch.radius_px).max(-cy);
        let bottom = patch.radius_px.min(height as i32 - 1 - cy);
        for dy in top..=bottom {
            let (first, last) = patch.row(image, dy);
            let row = (cy + dy) as usize * width as usize;
            let raw = &image.as_raw()[row..row + width as usize];
            for dx in first..=last {
                if wanted(dx, dy) {
                    self.x.push(dx as f32);
                    self.y.push(dy as f32);
                    self.value.push(f32::from(raw[(cx + dx) as usize]));
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
    pub(super) fn gather_telling(&mut self, image: &GrayImage, patch: &Patch, rough: &Vector) {
        let (s1, c1) = (rough[2].sin() as f32, rough[2].cos() as f32);
        let (s2, c2) = (rough[3].sin() as f32, rough[3].cos() as f32);
        let (x, y) = (rough[0] as f32, rough[1] as f32);
        let band_px = 2.2 * rough[4].exp() as f32 + 0.6;
        self.gather(image, patch, |dx, dy| {
            let (fx, fy) = (dx as f32 - x, dy as f32 - y);
            (fy * c1 - fx * s1).abs() < band_px
                || (fy * c2 - fx * s2).abs() < band_px
                || (dx % 2 == 0 && dy % 2 == 0)
        });
    }

    /// Normal matrix, gradient and cost at `at`.
    ///
    /// Single precision, summed in a fixed order: the same bits on every machine.
    pub(super) fn evaluate(&self, at: &Vector) -> Evaluated {
        simd::widest(Evaluation { pixels: self, at })
    }

    /// Gauss–Newton step of the logarithms of the blur of the two edges, all else held.
    pub(super) fn split_step(&self, at: &Vector, log_s: [f64; 2]) -> [f64; 2] {
        simd::widest(Splitting { pixels: self, at, log_s })
    }

    #[inline(always)]
    fn split_step_here(&self, at: &Vector, log_s: [f64; 2]) -> [f64; 2] {
        let [x0, y0, _, _, _, a, b, gx, gy] = std::array::from_fn(|i| at[i] as f32);
        let (s1, c1) = (at[2].sin() as f32, at[2].cos() as f32);
        let (s2, c2) = (at[3].sin() as f32, at[3].cos() as f32);
        let inverse_s = log_s.map(|log_s| (-log_s).exp() as f32);
        let mut sums = [[0.0_f32; LANES]; 5];
        let mut rows = [[0.0_f32; CHUNK]; 3];
        for start in (0..self.x.len()).step_by(CHUNK) {
            let end = (start + CHUNK).min(self.x.len());
            let [r1, r2, r3] = &mut rows;
            let places = self.x[start..end].iter().zip(&self.y[start..end]);
            let seen = self.value[start..end].iter().zip(&self.weight[start..end]);
            let out = r1.iter_mut().zip(r2).zip(r3.iter_mut());
            for (((x, y), (value, weight)), ((r1, r2), r3)) in places.zip(seen).zip(out) {
                let (dx, dy) = (x - x0, y - y0);
                let d1 = (dy * c1 - dx * s1) * inverse_s[0];
                let d2 = (dy * c2 - dx * s2) * inverse_s[1];
                let (e1, bell1) = erf(d1);
                let (e2, bell2) = erf(d2);
                let light = (1.0 + gx * dx + gy * dy) * weight;
                let scaled = -light * a * std::f32::consts::FRAC_2_SQRT_PI;
                *r1 = scaled * bell1 * e2 * d1;
                *r2 = scaled * e1 * bell2 * d2;
                *r3 = value * weight - (b + a * e1 * e2) * light;
            }
            for (sum, (i, j)) in sums.iter_mut().zip([(0, 0), (0, 1), (1, 1), (0, 2), (1, 2)]) {
                add_products(&rows[i][..end - start], &rows[j][..end - start], sum);
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
            add_products(off, &off[1..], &mut next);
            let mut sum = sums.iter_mut();
            for i in 0..=PARAMETERS {
                for j in 0..=i {
                    let Some(sum) = sum.next() else { break };
                    add_products(&rows[i][..end - start], &rows[j][..end - start], sum);
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
        self.pixels.split_step_here(self.at, self.log_s)
    }
}

pub(super) struct Evaluated {
    pub(super) normal_matrix: Matrix,
    pub(super) gradient: Vector,
    /// Sum of the squared residuals.
    pub(super) cost: f64,
    /// Sum of the products of each residual and the next one in the row.
    pub(super) next_products: f64,
}

/// Adds the products of two rows, lane by lane.
#[inline(always)]
fn add_products(one: &[f32], two: &[f32], sum: &mut [f32; LANES]) {
    let mut total = *sum;
    for (one, two) in one.chunks_exact(LANES).zip(two.chunks_exact(LANES)) {
        for lane in 0..LANES {
            total[lane] += one[lane] * two[lane];
        }
    }
    *sum = total;
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

#[cfg(test)]
mod tests {
    use super::*;

    /// A corner at (20.3, 19.6), blurred, with noise.
    fn pixels() -> (Pixels, Vector) {
        let image = GrayImage::from_fn(41, 41, |x, y| {
            let (dx, dy) = (f64::from(x) - 20.3, f64::from(y) - 19.6);
            let step = (dx * 0.9 - dy * 0.2).tanh() * (dy * 0.9 + dx * 0.3).tanh();
            let noise = f64::from((x * 7919 + y * 104_729) % 13) - 6.0;
            image::Luma([(120.0 + 80.0 * step + noise) as u8])
        });
        let mut pixels = Pixels::default();
        let axes = [[40.0, 3.0], [-2.0, 40.0]];
        let patch = Patch::around([20.3, 19.6], axes, (0.45, 3.0, 20)).expect("axes");
        pixels.gather(&image, &patch, |_, _| true);
        let at = Vector::from([0.2, -0.5, 0.1, 1.4, 0.4, 75.0, 121.0, 1e-3, -2e-3]);
        (pixels, at)
    }

    #[test]
    fn every_vector_width_gives_the_same_bits() {
        let (pixels, at) = pixels();
        let widest = pixels.evaluate(&at);
        let least = simd::Loop::run(Evaluation { pixels: &pixels, at: &at });
        assert_eq!(widest.cost.to_bits(), least.cost.to_bits());
        assert_eq!(widest.next_products.to_bits(), least.next_products.to_bits());
        assert_eq!(widest.normal_matrix.map(f64::to_bits), least.normal_matrix.map(f64::to_bits));
        assert_eq!(widest.gradient.map(f64::to_bits), least.gradient.map(f64::to_bits));
    }

    #[test]
    fn the_gradient_is_that_of_the_cost() {
        let (pixels, at) = pixels();
        let analytic = pixels.evaluate(&at).gradient;
        for i in 0..PARAMETERS {
            let step = [1e-2, 1e-2, 1e-3, 1e-3, 1e-2, 0.5, 0.5, 1e-3, 1e-3][i];
            let cost = |sign: f64| {
                let mut moved = at;
                moved[i] += sign * step;
                pixels.evaluate(&moved).cost
            };
            // The gradient of the fit is −½ dcost/dparameter.
            let numeric = -(cost(1.0) - cost(-1.0)) / (4.0 * step);
            let size = analytic[i].abs().max(0.02 * analytic.amax());
            assert!((numeric - analytic[i]).abs() < 0.03 * size, "{i}: {numeric} {}", analytic[i]);
        }
    }

    #[test]
    fn erf_and_its_bell_are_right_to_single_precision() {
        for k in -60..=60 {
            let x = f64::from(k) * 0.1;
            let (value, bell) = erf(x as f32);
            assert!((f64::from(value) - statrs::function::erf::erf(x)).abs() < 1e-6, "erf({x})");
            assert!((f64::from(bell) - (-x * x).exp()).abs() < 3e-7, "exp(-{x}^2)");
        }
    }
}
