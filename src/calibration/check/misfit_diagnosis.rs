//! Compares hypotheses for a misfit by BIC, and adds their uncertainty to the covariance.

use nalgebra::{Matrix3, SVector, Vector3};
use statrs::function::factorial::ln_binomial;

use super::{
    extended_bundle::Cause,
    misfit_models::{Explanation, explain},
    torn_views,
};
use crate::{
    calibration::solve::{
        bundle::{Bundle, Observations},
        schur_lm::inverse,
    },
    frame::ImageSize,
    geometry::LENS_PARAMETERS,
};

type LensMatrix = nalgebra::SMatrix<f64, LENS_PARAMETERS, LENS_PARAMETERS>;

/// Relative scatter of the focal length above which a common focal length is no result: 3 px at f = 1000.
const MAX_FOCAL_SCATTER: f64 = 0.003;
/// Minimum gain in BIC to report a hypothesis: odds of e¹⁰ to 1. Sound views stay below 3.
pub(super) const MIN_BIC_GAIN: f64 = 20.0;
/// Two groups of views whose principal points differ by less than this fraction of the picture's width are one camera,
/// refocused: 5 px at 1280.
const SAME_CENTRE: f64 = 0.004;

/// A fitted hypothesis, and how much better it explains the corners than the plain bundle.
#[derive(Clone, Debug)]
pub(super) struct Hypothesis {
    /// Gain in BIC over the richest plain bundle, `n ln(cost₀/cost) − k ln n`, less [`cost_of_search`].
    pub(in crate::calibration) gain: f64,
    pub(super) explanation: Explanation,
}

/// All fitted hypotheses, most probable first.
#[derive(Clone, Debug)]
pub(in crate::calibration) struct Causes {
    pub(super) hypotheses: Vec<Hypothesis>,
    /// Gain in BIC from correlated noise, if any: it competes with the hypotheses, for it explains residuals, too.
    noise_gain: f64,
    /// Covariance of the lens from not knowing which hypothesis holds.
    pub(in crate::calibration) doubt: LensMatrix,
}

impl Causes {
    pub(in crate::calibration) fn none() -> Self {
        Self { hypotheses: Vec::new(), noise_gain: 0.0, doubt: LensMatrix::zeros() }
    }

    /// The most probable hypothesis, if its gain is large enough to report and correlated noise doesn't explain as much.
    pub(super) fn best_hypothesis(&self) -> Option<&Hypothesis> {
        let least = MIN_BIC_GAIN.max(self.noise_gain);
        self.hypotheses.first().filter(|hypothesis| hypothesis.gain > least)
    }

    /// Relative scatter of the focal length, if a moving focus is the best hypothesis and the scatter too large for a common
    /// focal length.
    pub(in crate::calibration) fn focus_moved(&self) -> Option<f64> {
        let hypothesis = self.best_hypothesis().filter(|s| s.explanation.cause == Cause::Focus)?;
        let relative_sd = hypothesis.explanation.state.focal_relative_sd();
        (relative_sd > MAX_FOCAL_SCATTER).then_some(relative_sd)
    }
}

/// Fits every hypothesis, starting from the minimum of `bundle`, the richest plain one. `noise_gain` is what correlated
/// noise gains in BIC.
pub(in crate::calibration) fn causes(
    observations: &Observations,
    bundle: &Bundle,
    image_size: ImageSize,
    noise_floor: f64,
    noise_gain: f64,
) -> Causes {
    let n = observations.coordinate_count() as f64;
    let views = observations.view_count();
    let square_pixels = bundle.freedom.square_pixels;
    let least = n * noise_floor * noise_floor;
    let cost = bundle.cost.max(least);
    let mut all = vec![
        Cause::Focus,
        Cause::BoardStretched,
        Cause::BoardBent,
        Cause::RollingShutter,
        Cause::LensShape,
    ];
    all.extend(square_pixels.then_some(Cause::PixelAspect));
    all.extend(likeliest_split(bundle).map(Cause::Mixed));
    all.extend(torn_views::suspects(observations, &bundle.state).map(Cause::Torn));
    let mut hypotheses: Vec<Hypothesis> = all
        .into_iter()
        .filter_map(|cause| {
            // Fitted only if the first step promises to gain most of what the parameters cost.
            let k = cause.parameters(views) as f64;
            let worth = cost * (-0.8 * k * n.ln() / n).exp();
            let explanation =
                explain(observations, cause, image_size, &bundle.state, square_pixels, worth)?;
            let searched = match &explanation.cause {
                Cause::Mixed(odd) => cost_of_search(odd),
                _ => 0.0,
            };
            let gain = n * (cost / explanation.cost.max(least)).ln() - k * n.ln() - searched;
            Some(Hypothesis { gain, explanation })
        })
        .collect();
    hypotheses.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    prefer_focus(&mut hypotheses, image_size);
    let noise_gain = noise_gain.max(0.0);
    let doubt = doubt(&hypotheses, bundle, n, noise_gain);
    Causes { hypotheses, noise_gain, doubt }
}

