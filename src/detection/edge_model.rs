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

use crate::geometry::Corner;

const PARAMETERS: usize = 9;
const ROUNDS: usize = 15;
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
    pixels: Vec<[f64; 3]>,
}

/// Fits around `start`, with the board's axes `u` and `v` in pixels per square there.
///
/// `None` if the disc leaves the picture, or the fit runs away or stays poor.
pub(super) fn fit(
    image: &GrayImage,
    start: [f64; 2],
    axes_px: [[f64; 2]; 2],
    radius_px: i32,
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
    let pixels = &mut scratch.pixels;
    pixels.clear();
    for dy in -radius_px..=radius_px {
        for dx in -radius_px..=radius_px {
            if dx * dx + dy * dy <= radius_px * radius_px {
                let value = image.get_pixel((cx + dx) as u32, (cy + dy) as u32).0[0];
                pixels.push([f64::from(dx), f64::from(dy), f64::from(value)]);
            }
        }
    }
    let [u, v] = axes_px;
    let begin = [start[0] - centre[0], start[1] - centre[1]];
    let mut at = first_guess(pixels, begin, u[1].atan2(u[0]), v[1].atan2(v[0]));
    let mut damping = 1e-2;
    let mut now = evaluate(pixels, &at);
    for _ in 0..ROUNDS {
        let mut damped = now.normal_matrix;
        for i in 0..PARAMETERS {
            damped[(i, i)] += damping * (now.normal_matrix[(i, i)] + 1e-9);
        }
        let step = damped.cholesky()?.solve(&now.gradient);
        let mut tried = at + step;
        // A blur of a quarter pixel is a step to a camera; one of eight is no corner any more.
        tried[4] = tried[4].clamp(-1.05, 2.08);
        let next = evaluate(pixels, &tried);
        if next.cost < now.cost {
            let settled = step[0].abs().max(step[1].abs()) < 1e-4;
            (at, now) = (tried, next);
            damping *= 0.3;
            if settled {
                break;
            }
        } else {
            damping *= 5.0;
            if damping > 1e5 {
                break;
            }
        }
    }
    let freedom = pixels.len() as f64 - PARAMETERS as f64;
    let variance = now.cost / freedom;
    let covariance = now.normal_matrix.cholesky()?.inverse() * variance;
    let moved = (at[0] - begin[0]).hypot(at[1] - begin[1]);
    let contrast = at[5].abs();
    let residual = (now.cost / pixels.len() as f64).sqrt() / contrast;
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

fn first_guess(pixels: &[[f64; 3]], corner: [f64; 2], first_rad: f64, second_rad: f64) -> Vector {
    let mean = pixels.iter().map(|pixel| pixel[2]).sum::<f64>() / pixels.len() as f64;
    let (s1, c1) = first_rad.sin_cos();
    let (s2, c2) = second_rad.sin_cos();
    let contrast = pixels
        .iter()
        .map(|[x, y, value]| {
            let (dx, dy) = (x - corner[0], y - corner[1]);
            let side = (-dx * s1 + dy * c1) * (-dx * s2 + dy * c2);
            (value - mean) * side.signum()
        })
        .sum::<f64>()
        / pixels.len() as f64;
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

struct Evaluated {
    normal_matrix: Matrix,
    gradient: Vector,
    cost: f64,
}

fn evaluate(pixels: &[[f64; 3]], at: &Vector) -> Evaluated {
    let (s1, c1) = at[2].sin_cos();
    let (s2, c2) = at[3].sin_cos();
    let inverse_s = (-at[4]).exp();
    let slope = std::f64::consts::FRAC_2_SQRT_PI * inverse_s;
    let (a, b, gx, gy) = (at[5], at[6], at[7], at[8]);
    let mut sums =
        Evaluated { normal_matrix: Matrix::zeros(), gradient: Vector::zeros(), cost: 0.0 };
    for &[x, y, value] in pixels {
        let (dx, dy) = (x - at[0], y - at[1]);
        let d1 = -dx * s1 + dy * c1;
        let d2 = -dx * s2 + dy * c2;
        let (e1, bell1) = erf(d1 * inverse_s);
        let (e2, bell2) = erf(d2 * inverse_s);
        let (g1, g2) = (slope * bell1, slope * bell2);
        let light = 1.0 + gx * dx + gy * dy;
        let pattern = b + a * e1 * e2;
        let scaled = light * a;
        let jacobian = [
            scaled * (g1 * s1 * e2 + e1 * g2 * s2) - pattern * gx,
            scaled * (-g1 * c1 * e2 - e1 * g2 * c2) - pattern * gy,
            scaled * g1 * (-dx * c1 - dy * s1) * e2,
            scaled * e1 * g2 * (-dx * c2 - dy * s2),
            scaled * (-g1 * d1 * e2 - e1 * g2 * d2),
            light * e1 * e2,
            light,
            pattern * dx,
            pattern * dy,
        ];
        let residual = value - pattern * light;
        sums.cost += residual * residual;
        for i in 0..PARAMETERS {
            sums.gradient[i] += jacobian[i] * residual;
            for j in 0..=i {
                sums.normal_matrix[(i, j)] += jacobian[i] * jacobian[j];
            }
        }
    }
    sums.normal_matrix.fill_upper_triangle_with_lower_triangle();
    sums
}

/// `erf(x)` to 1.5e-7 and `exp(−x²)`. Abramowitz & Stegun 7.1.26.
fn erf(x: f64) -> (f64, f64) {
    let size = x.abs();
    let bell = (-size * size).exp();
    let t = 1.0 / (1.0 + 0.327_591_1 * size);
    let series = t
        * (0.254_829_592
            + t * (-0.284_496_736
                + t * (1.421_413_741 + t * (-1.453_152_027 + t * 1.061_405_429))));
    ((1.0 - series * bell).copysign(x), bell)
}
