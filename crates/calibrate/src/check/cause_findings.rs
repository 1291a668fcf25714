//! Turns the likeliest cause of a misfit into findings.

use super::{
    finding::{CANDIDATES, Finding, FindingCode, FocusMotion, Severity},
    hypotheses::{Cause, Family},
    misfit_diagnosis::Causes,
    misfit_models::Explanation,
};
use crate::solve::odds::CLEAR;

/// Finding of the likeliest cause of a misfit, or of an unclear cause; empty without a misfit.
pub(super) fn cause_findings(causes: &Causes) -> Vec<Finding> {
    let Some(best) = causes.best() else { return Vec::new() };
    let rivals = causes.rivals();
    // Corrected causes are reported with their correction.
    let is_moved = causes.focus_moved().is_some();
    let is_clear = rivals.is_empty();
    // No lens fits two cameras.
    let are_two = is_clear && matches!(best.cause, Cause::Mixed(_));
    let is_in_bound =
        std::iter::once(best).chain(rivals.iter().copied()).all(|it| it.cause.is_in_bound());
    let severity = match is_in_bound {
        _ if is_moved || are_two => Severity::Bad,
        true => Severity::Info,
        false => Severity::Care,
    };
    if is_clear {
        return finding_code(best).map(|code| Finding { code, severity }).into_iter().collect();
    }
    let candidates = few(std::iter::once(best).chain(rivals).map(|it| it.cause.row().code));
    vec![Finding { code: FindingCode::CauseUnclear { candidates, gain: best.gain }, severity }]
}

/// Finding of causes and lens families, by code, with a failed fit; `None` if all fits succeeded.
pub(super) fn fit_failed(causes: &Causes, families: &[&'static str]) -> Option<FindingCode> {
    let of = few(families.iter().copied().chain(causes.failed.iter().map(|it| it.row().code)));
    of[0].map(|_| FindingCode::FitFailed { of })
}

fn few(mut codes: impl Iterator<Item = &'static str>) -> [Option<&'static str>; CANDIDATES] {
    std::array::from_fn(|_| codes.next())
}

/// Finding for a hypothesis.
pub(super) fn finding_code(explanation: &Explanation) -> Option<FindingCode> {
    let gain = explanation.gain;
    let state = &explanation.state;
    let camera = &state.bundle.camera;
    let [first, second, third, ..] = state.shared;
    let depth_m = explanation.depth_m;
    Some(match &explanation.cause {
        cause @ (Cause::Focus
        | Cause::FocusDrift
        | Cause::FocusJump(_)
        | Cause::FocusBreathes(_)) => {
            let change = libm::expm1(first);
            let motion = match cause {
                Cause::FocusDrift => FocusMotion::Drift { change },
                Cause::FocusJump(view) => FocusMotion::Jump { view: *view, change },
                Cause::FocusBreathes(course) => {
                    let far = course.iter().copied().fold(f64::INFINITY, f64::min);
                    let near = course.iter().copied().fold(f64::NEG_INFINITY, f64::max);
                    FocusMotion::Breathes { change: libm::expm1(first * (near - far)) }
                }
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
    /// Cause to correct: the clear winner, or else pixels or squares that clearly aren't square.
    /// Correcting it makes other causes easier to see. `is_done` is true for causes already
    /// corrected.
    pub(super) fn correctable(&self, is_done: impl Fn(&Cause) -> bool) -> Option<&Explanation> {
        let best = self.best();
        let is_clear = self.rivals().is_empty();
        let family = best.map(|best| best.cause.row().family);
        if matches!(family, Some(Family::Focus | Family::Mixed | Family::Torn)) {
            return None;
        }
        let may_be = |it: &&Explanation| match it.cause {
            Cause::BoardBent => is_clear && best.is_some_and(|best| best.cause == it.cause),
            Cause::PixelAspect | Cause::BoardStretched => true,
            _ => false,
        };
        let can_be = |it: &&Explanation| it.gain > CLEAR && it.is_visible() && !is_done(&it.cause);
        let likeliest = self.explanations.iter().filter(can_be).find(may_be)?;
        // Prefer pixels to squares unless the views tell them apart: the board then keeps its
        // stated size for every use with this lens.
        let is_as_good =
            |it: &&Explanation| it.cause == Cause::PixelAspect && it.gain > likeliest.gain - CLEAR;
        let is_stretched = likeliest.cause == Cause::BoardStretched;
        let pixels = || self.explanations.iter().filter(can_be).find(is_as_good);
        is_stretched.then(pixels).flatten().or(Some(likeliest))
    }
}
