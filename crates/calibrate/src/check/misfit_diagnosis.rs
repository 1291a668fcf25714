//! Compares hypotheses for a misfit by BIC, and adds their uncertainty to the covariance.

use nalgebra::{Matrix2, SVector};

use super::{
    cause::{Cause, Family},
    first_steps::FirstStep,
    misfit_models::{Explanation, Unexplained},
    torn_views,
    view_split::{cost_of_search, likeliest_jump, likeliest_split},
};
use crate::solve::bundle::{Bundle, Observations};
use boresight_geometry::{
    Camera, LENS_PARAMETERS, LensMatrix, LensParameter, LensParts, frame::ImageSize,
};

/// Relative scatter of the focal length above which a common focal length is no result: 3 px at f = 1000.
const MAX_FOCAL_SCATTER: f64 = 0.003;
/// Minimum gain in BIC to report a hypothesis: odds of e¹⁰ to 1. Sound views stay below 3.
pub(super) const MIN_BIC_GAIN: f64 = 20.0;
/// Minimum gain in BIC to report a hypothesis with one parameter, which finds less by chance: odds of e⁶ to 1.
const MIN_BIC_GAIN_OF_ONE: f64 = 12.0;
/// Gain by which a hypothesis must beat the next one to be called the cause: odds of e⁵ to 1.
pub(super) const CLEAR_GAIN: f64 = 10.0;
/// Two groups of views whose principal points differ by less than this fraction of the picture's width are one camera,
/// refocused: 5 px at 1280.
const SAME_CENTRE: f64 = 0.004;
/// Standard deviations by which a drift of the focal length must exceed the square root of the gain wanted to be
/// reported with a probability of 95 %.
const POWER_SIGMAS: f64 = 1.645;

/// Prior probability that the focus drifts by itself, as small lenses do while they warm up, and the standard deviation
/// of that drift relative to the focal length.
const DRIFT_PROBABILITY: f64 = 0.3;
const DRIFT_SD: f64 = 6e-3;

/// A fitted hypothesis, with its gain over the plain bundle.
#[derive(Clone, Debug)]
pub(super) struct Hypothesis {
    /// Gain in BIC over the richest plain bundle, less [`cost_of_search`].
    pub(crate) gain: f64,
    pub(super) explanation: Explanation,
}

/// All fitted hypotheses, most probable first.
#[derive(Clone, Debug)]
pub(crate) struct Causes {
    pub(super) hypotheses: Vec<Hypothesis>,
    /// Covariance of the lens from not knowing which hypothesis holds.
    pub(crate) doubt: LensMatrix,
    /// Least relative change of the focal length from the first view to the last that would be reported. `None` if
    /// there are too few views.
    pub(crate) visible_drift: Option<f64>,
}

impl Causes {
    pub(crate) fn none() -> Self {
        Self { hypotheses: Vec::new(), doubt: LensMatrix::zeros(), visible_drift: None }
    }

    /// The most probable hypothesis, if its gain and its effect are large enough to report.
    pub(super) fn best_hypothesis(&self) -> Option<&Hypothesis> {
        let best = self.hypotheses.first()?;
        let is_one = best.explanation.parameters == 1;
        let least = if is_one { MIN_BIC_GAIN_OF_ONE } else { MIN_BIC_GAIN };
        (best.gain > least && best.explanation.is_visible()).then_some(best)
    }

    /// Gain in BIC of [`Self::best_hypothesis`].
    pub(crate) fn best_gain(&self) -> Option<f64> {
        self.best_hypothesis().map(|best| best.gain)
    }

    /// The best hypothesis of each other family that explains the views nearly as well as [`Self::best_hypothesis`].
    pub(super) fn rivals(&self) -> Vec<&Hypothesis> {
        let Some(best) = self.best_hypothesis() else { return Vec::new() };
        let family = best.explanation.cause.family();
        let mut rivals: Vec<&Hypothesis> = Vec::new();
        for hypothesis in &self.hypotheses {
            let other = hypothesis.explanation.cause.family();
            let is_first = rivals.iter().all(|rival| rival.explanation.cause.family() != other);
            if hypothesis.gain > best.gain - CLEAR_GAIN && is_first && family.rivals(other) {
                rivals.push(hypothesis);
            }
        }
        rivals
    }

