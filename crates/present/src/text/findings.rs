//! Warnings about a result: findings and actions.

use std::path::Path;

use super::{acceptance, apart};
use crate::grade::Grade;
use boresight_calibrate::{
    Calibration, Finding, FindingCode, FocusMotion, NotCalibrated, NotHeld, Severity, Verdict,
};
use boresight_formats::{FindingWords, ViewName};
use boresight_guide::session::ViewNumber;

/// The sentences of a calibration file.
pub const FINDING_WORDS: FindingWords =
    FindingWords { finding, not_calibrated, acceptance: acceptance::acceptance };

/// Name of a grade.
pub fn grade(grade: Grade) -> &'static str {
    match grade {
        Grade::Good => "Good",
        Grade::Care => "Use with care",
        Grade::Unfinished => "Unfinished",
        Grade::NotTrustworthy => "Not trustworthy",
    }
}

/// Verdict on a calibration.
pub fn verdict_on(calibration: &Calibration) -> &'static str {
    verdict(calibration.verdict, Grade::of(calibration) == Grade::Unfinished)
}

/// Meaning of a verdict; `unfinished` if more views would fix a bad result.
pub fn verdict(verdict: Verdict, unfinished: bool) -> &'static str {
    match verdict {
        Verdict::Untrustworthy if unfinished => "Unfinished: take more views",
        Verdict::Good => "Good: ready to use",
        Verdict::Care => "Use with care: see the warnings below",
        Verdict::Untrustworthy => "Not trustworthy: don't use this calibration",
    }
}

/// True for the name of the simulated camera.
pub fn is_simulated(source: &str) -> bool {
    source == "sim" || source.starts_with("sim:")
}

/// All grades.
const GRADES: [Grade; 4] = [Grade::Good, Grade::Care, Grade::Unfinished, Grade::NotTrustworthy];

/// `verdict` on a result from `source`; marked if the camera was simulated.
pub fn of_source(source: &str, verdict: &str) -> String {
    if is_simulated(source) { simulated(verdict) } else { verdict.to_owned() }
}

/// `verdict` on a result of rendered pictures.
pub(super) fn simulated(verdict: &str) -> String {
    let (grade, why) = verdict.split_at(verdict.find(':').unwrap_or(verdict.len()));
    if GRADES.map(self::grade).contains(&grade) {
        format!("{grade} (SIMULATED){why}")
    } else {
        format!("SIMULATED: {verdict}")
    }
}

/// Sentence of a finding on a calibration from `views`, and the action. Views are named by their
/// number in the calibration's file and report, and by their picture.
pub fn finding(finding: &Finding, views: &[ViewName]) -> (String, &'static str) {
    finding_of_views(finding, &|place| called(place, views))
}

/// Name of the view at `place` among the used ones of `views`: its number and picture.
fn called(place: usize, views: &[ViewName]) -> String {
    match (1..).zip(views).filter(|(_, view)| view.reason.is_none()).nth(place) {
        Some((nth, view)) => format!("{} ({})", view.number.unwrap_or(nth), view.name),
        None => (place + 1).to_string(),
    }
}

/// Sentence of a [`finding`] in a session, where views are named by number alone: `number` maps a
/// view's place in the calibration to its number.
pub fn finding_in_session(
    finding: &Finding,
    number: &dyn Fn(usize) -> Option<ViewNumber>,
) -> (String, &'static str) {
    finding_of_views(finding, &|place| {
        number(place).map_or_else(|| (place + 1).to_string(), |number| number.to_string())
    })
}

/// Command to leave a view out of an ended session, if any of `findings` recommends it: `frames` is
/// the folder of its pictures, and `board` names their board in the command.
pub fn leaving_out(findings: &[Finding], frames: &Path, board: &str) -> Option<String> {
    let removes = |finding: &Finding| {
        matches!(
            finding.code,
            FindingCode::ViewOdd { .. }
                | FindingCode::PlOutlier { .. }
                | FindingCode::CornerOdd { .. }
        )
    };
    let frames = frames.display();
    findings.iter().any(removes).then(|| {
        format!(
            "To leave a view out now, copy {frames} without its picture: boresight calibrate {board} COPY"
        )
    })
}

