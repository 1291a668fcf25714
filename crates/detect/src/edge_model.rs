//! Fits two blurred edges to the full-size picture around a corner.
//!
//! ```text
//! I(x, y) = (b + a erf(d1/s) erf(d2/s)) (1 + gx dx + gy dy)
//! ```
//! `d1`, `d2`: signed distances from the two edge lines through the corner; nine parameters:
//! corner, two directions, log of the blur `s`, contrast `a`, mean `b`, gradient of the light.
//! Levenberg–Marquardt over a patch that reaches almost halfway into the four (sheared) squares
//! around the corner. The covariance of the corner is `σ² (JᵀJ)⁻¹` with `σ²` from the part of the
//! residuals that can move the corner (`edge_pixels`), so clutter and noise both count, but not
//! halos or a blur that isn't Gaussian.
//!
//! Assumes that edges are straight within the patch and blurred by a Gaussian.

use image::GrayImage;
use nalgebra::Point2;

use super::{
    edge_pixels::{PARAMETERS, Pixels, Vector},
    patch::Patch,
    stated_noise::{ROUNDING_VARIANCE, position_px2, with_least_noise_px2},
};
use boresight_geometry::{
    Corner,
    least_squares::{Limits, Linearised, Minimum, Problem, minimise},
};

/// Limits on the thinned patch: to a third of the standard deviation, enough for a start.
const ROUGH: Limits =
    Limits { rounds: 15, first_damping: 1e-3, negligible_step: 0.1, cost_rounding: 1e-6 };
/// Limits on the pixels near the edges: to a thirtieth of a standard deviation. Sums have single
/// precision.
const FINE: Limits =
    Limits { rounds: 8, first_damping: 1e-3, negligible_step: 1e-3, cost_rounding: 1e-6 };
/// Limits of `ln s`: a blur of a quarter of a pixel is a step to a camera; one of eight pixels
/// hides the corner.
const LOG_BLUR: (f64, f64) = (-1.05, 2.08);
/// Gauss–Newton steps to separate the blur of the two edges.
const SPLIT_ROUNDS: usize = 3;
/// Reach of the patch to each side of the corner, in squares, and limits in pixels.
const REACH_SQUARES: f64 = 0.48;
const LEAST_REACH_PX: f64 = 3.0;
/// Used share of the gap between a square's edge and the marker.
const BAND_SHARE: f64 = 0.9;
/// Least fraction of the patch inside the picture.
const LEAST_VISIBLE: f64 = 0.5;
/// Least distance from the edge of the picture: a closer corner isn't visible from all sides.
const MARGIN_PX: f64 = 2.0;
/// Least number of pixels for a rough fit of a patch with bands.
const ROUGH_PIXELS: f64 = 60.0;
/// Least number of pixels: fewer don't determine nine parameters well.
const LEAST_PIXELS: usize = 24;

/// Fitted corner.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct EdgeFit {
    pub(super) corner: Corner,
    /// Root mean square residual as a fraction of the contrast.
    pub(super) residual: f64,
    /// Variance in squared grey levels of white noise with the same effect on the corner as the
    /// residuals.
    pub(super) noise: f64,
    /// The nine parameters and the patch.
    at: Vector,
    patch: Patch,
}

impl EdgeFit {
    /// Standard deviation of the Gaussian blur: `erf(d/s)` is a step blurred by a Gaussian of
    /// `s/√2`.
    pub(super) fn blur_px(&self) -> f64 {
        libm::exp(self.at[4]) / std::f64::consts::SQRT_2
    }

    /// Fit with noise of at least the variance `least`. A few hundred pixels determine their noise
    /// to a tenth or a fifth only, and noise below the board's usual level is chance.
    pub(super) fn with_least_noise(mut self, least: f64) -> Self {
        self.corner.covariance_px2 =
            with_least_noise_px2(self.corner.covariance_px2, self.noise, least);
        self
    }

    /// Half the brightness step in grey levels, positive if the squares between the two axes are
    /// light.
    pub(super) fn step(&self) -> f64 {
        self.at[5]
    }

    /// Half the brightness step in grey levels.
    pub(super) fn contrast(&self) -> f64 {
        self.step().abs()
    }