/// Moves `Focus` to the front if the best hypothesis is two cameras with the same principal point.
fn prefer_focus(hypotheses: &mut [Hypothesis], image_size: ImageSize) {
    let Some(first) = hypotheses.first() else { return };
    if !matches!(first.explanation.cause, Cause::Mixed(_)) {
        return;
    }
    let state = &first.explanation.state;
    let shift_px = state.shared[1].hypot(state.shared[2]) * state.bundle.camera.f_px.x;
    if shift_px > SAME_CENTRE * f64::from(image_size.width_px) {
        return;
    }
    let gain = first.gain;
    let focus = hypotheses
        .iter()
        .position(|s| s.explanation.cause == Cause::Focus && s.gain > MIN_BIC_GAIN.min(0.5 * gain));
    if let Some(focus) = focus {
        hypotheses[..=focus].rotate_right(1);
    }
}

/// Covariance added by averaging over the hypotheses: `Σ w (s² C + d dᵀ − s₀² C₀)`, with weights in proportion to the odds
/// `e^(gain/2)`; the plain bundle counts with the gain of its noise.
fn doubt(hypotheses: &[Hypothesis], bundle: &Bundle, n: f64, noise_gain: f64) -> LensMatrix {
    let mut doubt = LensMatrix::zeros();
    let most = hypotheses.iter().map(|s| s.gain).fold(noise_gain, f64::max);
    let odds = |gain: f64| (0.5 * (gain - most)).exp();
    let total = odds(noise_gain) + hypotheses.iter().map(|s| odds(s.gain)).sum::<f64>();
    let Some(plain) = bundle.covariance(bundle.noise_factor()) else { return doubt };
    let there = bundle.state.camera.lens_parameters();
    for Hypothesis { gain, explanation } in hypotheses {
        let lens = explanation.state.bundle.camera.lens_parameters();
        let off = SVector::<f64, LENS_PARAMETERS>::from_fn(|i, _| lens[i] - there[i]);
        let parameters = bundle.freedom.count() + 6 * explanation.state.local.len();
        let freedom = (n - (parameters + explanation.parameters) as f64).max(1.0);
        let variance = explanation.cost / freedom;
        let mut spread = explanation.unit_covariance * variance + off * off.transpose();
        if explanation.cause == Cause::Focus {
            let f_px = lens[0];
            let logs = explanation.state.local.iter().map(|local| local[0]);
            let of_f = f_px * f_px * logs.clone().map(|x| x * x).sum::<f64>() / logs.count() as f64;
            for (i, j) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                spread[(i, j)] += of_f;
            }
        }
        let more = spread - plain;
        // Only positive parts: a hypothesis must not make the result look more certain.
        doubt += positive_part(&more) * (odds(*gain) / total);
    }
    doubt
}

/// The part of a symmetric matrix with positive eigenvalues, computed after scaling to a unit diagonal.
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

