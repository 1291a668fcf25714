//! Pixels around an ellipse, and the residuals of the disc model.

use image::GrayImage;
use nalgebra::{Matrix2, SVector, Vector2};

use super::{
    erf::erf,
    simd::{self, CHUNK, LANES, Row, add_products, linearised, total},
    stated_noise::Blocks,
};
use boresight_geometry::least_squares::Linearised;

/// Number of parameters of the disc model.
pub(super) const PARAMETERS: usize = 10;
pub(super) type Vector = SVector<f64, PARAMETERS>;
type Linear = Linearised<PARAMETERS>;

/// Parameters and residual, in whole fours.
const ROWS: usize = 12;
/// Half the width of the band along the outline.
const BAND_PX: f32 = 3.0;
/// Approximate number of sampled pixels away from the outline.
const PLAIN_PIXELS: f64 = 200.0;
/// Largest distance of a pixel along an axis.
const MOST_PX: i32 = 400;
/// Width of an array for a row of pixels.
const WIDEST: usize = 2 * MOST_PX as usize + 1;

/// Pixels around an ellipse, padded with zero weight to a multiple of the lanes.
#[derive(Clone, Debug, Default)]
pub(super) struct Pixels {
    /// Pixel that the places are counted from.
    pub(super) centre: [i32; 2],
    reach_px: i32,
    x: Vec<f32>,
    y: Vec<f32>,
    value: Vec<f32>,
    weight: Vec<f32>,
    /// Residuals of the model's brightness, and its changes as the outline moves: outwards by a
    /// radius, and by a pixel along x and y.
    residuals: Vec<f32>,
    by_radius: Vec<f32>,
    by_x: Vec<f32>,
    by_y: Vec<f32>,
    pub(super) count: usize,
    blocks: Blocks,
}

impl Pixels {
    /// Gathers the pixels near the outline in every column and row whose offset is a multiple of
    /// `step_px`, and some inside and outside, up to `reach` radii.
    pub(super) fn gather(
        &mut self,
        image: &GrayImage,
        at: [f64; 2],
        to_circle: &Matrix2<f64>,
        (reach, step_px): (f64, i32),
    ) {
        self.centre = at.map(|at| libm::round(at) as i32);
        for row in [&mut self.x, &mut self.y, &mut self.value, &mut self.weight] {
            row.clear();
        }
        self.count = 0;
        let Some(inverse) = to_circle.try_inverse() else { return };
        let shape = inverse * inverse.transpose();
        let half_px = [shape[(0, 0)], shape[(1, 1)]].map(|it| reach * it.sqrt() + 1.0);
        let plain_px = (4.0 * half_px[0] * half_px[1] / PLAIN_PIXELS).sqrt();
        let half = half_px.map(|it| libm::ceil(it).min(f64::from(MOST_PX)) as i32);
        self.reach_px = half[0].max(half[1]);
        simd::widest(Gathering {
            half,
            steps_px: [step_px, libm::round(plain_px).max(1.0) as i32],
            from_centre: std::array::from_fn(|axis| {
                (at[axis] - f64::from(self.centre[axis])) as f32
            }),
            pixels: self,
            image,
            to_circle,
            reach: reach as f32,
        });
        self.count = self.x.len();
        let filled = self.count.next_multiple_of(LANES);
        self.weight.resize(self.count, 1.0);
        for row in [&mut self.x, &mut self.y, &mut self.value, &mut self.weight] {
            row.resize(filled, 0.0);
        }
    }

    /// Offsets from the ellipse's centre, and brightness.
    pub(super) fn each(&self, at: &Vector) -> impl Iterator<Item = (Vector2<f64>, f64)> {
        let (x, y) = (at[0], at[1]);
        let places = self.x.iter().zip(&self.y).zip(&self.value).take(self.count);
        places.map(move |((dx, dy), value)| {
            (Vector2::new(f64::from(*dx) - x, f64::from(*dy) - y), f64::from(*value))
        })
    }

    /// Cost, gradient and normal matrix at `at`, in squared grey levels.
    ///
    /// Single precision, summed in a fixed order: identical results on every machine.
    pub(super) fn linearise(&self, at: &Vector) -> Linear {
        simd::widest(Linearising(self, at))
    }

