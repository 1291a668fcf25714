//! Turns all evidence about a calibration into findings.

use nalgebra::{Matrix2, SymmetricEigen, Vector2};

use super::{
    disagreement::{CONTRADICTION_SIGMAS, Disagreement, distance2},
    finding::{Finding, FindingCode, Severity},
    held_out::HeldOutView,
    limits::Limits,
    noise_correlation::NoiseCorrelation,
    noise_findings::noise_finding,
    odd_corners::OddCorner,
    projection_sd::{ProjectionSd, ValidArea},
};
use crate::{
    causes::{Correction, NamedCauses},
    known_lens::{Combined, NotHeld},
    solve::{
        free_homography::FreeHomographies,
        model_choice::ModelChoice,
        odds::{CLEAR, UNLIKELY},
    },
};
use boresight_geometry::{
    Camera, Corner, GRID_COLUMNS, GRID_ROWS, LensParts, OutlierLine, frame::ImageSize, seen_count,
};

/// Limit of Hausman's statistic, χ² with 2 degrees of freedom if the lens model holds: its 0.99
/// quantile, `docs/method.md`, section 2.
const HAUSMAN_CARE: f64 = 9.21;
/// Three times [`HAUSMAN_CARE`]: the principal point is wrong by far more than its stated error. A
/// convention.
const HAUSMAN_BAD: f64 = 30.0;
/// Squared distance in stated standard deviations up to which the stated uncertainty covers a
/// shift: 2 sd.
const COVERED: f64 = 4.0;
/// Ratio of observed to expected shift when views are left out; 1 if they agree. 2 is the stop
/// rule's limit, `docs/method.md`, section 3.5.
const SKIP: f64 = 2.0;
/// Ratio of the noise by one lens to that of free homographies, from which the views are apart. 54
/// fits of real sets have 2.0 at most, three 6.2 at least.
const APART: f64 = 3.0;
/// Allowed distance of a corner outside the picture, as a fraction of the width: the edge fit
/// extrapolates by a few pixels.
const OUTSIDE: f64 = 0.005;
/// Distance of the principal point from the centre as a fraction of the picture's width. Centring
/// errors of real cameras are below a tenth; more indicates a cropped picture.
const PP_FAR_CARE: f64 = 0.1;
const PP_FAR_BAD: f64 = 0.2;
/// Ratio of observed to expected residual of a held-out view. A convention: with some hundred
/// coordinates, chance alone stays within about 10 % of 1.
const HELD_OUT: f64 = 1.6;
/// Ratio of a view's residual to the median above which the view is odd. A convention: chance
/// varies by about 10 %.
const ODD_VIEW: f64 = 2.5;
/// Least median residual in pixels, so that near-exact views aren't compared.
const LEAST_MEDIAN_PX: f64 = 0.02;
/// Tilts of 10° and 20°: below 20° the focal length can hardly be separated from the distance,
/// `docs/method.md`, section 0.
const TILT_NONE_RAD: f64 = 0.17;
const TILT_USEFUL_RAD: f64 = 0.35;
/// Least singular value of the stacked unit normals of the principal lines, `docs/method.md`,
/// section 3.2: that of two pairs with tilt axes 20° apart. Below it, the board was tilted about
/// one axis only.
const DIRECTIONS_WANTED: f64 = 0.35;
/// Typical error of a corner coordinate that excludes a board. [`Limits`] has the other limit.
const NOISE_BAD_PX: f64 = 3.0;
/// Evidence about a view for the checks.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ViewEvidence {
    /// Angle between image plane and board.
    pub(crate) tilt_rad: f64,
    /// Image direction in which the board recedes.
    pub(crate) tilt_azimuth_rad: f64,
    /// Root mean square residual per coordinate.
    pub(crate) residual_rms_px: f64,
    /// True if the view is a mirror image of the board.
    pub(crate) mirrored: bool,
}

