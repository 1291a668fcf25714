//! Compares hypotheses for a misfit by odds, and adds the uncertainty to the covariance.

use nalgebra::{DMatrix, SVector};

use super::{
    hypotheses::{Cause, Family},
    misfit_models::{Explained, Explanation, Unexplained},
    torn_views,
    view_split::{likeliest_jump, likeliest_split},
};
use crate::solve::{
    bundle::{Bundle, Observations},
    odds::CLEAR,
};
use boresight_geometry::{Camera, LENS_PARAMETERS, LensMatrix, frame::ImageSize};

/// Relative scatter of the focal length above which a common focal length is no result: 3 px at f
/// = 1000.
const MAX_FOCAL_SCATTER: f64 = 0.003;
/// Distance of the principal points of two groups of views, as a fraction of the picture's width,
/// below which the groups are a single refocused camera: 5 px at 1280.
const SAME_CENTRE: f64 = 0.004;
/// Standard deviations by which a drift of the focal length must exceed the square root of the
/// required gain to be reported with a probability of 95 %.
const POWER_SIGMAS: f64 = 1.645;

/// Fitted hypotheses, most probable first.
#[derive(Clone, Debug)]
pub(crate) struct Causes {
    pub(super) explanations: Vec<Explanation>,
    /// Causes with an unconverged fit, neither found nor ruled out.
    pub(super) failed: Vec<Cause>,
    /// Covariance of the lens from uncertainty about the true hypothesis.
    pub(crate) doubt: LensMatrix,
    /// Least reported relative change of the focal length from the first view to the last. `None`
    /// if there are too few views.
    pub(crate) visible_drift: Option<f64>,
}

impl Causes {
    pub(crate) fn none() -> Self {
        Self {
            explanations: Vec::new(),
            failed: Vec::new(),
            doubt: LensMatrix::zeros(),
            visible_drift: None,
        }
    }

    /// Most probable hypothesis with a reportable effect, with sufficient odds.
    pub(super) fn best(&self) -> Option<&Explanation> {
        self.explanations.iter().find(|it| it.is_visible()).filter(|best| best.gain > CLEAR)
    }

    /// Twice the logarithm of the odds of [`Self::best`], unless the lens is the cause.
    pub(crate) fn gain_beside_lens(&self) -> Option<f64> {
        self.best().filter(|best| best.cause.row().family != Family::Lens).map(|best| best.gain)
    }

    /// Best hypothesis of each other family that explains the views nearly as well as
    /// [`Self::best`].
    pub(super) fn rivals(&self) -> Vec<&Explanation> {
        let Some(best) = self.best() else { return Vec::new() };
        let mut found = vec![best];
        for rival in self.explanations.iter().filter(|it| it.gain > best.gain - CLEAR) {
            let family = rival.cause.row().family;
            let is_new = found.iter().all(|other| other.cause.row().family != family);
            // Two cameras count as a moved focus only if they have the same principal point.
            let is_same = (best.cause.row().family, family) == (Family::Focus, Family::Mixed);
            if rival.is_visible() && is_new && !is_same {
                found.push(rival);
            }
        }
        found.split_off(1)
    }

    /// Covariance of the lens under `best`, from alternative hypotheses of the same family. Other
    /// families are examined again after the correction for `best`.
    pub(super) fn doubt_beside(&self, best: &Explanation) -> LensMatrix {
        let there = best.state.bundle.camera.lens_parameters();
        let odds = |it: &Explanation| libm::exp(0.5 * (it.gain - best.gain)).min(1.0);
        let family = best.cause.row().family;
        let alike = self.explanations.iter().filter(|it| it.cause.row().family == family);
        let total: f64 = alike.clone().map(odds).sum();
        let spread = |it: &Explanation| {
            let lens = it.state.bundle.camera.lens_parameters();
            let off = SVector::<f64, LENS_PARAMETERS>::from_fn(|i, _| lens[i] - there[i]);
            off * off.transpose() * (odds(it) / total)
        };
        alike.map(spread).sum()
    }

    /// Relative scatter of the focal length, if the best hypothesis is a moving focus and the
    /// scatter is too large for a common focal length.
    pub(crate) fn focus_moved(&self) -> Option<f64> {
        let best = self.best()?;
        let is_focus = best.cause.row().family == Family::Focus;
        let relative_sd = best.focal_relative_sd();
        (is_focus && relative_sd > MAX_FOCAL_SCATTER).then_some(relative_sd)
    }
}