    /// Offset from the ellipse's centre, residual, and change as the outline moves outwards by a
    /// radius, by the model at `at`.
    pub(super) fn displacements(
        &mut self,
        image: &GrayImage,
        at: &Vector,
    ) -> impl Iterator<Item = (Vector2<f64>, f64, f64)> {
        simd::widest(Subtracting(self, image, at));
        let changes = self.residuals.iter().zip(&self.by_radius);
        self.each(at)
            .zip(changes)
            .map(|((v, _), (residual, by_radius))| (v, f64::from(*residual), f64::from(*by_radius)))
    }

    /// Variance of white noise with the same effect on the centre of the model at `at` as the
    /// residuals, from the pixels with a mirror image in `image`; see [`Blocks::noise`].
    pub(super) fn noise(&mut self, image: &GrayImage, at: &Vector) -> Option<f64> {
        simd::widest(Subtracting(self, image, at));
        let Self { x, y, residuals, by_x, by_y, blocks, count, reach_px, .. } = self;
        let rows = [&x[..*count], y, by_x, by_y, residuals];
        blocks.noise(([at[0], at[1]], *reach_px), rows, true)
    }
}

/// The disc model in single precision.
struct Model {
    centre: [f32; 2],
    /// The triangular `M`.
    to_circle: [f32; 3],
    inverse_s: f32,
    /// Contrast, mean, and gradient of the light.
    contrast: f32,
    mean: f32,
    gradient: [f32; 2],
    /// Change of brightness per pixel at the outline.
    steepest: f32,
}

/// The model at a pixel.
struct Here {
    dx: f32,
    dy: f32,
    /// `M v`, its length `ρ`, and the gradient of that.
    across: f32,
    down: f32,
    rho: f32,
    up: [f32; 2],
    slope: f32,
    /// Distance from the outline.
    distance: f32,
    edge: f32,
    bell: f32,
    /// Brightness without and factor by the gradient of the light.
    pattern: f32,
    light: f32,
}

impl Model {
    #[inline(always)]
    fn of(at: &Vector) -> Self {
        let [x, y, m0, m1, m2, _, contrast, mean, gx, gy] = std::array::from_fn(|i| at[i] as f32);
        let inverse_s = libm::exp(-at[5]) as f32;
        Self {
            centre: [x, y],
            to_circle: [m0, m1, m2],
            inverse_s,
            contrast,
            mean,
            gradient: [gx, gy],
            steepest: contrast * inverse_s * std::f32::consts::FRAC_2_SQRT_PI,
        }
    }

    #[inline(always)]
    fn at(&self, x: f32, y: f32) -> Here {
        let ([m0, m1, m2], [gx, gy]) = (self.to_circle, self.gradient);
        let (dx, dy) = (x - self.centre[0], y - self.centre[1]);
        let (across, down) = (m0 * dx + m1 * dy, m2 * dy);
        let rho = (across * across + down * down).sqrt().max(1e-6);
        let up = [m0 * across / rho, (m1 * across + m2 * down) / rho];
        let slope = (up[0] * up[0] + up[1] * up[1]).sqrt().max(1e-9);
        let distance = (rho - 1.0) / slope;
        let (edge, bell) = erf(distance * self.inverse_s);
        let pattern = self.mean + self.contrast * edge;
        let light = 1.0 + gx * dx + gy * dy;
        Here { dx, dy, across, down, rho, up, slope, distance, edge, bell, pattern, light }
    }
}

struct Gathering<'a> {
    pixels: &'a mut Pixels,
    image: &'a GrayImage,
    to_circle: &'a Matrix2<f64>,
    /// Offset of the ellipse from the central pixel.
    from_centre: [f32; 2],
    half: [i32; 2],
    /// Steps between the pixels near the outline, and between the others.
    steps_px: [i32; 2],
    reach: f32,
}