/// Evidence for the checks.
pub(crate) struct Evidence<'a> {
    pub(crate) image_size: ImageSize,
    pub(crate) camera: &'a Camera,
    pub(crate) choice: &'a ModelChoice,
    /// Scatter of a focal length allowed to vary, in pixels.
    pub(crate) varying_px: Option<f64>,
    pub(crate) free: Option<&'a FreeHomographies>,
    pub(crate) views: &'a [ViewEvidence],
    pub(crate) seen: &'a [Vec<Corner>],
    pub(crate) causes: Option<&'a NamedCauses>,
    /// Correction included in the result.
    pub(crate) correction: Option<&'a Correction>,
    pub(crate) odd_corners: &'a [OddCorner],
    pub(crate) held_out: Option<HeldOutView>,
    /// Combination of the result with an earlier calibration, if given.
    pub(crate) known_lens: Option<&'a Result<Combined, NotHeld>>,
    /// Independent check of the bundle; present if `free` is.
    pub(crate) disagreement: Option<Disagreement>,
    pub(crate) projection_sd: &'a ProjectionSd,
    pub(crate) pp_covariance_px2: Matrix2<f64>,
    pub(crate) valid_area: &'a ValidArea,
    /// 95 % bound of the error of projection over the boards' area.
    pub(crate) bound_px: f64,
    /// Ratio of the bound to the acceptance goal; `None` without one.
    pub(crate) of_goal: Option<f64>,
    pub(crate) skip_one_ratio: Option<f64>,
    pub(crate) distinct: usize,
    /// Number of given views, repeats of a held pose included.
    pub(crate) given: usize,
    pub(crate) noise_px: f64,
    pub(crate) noise_correlation: Option<&'a NoiseCorrelation>,
    pub(crate) noise_floor_px: Option<f64>,
    pub(crate) noise_floor: f64,
    pub(crate) shifted_sensor: bool,
    pub(crate) prior_used: bool,
    pub(crate) focal_prior_used: bool,
}

impl Evidence<'_> {
    fn limits(&self) -> Limits {
        Limits::of(self.image_size)
    }
}

/// Findings in a fixed order.
pub(crate) fn check(evidence: &Evidence<'_>) -> Vec<Finding> {
    let mut findings = Vec::new();
    let mut report = |severity: Option<Severity>, code: FindingCode| {
        findings.extend(severity.map(|severity| Finding { code, severity }));
    };
    views(evidence, &mut report);
    corners(evidence, &mut report);
    if let Some(scatter_px) = evidence.varying_px {
        // Checks based on a common focal length don't apply.
        let f_px = evidence.camera.f_px.x;
        report(Some(Severity::Info), FindingCode::FocalVaries { f_px, scatter_px });
        known_lens(evidence, &mut report);
        evidence.free.inspect(|free| outliers(free, &mut report));
        odd_views(evidence, &mut report);
    } else {
        lens(evidence, &mut report);
        let corrected = evidence.correction.map_or(&[][..], |correction| &correction.findings);
        for Finding { code, severity } in corrected.iter().copied().chain(between_views(evidence)) {
            report(Some(severity), code);
        }
        known_lens(evidence, &mut report);
        agreement(evidence, &mut report);
        odd_views(evidence, &mut report);
    }
    uncertainty(evidence, &mut report);
    findings
}

/// Severity of a measure by two limits; `None` below both. NaN is bad.
fn above(measured: f64, care: f64, bad: f64) -> Option<Severity> {
    if measured <= care {
        None
    } else if measured <= bad {
        Some(Severity::Care)
    } else {
        Some(Severity::Bad)
    }
}

