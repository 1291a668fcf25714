//! Whether new views show another distortion than an old calibration, `docs/method.md`, section 4.
//!
//! Two tests share a tenth of the false alarms: of any change of the five coefficients, and of a change in proportion, which is what
//! refocusing or warming does and which a few views see far better.

use nalgebra::{Point2, SMatrix, SVector};

use super::solve::schur_lm::inverse;
use boresight_geometry::{Camera, cell_centres_px, frame::ImageSize};

type Matrix5 = SMatrix<f64, 5, 5>;
type Vector5 = SVector<f64, 5>;
/// Derivative of the image of a ray by the five coefficients.
type Jacobian = SMatrix<f64, 2, 5>;

/// χ² quantiles at 0.9995 with 5 and 1 degrees of freedom, and the noncentrality for 95 % power at the latter.
const ANY_LIMIT: f64 = 22.105;
const PROPORTIONAL_LIMIT: f64 = 12.116;
const NONCENTRALITY_95: f64 = 26.272;
/// Displacement of a ray by the old distortion, in pixels, below which there is nothing to change in proportion. A change of
/// k1 stands for it.
const LEAST_DISTORTION_PX: f64 = 0.5;

/// What new views say about the distortion, to first order about the old one; f, the principal point and the poses settle.
#[derive(Clone, Copy, Debug)]
pub(super) struct DistortionPull {
    /// Information about (k1, k2, p1, p2, k3), for corners with the stated error.
    pub(super) information: Matrix5,
    /// Its gradient.
    pub(super) gradient: Vector5,
    /// σ₀ with the distortion free.
    pub(super) noise_factor: f64,
}

/// The outcome of both tests.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct LensChange {
    /// Whether one of them tells.
    pub(super) is_significant: bool,
    /// Largest displacement of a ray by the change found, in pixels.
    pub(super) displacement_px: f64,
    /// Largest displacement of a ray by a proportional change that would be told with a probability of 95 %, in pixels.
    pub(super) visible_px: f64,
}

impl LensChange {
    /// Tests `pull` against the distortion of `old`, which has the covariance `old_covariance`.
    ///
    /// `None` if the views leave the distortion open, or if no ray reaches the picture.
    pub(super) fn of(
        pull: &DistortionPull,
        old: &Camera,
        old_covariance: &Matrix5,
        image_size: ImageSize,
    ) -> Option<Self> {
        let DistortionPull { information, gradient, noise_factor } = pull;
        let variance = noise_factor * noise_factor;
        let unit_covariance = inverse(information)?;
        let any = unit_covariance * gradient;
        let covariance = unit_covariance * variance + old_covariance;
        let of_any = any.dot(&(inverse(&covariance)? * any));
        let moved_by: Vec<Jacobian> = cell_corners_px(image_size)
            .filter_map(|px| Some(old.project_ray(&old.ray_from_px(&px)?)?.jac_lens))
            .map(|jac_lens| jac_lens.fixed_columns::<5>(4).into_owned())
            .collect();
        let displacement_px =
            |change: &Vector5| moved_by.iter().map(|by| (by * change).norm()).fold(0.0, f64::max);
        let d = old.distortion;
        let mut along = Vector5::new(d.k1, d.k2, d.p1, d.p2, d.k3);
        if displacement_px(&along) < LEAST_DISTORTION_PX {
            along = Vector5::new(0.1, 0.0, 0.0, 0.0, 0.0);
        }
        let pulled = information * along;
        let scale = along.dot(&pulled);
        let share = along.dot(gradient) / scale;
        let of_old = (pulled.transpose() * old_covariance * pulled).x / (scale * scale);
        let share_variance = variance / scale + of_old;
        let is_proportional = share * share / share_variance > PROPORTIONAL_LIMIT;
        let along_px = displacement_px(&along);
        let found_px = if is_proportional { share.abs() * along_px } else { displacement_px(&any) };
        let visible_px = (NONCENTRALITY_95 * share_variance).sqrt() * along_px;
        (visible_px.is_finite() && of_any.is_finite()).then_some(Self {
            is_significant: is_proportional || of_any > ANY_LIMIT,
            displacement_px: found_px,
            visible_px,
        })
    }
}

/// Cells' centres and the corners of the picture.
fn cell_corners_px(image_size: ImageSize) -> impl Iterator<Item = Point2<f64>> {
    let (right, bottom) =
        (f64::from(image_size.width_px) - 1.0, f64::from(image_size.height_px) - 1.0);
    let corners = [(0.0, 0.0), (right, 0.0), (0.0, bottom), (right, bottom)];
    cell_centres_px(image_size).chain(corners.map(|(x, y)| Point2::new(x, y)))
}