impl simd::Loop for Gathering<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { pixels, image, to_circle, from_centre, half, steps_px, reach } = self;
        let [near_px, plain_px] = steps_px;
        let [[a, c], [b, d]]: [[f32; 2]; 2] = to_circle.map(|it| it as f32).into();
        let [cx, cy] = pixels.centre;
        let (width, height) = (image.width() as i32, image.height() as i32);
        let (left, right) = ((-half[0]).max(-cx), half[0].min(width - 1 - cx));
        if right < left {
            return;
        }
        let across = (right + 1 - left) as usize;
        let first = left as f32 - from_centre[0];
        let (mut columns, mut are_wanted) = ([0.0; WIDEST], [0_u8; WIDEST]);
        let (mut places, mut levels) = ([0.0; WIDEST], [0.0; WIDEST]);
        let (mut near, mut plain) = ([0_u8; WIDEST], [0_u8; WIDEST]);
        for (k, (column, (near, plain))) in
            (left..=right).zip(columns.iter_mut().zip(near.iter_mut().zip(&mut plain)))
        {
            *column = k as f32;
            (*near, *plain) = (u8::from(k % near_px == 0), u8::from(k % plain_px == 0));
        }
        let (xx, xy, yy) = (a * a + c * c, a * b + c * d, b * b + d * d);
        let band = BAND_PX * (xx + yy).sqrt();
        for dy in (-half[1]).max(-cy)..=half[1].min(height - 1 - cy) {
            let is_near_row = u8::from(dy % near_px == 0);
            let is_plain_row = u8::from(dy % plain_px == 0);
            if is_near_row + is_plain_row == 0 {
                continue;
            }
            let vy = dy as f32 - from_centre[1];
            // Last columns before the ends of the row through the ellipse of `rho` radii.
            let ends = |rho: f32| {
                let root = (xx * (rho * rho - yy * vy * vy) + xy * xy * vy * vy).max(0.0).sqrt();
                [-root, root].map(|root| (((root - xy * vy) / xx - first) as usize).min(across - 1))
            };
            let (outer, inner) = (ends((1.0 + band).min(reach)), ends((1.0 - band).max(0.0)));
            let runs = match is_plain_row {
                0 => [outer[0]..inner[0] + 1, inner[1].max(inner[0] + 1)..outer[1] + 1],
                _ => [0..across, 0..0],
            };
            let row = (cy + dy) as usize * width as usize + (cx + left) as usize;
            let raw = &image.as_raw()[row..row + across];
            for run in runs {
                let steps = near[run.clone()].iter().zip(&plain[run.clone()]);
                let wanted = are_wanted.iter_mut().zip(steps);
                for (column, (is_wanted, (near, plain))) in columns[run.clone()].iter().zip(wanted)
                {
                    let vx = column - from_centre[0];
                    let (x, y) = (a * vx + b * vy, c * vx + d * vy);
                    let rho2 = x * x + y * y;
                    let (up_x, up_y) = (a * x + c * y, b * x + d * y);
                    // |ρ − 1| < band · |∇ρ|
                    let apart = (rho2 - rho2.sqrt()).abs();
                    let band = BAND_PX * (up_x * up_x + up_y * up_y).sqrt();
                    let is_near = u8::from(apart < band) & near & is_near_row;
                    *is_wanted =
                        u8::from(rho2 < reach * reach) & (is_near | (plain & is_plain_row));
                }
                // Without branches: what isn't wanted is overwritten.
                let mut count = 0;
                let seen = columns[run.clone()].iter().zip(&raw[run]);
                for ((column, value), is_wanted) in seen.zip(&are_wanted) {
                    (places[count], levels[count]) = (*column, f32::from(*value));
                    count += usize::from(*is_wanted);
                }
                pixels.x.extend_from_slice(&places[..count]);
                pixels.value.extend_from_slice(&levels[..count]);
            }
            pixels.y.resize(pixels.x.len(), dy as f32);
        }
    }
}

struct Subtracting<'a>(&'a mut Pixels, &'a GrayImage, &'a Vector);

impl simd::Loop for Subtracting<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self(pixels, image, at) = self;
        let model = Model::of(at);
        let ends = [image.width(), image.height()].map(|size| size as f32 - 1.0);
        let [middle_x, middle_y] =
            std::array::from_fn(|axis| pixels.centre[axis] as f32 + model.centre[axis]);
        let is_inside = |at: f32, end: f32| (at >= 0.0) & (at <= end);
        let changes =
            [&mut pixels.residuals, &mut pixels.by_radius, &mut pixels.by_x, &mut pixels.by_y];
        let [residuals, by_radius, by_x, by_y] = changes.map(|row| {
            row.resize(pixels.x.len(), 0.0);
            row.iter_mut()
        });
        let places = pixels.x.iter().zip(&pixels.y).zip(&pixels.value);
        let into = residuals.zip(by_radius).zip(by_x.zip(by_y));
        for (((x, y), value), ((residual, by_radius), (by_x, by_y))) in places.zip(into) {
            let here = model.at(*x, *y);
            *residual = value - here.pattern * here.light;
            let by_distance = model.steepest * here.light * here.bell;
            *by_radius = -by_distance / here.slope;
            let has_mirrored =
                is_inside(middle_x - here.dx, ends[0]) & is_inside(middle_y - here.dy, ends[1]);
            let by_radius = if has_mirrored { *by_radius } else { 0.0 };
            *by_x = by_radius * here.up[0];
            *by_y = by_radius * here.up[1];
        }
    }
}