fn views(evidence: &Evidence<'_>, report: &mut impl FnMut(Option<Severity>, FindingCode)) {
    let (count, distinct) = (evidence.given, evidence.distinct);
    let wanted = evidence.limits().views;
    if distinct < wanted {
        report(Some(Severity::Bad), FindingCode::FewViews { distinct, wanted });
    }
    if distinct < count {
        let severity = match distinct {
            1 => Severity::Bad,
            2 | 3 => Severity::Care,
            _ => Severity::Info,
        };
        report(Some(severity), FindingCode::ViewsAlike { views: count, distinct });
    }
    let max_tilt_rad = evidence.views.iter().map(|view| view.tilt_rad).fold(0.0, f64::max);
    let tilted = |tilt_rad: f64| evidence.views.iter().filter(|v| v.tilt_rad >= tilt_rad).count();
    let wanted_views = count.clamp(1, 2);
    let severity = if tilted(TILT_NONE_RAD) < wanted_views {
        Some(Severity::Bad)
    } else if tilted(TILT_USEFUL_RAD) < wanted_views {
        Some(Severity::Info)
    } else {
        None
    };
    report(
        severity,
        FindingCode::TiltLow {
            tilted_views: tilted(TILT_USEFUL_RAD),
            wanted_views,
            max_tilt_rad,
            wanted_tilt_rad: TILT_USEFUL_RAD,
        },
    );
    // Tilt azimuths are the directions of the principal lines; the normals have the same singular
    // values.
    let mut normals = Matrix2::zeros();
    for view in evidence.views.iter().filter(|view| view.tilt_rad >= TILT_NONE_RAD) {
        let along =
            Vector2::new(libm::cos(view.tilt_azimuth_rad), libm::sin(view.tilt_azimuth_rad));
        normals += along * along.transpose();
    }
    let spread = SymmetricEigen::new(normals).eigenvalues.min().max(0.0).sqrt();
    if distinct >= 2 && spread < DIRECTIONS_WANTED {
        let code = FindingCode::DirectionsFew { spread, wanted: DIRECTIONS_WANTED };
        report(Some(Severity::Info), code);
    }
    if let Some(view) = evidence.views.iter().position(|view| view.mirrored) {
        report(Some(Severity::Care), FindingCode::Mirrored { view });
    }
    if evidence.prior_used {
        let focal_length = evidence.focal_prior_used;
        let severity = if focal_length { Severity::Care } else { Severity::Info };
        report(Some(severity), FindingCode::PriorUsed { focal_length });
    }
}

fn lens(evidence: &Evidence<'_>, report: &mut impl FnMut(Option<Severity>, FindingCode)) {
    let choice = evidence.choice;
    if !choice.bundle().converged {
        report(Some(Severity::Care), FindingCode::NotConverged);
    }
    if let Some((statistic, off)) = hausman(choice, evidence.noise_floor) {
        let code =
            FindingCode::LensSimple { model: choice.fit().model, statistic, limit: HAUSMAN_CARE };
        let stated = &evidence.pp_covariance_px2;
        let is_stated = distance2(&off, stated, stated.trace()) < COVERED;
        let severity = above(statistic, HAUSMAN_CARE, HAUSMAN_BAD);
        report(severity.map(|severity| if is_stated { Severity::Info } else { severity }), code);
    }
    let of = (GRID_COLUMNS * GRID_ROWS) as usize;
    let unmapped = evidence.projection_sd.unmapped;
    if unmapped > 0 {
        // Folded points aren't part of the valid area.
        let severity = Severity::Info;
        report(Some(severity), FindingCode::LensFolds { unmapped, of });
    }
}

/// Hausman's statistic (Hausman 1978) for the principal point under the richest lens model, and the
/// point's shift in pixels.
///
/// If the chosen model holds, its estimate is efficient, and the difference from the richer model's
/// has covariance `C_full − C`. `None` if the richest model is the chosen one.
fn hausman(choice: &ModelChoice, noise_floor: f64) -> Option<(f64, Vector2<f64>)> {
    let full = choice.bundles.len() - 1;
    if full == choice.chosen {
        return None;
    }
    let noise_factor = choice.fits[full].noise_factor.max(noise_floor);
    let pp_covariance = |index: usize| -> Option<Matrix2<f64>> {
        Some(choice.bundles[index].covariance(noise_factor)?.pp())
    };
    let (full_covariance, covariance) = (pp_covariance(full)?, pp_covariance(choice.chosen)?);
    let off = choice.fits[full].camera.pp_px - choice.fit().camera.pp_px;
    Some((distance2(&off, &(full_covariance - covariance), full_covariance.trace()), off))
}