    /// Covariance of the lens under `best`, from hypotheses of its family that may hold instead. Other families are
    /// examined again after the correction for `best`.
    pub(super) fn doubt_beside(&self, best: &Hypothesis) -> LensMatrix {
        let there = best.explanation.state.bundle.camera.lens_parameters();
        let odds = |gain: f64| libm::exp(0.5 * (gain - best.gain)).min(1.0);
        let family = best.explanation.cause.family();
        let alike = self.hypotheses.iter().filter(|h| h.explanation.cause.family() == family);
        let total: f64 = alike.clone().map(|hypothesis| odds(hypothesis.gain)).sum();
        let spread = |hypothesis: &Hypothesis| {
            let lens = hypothesis.explanation.state.bundle.camera.lens_parameters();
            let off = SVector::<f64, LENS_PARAMETERS>::from_fn(|i, _| lens[i] - there[i]);
            off * off.transpose() * (odds(hypothesis.gain) / total)
        };
        alike.map(spread).sum()
    }

    /// Relative scatter of the focal length, if a moving focus is the best hypothesis and the scatter too large for a common
    /// focal length.
    pub(crate) fn focus_moved(&self) -> Option<f64> {
        let best = self.best_hypothesis()?;
        let is_focus = best.explanation.cause.family() == Family::Focus;
        let relative_sd = best.explanation.focal_relative_sd();
        (is_focus && relative_sd > MAX_FOCAL_SCATTER).then_some(relative_sd)
    }
}

/// Fits every hypothesis, starting from the minimum of `bundle`, the richest plain one. `result` is the lens whose
/// doubt is computed; `noise_gain` is the gain in BIC from correlated noise.
pub(crate) fn causes(
    observations: &Observations,
    bundle: &Bundle,
    result: &Camera,
    image_size: ImageSize,
    noise_floor: f64,
    noise_gain: f64,
) -> Causes {
    let n = observations.coordinate_count() as f64;
    let unexplained = Unexplained::by(bundle, observations, image_size, noise_floor, noise_gain);
    let mut all = vec![
        Cause::Focus,
        Cause::FocusDrift,
        Cause::BoardStretched,
        Cause::BoardBent,
        Cause::BoardFlexes,
        Cause::PixelSkew,
        Cause::RollingShutter,
        Cause::Shifted,
        Cause::LensShape,
        Cause::SmoothField,
    ];
    all.extend(bundle.freedom.square_pixels.then_some(Cause::PixelAspect));
    all.extend(likeliest_jump(bundle).map(Cause::FocusJump));
    all.extend(likeliest_split(bundle).map(Cause::Mixed));
    all.extend(torn_views::suspects(observations, &bundle.state).map(Cause::Torn));
    let (explanations, drift) = unexplained.explain_all(all);
    let mut hypotheses: Vec<Hypothesis> = explanations
        .into_iter()
        .map(|explanation| {
            let searched = cost_of_search(&explanation.cause, observations.view_count());
            Hypothesis { gain: explanation.gain - searched, explanation }
        })
        .collect();
    hypotheses.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    prefer_focus(&mut hypotheses, image_size);
    prefer_common_bend(&mut hypotheses);
    let mut doubt = doubt(&hypotheses, bundle, result, n);
    // The views count the evidence for a drift, too.
    let noise_factor = bundle.noise_factor().max(noise_floor);
    let overcount = bundle
        .scatter(noise_factor)
        .map_or(1.0, |scatter| scatter.overcount(observations.view_count()));
    let noise_variance = noise_factor.powi(2) * overcount;
    if let Some(FirstStep { value, unit_variance, .. }) = drift {
        add_to_f(&mut doubt, unseen_drift(value, unit_variance * noise_variance), result);
    }
    let visible_drift = drift.map(|step| {
        let sd = (step.unit_variance * noise_variance).sqrt();
        ((MIN_BIC_GAIN_OF_ONE + libm::log(n)).sqrt() + POWER_SIGMAS) * sd
    });
    Causes { hypotheses, doubt, visible_drift }
}

/// Moves the best hypothesis about focus to the front if the best hypothesis is two cameras with the same principal point.
fn prefer_focus(hypotheses: &mut [Hypothesis], image_size: ImageSize) {
    let Some(first) = hypotheses.first() else { return };
    if !matches!(first.explanation.cause, Cause::Mixed(_)) {
        return;
    }
    let state = &first.explanation.state;
    let shift_px = libm::hypot(state.shared[1], state.shared[2]) * state.bundle.camera.f_px.x;
    if shift_px > SAME_CENTRE * f64::from(image_size.width_px) {
        return;
    }
    let gain = first.gain;
    let focus = hypotheses.iter().position(|s| {
        s.explanation.cause.family() == Family::Focus && s.gain > MIN_BIC_GAIN.min(0.5 * gain)
    });
    if let Some(focus) = focus {
        hypotheses[..=focus].rotate_right(1);
    }
}

