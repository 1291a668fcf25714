//! Fits a blurred ellipse to the full-size picture around a circle.
//!
//! ```text
//! I(v) = (b + a erf(d/s)) (1 + g·v),   d = (ρ − 1)/|∇ρ|,   ρ = |M v|
//! ```
//! `v`: offset from the ellipse's centre; `d`: distance from its outline, to first order; ten
//! parameters: centre, three of the triangular `M`, log of the blur `s`, contrast `a` (positive if
//! the ellipse is dark), mean `b`, gradient of the light. Except for the gradient, the model is
//! even about the centre. So even residuals (halos, the blur of a disc, an outline more bent than
//! the blur is wide) can't move the centre, and only the odd part counts in its covariance.

use image::GrayImage;
use nalgebra::{Matrix2, Point2, SMatrix, SVector, Vector2};

use super::{
    erf::erf,
    stated_noise::{Blocks, ROUNDING_VARIANCE, position_px2, with_least_noise_px2},
};
use boresight_geometry::{
    Corner,
    least_squares::{Limits, Linearised, Minimum, Problem, minimise},
};

const PARAMETERS: usize = 10;
type Vector = SVector<f64, PARAMETERS>;

const LIMITS: Limits =
    Limits { rounds: 25, first_damping: 1e-3, negligible_step: 1e-3, cost_rounding: 1e-7 };
/// Limits of `ln s`.
const LOG_BLUR: (f64, f64) = (-1.05, 2.3);
/// Sampling distance around the ellipse: as a share of the step to the nearest neighbour, in its
/// radii, and in pixels; and least number of pixels.
const REACH_STEPS: f64 = 0.5;
const REACH_RADII: f64 = 1.9;
const LEAST_BAND_PX: f64 = 3.0;
const LEAST_PIXELS: usize = 30;
/// Approximate number of sampled pixels away from the outline.
const PLAIN_PIXELS: f64 = 200.0;

/// Fitted ellipse.
#[derive(Clone, Copy, Debug)]
pub(super) struct DiscFit {
    /// Centre of the ellipse, not of the circle's image.
    pub(super) centre: Corner,
    at: Vector,
    /// Variance in squared grey levels of white noise with the same effect on the centre as the
    /// residuals.
    pub(super) noise: f64,
    /// Root mean square residual as a fraction of the contrast.
    pub(super) residual: f64,
}

impl DiscFit {
    /// Map of offsets in which the ellipse is a circle of radius 1.
    pub(super) fn to_circle(self) -> Matrix2<f64> {
        Matrix2::new(self.at[2], self.at[3], 0.0, self.at[4])
    }

    pub(super) fn blur_px(&self) -> f64 {
        libm::exp(self.at[5]) / std::f64::consts::SQRT_2
    }

    /// Half the brightness step in grey levels, positive for a dark ellipse.
    pub(super) fn step(&self) -> f64 {
        self.at[6]
    }

    /// Brightness of the lighter side in grey levels.
    pub(super) fn light(&self) -> f64 {
        self.at[7] + self.at[6].abs()
    }

    /// Fit with noise of at least the variance `least`: a few hundred pixels determine theirs to a
    /// tenth only.
    pub(super) fn with_least_noise(mut self, least: f64) -> Self {
        self.centre.covariance_px2 =
            with_least_noise_px2(self.centre.covariance_px2, self.noise, least);
        self
    }

    /// Sums, over the pixels near the outline, of the residual times the fourth harmonic of the
    /// angle on the board, and of that harmonic's square. The residual is a displacement of the
    /// outline in radii. A square has a fourth harmonic, a circle has none.
    pub(super) fn fourth_harmonic(
        &self,
        image: &GrayImage,
        circle_from_px: &Matrix2<f64>,
        scratch: &mut Pixels,
    ) -> [f64; 2] {
        let centre = self.centre.px;
        scratch.gather(image, [centre.x, centre.y], &self.to_circle(), REACH_RADII);
        let mut sums = [0.0; 2];
        let inverse_s = libm::exp(-self.at[5]);
        for (v, value) in scratch.each(&self.at) {
            let Some(model) = Model::at(&self.at, inverse_s, v) else { continue };
            let on_board = circle_from_px * v;
            let angle_rad = libm::atan2(on_board.y, on_board.x);
            // Change of the brightness if the outline moves outwards by a radius.
            let weight = -model.by_d / model.slope;
            let harmonic = weight * libm::cos(4.0 * angle_rad);
            sums[0] += (value - model.value) * harmonic;
            sums[1] += harmonic * harmonic;
        }
        sums
    }
}

/// Pixels around an ellipse.
#[derive(Clone, Debug, Default)]
pub(super) struct Pixels {
    centre: [i32; 2],
    /// Column and row from the centre, and brightness.
    pixels: Vec<[f32; 3]>,
    blocks: Blocks,
}

