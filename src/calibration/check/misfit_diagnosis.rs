//! Which of the things that go wrong explains a misfit best, and what not knowing it costs.

use nalgebra::{Matrix3, SVector, Vector3};

use super::misfit_models::{Cause, Explanation, explain};
use crate::{
    calibration::solve::{
        bundle::{Bundle, Observations},
        schur_lm::inverse,
    },
    frame::ImageSize,
    geometry::LENS_PARAMETERS,
};

type LensMatrix = nalgebra::SMatrix<f64, LENS_PARAMETERS, LENS_PARAMETERS>;

/// Scatter of the focal length, relative, from which one focal length is no result.
const FOCUS_BAD: f64 = 0.003;
/// Gain in BIC from which a cause is told: odds of e¹⁰ to 1. Sound views stay below 3.
const TOLD: f64 = 20.0;
/// Views of one camera, of which some were sorted out as another's, differ by no more than this share
/// of the picture's width: then it is the focal length that moved.
const SAME_CENTRE: f64 = 0.004;

/// One thing that may have gone wrong, and how much better it explains the corners.
#[derive(Clone, Debug)]
pub(super) struct Hypothesis {
    /// `n ln(cost₀/cost) − k ln n` over the richest plain bundle.
    pub(in crate::calibration) gain: f64,
    pub(super) explanation: Explanation,
}

/// All suspects, likeliest first.
#[derive(Clone, Debug)]
pub(in crate::calibration) struct Causes {
    pub(super) suspects: Vec<Hypothesis>,
    /// What the doubt about them adds to the covariance of the lens.
    pub(in crate::calibration) doubt: LensMatrix,
}

impl Causes {
    pub(in crate::calibration) fn none() -> Self {
        Self { suspects: Vec::new(), doubt: LensMatrix::zeros() }
    }

    /// The likeliest, if it is far likelier than that nothing is wrong.
    pub(super) fn best_hypothesis(&self) -> Option<&Hypothesis> {
        self.suspects.first().filter(|suspect| suspect.gain > TOLD)
    }

    /// Scatter of the focal length over its mean, if it is what moved, and by more than one focal length
    /// can stand for.
    pub(in crate::calibration) fn focus_moved(&self) -> Option<f64> {
        let suspect = self.best_hypothesis().filter(|s| s.explanation.cause == Cause::Focus)?;
        let relative_sd = suspect.explanation.state.focal_relative_sd();
        (relative_sd > FOCUS_BAD).then_some(relative_sd)
    }
}

/// Fits every cause from the minimum of `bundle`, the richest plain one.
pub(in crate::calibration) fn causes(
    observations: &Observations,
    bundle: &Bundle,
    image_size: ImageSize,
    noise_floor: f64,
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
    let mut suspects: Vec<Hypothesis> = all
        .into_iter()
        .filter_map(|cause| {
            // Not worth fitting unless the first step gains about what its parameters cost.
            let k = cause.parameters(views) as f64;
            let worth = cost * (-0.8 * k * n.ln() / n).exp();
            let explanation =
                explain(observations, cause, image_size, &bundle.state, square_pixels, worth)?;
            let gain = n * (cost / explanation.cost.max(least)).ln() - k * n.ln();
            Some(Hypothesis { gain, explanation })
        })
        .collect();
    suspects.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    prefer_focus(&mut suspects, image_size);
    let doubt = doubt(&suspects, bundle, n);
    Causes { suspects, doubt }
}

/// Two groups of views with different focal lengths and the same centre are one camera refocused.
fn prefer_focus(suspects: &mut [Hypothesis], image_size: ImageSize) {
    let Some(first) = suspects.first() else { return };
    if !matches!(first.explanation.cause, Cause::Mixed(_)) {
        return;
    }
    let state = &first.explanation.state;
    let shift_px = state.shared[1].hypot(state.shared[2]) * state.bundle.camera.f_px.x;
    if shift_px > SAME_CENTRE * f64::from(image_size.width_px) {
        return;
    }
    let gain = first.gain;
    let focus = suspects
        .iter()
        .position(|s| s.explanation.cause == Cause::Focus && s.gain > TOLD.min(0.5 * gain));
    if let Some(focus) = focus {
        suspects[..=focus].rotate_right(1);
    }
}