/// Fits every hypothesis, starting from the minimum of `bundle`, the richest plain bundle. `result`
/// is the lens of the computed doubt; `noise_gain` is the gain in BIC from correlated noise.
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
        Cause::FocusBreathes(nearness(bundle)),
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
    let Explained { mut explanations, failed, drift } = unexplained.explain_all(all);
    explanations.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    prefer_focus(&mut explanations, image_size);
    prefer_common_bend(&mut explanations);
    let doubt = doubt(&explanations, bundle, result, n);
    // The evidence for a drift is counted by views, too.
    let noise_factor = bundle.noise_factor().max(noise_floor);
    let overcount = bundle
        .scatter(noise_factor)
        .map_or(1.0, |scatter| scatter.overcount(observations.view_count()));
    let noise_variance = noise_factor.powi(2) * overcount;
    let visible_drift = drift.map(|step| {
        let information = 1.0 / (step.unit_variance * noise_variance);
        let occam = Cause::FocusDrift.occam(&DMatrix::from_element(1, 1, information));
        let gain = CLEAR + Cause::FocusDrift.against(observations.view_count()) + occam;
        (gain.sqrt() + POWER_SIGMAS) / information.sqrt()
    });
    Causes { explanations, failed, doubt, visible_drift }
}

/// Relative excess of the board's inverse distance in each view over the mean: the part of a focal
/// length that follows the distance.
fn nearness(bundle: &Bundle) -> Vec<f64> {
    let poses = bundle.state.cam_from_board.iter();
    let near: Vec<f64> = poses.map(|pose| pose.translation.z.recip()).collect();
    let mean = near.iter().sum::<f64>() / near.len() as f64;
    near.iter().map(|near| near / mean - 1.0).collect()
}

/// Moves the best focus hypothesis to the front if the best hypothesis is two cameras with the same
/// principal point. Their views pull the lens apart less, so the richer hypothesis keeps more of
/// its evidence.
fn prefer_focus(explanations: &mut [Explanation], image_size: ImageSize) {
    let Some(first) = explanations.first() else { return };
    let shift_px = libm::hypot(first.state.shared[1], first.state.shared[2])
        * first.state.bundle.camera.f_px.x;
    let is_same_centre = shift_px <= SAME_CENTRE * f64::from(image_size.width_px);
    if !matches!(first.cause, Cause::Mixed(_)) || !is_same_centre {
        return;
    }
    let is_focus = |it: &Explanation| it.cause.row().family == Family::Focus && it.gain > CLEAR;
    if let Some(focus) = explanations.iter().position(is_focus) {
        explanations[..=focus].rotate_right(1);
    }
}

/// Replaces a board that bends from view to view by one bent alike in all views, if the latter is a
/// finding alone. Shared causes are corrected first.
fn prefer_common_bend(explanations: &mut Vec<Explanation>) {
    let place = |cause: Cause| explanations.iter().position(|it| it.cause == cause);
    let (Some(0), Some(bent)) = (place(Cause::BoardFlexes), place(Cause::BoardBent)) else {
        return;
    };
    if explanations[bent].gain > CLEAR {
        explanations[..=bent].rotate_right(1);
        explanations.retain(|it| it.cause != Cause::BoardFlexes);
    }
}

/// Covariance from averaging over the shared hypotheses: `Σ w (s² C + d dᵀ − s₀² C₀)`, with weights
/// in proportion to the odds `e^(gain/2)`; the plain bundle's is 1. Effects that differ from view
/// to view are part of the views' scatter.
fn doubt(explanations: &[Explanation], bundle: &Bundle, result: &Camera, n: f64) -> LensMatrix {
    let mut doubt = LensMatrix::zeros();
    let shared = || explanations.iter().filter(|it| it.cause.is_shared());
    let most = shared().map(|it| it.gain).fold(0.0, f64::max);
    let odds = |gain: f64| libm::exp(0.5 * (gain - most));
    let total = odds(0.0) + shared().map(|it| odds(it.gain)).sum::<f64>();
    let Some(plain) = bundle.covariance(bundle.noise_factor()) else { return doubt };
    let there = result.lens_parameters();
    for explanation in shared() {
        let lens = explanation.state.bundle.camera.lens_parameters();
        let off = SVector::<f64, LENS_PARAMETERS>::from_fn(|i, _| lens[i] - there[i]);
        let freedom = bundle.freedom.count() + 6 * explanation.state.local.len();
        let variance = explanation.noise_variance(n, freedom);
        let more = explanation.unit_covariance * variance + off * off.transpose() - plain;
        // Positive parts only: a hypothesis must not reduce the uncertainty of the result.
        doubt += positive_part(&more) * (odds(explanation.gain) / total);
    }
    doubt
}

/// Positive part of a symmetric matrix, by eigenvalues after scaling to a unit diagonal.
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
