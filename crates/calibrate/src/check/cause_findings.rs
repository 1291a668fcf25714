//! Turns the likeliest cause of a misfit into findings.

use super::{
    cause::{Cause, Family},
    finding::{CANDIDATES, Finding, FindingCode, FocusMotion, Severity},
    misfit_diagnosis::{CLEAR_GAIN, Causes, Hypothesis},
};

/// Gain in BIC from which `fy ≠ fx` is believed, as for a coefficient of the lens: with square pixels, once in a
/// thousand calibrations.
const WORTH_A_PARAMETER: f64 = 4.0;
/// Twice the gain in log likelihood from which `fy ≠ fx` is corrected without being believed: with square pixels, once
/// in a hundred calibrations (χ²₁), which then know `fy` a little worse.
const WORTH_ALLOWING: f64 = 6.63;

/// The likeliest cause of a misfit, or a finding that it isn't clear; empty without a misfit.
pub(super) fn cause_findings(causes: &Causes) -> Vec<Finding> {
    let Some(best) = causes.best_hypothesis() else { return Vec::new() };
    let rivals = causes.rivals();
    // What is corrected is told by its correction.
    let is_moved = causes.focus_moved().is_some();
    let is_clear = rivals.is_empty();
    // No lens is that of two cameras.
    let are_two = is_clear && matches!(best.explanation.cause, Cause::Mixed(_));
    let severity = if is_moved || are_two { Severity::Bad } else { Severity::Care };
    if is_clear {
        return finding_code(best).map(|code| Finding { code, severity }).into_iter().collect();
    }
    let mut codes = std::iter::once(best)
        .chain(rivals)
        .filter_map(|hypothesis| Some(finding_code(hypothesis)?.code()));
    let candidates: [Option<&str>; CANDIDATES] = std::array::from_fn(|_| codes.next());
    vec![Finding { code: FindingCode::CauseUnclear { candidates, gain: best.gain }, severity }]
}

/// The finding that reports a hypothesis.
pub(super) fn finding_code(hypothesis: &Hypothesis) -> Option<FindingCode> {
    let Hypothesis { gain, explanation } = hypothesis;
    let gain = *gain;
    let state = &explanation.state;
    let camera = &state.bundle.camera;
    let [first, second, third, ..] = state.shared;
    let depth_m = explanation.depth_m;
    Some(match &explanation.cause {
        cause @ (Cause::Focus | Cause::FocusDrift | Cause::FocusJump(_)) => {
            let change = libm::expm1(first);
            let motion = match *cause {
                Cause::FocusDrift => FocusMotion::Drift { change },
                Cause::FocusJump(view) => FocusMotion::Jump { view, change },
                _ => FocusMotion::Scattered,
            };
            FindingCode::FocusMoved { gain, relative_sd: explanation.focal_relative_sd(), motion }
        }
        Cause::Mixed(odd) => FindingCode::ViewsMixed {
            odd_views: odd.iter().filter(|odd| **odd).count(),
            view: odd.iter().position(|odd| *odd).unwrap_or_default(),
            f_ratio: libm::exp(first),
            shift_px: libm::hypot(second, third) * camera.f_px.x,
            gain,
        },
        Cause::PixelAspect => {
            FindingCode::PixelsNotSquare { aspect: camera.f_px.y / camera.f_px.x, gain }
        }
        Cause::PixelSkew => FindingCode::PixelsSkewed { skew_rad: libm::atan(first), gain },
        Cause::BoardStretched => FindingCode::BoardStretched { aspect: 1.0 + first, gain },
        Cause::BoardBent => FindingCode::BoardBent { depth_m, gain },
        Cause::BoardFlexes => FindingCode::BoardFlexes { depth_m, gain },
        Cause::RollingShutter => {
            FindingCode::RollingShutter { shear_px: state.local_rms_length(), gain }
        }
        Cause::Shifted => FindingCode::PictureShifted { shift_px: state.local_rms_length(), gain },
        Cause::Torn(rows) => {
            let shift_px = |view: usize| libm::hypot(state.local[view][0], state.local[view][1]);
            let torn = rows.iter().enumerate().filter_map(|(view, row)| Some((view, (*row)?)));
            let (view, row_px) =
                torn.clone().max_by(|a, b| shift_px(a.0).total_cmp(&shift_px(b.0)))?;
            let (views, shift_px) = (torn.count(), shift_px(view));
            FindingCode::ViewTorn { view, row_px, shift_px, views, gain }
        }
        Cause::SmoothField => {
            FindingCode::PictureWarped { shift_px: explanation.largest_shift_px?, gain }
        }
        Cause::LensShape | Cause::NextRadial => FindingCode::LensOther { gain },
    })
}

impl Causes {
    /// The correctable cause: the clear winner, else non-square pixels or squares if they gain as much
    /// as a lens coefficient must. Correcting it makes other causes easier to see. `n` is the number of coordinates.
    pub(super) fn correctable(&self, n: f64) -> Option<&Hypothesis> {
        let best = self.best_hypothesis();
        let clear = best.filter(|_| self.rivals().is_empty());
        match clear.map(|clear| &clear.explanation.cause) {
            Some(Cause::BoardBent | Cause::PixelAspect) => return clear,
            Some(Cause::BoardStretched) => {
                return Some(self.aspect_rather_than(clear?));
            }
            _ => {}
        }
        let family = best.map(|best| best.explanation.cause.family());
        if matches!(family, Some(Family::Focus | Family::Mixed | Family::Torn)) {
            return None;
        }
        let is_aspect = |hypothesis: &&Hypothesis| {
            let explanation = &hypothesis.explanation;
            explanation.cause.family() == Family::Aspect && explanation.is_visible()
        };
        let likeliest = self.hypotheses.iter().find(is_aspect)?;
        let aspect = self.aspect_rather_than(likeliest);
        let gain = likeliest.explanation.by_views;
        if gain > WORTH_A_PARAMETER + libm::log(n) {
            return Some(aspect);
        }
        // With another misfit present it would absorb part of it.
        let may_be = best.is_none() && aspect.explanation.cause == Cause::PixelAspect;
        (may_be && gain > WORTH_ALLOWING).then_some(aspect)
    }

    /// Prefers non-square pixels to a stretched board, unless the views tell the two apart: the board then stays as it
    /// was stated, for everyone who uses the lens with it.
    fn aspect_rather_than<'a>(&'a self, stretched: &'a Hypothesis) -> &'a Hypothesis {
        let is_as_good = |hypothesis: &&Hypothesis| {
            hypothesis.explanation.cause == Cause::PixelAspect
                && hypothesis.explanation.is_visible()
                && hypothesis.gain > stretched.gain - CLEAR_GAIN
        };
        self.hypotheses.iter().find(is_as_good).unwrap_or(stretched)
    }
}

impl Family {
    /// True if a hypothesis of this family contradicts one of `other`.
    pub(super) fn rivals(self, other: Self) -> bool {
        // Two cameras are called a moved focus only if they have the same principal point.
        self != other && (self, other) != (Self::Focus, Self::Mixed)
    }
}
