//! Covariance of the lens from how far the views pull it apart, whatever the noise in a view is.
//!
//! Errors within a view may be alike, larger than in other views, or come from a board that isn't flat: each view then pulls
//! the lens by more than its corners' noise explains. Views are independent of each other, so the scatter of their pulls
//! tells the covariance without a model of the noise within them (Liang & Zeger 1986):
//!
//! ```text
//! C = I⁻¹ (Σ g̃ g̃ᵀ) I⁻¹,   g̃ = L (1 − H)^(−1/2) L⁻¹ g,   I = L Lᵀ,   H = L⁻¹ Iᵥ L⁻ᵀ
//! ```
//!
//! with `g` the gradient of a view at the minimum, its pose eliminated, and `Iᵥ` its information. The factor makes up for the
//! lens having followed the view (MacKinnon & White 1985, HC2): with independent noise, `C` is expected to be `σ² I⁻¹`.

use nalgebra::{DMatrix, DVector, SymmetricEigen};

use super::{bundle::Bundle, lens_model::tie_covariance};
use boresight_geometry::{LENS_PARAMETERS, LensMatrix};

/// Least share of its own pull that a view leaves in its residuals: one that decides a parameter alone tells nothing about
/// its scatter.
const LEAST_LEFT: f64 = 0.1;

/// The model of the noise is believed as much as this many views.
const MODEL_VIEWS: f64 = 10.0;

/// Degrees of freedom with which [`averaged`] knows the noise of `views` different views.
pub(crate) fn freedom(views: usize) -> f64 {
    MODEL_VIEWS + views as f64 - 1.0
}

/// Covariance by a model of the noise and by the scatter of `views` different views, averaged. Few views tell it badly:
/// theirs gets the variance of Student's t with a degree of freedom less than there are views. With three, the model's.
pub(crate) fn averaged(of_model: &LensMatrix, of_views: &LensMatrix, views: usize) -> LensMatrix {
    if views <= 3 {
        return *of_model;
    }
    let views = views as f64;
    let of_few = (views - 1.0) / (views - 3.0);
    (of_model * MODEL_VIEWS + of_views * (views * of_few)) / (MODEL_VIEWS + views)
}

impl Bundle {
    /// Covariance of the lens parameters from the scatter of the views, laid out as [`Self::covariance`]. `noise_factor` only
    /// weighs a prior against the corners. `None` if the information is singular.
    pub(crate) fn covariance_by_views(&self, noise_factor: f64) -> Option<LensMatrix> {
        let free: Vec<usize> = (0..LENS_PARAMETERS).filter(|i| self.freedom.free[*i]).collect();
        let count = free.len();
        let variance = noise_factor * noise_factor;
        let of = |matrix: &LensMatrix| {
            DMatrix::from_fn(count, count, |i, j| matrix[(free[i], free[j])] / variance)
        };
        let mut information = of(self.information());
        let prior = DMatrix::from_diagonal(&DVector::from_fn(count, |i, _| {
            self.prior_information()[free[i]]
        }));
        information += &prior;
        let scale = DVector::from_fn(count, |i, _| {
            information[(i, i)].max(f64::MIN_POSITIVE).sqrt().recip()
        });
        let scaled = |matrix: &DMatrix<f64>| {
            DMatrix::from_fn(count, count, |i, j| matrix[(i, j)] * scale[i] * scale[j])
        };
        let lower = scaled(&information).cholesky()?.unpack();
        let whitened = |matrix: &DMatrix<f64>| -> Option<DMatrix<f64>> {
            let half = lower.solve_lower_triangular(&scaled(matrix))?;
            lower.solve_lower_triangular(&half.transpose())
        };
        let mut scatter = whitened(&prior)?;
        for (of_view, gradient) in self.view_information() {
            let pull = DVector::from_fn(count, |i, _| gradient[free[i]] * scale[i] / variance);
            let pull = lower.solve_lower_triangular(&pull)?;
            let eigen = SymmetricEigen::new(whitened(&of(of_view))?);
            let mut along = eigen.eigenvectors.tr_mul(&pull);
            for (along, share) in along.iter_mut().zip(&eigen.eigenvalues) {
                *along /= (1.0 - share).max(LEAST_LEFT).sqrt();
            }
            let pull = &eigen.eigenvectors * along;
            scatter += &pull * pull.transpose();
        }
        let upper = lower.transpose();
        let half = upper.solve_upper_triangular(&scatter)?;
        let whole = upper.solve_upper_triangular(&half.transpose())?;
        let mut covariance = LensMatrix::zeros();
        for (i, row) in free.iter().enumerate() {
            for (j, column) in free.iter().enumerate() {
                covariance[(*row, *column)] = whole[(i, j)] * scale[i] * scale[j];
            }
        }
        if self.freedom.square_pixels {
            tie_covariance(&mut covariance);
        }
        Some(covariance)
    }
}