/// Splits the views into the two groups that disagree most about f and the principal point, and marks the smaller.
///
/// With `I` and `g` the information and gradient of each view, splitting into A and B gains `gₐᵀ(Iₐ⁻¹ + I_b⁻¹)gₐ`. Tries
/// consecutive views, and views sorted by the shift of each parameter; then improves the best split view by view. `None`
/// with fewer than four views.
fn likeliest_split(bundle: &Bundle) -> Option<Vec<bool>> {
    const PP_AND_F: [usize; 3] = [0, 2, 3];
    let views: Vec<Pull> = bundle
        .view_information()
        .iter()
        .map(|(information, gradient)| Pull {
            information: Matrix3::from_fn(|i, j| information[(PP_AND_F[i], PP_AND_F[j])]),
            gradient: Vector3::from_fn(|i, _| gradient[PP_AND_F[i]]),
        })
        .collect();
    let count = views.len();
    if count < 4 {
        return None;
    }
    let all = views.iter().fold(Pull::zero(), |sum, view| sum.with(view, 1.0));
    let gain = |odd: &Pull| -> Option<f64> {
        let (first, second) =
            (inverse(&(all.information - odd.information))?, inverse(&odd.information)?);
        Some((odd.gradient.transpose() * (first + second) * odd.gradient).x)
    };
    let mut orders: Vec<Vec<usize>> = vec![(0..count).collect()];
    for i in 0..3 {
        let mut order: Vec<usize> = (0..count).collect();
        let pull = |view: usize| {
            views[view].gradient[i] / views[view].information[(i, i)].max(f64::MIN_POSITIVE)
        };
        order.sort_by(|a, b| pull(*a).total_cmp(&pull(*b)));
        orders.push(order);
    }
    let mut best: Option<(f64, Vec<bool>)> = None;
    for order in orders {
        let mut group = Pull::zero();
        let mut most: Option<(f64, usize)> = None;
        for (taken, view) in order.iter().take(count - 1).enumerate() {
            group = group.with(&views[*view], 1.0);
            if let Some(gain) = gain(&group)
                && most.is_none_or(|(most, _)| gain > most)
            {
                most = Some((gain, taken + 1));
            }
        }
        if let Some((gain, taken)) = most
            && best.as_ref().is_none_or(|(most, _)| gain > *most)
        {
            let mut odd = vec![false; count];
            order[..taken].iter().for_each(|view| odd[*view] = true);
            best = Some((gain, odd));
        }
    }
    let (mut most, mut odd) = best?;
    let marked = views.iter().zip(&odd).filter(|(_, odd)| **odd);
    let mut group = marked.fold(Pull::zero(), |sum, (view, _)| sum.with(view, 1.0));
    let mut changed = true;
    while changed {
        changed = false;
        for view in 0..count {
            let moved = group.with(&views[view], if odd[view] { -1.0 } else { 1.0 });
            if let Some(better) = gain(&moved).filter(|gain| *gain > most * (1.0 + 1e-9)) {
                (most, group, changed) = (better, moved, true);
                odd[view] = !odd[view];
            }
        }
    }
    if 2 * odd.iter().filter(|odd| **odd).count() > count {
        odd.iter_mut().for_each(|odd| *odd = !*odd);
    }
    Some(odd)
}

/// What views tell about f and the principal point.
#[derive(Clone, Copy)]
struct Pull {
    information: Matrix3<f64>,
    gradient: Vector3<f64>,
}

impl Pull {
    fn zero() -> Self {
        Self { information: Matrix3::zeros(), gradient: Vector3::zeros() }
    }

    fn with(&self, other: &Self, times: f64) -> Self {
        Self {
            information: self.information + other.information * times,
            gradient: self.gradient + other.gradient * times,
        }
    }
}

/// What a split costs in BIC for having been searched for: twice the logarithm of how many splits are as simple. A
/// split into consecutive views is one of `N`; any other one of `N` sizes and of those with its size.
///
/// Noise alone gains about 0.64 `N` by the best of 2ᴺ splits.
fn cost_of_search(odd: &[bool]) -> f64 {
    let (views, marked) = (odd.len() as u64, odd.iter().filter(|odd| **odd).count() as u64);
    let changes = odd.windows(2).filter(|pair| pair[0] != pair[1]).count();
    let of_this_size = if changes == 1 { 0.0 } else { ln_binomial(views, marked) };
    2.0 * ((views as f64).ln() + of_this_size)
}