    /// Mean squared distance from the corner, along the first and the second edge, of the pixels
    /// that determine the edges. Pixels carry less information near the corner, where the other
    /// edge hides this one: their weight is `erf(t/a)²` at the distance `t`, up to the end of the
    /// patch.
    pub(super) fn mean_squared_reach_px2(&self) -> [f64; 2] {
        /// `∫(1 − erf²)` and `∫x² (1 − erf²)` from zero to infinity.
        const HIDDEN: (f64, f64) = (0.797_885, 0.332_452);
        /// Mean squared distance, in units of the squared reach, if the other edge's blur hides the
        /// whole edge.
        const ALL_HIDDEN: f64 = 0.6;
        let hidden_px = libm::exp(self.at[4]) / libm::sin(self.at[3] - self.at[2]).abs().max(0.1);
        self.patch.reach_px().map(|reach_px| {
            let length_px = reach_px - HIDDEN.0 * hidden_px;
            let most_px2 = ALL_HIDDEN * reach_px * reach_px;
            if length_px <= 0.3 * reach_px {
                return most_px2;
            }
            ((reach_px.powi(3) / 3.0 - HIDDEN.1 * hidden_px.powi(3)) / length_px).min(most_px2)
        })
    }

    /// Brightness of the light squares in grey levels.
    pub(super) fn light(&self) -> f64 {
        self.at[6] + self.contrast()
    }
}

/// Variances in px² of the Gaussian blurs of the first and the second edge, fitted separately.
pub(super) fn edge_variances_px2(
    image: &GrayImage,
    fit: &EdgeFit,
    scratch: &mut Scratch,
) -> [f64; 2] {
    let pixels = &mut scratch.fine;
    pixels.gather_informative(image, &fit.patch, &fit.at);
    let mut log_s = [fit.at[4]; 2];
    for _ in 0..SPLIT_ROUNDS {
        let step = pixels.split_step(&fit.at, log_s);
        for k in 0..2 {
            log_s[k] = (log_s[k] + step[k].clamp(-0.5, 0.5)).clamp(-1.6, 2.5);
        }
    }
    log_s.map(|log_s| 0.5 * libm::exp(2.0 * log_s))
}

/// Knowledge about the rest of the board for a fit. If squares are hardly larger than the blur,
/// their pixels alone can't separate blur, contrast and directions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Known {
    Nothing,
    /// Standard deviation of the Gaussian blur in pixels.
    Blur(f64),
    /// Blur as in [`Self::Blur`], and edges along the board's axes.
    BlurAndEdges(f64),
}

/// Buffers of the fit, reused between corners and frames.
#[derive(Clone, Debug, Default)]
pub(super) struct Scratch {
    coarse: Pixels,
    fine: Pixels,
}

/// Fits a corner near `start`, with the board's axes `u` and `v` there in pixels per square.
///
/// If there are markers in the light squares, `gap_squares` away from their edges, only pixels in
/// the gaps are used, after removing the blur of the markers' black frames. The gap is infinite on
/// a plain board.
///
/// First uses a quarter or a ninth of the patch's pixels, then the informative ones: all pixels
/// near the edges, a quarter of the others. Parameters given by [`Known`] are held fixed, together
/// with the gradient of the light.
///
/// `None` if the corner or most of the patch lies outside the picture, or if the fit diverges or
/// has no contrast.
pub(super) fn fit(
    image: &GrayImage,
    start: [f64; 2],
    axes_px: [[f64; 2]; 2],
    gap_squares: f64,
    known: Known,
    scratch: &mut Scratch,
) -> Option<EdgeFit> {
    let limits = (REACH_SQUARES, LEAST_REACH_PX);
    let patch = Patch::around(start, axes_px, limits, BAND_SHARE * gap_squares)?;
    let centre = [f64::from(patch.centre_px.0), f64::from(patch.centre_px.1)];
    let Scratch { coarse, fine } = scratch;
    let thin = thinning(&patch);
    coarse.gather(image, &patch, thin, |_, _| true);
    let whole = patch.area_px() / f64::from(thin * thin);
    if coarse.count < LEAST_PIXELS || (coarse.count as f64) < LEAST_VISIBLE * whole {
        return None;
    }
    let [u, v] = axes_px;
    let begin = [start[0] - centre[0], start[1] - centre[1]];
    let mut guess = first_guess(coarse, begin, libm::atan2(u[1], u[0]), libm::atan2(v[1], v[0]));
    let (known_blur_px, held): (_, &[usize]) = match known {
        Known::Nothing => (None, &[]),
        Known::Blur(blur_px) => (Some(blur_px), &[4, 7, 8]),
        Known::BlurAndEdges(blur_px) => (Some(blur_px), &[2, 3, 4, 7, 8]),
    };
    if let Some(blur_px) = known_blur_px {
        guess[4] = libm::log(blur_px * std::f64::consts::SQRT_2);
    }
    let rough = minimise(&EdgeProblem { pixels: coarse, held }, guess, ROUGH)?.state;
    fine.gather_informative(image, &patch, &rough);
    let mut start = rough;
    if patch.has_bands() {
        let area_px2 = (u[0] * v[1] - u[1] * v[0]).abs();
        let gaps_px = [u, v].map(|axis| gap_squares * area_px2 / libm::hypot(axis[0], axis[1]));
        // The light of the frames depends on the corner's place, and the place on that light.
        fine.remove_frames(&rough, gaps_px);
        start = minimise(&EdgeProblem { pixels: fine, held }, rough, ROUGH)?.state;
        fine.remove_frames(&start, gaps_px);
    }
    let Minimum { state: at, at: linear, .. } =
        minimise(&EdgeProblem { pixels: fine, held }, start, FINE)?;
    let moved = libm::hypot(at[0] - begin[0], at[1] - begin[1]);
    let contrast = at[5].abs();
    let residual = (linear.cost / fine.count as f64).sqrt() / contrast;
    if !(moved < 0.5 * patch.half_px && residual.is_finite() && contrast > 1.0) {
        return None;
    }
    // At its limits, the blur isn't that of the edges, and the fit isn't at the least residuals.
    let is_least = LOG_BLUR.0 < at[4] && at[4] < LOG_BLUR.1;
    let white = linear.cost / degrees_of_freedom(fine);
    let noise = fine.noise(image, &patch, &at, is_least).unwrap_or(white).max(ROUNDING_VARIANCE);
    let covariance = linear.normal_matrix.cholesky()?.inverse() * noise;
    let inside = |at: f64, size: u32| at >= MARGIN_PX && at <= f64::from(size) - 1.0 - MARGIN_PX;
    if !(inside(centre[0] + at[0], image.width()) && inside(centre[1] + at[1], image.height())) {
        return None;
    }
    let px = Point2::new(centre[0] + at[0], centre[1] + at[1]);
    let corner = Corner::new(px, position_px2(&covariance));
    Some(EdgeFit { corner, residual, noise, at, patch })
}