/// Puts a board that is bent alike in all views in place of one that bends from view to view, if it's a finding by itself:
/// what all views share is corrected first.
fn prefer_common_bend(hypotheses: &mut Vec<Hypothesis>) {
    let place = |cause: Cause| hypotheses.iter().position(|h| h.explanation.cause == cause);
    let (Some(0), Some(bent)) = (place(Cause::BoardFlexes), place(Cause::BoardBent)) else {
        return;
    };
    if hypotheses[bent].gain > MIN_BIC_GAIN {
        hypotheses[..=bent].rotate_right(1);
        hypotheses.retain(|h| h.explanation.cause != Cause::BoardFlexes);
    }
}

/// Covariance from averaging over the hypotheses: `Σ w (s² C + d dᵀ − s₀² C₀)`, with weights in proportion to the odds
/// `e^(gain/2)`; the plain bundle's is 1.
fn doubt(hypotheses: &[Hypothesis], bundle: &Bundle, result: &Camera, n: f64) -> LensMatrix {
    let mut doubt = LensMatrix::zeros();
    let most = hypotheses.iter().map(|s| s.gain).fold(0.0, f64::max);
    let odds = |gain: f64| libm::exp(0.5 * (gain - most));
    let total = odds(0.0) + hypotheses.iter().map(|s| odds(s.gain)).sum::<f64>();
    let Some(plain) = bundle.covariance(bundle.noise_factor()) else { return doubt };
    let there = result.lens_parameters();
    for Hypothesis { gain, explanation } in hypotheses {
        let is_one_of_focus =
            explanation.cause.family() == Family::Focus && explanation.parameters == 1;
        if is_one_of_focus && *gain < MIN_BIC_GAIN_OF_ONE {
            // `unseen_drift` covers this, with the better prior.
            continue;
        }
        let lens = explanation.state.bundle.camera.lens_parameters();
        let off = SVector::<f64, LENS_PARAMETERS>::from_fn(|i, _| lens[i] - there[i]);
        let freedom = bundle.freedom.count() + 6 * explanation.state.local.len();
        let variance = explanation.noise_variance(n, freedom);
        let mut spread = explanation.unit_covariance * variance + off * off.transpose();
        add_to_f(&mut spread, explanation.focal_spread().powi(2), result);
        let more = spread - plain;
        // Only positive parts: a hypothesis must not make the result look more certain.
        doubt += positive_part(&more) * (odds(*gain) / total);
    }
    doubt
}

/// Adds `relative_variance` of the focal length to a covariance.
fn add_to_f(covariance: &mut LensMatrix, relative_variance: f64, result: &Camera) {
    let f_px = result.f_px;
    let more = Matrix2::from_fn(|i, j| relative_variance * f_px[i] * f_px[j]);
    covariance.set_block(LensParameter::F, LensParameter::F, &(covariance.f() + more));
}

/// Relative variance of the focal length after the last view from a drift too small to detect: by its prior, a quarter
/// of the mean square of a drift that was measured as `measured` with `variance`.
fn unseen_drift(measured: f64, variance: f64) -> f64 {
    let prior = DRIFT_SD * DRIFT_SD;
    let sum = prior + variance;
    // Likelihood ratio of a drift to no drift.
    let ratio =
        (variance / sum).sqrt() * libm::exp(0.5 * measured * measured * prior / (variance * sum));
    let odds = ratio * DRIFT_PROBABILITY / (1.0 - DRIFT_PROBABILITY);
    let probability = if odds.is_finite() { odds / (1.0 + odds) } else { 1.0 };
    let (mean, left) = (measured * prior / sum, variance * prior / sum);
    0.25 * probability * (mean * mean + left)
}

/// The positive part of a symmetric matrix, by its eigenvalues after scaling to a unit diagonal.
pub(super) fn positive_part(matrix: &LensMatrix) -> LensMatrix {
    let scale = SVector::<f64, LENS_PARAMETERS>::from_fn(|i, _| {
        let size = matrix[(i, i)].abs().sqrt();
        if size > 0.0 { size } else { 1.0 }
    });
    let scaled = LensMatrix::from_fn(|i, j| matrix[(i, j)] / (scale[i] * scale[j]));
    let mut eigen = nalgebra::SymmetricEigen::new(scaled);
    eigen.eigenvalues.iter_mut().for_each(|value| *value = value.max(0.0));
    let positive = eigen.recompose();
    LensMatrix::from_fn(|i, j| positive[(i, j)] * scale[i] * scale[j])
}
