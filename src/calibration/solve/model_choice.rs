//! Which lens model the corners support, and what not knowing it costs.

use nalgebra::{Const, DMatrix, DVector, Dyn, OMatrix, SMatrix};

use super::{
    bundle::{Bundle, BundleState, Observations, adjust},
    lens_model::{LensModel, LensPrior},
};
use crate::geometry::{Camera, LENS_PARAMETERS};

/// Cost of a parameter when models are weighed against each other, instead of BIC's ln n.
///
/// BIC holds that a coefficient could be anything up to √n times its error, far more than lenses have,
/// and so calls a rich model improbable that is not. 4.5 stands for 10 times.
const DOUBT_PER_PARAMETER: f64 = 4.5;

type LensMatrix = SMatrix<f64, LENS_PARAMETERS, LENS_PARAMETERS>;

/// One lens model fitted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ModelFit {
    /// The model.
    pub model: LensModel,
    /// Its best lens.
    pub camera: Camera,
    /// Whitened sum of squared residuals.
    pub cost: f64,
    /// `n ln(cost/n) + k ln n`; the smallest is chosen.
    pub bic: f64,
    /// Probability of the model given the corners, `∝ exp(−(n ln(cost/n) + 4.5 k)/2)`;
    /// zero for models that were only fitted as a check.
    pub weight: f64,
    /// `√(cost/dof)`.
    pub noise_factor: f64,
}

/// How large coefficients are believed to be that the chosen model holds at zero: k2, p1, p2, k3.
///
/// No lens is centred to better, and a tangential coefficient of 1e-4 shifts the principal point by as
/// much as eight good views know it; what is too small to be chosen is not therefore zero.
const HELD_SD: [(usize, f64); 4] = [(5, 0.1), (6, 1.5e-4), (7, 1.5e-4), (8, 0.05)];

/// Multiples of those sizes, and how far each is believed.
const HELD_SCALES: [(f64, f64); 2] = [(1.0, 0.7), (6.0, 0.3)];

/// All models fitted, and the one chosen.
#[derive(Clone, Debug)]
pub(in crate::calibration) struct ModelChoice {
    pub(in crate::calibration) fits: Vec<ModelFit>,
    /// In the order of `fits`.
    pub(in crate::calibration) bundles: Vec<Bundle>,
    pub(in crate::calibration) chosen: usize,
    /// The richest model that might have been chosen.
    richest_allowed: LensModel,
}

/// What [`fit_models`] needs beside the corners.
pub(in crate::calibration) struct ModelSearch<'a> {
    pub(in crate::calibration) observations: &'a Observations,
    /// All to fit, simplest first.
    pub(in crate::calibration) models: &'a [LensModel],
    /// Those that may be chosen; the others only serve as a check.
    pub(in crate::calibration) allowed: &'a [LensModel],
    pub(in crate::calibration) square_pixels: bool,
    pub(in crate::calibration) prior: Option<&'a LensPrior>,
    /// Corners are never believed to be better than this, as a multiple of what they claim.
    pub(in crate::calibration) noise_floor: f64,
}

/// Fits the models in order, each started from the one before, the first from `start`.
///
/// `None` if none that may be chosen can be fitted.
pub(in crate::calibration) fn fit_models(
    search: &ModelSearch<'_>,
    start: BundleState,
) -> Option<ModelChoice> {
    let mut state = start;
    let mut fitted: Vec<(LensModel, Bundle)> = Vec::with_capacity(search.models.len());
    for model in search.models {
        let freedom = model.freedom(search.square_pixels);
        let bundle = adjust(search.observations, &freedom, search.prior, state.clone());
        let Some(bundle) = bundle else { break };
        state = bundle.state.clone();
        fitted.push((*model, bundle));
    }
    let n = search.observations.coordinate_count() as f64;
    let criterion = |bundle: &Bundle, per_parameter: f64| {
        let cost = (bundle.cost / n).max(search.noise_floor * search.noise_floor);
        n * cost.ln() + bundle.freedom.count() as f64 * per_parameter
    };
    let may = |model: &LensModel| search.allowed.contains(model);
    let bic: Vec<f64> = fitted.iter().map(|(_, bundle)| criterion(bundle, n.ln())).collect();
    let chosen = (0..fitted.len())
        .filter(|i| may(&fitted[*i].0))
        .min_by(|i, j| bic[*i].total_cmp(&bic[*j]))?;
    let doubt = |bundle: &Bundle| criterion(bundle, DOUBT_PER_PARAMETER);
    let chosen_doubt = doubt(&fitted[chosen].1);
    let weights: Vec<f64> = fitted
        .iter()
        .map(|(model, bundle)| {
            // Capped: a sum of weights must stay a number.
            if may(model) { (-0.5 * (doubt(bundle) - chosen_doubt)).min(600.0).exp() } else { 0.0 }
        })
        .collect();
    let total: f64 = weights.iter().sum();
    let fits = fitted
        .iter()
        .zip(bic.iter().zip(&weights))
        .map(|((model, bundle), (bic, weight))| ModelFit {
            model: *model,
            camera: bundle.state.camera,
            cost: bundle.cost,
            bic: *bic,
            weight: weight / total,
            noise_factor: bundle.noise_factor(),
        })
        .collect();
    let bundles = fitted.into_iter().map(|(_, bundle)| bundle).collect();
    let richest_allowed = search.allowed.iter().max().copied()?;
    Some(ModelChoice { fits, bundles, chosen, richest_allowed })
}

