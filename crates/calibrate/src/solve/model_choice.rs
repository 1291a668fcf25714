//! Chooses the lens model by BIC, and adds the uncertainty of the choice to the covariance.

use nalgebra::{Const, DMatrix, DVector, Dyn, Matrix2, OMatrix, SMatrix};

use super::{
    bundle::{Bundle, BundleState, Observations, adjust_from},
    lens_model::{LensModel, LensPrior},
    reversal::with_better_tilts,
    schur_lm::Limits,
};
use boresight_geometry::{Camera, LENS_PARAMETERS, LensMatrix, LensParameter, LensParts};

/// Penalty per parameter in the weights of model averaging, in place of BIC's ln n.
///
/// BIC's penalty ln n amounts to a prior on each coefficient √n times as wide as its standard error
/// (Kass & Raftery 1995), far wider than the variation of lenses, and so underrates rich models.
/// 4.5 ≈ ln 10² corresponds to a prior ten times as wide.
const AVERAGING_PENALTY: f64 = 4.5;

/// Ratio of a view's cost to the median from which a reversal is tried under each richer lens
/// model.
const SUSPICIOUS: f64 = 1.5;
/// Relative difference of the costs of two fits of one model at the same minimum.
pub(crate) const SAME_COST: f64 = 1e-6;
/// Most such trials.
const MOST_REVERSALS: usize = 4;

/// Fit of a lens model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ModelFit {
    /// Lens model of the fit.
    pub model: LensModel,
    /// Fitted lens.
    pub camera: Camera,
    /// Sum of squared whitened residuals.
    pub cost: f64,
    /// Bayesian information criterion `n ln(cost/n) + k ln n`; the smallest is chosen.
    pub bic: f64,
    /// Probability of the model given the corners, `∝ exp(−(n ln(cost/n) + 4.5 k)/2)`; zero for
    /// models fitted only as a check.
    pub weight: f64,
    /// σ₀ of this fit, see [`Bundle::noise_factor`].
    pub noise_factor: f64,
}

/// Multiples of [`LensModel::truncated_sd`], with the prior probability of each: most lenses are
/// good, some are not.
const TRUNCATED_SCALES: [(f64, f64); 2] = [(1.0, 0.7), (6.0, 0.3)];

/// Fitted models, with the chosen model.
#[derive(Clone, Debug)]
pub(crate) struct ModelChoice {
    pub(crate) fits: Vec<ModelFit>,
    /// True if a view was reversed.
    pub(crate) reversed: bool,
    /// Bundles in the order of `fits`.
    pub(crate) bundles: Vec<Bundle>,
    pub(crate) chosen: usize,
    /// Richest model allowed.
    pub(crate) richest_allowed: LensModel,
}

/// Arguments of [`fit_models`].
pub(crate) struct ModelSearch<'a> {
    pub(crate) observations: &'a Observations,
    /// Models to fit, simplest first.
    pub(crate) models: &'a [LensModel],
    /// Models allowed as the result; the others serve only as a check.
    pub(crate) allowed: &'a [LensModel],
    pub(crate) square_pixels: bool,
    pub(crate) prior: Option<&'a LensPrior>,
    /// Smallest credible noise factor.
    pub(crate) noise_floor: f64,
}

/// Stage at which reversed tilts are tried.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Reversals {
    /// Reversals of all views under the simplest model, and of suspicious views under each richer
    /// model.
    Early,
    /// Reversals of suspicious views under the richest model: a lens far from the simplest model
    /// may reverse views wrongly.
    Late,
}