/// Action in two parts: fix the cause, then redo a step. A remark limits nothing, so it needs no
/// further views.
macro_rules! mend_then {
    ($finding:ident, $mend:literal, $anew:literal) => {
        if $finding.severity == Severity::Info { $mend } else { concat!($mend, " ", $anew) }
    };
}

fn finding_of_views(finding: &Finding, called: &dyn Fn(usize) -> String) -> (String, &'static str) {
    match finding.code {
        FindingCode::FewViews { distinct, wanted } => (
            format!("Not enough views: {distinct} of at least {wanted}"),
            "Take more views, tipped in different directions.",
        ),
        FindingCode::ViewsAlike { views, distinct } => (
            format!("Only {distinct} of {views} views differ"),
            "Move and tip the board between views. Copies of a view add nothing.",
        ),
        FindingCode::TiltLow { tilted_views, wanted_views, max_tilt_rad, wanted_tilt_rad } => (
            format!(
                "Too few tipped views: {tilted_views} of at least {wanted_views} with {:.0}° or more (steepest: {:.0}°)",
                wanted_tilt_rad.to_degrees(),
                max_tilt_rad.to_degrees()
            ),
            "Tip the board by 30 to 50°: left, right, top and bottom edge away in turn.",
        ),
        FindingCode::DirectionsFew { spread, wanted } => (
            {
                let (spread, wanted) = apart(spread, wanted, 2);
                format!("The tilts were too similar (spread {spread}, at least {wanted})")
            },
            "Tip it in other directions too, 90° apart.",
        ),
        FindingCode::PriorUsed { focal_length } => (
            if focal_length {
                "Too few views to measure the focal length and lens. The program assumed typical values".into()
            } else {
                "Too few views to measure the lens. The program assumed typical values".into()
            },
            "Take more tipped views.",
        ),
        FindingCode::LensSimple { model, statistic, limit } => (
            format!(
                "The simple lens model {:?} doesn't fit this lens (χ² {statistic:.1}, limit {limit:.1})",
                model.code()
            ),
            "Take more views that fill the picture. Check that the board is flat.",
        ),
        FindingCode::LensFolds { unmapped, of } => (
            format!(
                "The lens model doesn't cover the whole picture: {unmapped} of {of} places are missing"
            ),
            "Take views that reach into the corners of the picture, unless they're black.",
        ),
        FindingCode::CheckDisagrees { distance_px, sigmas, limit } => (
            format!(
                "The independent check disagrees: its principal point is {distance_px:.1} px away ({sigmas:.1} sd, limit {limit:.1})"
            ),
            mend_then!(
                finding,
                "Check that the board is flat and that focus and zoom are locked.",
                "Then take the views again."
            ),
        ),
        FindingCode::LensContradicts { statistic, limit } => (
            format!(
                "The lens isn't the one of the earlier calibration (χ² {statistic:.0}, limit {limit:.0}), so it isn't held to it"
            ),
            "If focus or zoom was touched, calibrate without --hold.",
        ),
        FindingCode::LensNotHeld { reason } => not_held(reason),
        FindingCode::CheckMissing => (
            "No independent check of the principal point".into(),
            "Take more tipped views in different directions.",
        ),
        FindingCode::ViewsDisagree { ratio, limit } => (
            format!(
                "Leaving out one view moves the principal point {ratio:.1} times as far as expected (limit {limit:.1})"
            ),
            "Check the view with the largest residual and retake it.",
        ),
        FindingCode::ViewOdd { view, rms_px, typical_px } => (
            format!("View {} fits badly: {rms_px:.2} px (others {typical_px:.2} px)", called(view)),
            "Remove or retake it.",
        ),
        FindingCode::PlOutlier { view, distance_px, sigmas } => (
            format!(
                "The principal line of view {} misses the others' meeting point by {:.1} px ({sigmas:.1} sd)",
                called(view),
                distance_px.abs()
            ),
            "Retake that pose and remove this view. Check that the board is flat.",
        ),
        FindingCode::FocusMoved { relative_sd, motion, in_scene, .. } => (
            match motion {
                FocusMotion::Scattered => format!(
                    "The focus or zoom moved: the focal length varies by {:.2} % (sd) between views",
                    100.0 * relative_sd
                ),
                FocusMotion::Drift { change } => format!(
                    "The focus drifted: the focal length changed by {:+.2} % from the first view to the last",
                    100.0 * change
                ),
                FocusMotion::Jump { view, change } => format!(
                    "The focus or zoom moved before view {}: the focal length changed by {:+.2} %",
                    called(view),
                    100.0 * change
                ),
                FocusMotion::Breathes { change } => format!(
                    "The focal length follows the board's distance: it changed by {:+.2} % from the farthest board to the nearest",
                    100.0 * change
                ),
            } + if in_scene { ". The scene behind the board shows it, too" } else { "" },
            // What mustn't be used isn't praised in part.
            if finding.severity == Severity::Bad {
                "Lock focus and zoom, and start over."
            } else {
                "The principal point is still usable. For one focal length, lock focus and zoom and start over."
            },
        ),
        FindingCode::SceneStill { change, allowed } => (
            format!(
                "By the board alone, the focal length seems to change by {:+.2} % between views. The scene behind the board keeps its scale within {:.2} %: it isn't the focus, and not a second camera",
                100.0 * change,
                100.0 * allowed
            ),
            "Nothing to do: the result counts.",
        ),
        FindingCode::FocalVaries { f_px, scatter_px } => (
            format!(
                "Each view has a separate focal length, as requested: {f_px:.1} px on average, {scatter_px:.1} px sd between views"
            ),
            "Use the principal point with each view's focal length.",
        ),
        FindingCode::ViewsMixed { odd_views, view, f_ratio, shift_px, .. } => (
            format!(
                "{odd_views} views (first: view {}) come from a different camera, mode or size, or have their distortion removed already: focal length × {f_ratio:.3}, principal point {shift_px:.1} px away",
                called(view)
            ),
            "Calibrate each camera, mode and orientation separately. Switch off automatic rotation, zoom and framing.",
        ),
        FindingCode::PixelsNotSquare { aspect, .. } => (
            format!(
                "The picture of the board is stretched, height to width {aspect:.4}, by the camera's pixels or the board's squares. The result allows for it as pixels (fy/fx)"
            ),
            "Measure five squares in both directions. If they aren't square, print again without \"fit to page\"; if they are, the camera stretches its pictures.",
        ),
        FindingCode::BoardStretched { aspect, .. } => (
            format!(
                "The board's squares aren't square: height to width {aspect:.4}. The result allows for it"
            ),
            "Measure five squares in both directions. Print without \"fit to page\". If the squares are square, the camera stretches its pictures.",
        ),
        FindingCode::BoardBent { depth_m, .. } => (
            format!(
                "The board isn't flat: it bends by {:.2} mm. The result allows for it",
                1000.0 * depth_m
            ),
            mend_then!(
                finding,
                "Mount the board on glass, aluminium or a thick panel.",
                "Then take the views again."
            ),
        ),
        FindingCode::RollingShutter { shear_px, .. } => (
            format!(
                "Something moved while the pictures were read out: each view is sheared differently, by {shear_px:.1} px from top to bottom"
            ),
            "Rest the board and the camera before each view. Use more light and a shorter exposure.",
        ),
        FindingCode::BoardFlexes { depth_m, .. } => (
            format!(
                "The board bends differently in each view, by about {:.2} mm",
                1000.0 * depth_m
            ),
            mend_then!(
                finding,
                "Mount the board on glass, aluminium or a thick panel.",
                "Then take the views again."
            ),
        ),
        FindingCode::PictureShifted { shift_px, .. } => (
            format!("Each view is shifted differently in the picture, by about {shift_px:.1} px"),
            mend_then!(
                finding,
                "Switch off image stabilisation and automatic framing.",
                "Then start over."
            ),
        ),
        FindingCode::PixelsSkewed { skew_rad, .. } => (
            format!(
                "Rows and columns of the picture miss a right angle by {:.2}°",
                skew_rad.to_degrees()
            ),
            "Check whether the picture or the print is sheared, as by a scanner, a printer or software that corrects pictures.",
        ),
        FindingCode::CauseUnclear { candidates, .. } => (
            format!(
                "The views differ from each other: several causes explain it alike ({}). The bound allows for it",
                candidates.into_iter().flatten().collect::<Vec<_>>().join(", ")
            ),
            "For a smaller bound: lock focus and zoom, switch off stabilisation, fix the board to a flat plate, rest it before each view.",
        ),
        FindingCode::LensOther { .. } => (
            "No available lens model fits this lens".into(),
            "Use the result only where the board was. A fisheye or mirror lens needs a different model.",
        ),
        FindingCode::CornersOutside { view, views } => (
            format!(
                "{views} views (first: view {}) have corners outside the picture",
                called(view)
            ),
            "Give the true --image-size. Don't mix pictures of different size or orientation.",
        ),
        FindingCode::CornerOdd { view, corner, off_px, times, count } => (
            format!(
                "Corner {} of view {} is off by {off_px:.1} px, {times:.0} times as far as usual ({count} such corners)",
                corner + 1,
                called(view)
            ),
            "Check that view. Remove or retake it.",
        ),
        FindingCode::PrincipalPointFar { distance_px, share } => (
            format!(
                "The principal point is {distance_px:.0} px from the middle of the picture ({:.0} % of its width)",
                100.0 * share
            ),
            "Check the picture size, and that the camera doesn't crop the picture. If that's by design, start boresight with --shifted-sensor.",
        ),
        FindingCode::HeldOut { view, rms_px, expected_px } => (
            format!(
                "The other views don't predict view {}: {rms_px:.2} px (expected {expected_px:.2} px)",
                called(view)
            ),
            "Take more views, and check this one.",
        ),
        FindingCode::Mirrored { view } => (
            format!("View {} is a mirror image", called(view)),
            "Switch off mirroring in the camera or the driver.",
        ),
        FindingCode::NoiseHigh { noise_px, limit_px } => (
            {
                let (noise, most) = apart(noise_px, limit_px, 2);
                format!("Corners are noisy: {noise} px (limit {most} px)")
            },
            "Focus the lens, hold still, add light, and use a flat board of the stated size.",
        ),
        FindingCode::NoiseCorrelated { share, length_px, noise_px, residual_px } => (
            {
                let [noise, residual] = [noise_px, residual_px].map(|px| format!("{px:.2}"));
                let shown = if noise_px > residual_px && noise != residual {
                    format!(
                        "The true error is {noise} px, though residuals show only {residual} px. "
                    )
                } else {
                    String::new()
                };
                format!(
                    "Neighbouring corners share {:.0} % of their error, over about {length_px:.0} px. {shown}The stated uncertainty allows for it",
                    100.0 * share
                )
            },
            "Focus the lens, light the board evenly, and mount it flat.",
        ),
        FindingCode::NoiseUnderstated { noise_px, measured_px } => (
            format!(
                "The uncertainty is understated: residuals are {noise_px:.2} px, but corners scatter by {measured_px:.2} px while holding still"
            ),
            "Hold the board still until each view is taken. Take more views.",
        ),
        FindingCode::NoiseExceeded { noise_px, measured_px } => (
            format!(
                "Residuals are {noise_px:.2} px, but corners scatter by only {measured_px:.2} px while holding still: the rest is the same in every picture"
            ),
            "Check that the board is flat and its squares are equal. The stated uncertainty allows for it.",
        ),
        FindingCode::ProjectionUncertain { bound_px, goal_px, share, wanted_share } => (
            {
                let (share, least) = apart(100.0 * share, 100.0 * wanted_share, 0);
                format!(
                    "With 95 % probability, the error stays below {} px in only {share} % of the picture (at least {least} %), and below {} px where the board was",
                    acceptance::small(goal_px),
                    acceptance::small(bound_px)
                )
            },
            "Take more views that fill the picture, tipped by 30 to 50° in different directions.",
        ),
        FindingCode::NotConverged => (
            "The solver didn't converge".into(),
            "Check the views with large residuals. Take more views.",
        ),
    }
}

