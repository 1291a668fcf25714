//! Covariance of the lens from the scatter of the views, for any noise within a view.
//!
//! Errors within a view may be alike, larger than in other views, or come from a board that isn't
//! flat: each view then pulls the lens by more than its corners' noise explains. Views are
//! independent of each other, so the scatter of their pulls gives the covariance without a model of
//! the noise within them (Liang & Zeger 1986):
//!
//! ```text
//! C = I⁻¹ (Σ g̃ g̃ᵀ) I⁻¹,   g̃ = L (1 − H)^(−1/2) L⁻¹ g,   I = L Lᵀ,   H = L⁻¹ Iᵥ L⁻ᵀ
//! ```
//!
//! with `g` the gradient of a view at the minimum, its pose eliminated, and `Iᵥ` its information.
//! The factor compensates for the influence of the view on the lens (MacKinnon & White 1985, HC2):
//! with independent noise, `C` is expected to be `σ² I⁻¹`.

use std::ops::{Add, Mul};

use nalgebra::{DMatrix, DVector, SymmetricEigen};

use super::{bundle::Bundle, lens_model::tie_covariance};
use boresight_geometry::{LensMatrix, LensParts};

/// Least share of a view's pull left in the residuals: the scatter of a view that decides a
/// parameter alone is unknown.
const LEAST_LEFT: f64 = 0.1;

/// Share of errors beyond the stated bounds.
const BEYOND: f64 = 0.05;
/// Number of views with the same weight as the model of the noise.
const MODEL_VIEWS: f64 = 10.0;

/// Degrees of freedom of the noise from `views` distinct views in [`averaged`].
pub(crate) fn freedom(views: usize) -> f64 {
    MODEL_VIEWS + views as f64 - 1.0
}

/// Average of the covariances by a model of the noise and by the scatter of `views` distinct views.
/// The average is inflated because it is uncertain, as for an error in two directions with half of
/// their [`freedom`], because the lens follows the views (Bell & McCaffrey 2002): a normal
/// distribution with it has the 95 % quantile of F. With up to three views, the model's covariance.
pub(crate) fn averaged<T: Add<Output = T> + Mul<f64, Output = T>>(
    of_model: T,
    of_views: T,
    views: usize,
) -> T {
    if views <= 3 {
        return of_model;
    }
    // Quantile of F with two and these degrees of freedom, over that of half a χ² with two.
    let freedom = 0.5 * freedom(views);
    let quantile = 0.5 * freedom * (libm::pow(BEYOND, -2.0 / freedom) - 1.0);
    let share = quantile / -libm::log(BEYOND) / (MODEL_VIEWS + views as f64);
    of_model * (MODEL_VIEWS * share) + of_views * (views as f64 * share)
}

/// Scatter of parameters between the views.
pub(crate) struct Scatter {
    /// Scale of the parameters, for information with a unit diagonal.
    scale: DVector<f64>,
    lower: DMatrix<f64>,
    /// `L⁻¹ (Σ g̃ g̃ᵀ) L⁻ᵀ`: the identity is expected with independent noise.
    scatter: DMatrix<f64>,
}

impl Scatter {
    /// Scatter from each view's information and gradient, and the information of a prior, all for
    /// the actual noise. `None` if the information is singular.
    pub(crate) fn of(views: &[(DMatrix<f64>, DVector<f64>)], prior: &DMatrix<f64>) -> Option<Self> {
        let information = views.iter().fold(prior.clone(), |sum, (of_view, _)| sum + of_view);
        let scale = information.diagonal().map(|it| it.max(f64::MIN_POSITIVE).sqrt().recip());
        let scaled = |matrix: &DMatrix<f64>| {
            DMatrix::from_fn(scale.len(), scale.len(), |i, j| matrix[(i, j)] * scale[i] * scale[j])
        };
        let lower = scaled(&information).cholesky()?.unpack();
        let whitened = |matrix: &DMatrix<f64>| -> Option<DMatrix<f64>> {
            let half = lower.solve_lower_triangular(&scaled(matrix))?;
            lower.solve_lower_triangular(&half.transpose())
        };
        let mut scatter = whitened(prior)?;
        for (of_view, gradient) in views {
            let pull = lower.solve_lower_triangular(&gradient.component_mul(&scale))?;
            let eigen = SymmetricEigen::new(whitened(of_view)?);
            let mut along = eigen.eigenvectors.tr_mul(&pull);
            for (along, share) in along.iter_mut().zip(&eigen.eigenvalues) {
                *along /= (1.0 - share).max(LEAST_LEFT).sqrt();
            }
            let pull = &eigen.eigenvectors * along;
            scatter += &pull * pull.transpose();
        }
        Some(Self { scale, lower, scatter })
    }

    /// `C`.
    pub(crate) fn covariance(&self) -> Option<DMatrix<f64>> {
        let upper = self.lower.transpose();
        let half = upper.solve_upper_triangular(&self.scatter)?;
        let whole = upper.solve_upper_triangular(&half.transpose())?;
        let scale = &self.scale;
        Some(DMatrix::from_fn(scale.len(), scale.len(), |i, j| whole[(i, j)] * scale[i] * scale[j]))
    }

    /// Mean ratio of the observed scatter to that of independent corners.
    pub(crate) fn mean(&self) -> f64 {
        self.scatter.trace() / self.scale.len() as f64
    }

    /// Factor by which the corners of `views` views overstate the information, at least 1: the mean
    /// ratio ([`averaged`]) of the observed scatter to that of independent corners.
    pub(crate) fn overcount(&self, views: usize) -> f64 {
        averaged(1.0, self.mean(), views).max(1.0)
    }
}

impl Bundle {
    /// Pulls of the views at the free lens parameters, for corners with `noise_factor` times the
    /// stated error.
    pub(crate) fn scatter(&self, noise_factor: f64) -> Option<Scatter> {
        let free = self.freedom.parameters();
        let variance = noise_factor * noise_factor;
        let views: Vec<_> = self
            .view_information()
            .iter()
            .map(|(information, gradient)| {
                let pull = |i: usize, _| gradient[free[i].index()] / variance;
                (information.part(&free, &free) / variance, DVector::from_fn(free.len(), pull))
            })
            .collect();
        let of_prior = |i: usize, _| self.prior_information()[free[i].index()];
        Scatter::of(&views, &DMatrix::from_diagonal(&DVector::from_fn(free.len(), of_prior)))
    }

    /// Covariance of the lens parameters from the scatter of the views, laid out as
    /// [`Self::covariance`]. `noise_factor` only weighs a prior against the corners. `None` if the
    /// information is singular.
    pub(crate) fn covariance_by_views(&self, noise_factor: f64) -> Option<LensMatrix> {
        let of_free = self.scatter(noise_factor)?.covariance()?;
        let free = self.freedom.parameters();
        let mut covariance = LensMatrix::zeros();
        for (i, row) in free.iter().enumerate() {
            for (j, column) in free.iter().enumerate() {
                covariance[(row.index(), column.index())] = of_free[(i, j)];
            }
        }
        if self.freedom.square_pixels {
            tie_covariance(&mut covariance);
        }
        Some(covariance)
    }
}