/// Fits the models in order, each starting from the previous result, the first from `start`.
///
/// `None` if no allowed model can be fitted, or if the simplest model's fit `is_known`: the others
/// follow from it.
pub(crate) fn fit_models(
    search: &ModelSearch<'_>,
    start: BundleState,
    reversals: Reversals,
    is_known: impl Fn(&Bundle) -> bool,
) -> Option<ModelChoice> {
    let (mut state, mut reversed) = (start, false);
    let mut fitted: Vec<(LensModel, Bundle)> = Vec::with_capacity(search.models.len());
    for (place, model) in search.models.iter().enumerate() {
        let suspicious = match reversals {
            Reversals::Early if place == 0 => 0.0,
            Reversals::Late if place + 1 < search.models.len() => f64::INFINITY,
            Reversals::Early | Reversals::Late => SUSPICIOUS,
        };
        // The step from no distortion to some is long.
        let is_near = place >= 2 && model.is_near_simpler();
        let limits = if is_near { Limits::NEAR } else { Limits::GUESS };
        let start = (state, limits);
        let Some(bundle) = search.fit(*model, start, suspicious, &mut reversed) else { break };
        if place == 0 && is_known(&bundle) {
            return None;
        }
        state = bundle.state.clone();
        fitted.push((*model, bundle));
    }
    let n = search.observations.coordinate_count() as f64;
    let criterion = |bundle: &Bundle, per_parameter: f64| {
        let cost = (bundle.cost / n).max(search.noise_floor * search.noise_floor);
        n * libm::log(cost) + bundle.freedom.count() as f64 * per_parameter
    };
    let may = |model: &LensModel| search.allowed.contains(model);
    let bic: Vec<f64> = fitted.iter().map(|(_, bundle)| criterion(bundle, libm::log(n))).collect();
    let chosen = (0..fitted.len())
        .filter(|i| may(&fitted[*i].0))
        .min_by(|i, j| bic[*i].total_cmp(&bic[*j]))?;
    let penalised = |bundle: &Bundle| criterion(bundle, AVERAGING_PENALTY);
    let chosen_cost = penalised(&fitted[chosen].1);
    let weights: Vec<f64> = fitted
        .iter()
        .map(|(model, bundle)| {
            // Capped, so that the sum of weights stays finite.
            if may(model) {
                libm::exp((-0.5 * (penalised(bundle) - chosen_cost)).min(600.0))
            } else {
                0.0
            }
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
    Some(ModelChoice { fits, reversed, bundles, chosen, richest_allowed })
}

impl ModelSearch<'_> {
    /// Bundle of a model, after reversals of views that improve the fit. Sets `reversed` if there
    /// are any.
    fn fit(
        &self,
        model: LensModel,
        (mut start, limits): (BundleState, Limits),
        suspicious: f64,
        reversed: &mut bool,
    ) -> Option<Bundle> {
        start.camera = model.without_others(&start.camera);
        let freedom = model.freedom(self.square_pixels);
        let own_prior = model.own_prior();
        let prior = self.prior.or(own_prior.as_ref());
        let adjust = |start, limits| adjust_from(self.observations, &freedom, prior, start, limits);
        let mut bundle = adjust(start, limits)?;
        for _ in 0..MOST_REVERSALS {
            let Some(state) = with_better_tilts(self.observations, &bundle.state, suspicious)
            else {
                break;
            };
            let again = adjust(state, Limits::GUESS).filter(|again| again.cost < bundle.cost);
            let Some(again) = again else { break };
            (bundle, *reversed) = (again, true);
        }
        Some(bundle)
    }
}

impl ModelChoice {
    pub(crate) fn fit(&self) -> &ModelFit {
        &self.fits[self.chosen]
    }

    pub(crate) fn bundle(&self) -> &Bundle {
        &self.bundles[self.chosen]
    }

    /// Covariance of the chosen lens including model uncertainty, by model averaging:
    /// `Σ w_m (C_m + (θ_m − θ̂)(θ_m − θ̂)ᵀ)` over all models at least as rich as the chosen one.
    ///
    /// Simpler models are left out because they would lower it. Errors shared by all views are
    /// added, see [`SHARED_SD_PX`]. For the coefficients fixed at zero by the chosen model, the
    /// information of the corners is divided by `overcount`, 1 for independent errors. `covariance`
    /// gives `C_m` of a bundle with a noise factor. `None` if the result isn't finite.
    pub(crate) fn averaged_covariance(
        &self,
        noise_floor: f64,
        overcount: f64,
        covariance: impl Fn(&Bundle, f64) -> Option<LensMatrix>,
    ) -> Option<LensMatrix> {
        let centre = self.fit().camera.lens_parameters();
        let mut sum = LensMatrix::zeros();
        let mut total = 0.0;
        for (fit, bundle) in self.fits.iter().zip(&self.bundles).skip(self.chosen) {
            let Some(covariance) = covariance(bundle, fit.noise_factor.max(noise_floor)) else {
                continue;
            };
            let there = fit.camera.lens_parameters();
            let off = SMatrix::<f64, LENS_PARAMETERS, 1>::from_fn(|i, _| there[i] - centre[i]);
            sum += (covariance + off * off.transpose()) * fit.weight;
            total += fit.weight;
        }
        let mut averaged = sum / total + shared_error(self.fit().camera.f_px.x);
        if let Some(doubt) = self.model_truncation_covariance(noise_floor, overcount) {
            averaged += doubt;
        }
        averaged.iter().all(|x| x.is_finite()).then_some(averaged)
    }

    /// Covariance from the coefficients `q` fixed at zero by the chosen model.
    ///
    /// With the prior `q ~ N(0, T²)`, the information of the richest model gives the posterior
    /// `N(m, V)`, and the chosen lens moves by `B q`. Returns `B (V + m mᵀ) Bᵀ` times the weight of
    /// the chosen model. `None` if no richer model is allowed.
    fn model_truncation_covariance(&self, noise_floor: f64, overcount: f64) -> Option<LensMatrix> {
        let (fit, bundle) = (self.fit(), self.bundle());
        let (richest, full) = (self.fits.last()?, self.bundles.last()?);
        let allowed = self.richest_allowed.freedom(bundle.freedom.square_pixels);
        let truncated: Vec<(usize, f64)> = fit
            .model
            .truncated_sd()
            .iter()
            .map(|(parameter, sd)| (parameter.index(), *sd))
            .filter(|(i, _)| !bundle.freedom.free[*i] && full.freedom.free[*i] && allowed.free[*i])
            .collect();
        if truncated.is_empty() {
            return None;
        }
        let weight =
            fit.weight / self.fits[self.chosen..].iter().map(|fit| fit.weight).sum::<f64>();
        let noise_factor = richest.noise_factor.max(noise_floor) * overcount.sqrt();
        let information = full.information() / (noise_factor * noise_factor);
        // Covariance of the chosen model's other parameters.
        let others = bundle.covariance(noise_factor)?;
        let (there, here) = (richest.camera.lens_parameters(), fit.camera.lens_parameters());
        let off = SMatrix::<f64, LENS_PARAMETERS, 1>::from_fn(|i, _| there[i] - here[i]);
        let towards = information * off;
        let columns: Vec<_> = truncated.iter().map(|(i, _)| information.column(*i)).collect();
        let across = OMatrix::<f64, Const<LENS_PARAMETERS>, Dyn>::from_columns(&columns);
        let mut moved_by = -(others * &across);
        let precision = DMatrix::from_fn(truncated.len(), truncated.len(), |i, j| {
            across[(truncated[i].0, j)] + across.column(i).dot(&moved_by.column(j))
        });
        let pull = DVector::from_fn(truncated.len(), |i, _| {
            towards[truncated[i].0] + moved_by.column(i).dot(&towards)
        });
        // Average over the widths of the prior, weighted by the evidence for each.
        let (mut spread, mut total) = (DMatrix::zeros(truncated.len(), truncated.len()), 0.0);
        for (scale, probability) in TRUNCATED_SCALES {
            let prior = DVector::from_fn(truncated.len(), |i, _| (scale * truncated[i].1).powi(-2));
            let factors = (&precision + DMatrix::from_diagonal(&prior)).cholesky()?;
            let left = factors.inverse();
            let mean = &left * &pull;
            let log_evidence = 0.5 * (prior.map(libm::log).sum() - factors.ln_determinant())
                + 0.5 * mean.dot(&pull);
            let likely = probability * libm::exp(log_evidence.min(300.0));
            spread += (left + &mean * mean.transpose()) * likely;
            total += likely;
        }
        spread /= total;
        for (column, (index, _)) in truncated.iter().enumerate() {
            moved_by[(*index, column)] = 1.0;
        }
        Some(&moved_by * spread * moved_by.transpose() * weight)
    }
}

/// Standard deviations of the principal point, and relative ones of the focal length, from errors
/// shared by all views, which don't average out: edges bent by the lens, pixels that integrate over
/// their area. Measured on rendered sessions with known truth. Interpolation in a rectified picture
/// adds an error of the same size to the corners.
pub(super) const SHARED_SD_PX: f64 = 0.009;
const SHARED_F_SD: f64 = 1.5e-5;

fn shared_error(f_px: f64) -> LensMatrix {
    let mut variance = LensMatrix::zeros();
    // Equal along both axes, and fully correlated.
    let of_f = Matrix2::from_element((SHARED_F_SD * f_px).powi(2));
    variance.set_block(LensParameter::F, LensParameter::F, &of_f);
    let of_pp = Matrix2::from_diagonal_element(SHARED_SD_PX * SHARED_SD_PX);
    variance.set_block(LensParameter::PP, LensParameter::PP, &of_pp);
    variance
}
