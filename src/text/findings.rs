//! What speaks for or against a result: what was seen, and what to do.

use super::acceptance;
use crate::{
    calibration::{Finding, FindingCode, NotCalibrated, Verdict, files::FindingWords},
    session::ViewSummary,
};

/// The sentences of a calibration file.
pub const FINDING_WORDS: FindingWords =
    FindingWords { finding, not_calibrated, acceptance: acceptance::acceptance };

/// What the verdict means.
pub fn verdict(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Good => "GOOD: nothing speaks against this calibration",
        Verdict::Care => "USABLE WITH CARE: read the findings",
        Verdict::Untrustworthy => "NOT TRUSTWORTHY: do not use this calibration",
    }
}

/// Whether a source of that name is the simulated camera.
pub fn is_simulated(source: &str) -> bool {
    source == "sim" || source.starts_with("sim:")
}

/// `verdict` on what `source` delivered; marked if the camera was simulated.
pub fn of_source(source: &str, verdict: &str) -> String {
    if is_simulated(source) { format!("SIMULATED: {verdict}") } else { verdict.to_owned() }
}

/// One finding: what was seen, and what to do about it. Views are called by their place in the calibration,
/// from 1, as in its file and report.
pub fn finding(finding: &Finding) -> (String, &'static str) {
    finding_of_views(finding, &|place| place + 1)
}

/// Like [`finding`] in a session, where views are called by their numbers: `views` are those of the calibration.
pub fn finding_in_session(finding: &Finding, views: &[ViewSummary]) -> (String, &'static str) {
    let called =
        |place: usize| views.get(place).map_or(place + 1, |view| view.number.0 as usize + 1);
    finding_of_views(finding, &called)
}

