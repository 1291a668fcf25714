//! 95 % bound of the error limited by a goal.
//!
//! To first order, the error of a measurement `m` is normal with variance `∇m C ∇mᵀ`, with `C` the
//! covariance of all lens parameters, model uncertainty included. A length also has the relative
//! error of the board's square size, because every distance measured with the camera is a multiple
//! of that size.

use nalgebra::{Matrix2, Point2, RowSVector, SMatrix, Vector2, Vector3};
use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::goal::{AcceptanceGoal, TWO_SIDED_95};
use crate::check::projection_sd::projection_jacobian;
use boresight_geometry::{Camera, LENS_PARAMETERS, frame::ImageSize};

type LensMatrix = SMatrix<f64, LENS_PARAMETERS, LENS_PARAMETERS>;

/// Share of the picture, or of the places where a length fits into it, in which a goal must hold.
/// The rest are the outermost corners, where the lens model extrapolates.
const AREA: f64 = 0.95;
/// Trial places for an end of a length, across and down, edges of the picture included.
const PLACES: [u32; 2] = [17, 11];

/// Verdict on a goal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Acceptance {
    /// Goal judged.
    pub goal: AcceptanceGoal,
    /// Bound of the error in 95 of 100 calibrations. `None` if the length doesn't fit into the
    /// picture, or the lens model folds over in more than a twentieth of it.
    pub bound: Option<ErrorBound>,
}

/// Bound of an error, in the goal's unit: pixels for projection, metres for a length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ErrorBound {
    /// Bound from lens and board scale together.
    pub total: f64,
    /// Bound from the lens alone.
    pub lens: f64,
    /// Bound from the board's square size alone; zero for projection.
    pub scale: f64,
    /// Place in the picture where the bound holds, in pixels: both ends of a length, or the same
    /// point twice. In 95 % of the picture the error is smaller.
    pub place_px: [Point2<f64>; 2],
}

impl Acceptance {
    /// True if the error stays within the goal.
    pub fn is_met(&self) -> bool {
        self.bound.is_some_and(|bound| bound.total <= self.goal.limit())
    }

    /// True if the board's square size alone exceeds the goal, so no view can help.
    pub fn is_out_of_reach(&self) -> bool {
        self.bound.is_some_and(|bound| bound.scale >= self.goal.limit())
    }

    /// Ratio of the lens's part of the error to the part left by the goal: at most 1 if the goal is
    /// met. If the goal is out of reach, the ratio to the whole goal, so that a session still ends.
    /// Infinite without a bound.
    pub fn excess(&self) -> f64 {
        let Some(bound) = self.bound else { return f64::INFINITY };
        let limit = self.goal.limit();
        let left = if self.is_out_of_reach() {
            limit
        } else {
            (limit * limit - bound.scale * bound.scale).sqrt()
        };
        bound.lens / left
    }
}

/// Evaluates `goal` for a lens with the `covariance` of the parameters (in the order of
/// [`LENS_PARAMETERS`], model uncertainty included) and pictures of `image_size`. `scale_sd` is the
/// relative standard deviation of the board's square size.
///
/// ```
/// # use boresight_calibrate::{AcceptanceGoal, acceptance};
/// # use boresight_geometry::{Camera, LensMatrix, frame::ImageSize};
/// # use nalgebra::Point2;
/// let (camera, size) = (
///     Camera::pinhole(900.0, Point2::new(640.0, 360.0)),
///     ImageSize { width_px: 1280, height_px: 720 },
/// );
/// let goal = AcceptanceGoal::Projection { px: 0.5 };
/// // Every lens parameter is known to a thousandth.
/// let reached = acceptance(goal, &camera, &(LensMatrix::identity() * 1e-6), size, 1e-3);
/// assert!(reached.bound.is_some());
/// assert_eq!(reached.is_met(), reached.excess() <= 1.0);
/// ```
pub fn acceptance(
    goal: AcceptanceGoal,
    camera: &Camera,
    covariance: &LensMatrix,
    image_size: ImageSize,
    scale_sd: f64,
) -> Acceptance {
    let bound = match goal {
        AcceptanceGoal::Projection { .. } => projection_bound(camera, covariance, image_size),
        AcceptanceGoal::Length { length_m, at_m, .. } => {
            let lens = length_sd(camera, covariance, image_size, length_m / at_m);
            lens.map(|(sd, place_px)| {
                let lens = TWO_SIDED_95 * at_m * sd;
                let scale = goal.scale_part(scale_sd);
                ErrorBound { total: libm::hypot(lens, scale), lens, scale, place_px }
            })
        }
    };
    Acceptance { goal, bound }
}

/// Bound of the projection error at 95 % of the picture's grid points, each with 95 % probability.
fn projection_bound(
    camera: &Camera,
    covariance: &LensMatrix,
    image_size: ImageSize,
) -> Option<ErrorBound> {
    let jacobian = projection_jacobian(camera, image_size)?;
    let bounds: Vec<(f64, Point2<f64>)> = jacobian
        .px
        .iter()
        .zip(&jacobian.jac_lens)
        .map(|(px, jac_lens)| (radius_95(&(jac_lens * covariance * jac_lens.transpose())), *px))
        .collect();
    let count = bounds.len() + jacobian.unmapped;
    let (total, px) = quantile(bounds, count)?;
    Some(ErrorBound { total, lens: total, scale: 0.0, place_px: [px, px] })
}

