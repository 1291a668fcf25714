//! Pixels around a corner, and the residuals of the edge model.

use image::GrayImage;

use nalgebra::SVector;

use super::{
    erf::erf,
    patch::{Patch, RADIUS_LIMIT_PX},
    simd::{self, CHUNK, LANES, Row, add_products, linearised, total},
    stated_noise::Blocks,
};
use boresight_geometry::least_squares::Linearised;

/// Number of parameters of the edge model.
pub(super) const PARAMETERS: usize = 9;
pub(super) type Vector = SVector<f64, PARAMETERS>;
type Linear = Linearised<PARAMETERS>;

/// Pixels of a patch, padded with zero weight to a multiple of the lanes.
#[derive(Clone, Debug, Default)]
pub(super) struct Pixels {
    /// Offset from the patch's centre, brightness, weight.
    pub(super) x: Vec<f32>,
    pub(super) y: Vec<f32>,
    pub(super) value: Vec<f32>,
    weight: Vec<f32>,
    /// Light added to the brightness in place of markers' frames.
    frames: Vec<f32>,
    /// Residuals of the model's brightness.
    residuals: Vec<f32>,
    /// Derivative of the model's brightness by the corner's position, per pixel.
    by_x: Vec<f32>,
    by_y: Vec<f32>,
    blocks: Blocks,
    pub(super) count: usize,
}

/// Width of an array for a row of a patch.
const WIDEST: usize = 2 * RADIUS_LIMIT_PX as usize + 2;

impl Pixels {
    /// Gathers the `wanted` pixels of the patch in every row and column whose offset is a multiple
    /// of `step_px`.
    pub(super) fn gather(
        &mut self,
        image: &GrayImage,
        patch: &Patch,
        step_px: i32,
        wanted: impl Fn(i32, i32) -> bool,
    ) {
        for row in [&mut self.x, &mut self.y, &mut self.value, &mut self.weight] {
            row.clear();
        }
        self.frames.clear();
        simd::widest(Gathering(self, image, patch, step_px, wanted));
        self.count = self.x.len();
        let filled = self.count.next_multiple_of(LANES);
        self.weight.resize(self.count, 1.0);
        for row in [&mut self.x, &mut self.y, &mut self.value, &mut self.weight] {
            row.resize(filled, 0.0);
        }
    }

    /// Gathers all pixels near the edges, and a quarter of the others.
    pub(super) fn gather_informative(&mut self, image: &GrayImage, patch: &Patch, rough: &Vector) {
        let (s1, c1) = (libm::sin(rough[2]) as f32, libm::cos(rough[2]) as f32);
        let (s2, c2) = (libm::sin(rough[3]) as f32, libm::cos(rough[3]) as f32);
        let (x, y) = (rough[0] as f32, rough[1] as f32);
        let band_px = 2.2 * libm::exp(rough[4]) as f32 + 0.6;
        self.gather(image, patch, 1, move |dx, dy| {
            let (fx, fy) = (dx as f32 - x, dy as f32 - y);
            ((fy * c1 - fx * s1).abs() < band_px)
                | ((fy * c2 - fx * s2).abs() < band_px)
                | ((dx | dy) & 1 == 0)
        });
    }

    /// Adds the light taken away by the black frames of markers in the two light squares, for the
    /// edge model at `at`: dark beyond `gaps_px` from both edges, with the blur of the edges.
    /// Replaces earlier additions.
    pub(super) fn remove_frames(&mut self, at: &Vector, gaps_px: [f64; 2]) {
        self.frames.resize(self.x.len(), 0.0);
        simd::widest(RemovingFrames(self, at, gaps_px));
    }

    /// Cost, gradient and normal matrix at `at`, in squared grey levels.
    ///
    /// Single precision, summed in a fixed order: identical results on every machine.
    pub(super) fn linearise(&self, at: &Vector) -> Linear {
        simd::widest(Linearising(self, at))
    }

