//! Test for a change of distortion between an old calibration and new views, `docs/method.md`, section 4.
//!
//! Two tests share a tenth of the false alarms: for any change of the coefficients, and for a change in proportion. The
//! latter is the effect of refocusing or warming, and a few views detect it far better.

use nalgebra::{DMatrix, DVector, Matrix2xX, Point2};
use statrs::distribution::{ChiSquared, ContinuousCDF};

use boresight_geometry::{
    Camera, LensMatrix, LensParameter, LensParts, cell_centres_px, frame::ImageSize,
};

/// Probability that no change passes either test, of any change or of a change in proportion. Then the χ² quantile of
/// the second test with 1 degree of freedom, and the noncentrality for 95 % power there.
const UNCHANGED: f64 = 0.9995;
const PROPORTIONAL_LIMIT: f64 = 12.116;
const NONCENTRALITY_95: f64 = 26.272;
/// Displacement of a ray by the old distortion, in pixels, below which no change in proportion is possible. A change of
/// k1 stands for it.
const LEAST_DISTORTION_PX: f64 = 0.5;
/// Least share of the largest information about a direction of change at which a direction is tested, coefficients
/// scaled alike: numerator and denominator of a rational lens may cancel.
const UNTOLD: f64 = 1e-12;

/// Gradient and information of new views about the distortion, to first order about the old one; f, the principal point
/// and the poses are refitted.
#[derive(Clone, Debug)]
pub(super) struct DistortionPull {
    /// The coefficients that may have changed.
    pub(super) coefficients: &'static [LensParameter],
    /// Information about them, for corners with the stated error.
    pub(super) information: DMatrix<f64>,
    /// Gradient of the cost by the coefficients.
    pub(super) gradient: DVector<f64>,
    /// σ₀ with the distortion free.
    pub(super) noise_factor: f64,
}

/// The outcome of both tests.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct LensChange {
    /// True if either test finds a change.
    pub(super) is_significant: bool,
    /// Largest displacement of a ray by the change found, in pixels.
    pub(super) displacement_px: f64,
    /// Largest displacement of a ray, in pixels, by a proportional change that would be detected with a probability of
    /// 95 %.
    pub(super) visible_px: f64,
}

impl LensChange {
    /// Tests `pull` against the distortion of `old`, whose parameters have the covariance `old_covariance`. `None` if
    /// the views carry no information about the distortion, or if no ray reaches the picture.
    ///
    /// `None` if the views tell nothing about the distortion, or if no ray reaches the picture.
    pub(super) fn of(
        pull: &DistortionPull,
        old: &Camera,
        old_covariance: &LensMatrix,
        image_size: ImageSize,
    ) -> Option<Self> {
        let DistortionPull { coefficients, information, gradient, noise_factor } = pull;
        let variance = noise_factor * noise_factor;
        let old_covariance = old_covariance.part(coefficients, coefficients);
        let (any, is_any) = any_change(pull, &old_covariance)?;
        let moved_by: Vec<Matrix2xX<f64>> = cell_corners_px(image_size)
            .filter_map(|px| Some(old.project_ray(&old.ray_from_px(&px)?)?.jac_lens))
            .map(|by| {
                Matrix2xX::from_fn(coefficients.len(), |i, j| by[(i, coefficients[j].index())])
            })
            .collect();
        let displacement_px = |change: &DVector<f64>| {
            moved_by.iter().map(|by| (by * change).norm()).fold(0.0, f64::max)
        };
        let vector = |of: &dyn Fn(LensParameter) -> f64| {
            DVector::from_fn(coefficients.len(), |i, _| of(coefficients[i]))
        };
        let parameters = old.lens_parameters();
        let mut along = vector(&|coefficient| parameters[coefficient.index()]);
        if displacement_px(&along) < LEAST_DISTORTION_PX {
            along = vector(&|coefficient| if coefficient == LensParameter::K1 { 0.1 } else { 0.0 });
        }
        let pulled = information * &along;
        let scale = along.dot(&pulled);
        let share = along.dot(gradient) / scale;
        let of_old = pulled.dot(&(&old_covariance * &pulled)) / (scale * scale);
        let share_variance = variance / scale + of_old;
        let is_proportional = share * share / share_variance > PROPORTIONAL_LIMIT;
        let along_px = displacement_px(&along);
        let found_px = if is_proportional { share.abs() * along_px } else { displacement_px(&any) };
        let visible_px = (NONCENTRALITY_95 * share_variance).sqrt() * along_px;
        visible_px.is_finite().then_some(Self {
            is_significant: is_proportional || is_any,
            displacement_px: found_px,
            visible_px,
        })
    }
}

/// The change of the coefficients, over all directions that the views determine, and whether it's significant. `None`
/// if they determine none.
fn any_change(
    pull: &DistortionPull,
    old_covariance: &DMatrix<f64>,
) -> Option<(DVector<f64>, bool)> {
    let unit = pull.information.diagonal().map(|information| information.sqrt().recip());
    if !unit.iter().all(|unit| unit.is_finite()) {
        return None;
    }
    let unit = DMatrix::from_diagonal(&unit);
    let eigen = (&unit * &pull.information * &unit).symmetric_eigen();
    let least = UNTOLD * eigen.eigenvalues.max();
    let told: Vec<usize> =
        (0..eigen.eigenvalues.len()).filter(|i| eigen.eigenvalues[*i] > least).collect();
    // A column for each direction, scaled so that the views measure it with a standard deviation of 1.
    let mut directions = &unit * eigen.eigenvectors.select_columns(&told);
    for (column, i) in told.iter().enumerate() {
        directions.column_mut(column).scale_mut(eigen.eigenvalues[*i].sqrt().recip());
    }
    let seen = directions.transpose() * &pull.gradient;
    let by_change = directions.transpose() * &pull.information;
    let covariance = DMatrix::identity(told.len(), told.len()) * pull.noise_factor.powi(2)
        + &by_change * old_covariance * by_change.transpose();
    let statistic = seen.dot(&covariance.cholesky()?.solve(&seen));
    let limit = ChiSquared::new(told.len() as f64).ok()?.inverse_cdf(UNCHANGED);
    statistic.is_finite().then_some((directions * seen, statistic > limit))
}

/// Cells' centres and the corners of the picture.
fn cell_corners_px(image_size: ImageSize) -> impl Iterator<Item = Point2<f64>> {
    let (right, bottom) =
        (f64::from(image_size.width_px) - 1.0, f64::from(image_size.height_px) - 1.0);
    let corners = [(0.0, 0.0), (right, 0.0), (0.0, bottom), (right, bottom)];
    cell_centres_px(image_size).chain(corners.map(|(x, y)| Point2::new(x, y)))
}