/// Reason for `--hold` having no effect, and the action.
fn not_held(reason: NotHeld) -> (String, &'static str) {
    let (why, action) = match reason {
        NotHeld::OtherKind { earlier, now } => (
            format!("that has a {} lens, and these views a {} one", earlier.name(), now.name()),
            "Name the lens of the earlier calibration with --lens, or calibrate without --hold.",
        ),
        NotHeld::NoCovariance => {
            ("the uncertainties of both make no sense together".into(), "Calibrate without --hold.")
        }
        NotHeld::FocalVaries => (
            "each of these views has its own focal length".into(),
            "Lock focus and zoom, or calibrate without --hold.",
        ),
    };
    (format!("The lens isn't held to the earlier calibration: {why}"), action)
}

/// Reason for not using a single view: wrong corners.
pub const NOT_OF_THE_BOARD: &str = "its corners aren't the board's: their order or number of columns is another, or some are wrong";

/// Reason for having no calibration from `views`, and the action.
pub fn not_calibrated(reason: &NotCalibrated, views: &[ViewName]) -> (String, String) {
    let (what, action) = match *reason {
        NotCalibrated::NoViews => {
            let action = commonest_reason(views);
            return (
                "No photo was taken before the end".into(),
                action.unwrap_or_else(|| "Show the whole board, and hold it still.".into()),
            );
        }
        NotCalibrated::NoModels => ("No lens model to try".into(), "Choose one with --lens."),
        NotCalibrated::NoPicture { width_px, height_px } => {
            (format!("The picture is {width_px}x{height_px}"), "Give the true --image-size.")
        }
        NotCalibrated::CornerCount { view, got, want } => (
            format!("View {} has {got} corners, the board has {want}", called(view, views)),
            "Check --board: it counts inner corners, one fewer than squares in each direction.",
        ),
        NotCalibrated::CornerValue { view, corner } => (
            format!("Corner {} of view {} is not a number", corner + 1, called(view, views)),
            "Fix the corner table.",
        ),
        NotCalibrated::NoHomography { view } => (
            format!("The corners of view {} aren't those of a flat board", called(view, views)),
            "Check the order of the corners: row by row over the board.",
        ),
        NotCalibrated::NoGrid { view } => (
            format!(
                "The corners of view {} don't run row by row over a board of this size",
                called(view, views)
            ),
            "Check --board (columns x rows of inner corners) and the order of the corners.",
        ),
        NotCalibrated::Undetermined { distinct } => (
            format!("{distinct} different views aren't enough to measure the lens"),
            "Tip the board by 30 to 50° in different directions.",
        ),
    };
    (what, action.into())
}

