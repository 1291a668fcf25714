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
use nalgebra::{Matrix2, Point2};

use super::{
    disc_pixels::{PARAMETERS, Pixels, Vector},
    stated_noise::{ROUNDING_VARIANCE, position_px2, with_least_noise_px2},
};
use boresight_geometry::{
    Corner,
    least_squares::{Limits, Linearised, Minimum, Problem, minimise},
};

/// Limits on the thinned pixels: to a third of the standard deviation, enough for a start.
const ROUGH: Limits =
    Limits { rounds: 25, first_damping: 1e-3, negligible_step: 0.1, cost_rounding: 1e-6 };
/// Limits on all pixels near the outline: to a thirtieth of a standard deviation. Sums have single
/// precision.
const FINE: Limits =
    Limits { rounds: 25, first_damping: 1e-3, negligible_step: 1e-3, cost_rounding: 1e-6 };
/// Limits of `ln s`.
const LOG_BLUR: (f64, f64) = (-1.05, 2.3);
/// Sampling distance around the ellipse: as a share of the step to the nearest neighbour, and in
/// its radii; and least number of pixels.
const REACH_STEPS: f64 = 0.5;
const REACH_RADII: f64 = 1.9;
const LEAST_PIXELS: usize = 30;
/// `1/|M|` from which every second row and column is enough for a start, in pixels.
const LARGE_PX: f64 = 6.0;

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

    /// Adds to `sums`, over the pixels near the outline, the residual times the fourth harmonic of
    /// the angle on the board, and that harmonic's square. The residual is a displacement of the
    /// outline in radii. A square has a fourth harmonic, a circle has none.
    pub(super) fn add_fourth_harmonic(
        &self,
        image: &GrayImage,
        px_from_board: &Matrix2<f64>,
        sums: &mut [f64; 2],
        scratch: &mut Pixels,
    ) {
        let Some(board_from_px) = px_from_board.try_inverse() else { return };
        let (centre, to_circle) = (self.centre.px, self.to_circle());
        let step_px = step_px(&to_circle);
        scratch.gather(image, [centre.x, centre.y], &to_circle, (REACH_RADII, step_px));
        for (v, residual, by_radius) in scratch.displacements(image, &self.at) {
            let on_board = board_from_px * v;
            let cosine2 = on_board.x * on_board.x / on_board.norm_squared().max(1e-12);
            let harmonic = by_radius * (8.0 * cosine2 * (cosine2 - 1.0) + 1.0);
            sums[0] += residual * harmonic;
            sums[1] += harmonic * harmonic;
        }
    }
}

struct DiscProblem<'a>(&'a Pixels);

impl Problem<PARAMETERS> for DiscProblem<'_> {
    type State = Vector;
    type Extra = ();

    fn linearise(&self, at: &Vector) -> Option<Linearised<PARAMETERS>> {
        let linear = self.0.linearise(at);
        linear.cost.is_finite().then_some(linear)
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
    (pixels.count as f64 - PARAMETERS as f64).max(1.0)
}

/// Step in rows and columns between the pixels of a rough fit.
fn step_px(to_circle: &Matrix2<f64>) -> i32 {
    if to_circle.norm() * LARGE_PX < 1.0 { 2 } else { 1 }
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
    scratch.gather(image, start_px, to_circle, (reach, step_px(to_circle)));
    if scratch.count < LEAST_PIXELS {
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
    let rough = minimise(&DiscProblem(scratch), guess, ROUGH)?.state;
    let m = Matrix2::new(rough[2], rough[3], 0.0, rough[4]);
    let middle = [centre[0] + rough[0], centre[1] + rough[1]];
    let moved_px = libm::hypot(middle[0] - start_px[0], middle[1] - start_px[1]);
    let radius_px = 1.0 / m.norm();
    if !(moved_px < radius_px.max(2.0)) || rough[6].abs() < 1.0 {
        return None;
    }
    // Around the fitted ellipse.
    scratch.gather(image, middle, &m, (reach, 1));
    let mut start = rough;
    let centre = scratch.centre.map(f64::from);
    (start[0], start[1]) = (middle[0] - centre[0], middle[1] - centre[1]);
    let count = scratch.count;
    if count < LEAST_PIXELS {
        return None;
    }
    let Minimum { state: at, at: linear, .. } = minimise(&DiscProblem(scratch), start, FINE)?;
    let residual = (linear.cost / count as f64).sqrt() / at[6].abs();
    let px = Point2::new(centre[0] + at[0], centre[1] + at[1]);
    let noise = scratch.noise(image, &at)?.max(ROUNDING_VARIANCE);
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