impl ModelChoice {
    pub(in crate::calibration) fn fit(&self) -> &ModelFit {
        &self.fits[self.chosen]
    }

    pub(in crate::calibration) fn bundle(&self) -> &Bundle {
        &self.bundles[self.chosen]
    }

    /// Covariance of the chosen lens with the doubt about the model in it:
    /// `Σ w_m (C_m + (θ_m − θ̂)(θ_m − θ̂)ᵀ)` over all models at least as rich as the chosen one.
    ///
    /// Simpler models could only lower it; they are left out. Errors that all views share are added, see
    /// [`SHARED_PP_SD_PX`].
    pub(in crate::calibration) fn averaged_covariance(
        &self,
        noise_floor: f64,
    ) -> Option<LensMatrix> {
        let centre = self.fit().camera.lens_parameters();
        let mut sum = LensMatrix::zeros();
        let mut total = 0.0;
        for (fit, bundle) in self.fits.iter().zip(&self.bundles).skip(self.chosen) {
            let Some(covariance) = bundle.covariance(fit.noise_factor.max(noise_floor)) else {
                continue;
            };
            let there = fit.camera.lens_parameters();
            let off = SMatrix::<f64, LENS_PARAMETERS, 1>::from_fn(|i, _| there[i] - centre[i]);
            sum += (covariance + off * off.transpose()) * fit.weight;
            total += fit.weight;
        }
        let mut averaged = sum / total + shared_error(self.fit().camera.f_px.x);
        if let Some(doubt) = self.model_truncation_covariance(noise_floor) {
            averaged += doubt;
        }
        averaged.iter().all(|x| x.is_finite()).then_some(averaged)
    }

    /// What the coefficients that the chosen model holds at zero may do to its other parameters.
    ///
    /// With `q ~ N(0, T²)` before the corners, what the richest model's information leaves of them is
    /// `N(m, V)`; the chosen lens moves by `B q`. Adds `B (V + m mᵀ) Bᵀ`, weighed by how likely the chosen
    /// model is. `None` if no richer model may be chosen.
    fn model_truncation_covariance(&self, noise_floor: f64) -> Option<LensMatrix> {
        let (fit, bundle) = (self.fit(), self.bundle());
        let (richest, full) = (self.fits.last()?, self.bundles.last()?);
        let allowed = self.richest_allowed.freedom(bundle.freedom.square_pixels);
        let held: Vec<(usize, f64)> = HELD_SD
            .into_iter()
            .filter(|(i, _)| !bundle.freedom.free[*i] && full.freedom.free[*i] && allowed.free[*i])
            .collect();
        if held.is_empty() {
            return None;
        }
        let weight =
            fit.weight / self.fits[self.chosen..].iter().map(|fit| fit.weight).sum::<f64>();
        let noise_factor = richest.noise_factor.max(noise_floor);
        let information = full.information() / (noise_factor * noise_factor);
        // The other parameters, settled: those of the chosen model.
        let others = bundle.covariance(noise_factor)?;
        let (there, here) = (richest.camera.lens_parameters(), fit.camera.lens_parameters());
        let off = SMatrix::<f64, LENS_PARAMETERS, 1>::from_fn(|i, _| there[i] - here[i]);
        let towards = information * off;
        let columns: Vec<_> = held.iter().map(|(i, _)| information.column(*i)).collect();
        let across = OMatrix::<f64, Const<LENS_PARAMETERS>, Dyn>::from_columns(&columns);
        let mut moved_by = -(others * &across);
        let own = DMatrix::from_fn(held.len(), held.len(), |i, j| {
            across[(held[i].0, j)] + across.column(i).dot(&moved_by.column(j))
        });
        let pull = DVector::from_fn(held.len(), |i, _| {
            towards[held[i].0] + moved_by.column(i).dot(&towards)
        });
        // Averaged over how large the coefficients are taken to be, by how well each size foretells them.
        let (mut spread, mut total) = (DMatrix::zeros(held.len(), held.len()), 0.0);
        for (scale, lens_estimate) in HELD_SCALES {
            let prior = DVector::from_fn(held.len(), |i, _| (scale * held[i].1).powi(-2));
            let factors = (&own + DMatrix::from_diagonal(&prior)).cholesky()?;
            let left = factors.inverse();
            let mean = &left * &pull;
            let log_evidence =
                0.5 * (prior.map(f64::ln).sum() - factors.ln_determinant()) + 0.5 * mean.dot(&pull);
            let likely = lens_estimate * log_evidence.min(300.0).exp();
            spread += (left + &mean * mean.transpose()) * likely;
            total += likely;
        }
        spread /= total;
        for (column, (index, _)) in held.iter().enumerate() {
            moved_by[(*index, column)] = 1.0;
        }
        Some(&moved_by * spread * moved_by.transpose() * weight)
    }
}

/// Edges that the lens bends, pixels that are not points: such errors of corners are alike in all views and
/// do not average out. Rendered sessions with known truth show about these, as standard deviations of the
/// principal point and, as a share, of the focal length.
const SHARED_PP_SD_PX: f64 = 0.009;
const SHARED_F_SD: f64 = 1.5e-5;

fn shared_error(f_px: f64) -> LensMatrix {
    let mut variance = LensMatrix::zeros();
    // Both axes alike.
    variance.fixed_view_mut::<2, 2>(0, 0).fill((SHARED_F_SD * f_px).powi(2));
    variance[(2, 2)] = SHARED_PP_SD_PX * SHARED_PP_SD_PX;
    variance[(3, 3)] = variance[(2, 2)];
    variance
}