/// Reports a contradiction to the earlier calibration meant to hold the lens, or a failure to hold
/// the lens.
fn known_lens(evidence: &Evidence<'_>, report: &mut impl FnMut(Option<Severity>, FindingCode)) {
    match evidence.known_lens {
        Some(Ok(Combined { statistic, limit, .. })) => {
            let code = FindingCode::LensContradicts { statistic: *statistic, limit: *limit };
            report(above(*statistic, *limit, f64::INFINITY), code);
        }
        Some(Err(reason)) => {
            report(Some(Severity::Care), FindingCode::LensNotHeld { reason: *reason });
        }
        None => {}
    }
}

/// What the views name, and a camera that changes without a name: views that fit much better by
/// themselves than by one lens ask for care.
fn between_views(evidence: &Evidence<'_>) -> Vec<Finding> {
    let mut findings = evidence.causes.map_or(Vec::new(), |causes| causes.findings.clone());
    let apart = evidence.free.map_or(0.0, |free| {
        evidence.choice.bundle().noise_factor() / free.noise_factor().max(evidence.noise_floor)
    });
    if apart > APART && findings.iter().all(|finding| finding.severity == Severity::Info) {
        let of_camera = ["FOCUS-MOVED", "VIEWS-MIXED", "PICTURE-SHIFTED"];
        let candidates = std::array::from_fn(|i| of_camera.get(i).copied());
        findings.retain(|finding| !matches!(finding.code, FindingCode::CauseUnclear { .. }));
        let code = FindingCode::CauseUnclear { candidates, sigmas: apart };
        findings.push(Finding { code, severity: Severity::Care });
    }
    findings
}

fn agreement(evidence: &Evidence<'_>, report: &mut impl FnMut(Option<Severity>, FindingCode)) {
    if let Some(Disagreement { distance_px, sigmas }) = evidence.disagreement {
        let code = FindingCode::CheckDisagrees { distance_px, sigmas, limit: CONTRADICTION_SIGMAS };
        // The free homographies have a simpler lens, so a difference needn't be the result's error.
        report((sigmas > CONTRADICTION_SIGMAS).then_some(Severity::Info), code);
    }
    if let Some(free) = evidence.free {
        outliers(free, report);
    } else if evidence.distinct >= 3 {
        report(Some(Severity::Info), FindingCode::CheckMissing);
    }
    if let Some(ratio) = evidence.skip_one_ratio {
        let code = FindingCode::ViewsDisagree { ratio, limit: SKIP };
        report((ratio > SKIP).then_some(Severity::Info), code);
    }
    if let Some(HeldOutView { view, rms_px, expected_px }) = evidence.held_out {
        let code = FindingCode::HeldOut { view, rms_px, expected_px };
        report((rms_px > HELD_OUT * expected_px).then_some(Severity::Info), code);
    }
}

/// Views with a far worse fit than the others, single odd corners aside.
fn odd_views(evidence: &Evidence<'_>, report: &mut impl FnMut(Option<Severity>, FindingCode)) {
    let rms_px: Vec<f64> = evidence
        .views
        .iter()
        .zip(evidence.seen)
        .enumerate()
        .map(|(view, (result, seen))| {
            let odd = evidence.odd_corners.iter().filter(|odd| odd.view == view);
            let of_odd: f64 = odd.map(|odd| odd.off_px.powi(2)).sum();
            let coordinates = (2 * seen_count(seen)).max(1) as f64;
            (result.residual_rms_px.powi(2) - of_odd / coordinates).max(0.0).sqrt()
        })
        .collect();
    let mut sorted_px = rms_px.clone();
    sorted_px.sort_by(f64::total_cmp);
    let typical_px = sorted_px.get(sorted_px.len() / 2).copied().unwrap_or(0.0);
    let limit_px = ODD_VIEW * typical_px.max(LEAST_MEDIAN_PX);
    for (view, rms_px) in rms_px.into_iter().enumerate() {
        if rms_px > limit_px {
            // The view's weight already reflects its noise.
            report(Some(Severity::Info), FindingCode::ViewOdd { view, rms_px, typical_px });
        }
    }
}

