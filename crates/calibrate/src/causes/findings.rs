//! Turns named causes into findings.

use super::{
    evidence::range,
    explanations::Explanation,
    judge::{Named, Verdicts},
    kinds::{Kind, MAX_CHANGE, Scope},
    witness::Vetoed,
};
use crate::check::finding::{CANDIDATES, Finding, FindingCode, FocusMotion, Severity};

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
        let code = code(named, depth_of_unit_m);
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
    let vetoed = causes.vetoed.map(|Vetoed { change, allowed }| Finding {
        code: FindingCode::SceneStill { change, allowed },
        severity: Severity::Info,
    });
    causes.named.iter().map(finding).chain(vetoed).collect()
}

/// Finding of a corrected cause; the bound includes its doubt.
pub(super) fn corrected(explanation: &Explanation) -> Finding {
    let sigmas = explanation.gain.max(0.0).sqrt();
    let camera = &explanation.state.bundle.camera;
    let code = match explanation.kind {
        Kind::BoardBent => FindingCode::BoardBent { depth_m: range(&explanation.rise_m), sigmas },
        Kind::BoardStretched => {
            FindingCode::BoardStretched { aspect: 1.0 + explanation.state.extras[0], sigmas }
        }
        _ => FindingCode::PixelsNotSquare { aspect: camera.f_px.y / camera.f_px.x, sigmas },
    };
    Finding { code, severity: Severity::Info }
}

fn code(named: &Named, depth_of_unit_m: f64) -> FindingCode {
    let sigmas = named.sigmas;
    let size = |i: usize| named.size.get(i).copied().unwrap_or(0.0);
    let length = || libm::hypot(size(0), size(1));
    let depth_m = || named.size.iter().map(|it| it * it).sum::<f64>().sqrt() * depth_of_unit_m;
    let concerned = || named.course.iter().position(|times| *times != 0.0).unwrap_or_default();
    let relative_sd = size(0).abs() * sample_sd(&named.course);
    let in_scene = named.in_scene;
    let focus = |motion| FindingCode::FocusMoved { sigmas, relative_sd, motion, in_scene };
    let change = libm::expm1(size(0));
    match named.kind {
        Kind::FocusDrift => focus(FocusMotion::Drift { change }),
        Kind::FocusJump => focus(FocusMotion::Jump { view: concerned(), change }),
        Kind::FocusBreathes => {
            let change = libm::expm1(size(0) * range(&named.course));
            focus(FocusMotion::Breathes { change })
        }
        Kind::FocusScatters => focus(FocusMotion::Scattered),
        Kind::Mixed => FindingCode::ViewsMixed {
            odd_views: named.course.iter().filter(|times| **times != 0.0).count(),
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

/// Sample standard deviation of the factors of a course; 1 without a course.
fn sample_sd(course: &[f64]) -> f64 {
    if course.is_empty() {
        return 1.0;
    }
    let count = course.len() as f64;
    let mean = course.iter().sum::<f64>() / count;
    let squares: f64 = course.iter().map(|times| (times - mean).powi(2)).sum();
    (squares / (count - 1.0)).sqrt()
}
