//! Effects that each view has by itself, as random effects with estimated sizes.

use nalgebra::{DMatrix, DVector};

use super::columns::{COLUMNS, Products, RESIDUAL};
use crate::check::odd_corners::{OF_MEDIAN, median};

/// Rounds of expectation–maximisation from a start.
const ROUNDS: usize = 10;
/// First guess of an effect's size, as a share of the noise of a corner.
const FIRST: f64 = 0.3;
const LEAST_VARIANCE: f64 = 1e-14;

/// Products of views with the noise of each view as unit variance.
pub(super) struct Whitened {
    pub(super) products: Vec<Products>,
    /// Root mean square shift of a corner by each parameter of unit size, in sd of the noise.
    unit: Vec<f64>,
}

impl Whitened {
    /// Divides the products of each view by its noise: the residual beyond `absorbed`, effects
    /// that a view may have by itself, shrunk towards the median view (method of moments).
    /// `coordinates` is the number in each view; the noise is at least `noise_floor`.
    pub(super) fn of(
        of_views: &[Products],
        coordinates: &[f64],
        absorbed: &[usize],
        noise_floor: f64,
    ) -> Option<Self> {
        let taken = 6.0 + absorbed.len() as f64;
        let log_noise: Option<Vec<f64>> = of_views
            .iter()
            .zip(coordinates)
            .map(|(products, n)| {
                let left = eliminated(products, absorbed, None)?[(RESIDUAL, RESIDUAL)];
                Some(libm::log((left / (n - taken).max(4.0)).max(noise_floor * noise_floor)))
            })
            .collect();
        let log_noise = log_noise?;
        let typical = median(log_noise.clone());
        let own = |n: &f64| 2.0 / (n - taken).max(4.0);
        let of_chance = coordinates.iter().map(own).sum::<f64>() / coordinates.len() as f64;
        let off = log_noise.iter().map(|log| (log - typical).powi(2)).collect();
        let scatter = (median(off) * OF_MEDIAN - of_chance).max(0.0);
        let products: Vec<Products> = of_views
            .iter()
            .zip(log_noise.iter().zip(coordinates))
            .map(|(products, (log, n))| {
                let kept = scatter / (scatter + own(n));
                products / libm::exp(typical + (log - typical) * kept)
            })
            .collect();
        let all: f64 = coordinates.iter().sum();
        let unit = (0..COLUMNS)
            .map(|i| (products.iter().map(|it| it[(i, i)]).sum::<f64>() / all).sqrt())
            .collect();
        Some(Self { products, unit })
    }

    /// First guess of the variances of the effects in `columns`.
    pub(super) fn guess(&self, columns: &[usize]) -> Vec<f64> {
        columns.iter().map(|column| (FIRST / self.unit[*column].max(1e-12)).powi(2)).collect()
    }

    /// Variances of the effects in `columns` from a guess, by expectation–maximisation (Dempster,
    /// Laird & Rubin 1977). `pull` is each view's residual column at these effects, lens fitted.
    pub(super) fn variances(
        &self,
        columns: &[usize],
        pull: &[DVector<f64>],
        mut variance: Vec<f64>,
    ) -> Option<Vec<f64>> {
        let informations: Vec<DMatrix<f64>> =
            self.products.iter().map(|products| part(products, columns)).collect();
        let count = informations.len() as f64;
        for _ in 0..ROUNDS {
            let mut sum = vec![0.0; columns.len()];
            for (information, pull) in informations.iter().zip(pull) {
                let mut posterior = information.clone();
                (0..columns.len()).for_each(|i| posterior[(i, i)] += variance[i].recip());
                let covariance = posterior.cholesky()?.inverse();
                let mean = &covariance * pull;
                for (i, sum) in sum.iter_mut().enumerate() {
                    *sum += mean[i] * mean[i] + covariance[(i, i)];
                }
            }
            variance = sum.iter().map(|sum| (sum / count).max(LEAST_VARIANCE)).collect();
        }
        Some(variance)
    }
}

/// Views' products with effects of known variance marginalised.
pub(super) struct Marginalised {
    pub(super) products: Vec<Products>,
    /// `ln |I + T D T|` of each view: its share of minus twice the log likelihood.
    pub(super) log_determinant: Vec<f64>,
    pub(super) variance: Vec<f64>,
}

impl Marginalised {
    pub(super) fn of(whitened: &Whitened, columns: &[usize], variance: Vec<f64>) -> Option<Self> {
        let log_determinant = whitened.products.iter().map(|products| {
            let mut scaled = part(products, columns);
            for i in 0..columns.len() {
                for j in 0..columns.len() {
                    scaled[(i, j)] *= (variance[i] * variance[j]).sqrt();
                }
                scaled[(i, i)] += 1.0;
            }
            Some(scaled.cholesky()?.ln_determinant())
        });
        let log_determinant = log_determinant.collect::<Option<_>>()?;
        let precision: Vec<f64> = variance.iter().map(|it| it.recip()).collect();
        let products = whitened.products.iter();
        let products = products.map(|it| eliminated(it, columns, Some(&precision)));
        Some(Self { products: products.collect::<Option<_>>()?, log_determinant, variance })
    }
}

/// Products with `columns` eliminated, under a prior `precision` or none.
pub(super) fn eliminated(
    products: &Products,
    columns: &[usize],
    precision: Option<&[f64]>,
) -> Option<Products> {
    let mut own = part(products, columns);
    for i in 0..columns.len() {
        match precision {
            Some(precision) => own[(i, i)] += precision[i],
            None => own[(i, i)] += own[(i, i)] * 1e-9 + f64::MIN_POSITIVE,
        }
    }
    let across = products.select_rows(columns);
    let settled = own.cholesky()?.solve(&across);
    let absorbed = across.transpose() * settled;
    Some(products - absorbed)
}

fn part(products: &Products, columns: &[usize]) -> DMatrix<f64> {
    DMatrix::from_fn(columns.len(), columns.len(), |i, j| products[(columns[i], columns[j])])
}