/// Most frequent reason for not using `views`, as a sentence; the first of equally frequent
/// reasons.
fn commonest_reason(views: &[ViewName]) -> Option<String> {
    let reasons = || views.iter().filter_map(|view| view.reason.as_deref());
    let often = |reason: &&str| reasons().filter(|other| other == reason).count();
    let reason = reasons().rev().max_by_key(often)?;
    Some(format!("{}.", reason.trim_end_matches('.')))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_remark_asks_for_no_other_views() {
        let code = FindingCode::BoardBent { depth_m: 0.000_2, sigmas: 8.0 };
        let action = |severity| finding(&Finding { code, severity }, &[]).1;
        assert_eq!(action(Severity::Info), "Mount the board on glass, aluminium or a thick panel.");
        assert!(action(Severity::Care).ends_with("Then take the views again."));
    }

    fn remark(code: FindingCode) -> Finding {
        Finding { code, severity: Severity::Info }
    }

    #[test]
    fn an_ended_session_names_how_to_leave_a_view_out() {
        let odd = remark(FindingCode::ViewOdd { view: 2, rms_px: 1.0, typical_px: 0.1 });
        let board = "--board 9x6 --square 25mm";
        let said = leaving_out(&[odd], Path::new("one/frames"), board).expect("a way");
        assert_eq!(
            said,
            "To leave a view out now, copy one/frames without its picture: boresight calibrate --board 9x6 --square 25mm COPY"
        );
        let other = remark(FindingCode::NotConverged);
        assert_eq!(leaving_out(&[other], Path::new("one/frames"), board), None);
    }

    #[test]
    fn noise_is_compared_only_where_it_differs() {
        let said = |noise_px, residual_px| {
            let (share, length_px) = (0.4, 90.0);
            let code = FindingCode::NoiseCorrelated { share, length_px, noise_px, residual_px };
            finding(&remark(code), &[]).0
        };
        assert!(
            said(0.21, 0.11)
                .contains("The true error is 0.21 px, though residuals show only 0.11 px.")
        );
        for [noise_px, residual_px] in [[0.112, 0.111], [0.37, 0.38]] {
            assert!(!said(noise_px, residual_px).contains("though"));
        }
    }
}