impl Pixels {
    /// Gathers all pixels near the outline, and some inside and outside, up to `reach` radii.
    fn gather(&mut self, image: &GrayImage, at: [f64; 2], to_circle: &Matrix2<f64>, reach: f64) {
        self.centre = at.map(|at| libm::round(at) as i32);
        self.pixels.clear();
        let (width, height) = (image.width() as i32, image.height() as i32);
        let Some(inverse) = to_circle.try_inverse() else { return };
        let shape = inverse * inverse.transpose();
        let half_px = [shape[(0, 0)], shape[(1, 1)]].map(|it| reach * it.sqrt() + 1.0);
        let half = half_px.map(|it| libm::ceil(it).min(400.0) as i32);
        let area_px2 = 4.0 * half_px[0] * half_px[1];
        let thin = libm::round((area_px2 / PLAIN_PIXELS).sqrt()).max(1.0) as i32;
        // No slope is steeper, so that most pixels need neither root.
        let band = LEAST_BAND_PX * to_circle.norm() + 1e-9;
        let near = (1.0 - band).max(0.0).powi(2)..(1.0 + band).powi(2);
        for dy in (-half[1]).max(-self.centre[1])..=half[1].min(height - 1 - self.centre[1]) {
            let row = (self.centre[1] + dy) as usize * width as usize;
            for dx in (-half[0]).max(-self.centre[0])..=half[0].min(width - 1 - self.centre[0]) {
                let v = Vector2::new(
                    f64::from(self.centre[0] + dx) - at[0],
                    f64::from(self.centre[1] + dy) - at[1],
                );
                let across = to_circle * v;
                let is_plain = dx % thin == 0 && dy % thin == 0;
                if !is_plain && !near.contains(&across.norm_squared()) {
                    continue;
                }
                let rho = across.norm();
                let slope = (to_circle.transpose() * across).norm() / rho.max(1e-9);
                let is_near = (rho - 1.0).abs() < LEAST_BAND_PX * slope;
                if rho < reach && (is_plain || is_near) {
                    let value = image.as_raw()[row + (self.centre[0] + dx) as usize];
                    self.pixels.push([dx as f32, dy as f32, f32::from(value)]);
                }
            }
        }
    }

    /// Offsets from the ellipse's centre, and brightness.
    fn each(&self, at: &Vector) -> impl Iterator<Item = (Vector2<f64>, f64)> {
        let (x, y) = (at[0], at[1]);
        self.pixels.iter().map(move |[dx, dy, value]| {
            (Vector2::new(f64::from(*dx) - x, f64::from(*dy) - y), f64::from(*value))
        })
    }
}

/// Model at a place.
struct Model {
    value: f64,
    /// Change per pixel of distance from the outline.
    by_d: f64,
    /// `|∇ρ|` and the direction of `∇ρ`.
    slope: f64,
    outwards: Vector2<f64>,
    across: Vector2<f64>,
    rho: f64,
    edge: f64,
    light: f64,
}

impl Model {
    /// Model with the given reciprocal of the blur `s`.
    fn at(at: &Vector, inverse_s: f64, v: Vector2<f64>) -> Option<Self> {
        let m = Matrix2::new(at[2], at[3], 0.0, at[4]);
        let across = m * v;
        let rho = across.norm();
        if rho < 1e-6 {
            return None;
        }
        let gradient = m.transpose() * across / rho;
        let slope = gradient.norm();
        let (edge, bell) = erf(((rho - 1.0) / slope * inverse_s) as f32);
        let (edge, bell) = (f64::from(edge), f64::from(bell));
        let light = 1.0 + at[8] * v.x + at[9] * v.y;
        let by_d = at[6] * light * bell * inverse_s * std::f64::consts::FRAC_2_SQRT_PI;
        let value = (at[7] + at[6] * edge) * light;
        let outwards = gradient / slope;
        Some(Self { value, by_d, slope, outwards, across, rho, edge, light })
    }
}

struct DiscProblem<'a>(&'a Pixels);

impl Problem<PARAMETERS> for DiscProblem<'_> {
    type State = Vector;
    type Extra = ();

    fn linearise(&self, at: &Vector) -> Option<Linearised<PARAMETERS>> {
        let (mut cost, mut gradient) = (0.0, Vector::zeros());
        let mut normal_matrix = SMatrix::<f64, PARAMETERS, PARAMETERS>::zeros();
        let inverse_s = libm::exp(-at[5]);
        for (v, value) in self.0.each(at) {
            let Some(model) = Model::at(at, inverse_s, v) else { continue };
            let Model { by_d, slope, outwards, across, rho, edge, light, .. } = model;
            let by_rho = by_d / slope / rho;
            let distance = (rho - 1.0) / slope;
            let row = Vector::from([
                -by_d * outwards.x - at[8] * (at[7] + at[6] * edge),
                -by_d * outwards.y - at[9] * (at[7] + at[6] * edge),
                by_rho * across.x * v.x,
                by_rho * across.x * v.y,
                by_rho * across.y * v.y,
                -by_d * distance,
                edge * light,
                light,
                (at[7] + at[6] * edge) * v.x,
                (at[7] + at[6] * edge) * v.y,
            ]);
            let residual = value - model.value;
            cost += residual * residual;
            gradient += row * residual;
            normal_matrix.syger(1.0, &row, &row, 1.0);
        }
        normal_matrix.fill_upper_triangle_with_lower_triangle();
        cost.is_finite().then_some(Linearised { cost, gradient, normal_matrix, extra: () })
    }

    fn moved(&self, at: &Vector, step: &Vector) -> Vector {
        let mut moved = at + step;
        moved[5] = moved[5].clamp(LOG_BLUR.0, LOG_BLUR.1);
        moved
    }

    fn noise_variance(&self, cost: f64) -> f64 {
        cost / degrees_of_freedom(self.0)
    }
}