fn finding_of_views(finding: &Finding, called: &dyn Fn(usize) -> usize) -> (String, &'static str) {
    match finding.code {
        FindingCode::FewViews { distinct, wanted } => (
            format!("Only {distinct} different views, want {wanted}"),
            "Take more views, tipped in other directions.",
        ),
        FindingCode::ViewsAlike { views, distinct } => (
            format!("{views} views, but only {distinct} of them differ"),
            "Move and tip the board between views; copies of a view add nothing.",
        ),
        FindingCode::TiltLow { tilted_views, wanted_views, max_tilt_rad, wanted_tilt_rad } => (
            format!(
                "{tilted_views} views are tipped by at least {:.0}°, want {wanted_views}; the steepest has {:.0}°",
                wanted_tilt_rad.to_degrees(),
                max_tilt_rad.to_degrees()
            ),
            "Tip the board 30 to 50°, away at the left, the right, the top and the bottom.",
        ),
        FindingCode::DirectionsFew { spread, wanted } => (
            format!(
                "All views are tipped in about the same direction (spread {spread:.2}, want {wanted:.2})"
            ),
            "Tip the board towards other directions, 90° apart.",
        ),
        FindingCode::CoverageLow { share, wanted } => (
            format!(
                "The boards covered {:.0} % of the picture, want {:.0} %",
                100.0 * share,
                100.0 * wanted
            ),
            "Hold the board closer, and into the corners of the picture.",
        ),
        FindingCode::PriorUsed { focal_length } => (
            if focal_length {
                "The views alone do not fix focal length and lens: usual values were assumed".into()
            } else {
                "The views alone do not fix the lens: usual values were assumed".into()
            },
            "Take more tipped views.",
        ),
        FindingCode::LensSimple { model, statistic, limit } => (
            format!(
                "The lens model {:?} is too simple: a richer one moves the principal point (χ² {statistic:.1}, limit {limit:.1})",
                model.code()
            ),
            "Take more views that fill the picture; check that the board is flat.",
        ),
        FindingCode::LensFolds { unmapped, of } => (
            format!("The lens model has no ray for {unmapped} of {of} places in the picture"),
            "Take views that reach into the corners of the picture.",
        ),
        FindingCode::CheckDisagrees { distance_px, sigmas, limit } => (
            format!(
                "The independent check puts the principal point {distance_px:.1} px away ({sigmas:.1} sd, limit {limit:.1})"
            ),
            "Check that the board is flat and focus and zoom are locked; take the views again.",
        ),
        FindingCode::LensContradicts { statistic, limit } => (
            format!(
                "The lens isn't the one of the earlier calibration (χ² {statistic:.0}, limit {limit:.0}), so it isn't held to it"
            ),
            "If focus or zoom was touched, calibrate without --hold.",
        ),
        FindingCode::CheckMissing => (
            "There is no independent check of the principal point".into(),
            "Take more tipped views in different directions.",
        ),
        FindingCode::ViewsDisagree { ratio, limit } => (
            format!(
                "Leaving single views out moves the principal point {ratio:.1} times as far as it should (limit {limit:.1})"
            ),
            "Look at the view with the largest residual; take it again.",
        ),
        FindingCode::ViewOdd { view, rms_px, typical_px } => (
            format!("View {} fits badly: {rms_px:.2} px, others {typical_px:.2} px", called(view)),
            "Remove it, or take it again.",
        ),
        FindingCode::PlOutlier { view, distance_px, sigmas } => (
            format!(
                "The principal line of view {} misses the others' meeting point by {:.1} px ({sigmas:.1} sd)",
                called(view),
                distance_px.abs()
            ),
            "Show that pose again and remove this view; check that the board is flat.",
        ),
        FindingCode::FocusMoved { relative_sd, .. } => (
            format!(
                "The focal length changes from view to view, by {:.2} % (sd): focus or zoom moved",
                100.0 * relative_sd
            ),
            "The principal point given needs no common focal length and may be used, each view with its own; lock focus and zoom and start again for one lens.",
        ),
        FindingCode::FocalVaries { f_px, scatter_px } => (
            format!(
                "Each view has its own focal length, as asked: {f_px:.1} px on average, {scatter_px:.1} px sd between views"
            ),
            "Use the principal point with each view's own focal length.",
        ),
        FindingCode::ViewsMixed { odd_views, view, f_ratio, shift_px, .. } => (
            format!(
                "{odd_views} views, the first of them view {}, are of another camera, mode or size: focal length times {f_ratio:.3}, principal point {shift_px:.1} px away",
                called(view)
            ),
            "Calibrate each camera, mode and orientation by itself; switch off automatic rotation, zoom and framing.",
        ),
        FindingCode::PixelsNotSquare { aspect, .. } => (
            format!(
                "Pixels are {aspect:.4} times as high in focal length as wide: they are not square"
            ),
            "If the camera stretches its pictures, calibrate with --set calibration.square_pixels=false; else measure the board both ways.",
        ),
        FindingCode::BoardStretched { aspect, .. } => (
            format!("The board's squares are {aspect:.4} times as high as wide"),
            "Measure the board over five squares both ways; print it without \"fit to page\".",
        ),
        FindingCode::BoardBent { depth_m, .. } => (
            format!("The board is not flat, by {:.2} mm", 1000.0 * depth_m),
            "Mount it on glass, aluminium or thick board, and take the views again.",
        ),
        FindingCode::RollingShutter { shear_px, .. } => (
            format!(
                "Each view is sheared its own way, by {shear_px:.1} px from top to bottom: something moved while the picture was read out"
            ),
            "Rest the board and the camera before each view; use more light and a shorter exposure.",
        ),
        FindingCode::LensOther { .. } => (
            "The lens has a shape that no model here describes".into(),
            "Use the result only where the boards were; a fisheye or mirror needs another model.",
        ),
        FindingCode::CornersOutside { view, views } => (
            format!(
                "{views} views, the first of them view {}, have corners outside of the picture",
                called(view)
            ),
            "Give the true --image-size; do not mix pictures of different size or orientation.",
        ),
        FindingCode::CornerOdd { view, corner, off_px, times, count } => (
            format!(
                "Corner {} of view {} lies {off_px:.1} px from where it should, {times:.0} times the usual ({count} such corners)",
                corner + 1,
                called(view)
            ),
            "Look at that view; remove it, or take it again.",
        ),
        FindingCode::PrincipalPointFar { distance_px, share } => (
            format!(
                "The principal point lies {distance_px:.0} px from the middle of the picture, {:.0} % of its width",
                100.0 * share
            ),
            "Check that the picture's size is right and that the camera does not crop it.",
        ),
        FindingCode::HeldOut { view, rms_px, expected_px } => (
            format!(
                "The other views do not predict view {}: {rms_px:.2} px, expected {expected_px:.2} px",
                called(view)
            ),
            "Take more views; look at this one.",
        ),
        FindingCode::Mirrored { view } => (
            format!("View {} is a mirror image", called(view)),
            "Switch mirroring off in the camera or the driver.",
        ),
        FindingCode::NoiseHigh { noise_px, limit_px } => (
            format!("Corners err by {noise_px:.2} px, want at most {limit_px:.2} px"),
            "Focus the lens, hold still, use more light, and a flat board of the stated size.",
        ),
        FindingCode::NoiseCorrelated { share, length_px, noise_px, residual_px } => (
            format!(
                "Neighbouring corners err alike: {:.0} % of their error, over some {length_px:.0} px. They err by {noise_px:.2} px, though the residuals show only {residual_px:.2} px; the uncertainty allows for it",
                100.0 * share
            ),
            "Focus the lens, light the board evenly, and mount it flat.",
        ),
        FindingCode::NoiseUnderstated { noise_px, measured_px } => (
            format!(
                "The fit leaves residuals of {noise_px:.2} px, but the corners of a board held still scatter by {measured_px:.2} px: the uncertainty is understated"
            ),
            "Hold the board still until a view is taken; take more views.",
        ),
        FindingCode::NoiseExceeded { noise_px, measured_px } => (
            format!(
                "Residuals are {noise_px:.2} px, but the corners of a board held still scatter by only {measured_px:.2} px: the rest is the same in every picture"
            ),
            "Check that the board is flat and its squares are equal; the uncertainty allows for it.",
        ),
        FindingCode::PrincipalPointUncertain { sd_px, wanted_px } => (
            format!("The principal point is known to {sd_px:.1} px, want {wanted_px:.1} px"),
            "Take more views that fill the picture, in opposed pairs.",
        ),
        FindingCode::FocalLengthUncertain { sd_px, wanted_px } => (
            format!("The focal length is known to {sd_px:.1} px, want {wanted_px:.1} px"),
            "Take more views, tipped by 40 to 50°.",
        ),
        FindingCode::ProjectionUncertain { mean_px, max_px, wanted_px } => (
            format!(
                "Projection is known to {mean_px:.2} px on average and {max_px:.2} px at worst, want {wanted_px:.2} px on average"
            ),
            "Take more views that fill the picture.",
        ),
        FindingCode::NotConverged => (
            "The solver did not reach a minimum".into(),
            "Look at the views with large residuals; take more views.",
        ),
    }
}