struct Linearising<'a>(&'a Pixels, &'a Vector);

impl simd::Loop for Linearising<'_> {
    type Output = Linear;

    #[inline(always)]
    fn run(self) -> Linear {
        let Self(pixels, at) = self;
        let model = Model::of(at);
        let [gx, gy] = model.gradient;
        let mut sums = [[[[[0.0; LANES]; 4]; 2]; ROWS / 4]; ROWS / 2];
        let mut rows: [Row; ROWS] = Default::default();
        for start in (0..pixels.x.len()).step_by(CHUNK) {
            let end = (start + CHUNK).min(pixels.x.len());
            let (x, y) = (&pixels.x[start..end], &pixels.y[start..end]);
            let (value, weight) = (&pixels.value[start..end], &pixels.weight[start..end]);
            let [r0, r1, r2, r3, r4, r5, r6, r7, r8, r9, left, _] =
                rows.each_mut().map(|row| row.0.as_flattened_mut());
            let places = x.iter().zip(y).zip(value.iter().zip(weight));
            let first = r0.iter_mut().zip(r1).zip(r2.iter_mut().zip(r3)).zip(r4.iter_mut().zip(r5));
            let second = r6.iter_mut().zip(r7).zip(r8.iter_mut().zip(r9)).zip(left.iter_mut());
            for (((x, y), (value, weight)), (first, second)) in places.zip(first.zip(second)) {
                let (((r0, r1), (r2, r3)), (r4, r5)) = first;
                let (((r6, r7), (r8, r9)), left) = second;
                let here = model.at(*x, *y);
                let Here { dx, dy, across, down, rho, up, slope, distance, edge, bell, .. } = here;
                let (light, pattern) = (here.light * weight, here.pattern * weight);
                let by_distance = model.steepest * light * bell;
                let by_rho = by_distance / (slope * rho);
                *r0 = -by_distance * up[0] / slope - gx * pattern;
                *r1 = -by_distance * up[1] / slope - gy * pattern;
                *r2 = by_rho * across * dx;
                *r3 = by_rho * across * dy;
                *r4 = by_rho * down * dy;
                *r5 = -by_distance * distance;
                *r6 = edge * light;
                *r7 = light;
                *r8 = pattern * dx;
                *r9 = pattern * dy;
                *left = value * weight - here.pattern * light;
            }
            // Products of two rows by four: as many sums as there are registers.
            let (twos, fours) = (rows.as_chunks::<2>().0, rows.as_chunks::<4>().0);
            for (k, (two, sums)) in twos.iter().zip(&mut sums).enumerate() {
                for (four, sums) in fours.iter().zip(sums).take(1 + k / 2) {
                    add_products(two, four, end - start, sums);
                }
            }
        }
        let sum = |i: usize, j: usize| total(sums[i / 2][j / 4][i % 2][j % 4]);
        linearised(sum)
    }
}

#[cfg(test)]
mod tests {
    use super::{super::simd::checks, *};

    /// Blurred ellipse at (20.3, 19.6), with noise.
    fn pixels() -> (Pixels, Vector) {
        let image = GrayImage::from_fn(41, 41, |x, y| {
            let (dx, dy) = (f64::from(x) - 20.3, f64::from(y) - 19.6);
            let rho = libm::hypot(dx / 11.0, dy / 8.0);
            let noise = f64::from((x * 7919 + y * 104_729) % 13) - 6.0;
            image::Luma([(120.0 + 80.0 * (7.0 * (rho - 1.0)).tanh() + noise) as u8])
        });
        let mut pixels = Pixels::default();
        let to_circle = Matrix2::new(1.0 / 11.0, 0.0, 0.0, 1.0 / 8.0);
        pixels.gather(&image, [20.3, 19.6], &to_circle, (1.9, 1));
        let at = [0.2, -0.5, 0.088, 0.004, 0.129, 0.4, 75.0, 121.0, 1e-3, -2e-3];
        (pixels, at.into())
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
        // The change of `|∇ρ|` with `M` is left out.
        let share = |i: usize| if (2..5).contains(&i) { 0.1 } else { 0.03 };
        let steps = [1e-2, 1e-2, 1e-4, 1e-4, 1e-4, 1e-2, 0.5, 0.5, 1e-3, 1e-3];
        checks::is_gradient_of_cost(|at| pixels.linearise(at), &at, steps, share);
    }
}
