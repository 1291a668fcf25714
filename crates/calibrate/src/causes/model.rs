//! Lens and shared parameters, fitted to the products of the views and left out view by view.

use nalgebra::{DMatrix, DVector};

use super::{
    columns::{Products, RESIDUAL, solve},
    evidence::{Size, size},
};
use boresight_geometry::LENS_PARAMETERS;

/// Precision of a distortion coefficient beyond the corners': weak, for views that determine none.
const DISTORTION_PRECISION: f64 = 1e-2;
/// First distortion coefficient among the lens parameters.
const FIRST_DISTORTION: usize = 4;
const _: () = assert!(FIRST_DISTORTION < LENS_PARAMETERS);

/// Parameters shared by all views, besides the lens's.
#[derive(Clone, Debug)]
pub(super) struct Shared {
    pub(super) columns: &'static [usize],
    pub(super) sd: Vec<f64>,
    /// Factor on each view; 1 without.
    pub(super) course: Option<Vec<f64>>,
}

/// Sums of a view about lens and shared parameters.
pub(super) struct OfView {
    pub(super) information: DMatrix<f64>,
    pub(super) gradient: DVector<f64>,
    pub(super) cost: f64,
}

/// Fit of lens and shared parameters.
pub(super) struct Fit {
    pub(super) views: Vec<OfView>,
    pub(super) precision: DVector<f64>,
    pub(super) value: DVector<f64>,
    /// Columns of the parameters, lens first, each with its course.
    columns: Vec<(usize, Option<Vec<f64>>)>,
}

impl Fit {
    /// Fit of the `lens` columns and `shared` to `products`. `None` if singular.
    pub(super) fn of(products: &[Products], lens: &[usize], shared: &[Shared]) -> Option<Self> {
        let mut columns: Vec<(usize, Option<Vec<f64>>)> =
            lens.iter().map(|column| (*column, None)).collect();
        let of_lens = |i: &usize| if *i < FIRST_DISTORTION { 0.0 } else { DISTORTION_PRECISION };
        let mut precision: Vec<f64> = lens.iter().map(of_lens).collect();
        for shared in shared {
            columns.extend(shared.columns.iter().map(|column| (*column, shared.course.clone())));
            precision.extend(shared.sd.iter().map(|sd| sd.powi(-2)));
        }
        let views = products.iter().enumerate().map(|(view, products)| {
            let times = |column: &(usize, Option<Vec<f64>>)| {
                column.1.as_ref().map_or(1.0, |course| course[view])
            };
            let count = columns.len();
            let at = |i: usize, j: usize| {
                let (first, second) = (&columns[i], &columns[j]);
                products[(first.0, second.0)] * times(first) * times(second)
            };
            OfView {
                information: DMatrix::from_fn(count, count, at),
                gradient: DVector::from_fn(count, |i, _| {
                    products[(columns[i].0, RESIDUAL)] * times(&columns[i])
                }),
                cost: products[(RESIDUAL, RESIDUAL)],
            }
        });
        let views: Vec<OfView> = views.collect();
        let precision = DVector::from_vec(precision);
        let mut fit = Self { value: DVector::zeros(columns.len()), views, precision, columns };
        let (information, gradient) = fit.total();
        fit.value = solve(&information, &as_matrix(gradient))?.column(0).into_owned();
        Some(fit)
    }

    /// Sums over the views, with the prior.
    pub(super) fn total(&self) -> (DMatrix<f64>, DVector<f64>) {
        let mut information = DMatrix::from_diagonal(&self.precision);
        let mut gradient = DVector::zeros(self.precision.len());
        for view in &self.views {
            information += &view.information;
            gradient += &view.gradient;
        }
        (information, gradient)
    }

    /// Gain of the fit in twice the log likelihood over no change of any parameter.
    pub(super) fn gain(&self) -> f64 {
        self.total().1.dot(&self.value)
    }

    /// Values without each view in turn. `None` if a view alone determines a parameter.
    pub(super) fn left_out(&self) -> Option<Vec<DVector<f64>>> {
        let (information, gradient) = self.total();
        let without = |view: &OfView| {
            let information = &information - &view.information;
            let gradient = as_matrix(&gradient - &view.gradient);
            Some(solve(&information, &gradient)?.column(0).into_owned())
        };
        self.views.iter().map(without).collect()
    }

    /// Minus twice the log likelihood of each view, predicted by the values without it.
    pub(super) fn predicted(&self, left_out: &[DVector<f64>]) -> Vec<f64> {
        self.views.iter().zip(left_out).map(|(view, without)| view.cost_at(without)).collect()
    }

    /// Size of the parameters from the index `first` on, `count` of them.
    pub(super) fn size(
        &self,
        left_out: &[DVector<f64>],
        (first, count): (usize, usize),
        tries: f64,
    ) -> Option<Size> {
        let part = |all: &DVector<f64>| all.rows(first, count).into_owned();
        let without: Vec<_> = left_out.iter().map(part).collect();
        size(&part(&self.value), &without, tries)
    }

    /// Residual column of each view at the fit, for the view's own effects in `columns`.
    pub(super) fn pull(&self, products: &[Products], columns: &[usize]) -> Vec<DVector<f64>> {
        let pull = |(view, products): (usize, &Products)| {
            let of_one = |column: usize| {
                let explained = self.columns.iter().zip(&self.value).map(|(of, value)| {
                    let times = of.1.as_ref().map_or(1.0, |course| course[view]);
                    products[(column, of.0)] * times * value
                });
                products[(column, RESIDUAL)] - explained.sum::<f64>()
            };
            DVector::from_iterator(columns.len(), columns.iter().map(|column| of_one(*column)))
        };
        products.iter().enumerate().map(pull).collect()
    }
}

impl OfView {
    /// Cost with the parameters at `value`.
    pub(super) fn cost_at(&self, value: &DVector<f64>) -> f64 {
        self.cost - 2.0 * self.gradient.dot(value) + value.dot(&(&self.information * value))
    }
}

pub(super) fn as_matrix(column: DVector<f64>) -> DMatrix<f64> {
    DMatrix::from_columns(&[column])
}