/// Why there is no calibration at all, and what to do.
pub fn not_calibrated(reason: &NotCalibrated) -> (String, &'static str) {
    match *reason {
        NotCalibrated::NoViews => ("There is no view of the board".into(), "Show the whole board."),
        NotCalibrated::NoModels => ("There is no lens model to try".into(), "Name one."),
        NotCalibrated::NoPicture { width_px, height_px } => {
            (format!("The picture is {width_px}x{height_px}"), "Give the true --image-size.")
        }
        NotCalibrated::CornerCount { view, got, want } => (
            format!("View {} has {got} corners, the board has {want}", view + 1),
            "Check --board: it counts inner corners, one less than squares each way.",
        ),
        NotCalibrated::CornerValue { view, corner } => (
            format!("Corner {} of view {} is not a number", corner + 1, view + 1),
            "Mend the corner table.",
        ),
        NotCalibrated::NoHomography { view } => (
            format!("The corners of view {} are not those of a flat board", view + 1),
            "Check the order of the corners: row by row over the board.",
        ),
        NotCalibrated::NoGrid { view } => (
            format!(
                "The corners of view {} do not run row by row over a board of this size",
                view + 1
            ),
            "Check --board (columns x rows of inner corners) and the order of the corners.",
        ),
        NotCalibrated::Undetermined { distinct } => (
            format!("{distinct} different views do not determine the lens"),
            "Take views with the board tipped 30 to 50° in different directions.",
        ),
    }
}