fn degrees_of_freedom(pixels: &Pixels) -> f64 {
    (pixels.pixels.len() as f64 - PARAMETERS as f64).max(1.0)
}

/// Fits the ellipse near `start_px` with the approximate map `to_circle` to a circle of radius 1;
/// the nearest circle is `step` radii away. `None` if most of it lies outside of the picture, or if
/// the fit diverges or has no contrast.
pub(super) fn fit(
    image: &GrayImage,
    start_px: [f64; 2],
    to_circle: &Matrix2<f64>,
    step: f64,
    scratch: &mut Pixels,
) -> Option<DiscFit> {
    let reach = (REACH_STEPS * step).clamp(1.02, REACH_RADII);
    scratch.gather(image, start_px, to_circle, reach);
    let count = scratch.pixels.len();
    if count < LEAST_PIXELS {
        return None;
    }
    let centre = scratch.centre.map(f64::from);
    let mut guess = Vector::zeros();
    (guess[0], guess[1]) = (start_px[0] - centre[0], start_px[1] - centre[1]);
    // Upper triangle with the same product.
    let upper = (to_circle.transpose() * to_circle).cholesky()?.l().transpose();
    (guess[2], guess[3], guess[4]) = (upper[(0, 0)], upper[(0, 1)], upper[(1, 1)]);
    guess[5] = libm::log(1.5);
    let mut sides = [[0.0, 1e-9]; 2];
    for (v, value) in scratch.each(&guess) {
        let side = &mut sides[usize::from((to_circle * v).norm() > 1.0)];
        side[0] += value;
        side[1] += 1.0;
    }
    let [inner, outer] = sides.map(|[sum, count]| sum / count);
    (guess[6], guess[7]) = ((outer - inner) / 2.0, (outer + inner) / 2.0);
    let rough = minimise(&DiscProblem(scratch), guess, LIMITS)?.state;
    let m = Matrix2::new(rough[2], rough[3], 0.0, rough[4]);
    let middle = [centre[0] + rough[0], centre[1] + rough[1]];
    let moved_px = libm::hypot(middle[0] - start_px[0], middle[1] - start_px[1]);
    let radius_px = 1.0 / m.norm();
    if !(moved_px < radius_px.max(2.0)) || rough[6].abs() < 1.0 {
        return None;
    }
    // Around the fitted ellipse.
    scratch.gather(image, middle, &m, reach);
    let mut start = rough;
    let centre = scratch.centre.map(f64::from);
    (start[0], start[1]) = (middle[0] - centre[0], middle[1] - centre[1]);
    let count = scratch.pixels.len();
    if count < LEAST_PIXELS {
        return None;
    }
    let Minimum { state: at, at: linear, .. } = minimise(&DiscProblem(scratch), start, LIMITS)?;
    let residual = (linear.cost / count as f64).sqrt() / at[6].abs();
    let px = Point2::new(centre[0] + at[0], centre[1] + at[1]);
    let noise = noise(image, &at, scratch)?.max(ROUNDING_VARIANCE);
    let covariance = linear.normal_matrix.cholesky()?.inverse() * noise;
    let covariance_px2 = position_px2(&covariance);
    let is_sound = residual.is_finite() && covariance_px2.iter().all(|it| it.is_finite());
    (is_sound && at[2] * at[4] != 0.0).then_some(DiscFit {
        centre: Corner::new(px, covariance_px2),
        at,
        noise,
        residual,
    })
}

/// Variance of white noise with the same effect on the centre as the residuals, from the pixels
/// with a mirror image in the picture.
fn noise(image: &GrayImage, at: &Vector, scratch: &mut Pixels) -> Option<f64> {
    let mut blocks = std::mem::take(&mut scratch.blocks);
    let place = blocks.clear(scratch.each(at).map(|(v, _)| v.amax()).fold(0.0, f64::max));
    let [left, top] = scratch.centre.map(f64::from);
    let middle = Vector2::new(left + at[0], top + at[1]);
    let inverse_s = libm::exp(-at[5]);
    let is_inside = |at: f64, size: u32| (0.0..=f64::from(size - 1)).contains(&at);
    blocks.add(scratch.each(at).filter_map(|(v, value)| {
        let mirrored = middle - v;
        let model = Model::at(at, inverse_s, v)?;
        (is_inside(mirrored.x, image.width()) && is_inside(mirrored.y, image.height()))
            .then(|| ([place(v.x), place(v.y)], -model.by_d * model.outwards, value - model.value))
    }));
    let noise = blocks.noise(true);
    scratch.blocks = blocks;
    noise
}