/// `Σ w (s² C + d dᵀ − s₀² C₀)`, each suspect weighed by its odds `e^(gain/2)` against the plain bundle's
/// 1: what averaging over what may be wrong adds to the covariance.
fn doubt(suspects: &[Hypothesis], bundle: &Bundle, n: f64) -> LensMatrix {
    let mut doubt = LensMatrix::zeros();
    let most = suspects.iter().map(|s| s.gain).fold(0.0, f64::max);
    let odds = |gain: f64| (0.5 * (gain - most)).exp();
    let total = odds(0.0) + suspects.iter().map(|s| odds(s.gain)).sum::<f64>();
    let Some(plain) = bundle.covariance(bundle.noise_factor()) else { return doubt };
    let there = bundle.state.camera.lens_parameters();
    for Hypothesis { gain, explanation } in suspects {
        let lens = explanation.state.bundle.camera.lens_parameters();
        let off = SVector::<f64, LENS_PARAMETERS>::from_fn(|i, _| lens[i] - there[i]);
        let parameters = bundle.freedom.count() + 6 * explanation.state.local.len();
        let freedom = (n - (parameters + explanation.parameters) as f64).max(1.0);
        let variance = explanation.cost / freedom;
        let mut spread = explanation.unit_covariance * variance + off * off.transpose();
        if explanation.cause == Cause::Focus {
            let f_px = lens[0];
            let own = explanation.state.local.iter().map(|local| local[0]);
            let of_f = f_px * f_px * own.clone().map(|x| x * x).sum::<f64>() / own.count() as f64;
            for (i, j) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                spread[(i, j)] += of_f;
            }
        }
        let more = spread - plain;
        // Only what widens: an average is never surer than its parts without it.
        doubt += positive_part(&more) * (odds(*gain) / total);
    }
    doubt
}

/// The part of a symmetric matrix that belongs to its positive eigenvalues, in units of its diagonal.
fn positive_part(matrix: &LensMatrix) -> LensMatrix {
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

/// The two groups of views that pull f and the principal point apart most; the smaller is marked.
///
/// With `I` and `g` each view's information and pull, groups A and B gain `gₐᵀ(Iₐ⁻¹ + I_b⁻¹)gₐ`. Tried
/// are consecutive views, and views sorted by each parameter's own pull; the best is then improved view by
/// view. `None` with fewer than four.
fn likeliest_split(bundle: &Bundle) -> Option<Vec<bool>> {
    const PP_AND_F: [usize; 3] = [0, 2, 3];
    let views: Vec<(Matrix3<f64>, Vector3<f64>)> = bundle
        .view_information()
        .iter()
        .map(|(information, gradient)| {
            (
                Matrix3::from_fn(|i, j| information[(PP_AND_F[i], PP_AND_F[j])]),
                Vector3::from_fn(|i, _| gradient[PP_AND_F[i]]),
            )
        })
        .collect();
    let count = views.len();
    if count < 4 {
        return None;
    }
    let gain = |odd: &[bool]| -> Option<f64> {
        let mut of = [Matrix3::zeros(), Matrix3::zeros()];
        let mut pull = Vector3::zeros();
        for ((information, gradient), odd) in views.iter().zip(odd) {
            of[usize::from(*odd)] += information;
            if *odd {
                pull += gradient;
            }
        }
        let (first, second) = (inverse(&of[0])?, inverse(&of[1])?);
        Some((pull.transpose() * (first + second) * pull).x)
    };
    let mut orders: Vec<Vec<usize>> = vec![(0..count).collect()];
    for i in 0..3 {
        let mut order: Vec<usize> = (0..count).collect();
        let pull = |view: usize| views[view].1[i] / views[view].0[(i, i)].max(f64::MIN_POSITIVE);
        order.sort_by(|a, b| pull(*a).total_cmp(&pull(*b)));
        orders.push(order);
    }
    let mut best: Option<(f64, Vec<bool>)> = None;
    for order in orders {
        for at in 1..count {
            let mut odd = vec![false; count];
            order[at..].iter().for_each(|view| odd[*view] = true);
            if let Some(gain) = gain(&odd)
                && best.as_ref().is_none_or(|(most, _)| gain > *most)
            {
                best = Some((gain, odd));
            }
        }
    }
    let (mut most, mut odd) = best?;
    let mut changed = true;
    while changed {
        changed = false;
        for view in 0..count {
            odd[view] = !odd[view];
            match gain(&odd) {
                Some(better) if better > most * (1.0 + 1e-9) => {
                    most = better;
                    changed = true;
                }
                _ => odd[view] = !odd[view],
            }
        }
    }
    if 2 * odd.iter().filter(|odd| **odd).count() > count {
        odd.iter_mut().for_each(|odd| *odd = !*odd);
    }
    Some(odd)
}
