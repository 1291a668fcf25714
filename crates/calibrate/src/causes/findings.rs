//! Turns named causes into findings.

use super::{
    explanations::Explanation,
    judge::{Named, Verdicts},
    kinds::{Kind, Scope},
};
use crate::check::finding::{CANDIDATES, Finding, FindingCode, FocusMotion, Severity};

/// Change of the camera between views above which one lens is no result, relative to half the
/// picture: 3 px at 1000 px from the principal point.
const MAX_CHANGE: f64 = 0.003;

/// Findings of named causes that nothing corrects. A moved focus or a second camera, named alone,
/// rules the lens out; a camera that otherwise changes from picture to picture limits its use. The
/// bound covers everything else.
pub(super) fn of_verdicts(
    causes: &Verdicts,
    depth_of_unit_m: f64,
    half_width_px: f64,
) -> Vec<Finding> {
    let is_between = |named: &&Named| named.kind.row().scope != Scope::Shared;
    let is_only = causes.named.iter().filter(is_between).count() == 1;
    let finding = |named: &Named| {
        let code = code(named, causes, depth_of_unit_m);
        let (is_large, is_fatal) = match code {
            FindingCode::FocusMoved { relative_sd, .. } => (relative_sd > MAX_CHANGE, true),
            FindingCode::ViewsMixed { .. } => (true, true),
            FindingCode::PictureShifted { shift_px, .. } => {
                (shift_px > MAX_CHANGE * half_width_px, false)
            }
            _ => (false, false),
        };
        let all = std::iter::once(named.kind).chain(named.rivals.iter().copied());
        let is_of_camera = all.clone().all(Kind::is_of_camera);
        let severity = match (is_large && is_of_camera, is_fatal && named.rivals.is_empty()) {
            (false, _) => Severity::Info,
            (true, true) if is_only => Severity::Bad,
            (true, _) => Severity::Care,
        };
        if named.rivals.is_empty() {
            return Finding { code, severity };
        }
        let mut codes: Vec<&'static str> = all.map(|kind| kind.row().code).collect();
        codes.dedup();
        let candidates = std::array::from_fn::<_, CANDIDATES, _>(|i| codes.get(i).copied());
        let code = FindingCode::CauseUnclear { candidates, sigmas: named.sigmas };
        Finding { code, severity }
    };
    causes.named.iter().map(finding).collect()
}

/// Finding of a corrected cause; the bound includes its doubt.
pub(super) fn corrected(explanation: &Explanation) -> Finding {
    let sigmas = explanation.gain.max(0.0).sqrt();
    let camera = &explanation.state.bundle.camera;
    let code = match explanation.kind {
        Kind::BoardBent => {
            let rises = explanation.rise_m.iter().copied();
            let depth_m = rises.clone().fold(f64::NEG_INFINITY, f64::max)
                - rises.fold(f64::INFINITY, f64::min);
            FindingCode::BoardBent { depth_m, sigmas }
        }
        Kind::BoardStretched => {
            FindingCode::BoardStretched { aspect: 1.0 + explanation.state.extras[0], sigmas }
        }
        _ => FindingCode::PixelsNotSquare { aspect: camera.f_px.y / camera.f_px.x, sigmas },
    };
    Finding { code, severity: Severity::Info }
}

fn code(named: &Named, causes: &Verdicts, depth_of_unit_m: f64) -> FindingCode {
    let sigmas = named.sigmas;
    let size = |i: usize| named.size.get(i).copied().unwrap_or(0.0);
    let length = || libm::hypot(size(0), size(1));
    let depth_m = || named.size.iter().map(|it| it * it).sum::<f64>().sqrt() * depth_of_unit_m;
    let concerned = || named.is_concerned.iter().position(|it| *it).unwrap_or_default();
    let relative_sd = size(0).abs() * named.spread;
    let focus = |motion| FindingCode::FocusMoved { sigmas, relative_sd, motion };
    let change = libm::expm1(size(0));
    match named.kind {
        Kind::FocusDrift => focus(FocusMotion::Drift { change }),
        Kind::FocusJump => focus(FocusMotion::Jump { view: concerned(), change }),
        Kind::FocusBreathes => {
            let near = causes.nearness.iter().copied();
            let range =
                near.clone().fold(f64::NEG_INFINITY, f64::max) - near.fold(f64::INFINITY, f64::min);
            let change = libm::expm1(size(0) * range);
            focus(FocusMotion::Breathes { change })
        }
        Kind::FocusScatters => focus(FocusMotion::Scattered),
        Kind::Mixed => FindingCode::ViewsMixed {
            odd_views: named.is_concerned.iter().filter(|it| **it).count(),
            view: concerned(),
            f_ratio: libm::exp(size(0)),
            shift_px: libm::hypot(size(1), size(2)),
            sigmas,
        },
        Kind::PixelAspect => FindingCode::PixelsNotSquare { aspect: 1.0 + size(0), sigmas },
        Kind::BoardStretched => FindingCode::BoardStretched { aspect: 1.0 + size(0), sigmas },
        Kind::PixelSkew => FindingCode::PixelsSkewed { skew_rad: libm::atan(size(0)), sigmas },
        Kind::BoardBent => FindingCode::BoardBent { depth_m: depth_m(), sigmas },
        Kind::BoardFlexes => FindingCode::BoardFlexes { depth_m: depth_m(), sigmas },
        Kind::RollingShutter => FindingCode::RollingShutter { shear_px: length(), sigmas },
        Kind::Shifted => FindingCode::PictureShifted { shift_px: length(), sigmas },
        Kind::LensShape => FindingCode::LensOther { sigmas },
    }
}