/// Step in rows and columns between the pixels of the rough fit. Bands keep at least two pixels
/// across.
fn thinning(patch: &Patch) -> i32 {
    let most = match patch.half_px {
        half if half > 13.0 => 3,
        half if half > 6.5 => 2,
        _ => 1,
    };
    let is_enough = |thin: &i32| {
        let thin = f64::from(*thin);
        !patch.has_bands()
            || (patch.band_px() >= thin && patch.area_px() >= ROUGH_PIXELS * thin * thin)
    };
    (2..=most).rev().find(is_enough).unwrap_or(1)
}

fn first_guess(pixels: &Pixels, corner: [f64; 2], first_rad: f64, second_rad: f64) -> Vector {
    let each = || {
        let places = pixels.x.iter().zip(&pixels.y).zip(&pixels.value).take(pixels.count);
        places.map(|((x, y), value)| [f64::from(*x), f64::from(*y), f64::from(*value)])
    };
    let count = pixels.count as f64;
    let mean = each().map(|[_, _, value]| value).sum::<f64>() / count;
    let (s1, c1) = libm::sincos(first_rad);
    let (s2, c2) = libm::sincos(second_rad);
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
        libm::log(1.5_f64),
        contrast,
        mean,
        0.0,
        0.0,
    ])
}

/// Edge model on the pixels of a patch.
struct EdgeProblem<'a> {
    pixels: &'a Pixels,
    /// Indices of fixed parameters.
    held: &'a [usize],
}

impl Problem<PARAMETERS> for EdgeProblem<'_> {
    type State = Vector;
    type Extra = ();

    fn linearise(&self, at: &Vector) -> Option<Linearised<PARAMETERS>> {
        let mut linear = self.pixels.linearise(at);
        for &i in self.held {
            linear.normal_matrix.row_mut(i).fill(0.0);
            linear.normal_matrix.column_mut(i).fill(0.0);
            linear.normal_matrix[(i, i)] = 1.0;
            linear.gradient[i] = 0.0;
        }
        linear.cost.is_finite().then_some(linear)
    }

    fn moved(&self, at: &Vector, step: &Vector) -> Vector {
        let mut moved = at + step;
        moved[4] = moved[4].clamp(LOG_BLUR.0, LOG_BLUR.1);
        moved
    }

    fn noise_variance(&self, cost: f64) -> f64 {
        cost / degrees_of_freedom(self.pixels)
    }
}