    /// Variance of white noise with the same effect on the corner of the model at `at` as the
    /// residuals, from the pixels with a mirror image in the patch; see [`Blocks::noise`].
    pub(super) fn noise(
        &mut self,
        image: &GrayImage,
        patch: &Patch,
        at: &Vector,
        is_even: bool,
    ) -> Option<f64> {
        for row in [&mut self.residuals, &mut self.by_x, &mut self.by_y] {
            row.resize(self.x.len(), 0.0);
        }
        simd::widest(Subtracting(self, image, patch, at));
        let Self { x, y, residuals, by_x, by_y, blocks, count, .. } = self;
        let rows = [&x[..*count], y, by_x, by_y, residuals];
        blocks.noise(([at[0], at[1]], RADIUS_LIMIT_PX), rows, is_even)
    }

    /// Gauss–Newton step of the logarithms of the blur of the two edges, all other parameters held.
    pub(super) fn split_step(&self, at: &Vector, log_s: [f64; 2]) -> [f64; 2] {
        simd::widest(Splitting(self, at, log_s))
    }
}

struct Gathering<'a, Wanted>(&'a mut Pixels, &'a GrayImage, &'a Patch, i32, Wanted);

impl<Wanted: Fn(i32, i32) -> bool> simd::Loop for Gathering<'_, Wanted> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self(Pixels { x, y, value, .. }, image, patch, step_px, wanted) = self;
        let (cx, cy) = patch.centre_px;
        let (width, height) = image.dimensions();
        let top = (-RADIUS_LIMIT_PX).max(-cy);
        let bottom = RADIUS_LIMIT_PX.min(height as i32 - 1 - cy);
        let from = |first: i32| first + (-first).rem_euclid(step_px);
        let (mut are_wanted, mut places, mut levels) = ([0; WIDEST], [0.0; WIDEST], [0.0; WIDEST]);
        for dy in (from(top)..=bottom).step_by(step_px as usize) {
            let row = (cy + dy) as usize * width as usize;
            let raw = &image.as_raw()[row..row + width as usize];
            for (first, last) in patch.runs(image, dy) {
                let first = from(first);
                let across = ((last + step_px - first) / step_px).max(0) as usize;
                // Overflow checks would prevent vectorisation.
                let at = |k: i32| first.wrapping_add(k.wrapping_mul(step_px));
                for (k, is_wanted) in (0_i32..).zip(&mut are_wanted[..across]) {
                    *is_wanted = u8::from(wanted(at(k), dy));
                }
                let mut count = 0;
                // Without branches: what isn't wanted is overwritten.
                for (k, is_wanted) in (0_i32..).zip(&are_wanted[..across]) {
                    places[count] = at(k) as f32;
                    levels[count] = f32::from(raw[cx.wrapping_add(at(k)) as usize]);
                    count += usize::from(*is_wanted);
                }
                x.extend_from_slice(&places[..count]);
                value.extend_from_slice(&levels[..count]);
                y.resize(x.len(), dy as f32);
            }
        }
    }
}

struct Linearising<'a>(&'a Pixels, &'a Vector);

impl simd::Loop for Linearising<'_> {
    type Output = Linear;

    #[inline(always)]
    fn run(self) -> Linear {
        let Self(pixels, at) = self;
        let [x0, y0, _, _, _, a, b, gx, gy] = std::array::from_fn(|i| at[i] as f32);
        let (s1, c1) = (libm::sin(at[2]) as f32, libm::cos(at[2]) as f32);
        let (s2, c2) = (libm::sin(at[3]) as f32, libm::cos(at[3]) as f32);
        let inverse_s = libm::exp(-at[4]) as f32;
        let slope = inverse_s * std::f32::consts::FRAC_2_SQRT_PI;
        let mut sums = [[[[[0.0; LANES]; 5]; 2]; 2]; 5];
        let mut rows: [Row; PARAMETERS + 1] = Default::default();
        for start in (0..pixels.x.len()).step_by(CHUNK) {
            let end = (start + CHUNK).min(pixels.x.len());
            let (x, y) = (&pixels.x[start..end], &pixels.y[start..end]);
            let (value, weight) = (&pixels.value[start..end], &pixels.weight[start..end]);
            let [r0, r1, r2, r3, r4, r5, r6, r7, r8, r9] =
                rows.each_mut().map(|row| row.0.as_flattened_mut());
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
            // Products of two rows by five: as many sums as there are registers.
            let (twos, fives) = (rows.as_chunks::<2>().0, rows.as_chunks::<5>().0);
            for (k, (two, sums)) in twos.iter().zip(&mut sums).enumerate() {
                for (five, sums) in fives.iter().zip(sums).take(1 + k / 2) {
                    add_products(two, five, end - start, sums);
                }
            }
        }
        let sum = |i: usize, j: usize| total(sums[i / 2][j / 5][i % 2][j % 5]);
        linearised(sum)
    }
}