/// [`AREA`] quantile of `errors` over `count` places, with the place; a place without an error
/// ranks last. `None` if the quantile falls on such a place.
pub(crate) fn quantile<Place: Copy>(
    mut errors: Vec<(f64, Place)>,
    count: usize,
) -> Option<(f64, Place)> {
    errors.sort_by(|a, b| a.0.total_cmp(&b.0));
    let rank = (AREA * count as f64).ceil() as usize;
    errors.get(rank.checked_sub(1)?).copied()
}

/// Radius of the circle that holds 95 % of a 2D normal distribution about zero. Its square is a
/// weighted sum of two χ²₁, approximated by the gamma distribution of the same mean and variance
/// (Satterthwaite 1946).
fn radius_95(covariance_px2: &Matrix2<f64>) -> f64 {
    let squares = (covariance_px2 * covariance_px2).trace();
    let mean = covariance_px2.trace();
    if mean.is_nan() || mean <= 0.0 {
        return 0.0;
    }
    let freedom = (mean * mean / squares).clamp(1.0, 2.0);
    ChiSquared::new(freedom)
        .map_or(mean, |chi2| mean / freedom * chi2.inverse_cdf(0.95))
        .max(0.0)
        .sqrt()
}

/// Standard deviation of `|ray₂ − ray₁|` for two points `span` apart in normalised coordinates. The
/// bound at 95 % of the places, over all of eight directions in which the points fit into the
/// picture, with its place in pixels.
fn length_sd(
    camera: &Camera,
    covariance: &LensMatrix,
    image_size: ImageSize,
    span: f64,
) -> Option<(f64, [Point2<f64>; 2])> {
    let all: Vec<_> = spans_in(camera, image_size, span)
        .map(|placed| (placed.sd(covariance), placed.place_px))
        .collect();
    let count = all.len();
    quantile(all, count)
}

/// Two points in the picture, a fixed span apart in normalised coordinates.
pub(crate) struct PlacedSpan {
    /// Both points in the picture, in pixels.
    pub(crate) place_px: [Point2<f64>; 2],
    /// Change of the span by the lens parameters.
    by_lens: RowSVector<f64, LENS_PARAMETERS>,
}

impl PlacedSpan {
    /// Standard deviation of the span by a lens with the `covariance` of its parameters.
    pub(crate) fn sd(&self, covariance: &LensMatrix) -> f64 {
        (self.by_lens * covariance * self.by_lens.transpose()).x.max(0.0).sqrt()
    }
}

/// Places where two points `span` apart fit into pictures of `image_size`, in eight directions.
pub(crate) fn spans_in(
    camera: &Camera,
    image_size: ImageSize,
    span: f64,
) -> impl Iterator<Item = PlacedSpan> {
    let far =
        Vector2::new(f64::from(image_size.width_px) - 1.0, f64::from(image_size.height_px) - 1.0);
    let in_picture =
        move |px: &Point2<f64>| (0.0..=far.x).contains(&px.x) && (0.0..=far.y).contains(&px.y);
    let [columns, rows] = PLACES;
    let starts = (0..columns * rows).filter_map(move |i| {
        let share = |at: u32, of: u32| f64::from(at) / f64::from(of - 1);
        let px = Point2::new(share(i % columns, columns) * far.x, share(i / columns, rows) * far.y);
        let start = camera.normalized_from_px(&px)?;
        Some((px, start, ray_by_lens(camera, &start)?))
    });
    starts.flat_map(move |(start_px, start, start_moves)| {
        (0..8_u8).filter_map(move |eighth| {
            let (sin, cos) = libm::sincos(f64::from(eighth) * std::f64::consts::FRAC_PI_4);
            let direction = Vector2::new(cos, sin);
            let end = start + direction * span;
            let end_px = camera.px_from_normalized(&end);
            // Beyond the fold of the lens model, rays return to the picture at pixels of other
            // rays.
            let is_ray = |ray: Point2<f64>| (ray - end).norm() < 1e-6;
            if !in_picture(&end_px) || !camera.normalized_from_px(&end_px).is_some_and(is_ray) {
                return None;
            }
            let by_lens = direction.transpose() * (ray_by_lens(camera, &end)? - start_moves);
            Some(PlacedSpan { place_px: [start_px, end_px], by_lens })
        })
    })
}

/// Derivative of the ray of a fixed pixel by the lens parameters: `−(∂px/∂ray)⁻¹ ∂px/∂lens`.
fn ray_by_lens(camera: &Camera, ray: &Point2<f64>) -> Option<SMatrix<f64, 2, LENS_PARAMETERS>> {
    let sighted = camera.project_ray(&Vector3::new(ray.x, ray.y, 1.0))?;
    let by_ray = camera.px_by_normalized(ray)?;
    Some(-(by_ray.try_inverse()? * sighted.jac_lens))
}