fn degrees_of_freedom(pixels: &Pixels) -> f64 {
    (pixels.count as f64 - PARAMETERS as f64).max(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Blurred corner at (20.3, 19.6) on squares of 12 px, with noise.
    fn picture() -> GrayImage {
        GrayImage::from_fn(41, 41, |x, y| {
            let (dx, dy) = (f64::from(x) - 20.3, f64::from(y) - 19.6);
            let step =
                ((dx * 0.98 - dy * 0.2) * 0.5).tanh() * ((dy * 0.95 + dx * 0.3) * 0.5).tanh();
            let noise = f64::from((x * 7919 + y * 104_729) % 13) - 6.0;
            image::Luma([(120.0 + 80.0 * step + noise) as u8])
        })
    }

    #[test]
    fn covariance_blur_and_residual_are_of_the_fitted_parameters() {
        let (image, axes_px) = (picture(), [[12.0, 2.0], [-3.0, 12.0]]);
        let limits = (REACH_SQUARES, LEAST_REACH_PX);
        let patch = Patch::around([20.0, 20.0], axes_px, limits, f64::INFINITY).expect("axes");
        let mut pixels = Pixels::default();
        pixels.gather(&image, &patch, 1, |_, _| true);
        let start = first_guess(&pixels, [0.0, 0.0], 0.1, 1.8);
        for limits in [ROUGH, FINE] {
            let problem = EdgeProblem { pixels: &pixels, held: &[] };
            let Minimum { state, at, .. } = minimise(&problem, start, limits).expect("a fit");
            let again = pixels.linearise(&state);
            assert_eq!(at.cost.to_bits(), again.cost.to_bits());
            assert_eq!(at.normal_matrix, again.normal_matrix);
        }
    }

    #[test]
    fn the_fit_ends_where_no_parameter_has_far_to_go() {
        let image = picture();
        let axes_px = [[12.0, 2.0], [-3.0, 12.0]];
        let mut scratch = Scratch::default();
        let fit = fit(&image, [20.0, 20.0], axes_px, f64::INFINITY, Known::Nothing, &mut scratch)
            .expect("a fit");
        let linear = scratch.fine.linearise(&fit.at);
        let covariance = linear.normal_matrix.cholesky().expect("definite").inverse();
        let variance = linear.cost / degrees_of_freedom(&scratch.fine);
        let step = covariance * linear.gradient;
        for i in 0..PARAMETERS {
            let sd = (variance * covariance[(i, i)]).sqrt();
            assert!(step[i].abs() < 0.02 * sd, "parameter {i}: {} of {sd}", step[i]);
        }
    }

    /// Halos by sharpening or the blur of a disc are outside the model. Both sides of an edge are
    /// alike, so they don't move the corner, and mustn't make it less certain.
    #[test]
    fn the_stated_error_is_the_true_one_whatever_the_edges_look_like() {
        let blurred = |d: f64| (0.55 * d).tanh();
        let haloed = |d: f64| (0.9 * d).tanh() * (1.0 + 0.35 * (-0.12 * d * d).exp());
        let boxed = |d: f64| (d / 3.5).clamp(-1.0, 1.0);
        let profiles: [(&str, &dyn Fn(f64) -> f64); 3] =
            [("blurred", &blurred), ("with halos", &haloed), ("by a disc", &boxed)];
        let mut seed = 1_u64;
        let mut uniform = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (seed >> 40) as f64 / f64::from(1 << 24)
        };
        let mut scratch = Scratch::default();
        for (name, edge) in profiles {
            let (mut squares, mut count) = (0.0, 0.0);
            for _ in 0..60 {
                let at = [20.0 + uniform(), 20.0 + uniform()];
                let image = GrayImage::from_fn(41, 41, |x, y| {
                    let (dx, dy) = (f64::from(x) - at[0], f64::from(y) - at[1]);
                    let step = edge(dy * 0.98 - dx * 0.2) * edge(dy * 0.29 + dx * 0.957);
                    // Approximately normal.
                    let noise = 2.5 * (0..12).map(|_| uniform() - 0.5).sum::<f64>();
                    image::Luma([(125.0 + 70.0 * step + noise).round() as u8])
                });
                let axes_px = [[14.7, 3.0], [-4.2, 14.0]];
                let fit =
                    fit(&image, [20.5, 20.5], axes_px, f64::INFINITY, Known::Nothing, &mut scratch);
                let corner = fit.expect("a fit").corner;
                let off_px = corner.px - Point2::from(at);
                squares += off_px.norm_squared() / corner.covariance_px2.trace();
                count += 1.0;
            }
            let ratio = f64::sqrt(squares / count);
            assert!((0.7..1.3).contains(&ratio), "{name}: errors are {ratio} times the stated sd");
        }
    }
}