/// Subtracts the model; the derivatives are zero without a mirror image.
struct Subtracting<'a>(&'a mut Pixels, &'a GrayImage, &'a Patch, &'a Vector);

impl simd::Loop for Subtracting<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self(pixels, image, patch, at) = self;
        let [x0, y0, _, _, _, a, b, gx, gy] = std::array::from_fn(|i| at[i] as f32);
        let (s1, c1) = (libm::sin(at[2]) as f32, libm::cos(at[2]) as f32);
        let (s2, c2) = (libm::sin(at[3]) as f32, libm::cos(at[3]) as f32);
        let inverse_s = libm::exp(-at[4]) as f32;
        let slope = a * inverse_s * std::f32::consts::FRAC_2_SQRT_PI;
        let size_px = [image.width() as f32, image.height() as f32];
        let places = pixels.x.iter().zip(&pixels.y).zip(&pixels.value);
        let changes = pixels.by_x.iter_mut().zip(&mut pixels.by_y);
        let into = pixels.residuals.iter_mut().zip(changes);
        for (((x, y), value), (residual, (by_x, by_y))) in places.zip(into) {
            let (dx, dy) = (x - x0, y - y0);
            let (e1, bell1) = erf((dy * c1 - dx * s1) * inverse_s);
            let (e2, bell2) = erf((dy * c2 - dx * s2) * inverse_s);
            *residual = value - (b + a * e1 * e2) * (1.0 + gx * dx + gy * dy);
            let slope = if patch.holds(size_px, [x0 - dx, y0 - dy]) { slope } else { 0.0 };
            let (across1, across2) = (slope * bell1 * e2, slope * e1 * bell2);
            *by_x = across1 * s1 + across2 * s2;
            *by_y = -(across1 * c1 + across2 * c2);
        }
    }
}

struct RemovingFrames<'a>(&'a mut Pixels, &'a Vector, [f64; 2]);

impl simd::Loop for RemovingFrames<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self(pixels, at, gaps_px) = self;
        let [x0, y0, _, _, _, a, _, gx, gy] = std::array::from_fn(|i| at[i] as f32);
        let (s1, c1) = (libm::sin(at[2]) as f32, libm::cos(at[2]) as f32);
        let (s2, c2) = (libm::sin(at[3]) as f32, libm::cos(at[3]) as f32);
        let (s2, c2) = (s2 * a.signum(), c2 * a.signum());
        let inverse_s = libm::exp(-at[4]) as f32;
        let [gap1, gap2] = gaps_px.map(|gap| gap as f32 * inverse_s);
        let mut row = [0.0_f32; CHUNK];
        for start in (0..pixels.x.len()).step_by(CHUNK) {
            let end = (start + CHUNK).min(pixels.x.len());
            let places = pixels.x[start..end].iter().zip(&pixels.y[start..end]);
            for ((x, y), frames) in places.zip(&mut row) {
                let (dx, dy) = (x - x0, y - y0);
                let d1 = (dy * c1 - dx * s1) * inverse_s;
                let d2 = (dy * c2 - dx * s2) * inverse_s;
                // Twice the share of a frame's darkness, across each edge to both sides.
                let above1 = 1.0 + erf(d1 - gap1).0;
                let below1 = 1.0 + erf(-d1 - gap1).0;
                let above2 = 1.0 + erf(d2 - gap2).0;
                let below2 = 1.0 + erf(-d2 - gap2).0;
                let light = 0.5 * a.abs() * (1.0 + gx * dx + gy * dy);
                *frames = light * (above1 * above2 + below1 * below2);
            }
            let added = pixels.frames[start..end].iter_mut().zip(&row);
            for (value, (added, frames)) in pixels.value[start..end].iter_mut().zip(added) {
                *value += frames - *added;
                *added = *frames;
            }
        }
    }
}