/// Principal lines that miss the intersection of the others.
fn outliers(free: &FreeHomographies, report: &mut impl FnMut(Option<Severity>, FindingCode)) {
    for OutlierLine { index, distance_px, sigmas } in &free.outliers {
        let (view, distance_px, sigmas) = (*index, *distance_px, *sigmas);
        report(Some(Severity::Info), FindingCode::PlOutlier { view, distance_px, sigmas });
    }
}

/// Impossible corners, and the position of the principal point.
fn corners(evidence: &Evidence<'_>, report: &mut impl FnMut(Option<Severity>, FindingCode)) {
    let ImageSize { width_px, height_px } = evidence.image_size;
    let (width_px, height_px) = (f64::from(width_px), f64::from(height_px));
    let margin_px = OUTSIDE * width_px;
    let outside = |corner: &Corner| {
        let is_outside = corner.px.x < -margin_px
            || corner.px.y < -margin_px
            || corner.px.x > width_px - 1.0 + margin_px
            || corner.px.y > height_px - 1.0 + margin_px;
        corner.is_seen() && is_outside
    };
    let mut views = evidence.seen.iter().enumerate().filter(|(_, seen)| seen.iter().any(outside));
    if let Some((view, _)) = views.next() {
        let code = FindingCode::CornersOutside { view, views: 1 + views.count() };
        report(Some(Severity::Bad), code);
    }
    if let Some(OddCorner { view, corner, off_px, times }) = evidence.odd_corners.first().copied() {
        let count = evidence.odd_corners.len();
        report(Some(Severity::Info), FindingCode::CornerOdd { view, corner, off_px, times, count });
    }
    let pp_px = evidence.camera.pp_px;
    let distance_px = (pp_px - evidence.image_size.centre_px()).norm();
    let share = distance_px / width_px;
    let code = FindingCode::PrincipalPointFar { distance_px, share };
    let severity = above(share, PP_FAR_CARE, PP_FAR_BAD);
    report(severity.filter(|_| !evidence.shifted_sensor), code);
}

fn uncertainty(evidence: &Evidence<'_>, report: &mut impl FnMut(Option<Severity>, FindingCode)) {
    let limits = evidence.limits();
    let limit_px = limits.noise_px;
    let code = FindingCode::NoiseHigh { noise_px: evidence.noise_px, limit_px };
    report(above(evidence.noise_px, limit_px, NOISE_BAD_PX), code);
    noise(evidence, report);
    let ValidArea { goal_px, share, .. } = *evidence.valid_area;
    let (bound_px, wanted_share) = (evidence.bound_px, limits.valid_share);
    let is_met = evidence.of_goal.map_or(share >= wanted_share, |ratio| ratio <= 1.0);
    let severity = if is_met {
        None
    } else if evidence.of_goal.unwrap_or(bound_px / goal_px) <= limits.unfinished {
        Some(Severity::Care)
    } else {
        Some(Severity::Bad)
    };
    report(severity, FindingCode::ProjectionUncertain { bound_px, goal_px, share, wanted_share });
}

/// Noise understated by the residuals.
fn noise(evidence: &Evidence<'_>, report: &mut impl FnMut(Option<Severity>, FindingCode)) {
    if let Some(correlation) = evidence.noise_correlation
        && correlation.gain > UNLIKELY + CLEAR
        && evidence.causes.is_none_or(|causes| causes.findings.is_empty())
    {
        // For the typical corner, like `noise_px`.
        let noise_px = evidence.noise_px * correlation.noise_factor
            / evidence.choice.bundle().noise_factor().max(f64::MIN_POSITIVE);
        let code = FindingCode::NoiseCorrelated {
            share: correlation.share,
            length_px: correlation.length_px,
            noise_px,
            residual_px: evidence.noise_px,
        };
        // The covariance allows for it.
        report(Some(Severity::Info), code);
    }
    let measured = evidence.noise_floor_px;
    if let Some(Finding { code, severity }) =
        measured.and_then(|measured_px| noise_finding(evidence.noise_px, measured_px))
    {
        report(Some(severity), code);
    }
}