struct Splitting<'a>(&'a Pixels, &'a Vector, [f64; 2]);

impl simd::Loop for Splitting<'_> {
    type Output = [f64; 2];

    #[inline(always)]
    fn run(self) -> [f64; 2] {
        let Self(pixels, at, log_s) = self;
        let [x0, y0, _, _, _, a, b, gx, gy] = std::array::from_fn(|i| at[i] as f32);
        let (s1, c1) = (libm::sin(at[2]) as f32, libm::cos(at[2]) as f32);
        let (s2, c2) = (libm::sin(at[3]) as f32, libm::cos(at[3]) as f32);
        let inverse_s = log_s.map(|log_s| libm::exp(-log_s) as f32);
        let mut sums = [[[0.0; LANES]; 3]; 3];
        let mut rows: [Row; 3] = Default::default();
        for start in (0..pixels.x.len()).step_by(CHUNK) {
            let end = (start + CHUNK).min(pixels.x.len());
            let [r1, r2, r3] = rows.each_mut().map(|row| row.0.as_flattened_mut());
            let places = pixels.x[start..end].iter().zip(&pixels.y[start..end]);
            let seen = pixels.value[start..end].iter().zip(&pixels.weight[start..end]);
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
            add_products(&rows, &rows, end - start, &mut sums);
        }
        let [[n11, ..], [n12, n22, _], [g1, g2, _]] = sums.map(|row| row.map(total));
        let determinant = (n11 * n22 - n12 * n12).max(1e-9);
        [(n22 * g1 - n12 * g2) / determinant, (n11 * g2 - n12 * g1) / determinant]
    }
}

#[cfg(test)]
mod tests {
    use super::{super::simd::checks, *};

    /// Blurred corner at (20.3, 19.6), with noise.
    fn pixels() -> (Pixels, Vector) {
        let image = GrayImage::from_fn(41, 41, |x, y| {
            let (dx, dy) = (f64::from(x) - 20.3, f64::from(y) - 19.6);
            let step = (dx * 0.9 - dy * 0.2).tanh() * (dy * 0.9 + dx * 0.3).tanh();
            let noise = f64::from((x * 7919 + y * 104_729) % 13) - 6.0;
            image::Luma([(120.0 + 80.0 * step + noise) as u8])
        });
        let mut pixels = Pixels::default();
        let axes = [[40.0, 3.0], [-2.0, 40.0]];
        let patch = Patch::around([20.3, 19.6], axes, (0.45, 3.0), f64::INFINITY).expect("axes");
        pixels.gather(&image, &patch, 1, |_, _| true);
        let at = Vector::from([0.2, -0.5, 0.1, 1.4, 0.4, 75.0, 121.0, 1e-3, -2e-3]);
        (pixels, at)
    }

    #[test]
    fn every_vector_width_gives_the_same_bits() {
        let (pixels, at) = pixels();
        let widest = pixels.linearise(&at);
        let least = simd::Loop::run(Linearising(&pixels, &at));
        checks::are_the_same_bits(&widest, &least);
    }

    #[test]
    fn the_gradient_is_that_of_the_cost() {
        let (pixels, at) = pixels();
        let steps = [1e-2, 1e-2, 1e-3, 1e-3, 1e-2, 0.5, 0.5, 1e-3, 1e-3];
        checks::is_gradient_of_cost(|at| pixels.linearise(at), &at, steps, |_| 0.03);
    }
}
