//! The words of the result page.

use std::path::Path;

use nalgebra::Point2;

use super::{acceptance, knows_sd, measured, percent, projection};
use boresight_calibrate::{Calibration, LensModel, PrincipalPoints};
use boresight_geometry::{Camera, Distortion, LensParameter, LensValues};
use boresight_guide::session::{Prompt, Snapshot};

/// Sentences below a good result.
pub const USE_WHERE_BRIGHT: &str = "Use it where the picture is bright.";
/// See [`USE_WHERE_BRIGHT`].
pub const KEEP_THE_LENS: &str = "Keep focus and zoom as they are.";
/// Name of the error bound held to a person's goal.
pub const BOUND_95: &str = "Error bound, 95 %";
/// Button to see the certificate.
pub const CERTIFICATE: &str = "Certificate";
/// The same for a simulated camera.
pub const SAMPLE: &str = "Sample certificate";
/// Button with the export formats.
pub const USE_IN: &str = "Use in…";
/// The same for a result that isn't trustworthy.
pub const EXPORT_ANYWAY: &str = "Export anyway…";
/// Button to the evidence behind the result.
pub const ENGINEERS_VIEW: &str = "Engineer's view";
/// Way back from it.
pub const RESULT_CARD: &str = "Back to the result";
/// Button to start over.
pub const START_AGAIN: &str = "Start again";
/// Legend of the map where no board was.
pub const NO_BOARD_HERE: &str = "no board was here";

/// Caption of the goal beside the error.
pub fn your_goal(goal: &str) -> String {
    format!("Goal: {goal}")
}

/// Legend of the map where the goal is met.
pub fn meets_goal(share: f64) -> String {
    format!("meets the goal: {} of the picture", percent(share))
}

/// Share of the picture that meets `goal`, and where a board was.
pub fn met(share: f64, goal: &str) -> String {
    format!("{} of the picture, where boards were (goal {goal})", percent(share))
}

/// Legend of the map with numbers; `met` as of [`met`].
pub fn met_in_green(met: &str) -> String {
    format!("Green: meets the goal, {met}. Amber: it's missed, or no board was there.")
}

/// Name of [`met`].
pub const MEETS: &str = "Meets the goal";
/// Cause of a goal that's missed, and what may reach it.
pub const MISSES: [&str; 2] = [
    "The goal isn't reached: the picture is too noisy, or there are too few photos.",
    "Add light, hold still, and take more photos.",
];

/// Number of photos.
pub fn photos(count: usize) -> String {
    if count == 1 { "1 photo".into() } else { format!("{count} photos") }
}

/// Label before the export buttons.
pub const EXPORT: &str = "Export:";
/// Heading of the result page without a result.
pub const NO_RESULT: &str = "No calibration yet";
/// Action without a result.
pub const NO_RESULT_ACTION: &str = "It needs at least two views with the board tipped in different directions. Match the outline on the Guide page.";
/// Heading of the principal point by every method.
pub const METHODS: &str = "Principal point by method";
/// Tooltip of the methods' results.
pub const METHODS_TIP: &str = "The result is the bundle adjustment. Lens distortion pulls raw principal lines towards the middle of the boards; that is expected.";

/// Both accuracies that matter, each with a goal.
pub fn accuracies(snapshot: &Snapshot) -> Vec<String> {
    let has_goal = snapshot.calibration.as_ref().is_some_and(|c| c.acceptance.is_some());
    let first = if has_goal { "Error" } else { "Principal point" };
    let both = [
        (first, super::numbers::precision(snapshot)),
        (super::numbers::TYPICAL_ERROR, super::numbers::precision_over_picture(snapshot)),
    ];
    both.into_iter().filter_map(|(name, value)| Some(format!("{name}: {}", value?))).collect()
}

/// Corners of the picture hardly covered by boards, and a remedy; `None` without such corners.
/// `open` goes clockwise from the top left.
pub fn open_corners(open: [bool; 4]) -> Option<String> {
    const NAMES: [&str; 4] = ["top left", "top right", "bottom right", "bottom left"];
    let names: Vec<&str> =
        NAMES.into_iter().zip(open).filter_map(|(name, open)| open.then_some(name)).collect();
    let [first, .., last] = names.as_slice() else {
        let only = names.first()?;
        return Some(format!(
            "The board hardly reached the {only} corner of the picture. Values there are extrapolated. Two more photos would confirm them."
        ));
    };
    let corners = match names.as_slice() {
        [_, _] => format!("{first} and {last}"),
        [_, second, _] => format!("{first}, {second} and {last}"),
        _ => format!("{first}, {}, {} and {last}", names[1], names[2]),
    };
    Some(format!(
        "The board hardly reached the {corners} corners of the picture. Values there are extrapolated. Two more photos would confirm them."
    ))
}

/// Button to continue with more views.
pub const TAKE_MORE: &str = "Take two more";
/// See [`TAKE_MORE`].
pub const TAKE_MORE_TIP: &str =
    "Continue this session with two more views, as far into those corners as the board fits.";

/// Distance of the independent check from the result; `None` without a check.
pub fn independent_check(points: &PrincipalPoints) -> Option<String> {
    let off_px = (points.free_homography?.px - points.bundle?.px).norm();
    Some(format!("A second method agrees within {} px", super::numbers::small(off_px)))
}

/// Reason for having no view, from the frames' most frequent requests.
pub fn most_often(asked: &[(Prompt, usize)]) -> Option<String> {
    let most: Vec<String> = asked
        .iter()
        .take(3)
        .map(|(prompt, count)| {
            let pictures = if *count == 1 { "picture" } else { "pictures" };
            format!("\u{201c}{}\u{201d} ({count} {pictures})", super::prompt(*prompt))
        })
        .collect();
    (!most.is_empty()).then(|| format!("Most often: {}.", most.join(", ")))
}

/// Heading of the page's numbers.
pub const NUMBERS_HEADING: &str = "Numbers";
/// Heading of the result page without a view.
pub const NO_VIEW_TAKEN: &str = "No view was taken";
/// Advice after a failure.
pub const TRY: &str = "Fill the picture with the board, match the outline and hold still. Check that the board on the Start page is the one in your hands.";

/// Tooltip of the export button for a format.
pub fn export_tip(format: &str) -> String {
    format!("Save the result as {format} in the session folder.")
}

/// Note about a written file.
pub fn written(file: &Path) -> String {
    format!("Written: {}", file.display())
}

/// Tooltip of the button for a file.
pub fn show_tip(file: &Path) -> String {
    format!("Show {}", file.display())
}

/// Label of the field for an older calibration.
pub const COMPARE: &str = "Compare with an older calibration:";
/// See [`COMPARE`].
pub const COMPARE_TIP: &str = "Show what has changed since: principal point, focal length and points of the picture, each with its uncertainty. Choose or drop a calibration.json, or a file from OpenCV, ROS, Kalibr or mrcal. The older file isn't changed. The findings go into this session's report.";
/// Hint in the empty field.
pub const COMPARE_HINT: &str = "path of the file";
/// Button to start the comparison.
pub const COMPARE_BUTTON: &str = "Compare";
/// Note while a comparison runs.
pub const COMPARING: &str = "Comparing";

/// Error of a desktop without a program to show files.
pub const NO_VIEWER: &str = "No program found to open files (xdg-open)";

/// Folder of the stored session.
pub fn stored_in(folder: &Path) -> String {
    format!("Session: {}", folder.display())
}

/// Names and values of the coefficients in the lens's family.
pub fn coefficients(distortion: &Distortion) -> String {
    let camera = Camera { distortion: *distortion, ..Camera::pinhole(1.0, Point2::origin()) };
    let lens = camera.lens_parameters();
    let named = |coefficient: &LensParameter| {
        let (name, [value]) = (coefficient.name(), lens.of([*coefficient]));
        let decimals = if coefficient.is_tangential() { 6 } else { 5 };
        format!("{name} {value:.decimals$}")
    };
    let family = LensModel::simplest_with(&camera).family();
    family.richest().distortion().iter().map(named).collect::<Vec<_>>().join(", ")
}

/// Result as names and values; `met` is the share of the picture that meets the goal, in words.
pub fn result_lines(calibration: &Calibration, met: Option<String>) -> Vec<(&'static str, String)> {
    let (lens, sd) = (calibration.camera.lens_parameters(), calibration.sd());
    let [fx, fy, cx, cy] = lens.of(LensParameter::F_THEN_PP);
    let [sd_fx, sd_fy, sd_cx, sd_cy] = sd.of(LensParameter::F_THEN_PP);
    let measured = |value, sd, decimals| measured(calibration, value, sd, decimals);
    let (x, y) = (measured(cx, sd_cx, 2), measured(cy, sd_cy, 2));
    let mut lines = vec![("Principal point", format!("({x}, {y}) px"))];
    lines.push(if (fx - fy).abs() < 1e-9 {
        ("Focal length", format!("{} px", measured(fx, sd_fx, 2)))
    } else {
        ("Focal lengths", format!("{}, {} px", measured(fx, sd_fx, 2), measured(fy, sd_fy, 2)))
    });
    lines.push(("Lens model", calibration.model.code().into()));
    for coefficient in LensParameter::DISTORTION {
        let ([value], [sd]) = (lens.of([coefficient]), sd.of([coefficient]));
        if sd > 0.0 {
            lines.push((coefficient.name(), measured(value, sd, 5)));
        }
    }
    lines.extend(acceptance::on_goal(calibration).map(|(what, _)| ("Goal", what)));
    lines.push((super::numbers::TYPICAL_ERROR, projection(calibration)));
    let bound = error_bound(calibration.picture_bound_px(), calibration.covered_bound_px);
    lines
        .extend(bound.filter(|_| knows_sd(calibration)).map(|bound| ("Error bound (95 %)", bound)));
    if let Some(change) = calibration.visible_drift {
        lines.push(("Focus", unseen_drift(change)));
    }
    lines.push((
        "Corners",
        match calibration.views.len() {
            1 => format!("{:.3} px RMS in 1 view", calibration.rms_px),
            views => format!("{:.3} px RMS in {views} views", calibration.rms_px),
        },
    ));
    if let Some(measured_px) = calibration.noise_floor_px {
        lines.push(("Corner noise", noise(calibration.noise_px, measured_px)));
    }
    lines.extend(met.map(|met| (MEETS, met)));
    lines.push(("Covered", percent(calibration.coverage)));
    lines
}

/// Error bound over the picture and over the area covered by boards.
pub fn error_bound(picture_px: Option<f64>, covered_px: Option<f64>) -> Option<String> {
    let picture = picture_px.map(|px| format!("{px:.2} px over the picture"));
    let covered = covered_px.map(|px| format!("{px:.2} px where boards were"));
    let bounds: Vec<String> = picture.into_iter().chain(covered).collect();
    (!bounds.is_empty()).then(|| bounds.join(", "))
}

/// Smallest relative change of the focal length that would be reported.
pub fn unseen_drift(change: f64) -> String {
    format!("no change above {:.2} % seen", 100.0 * change)
}

/// Corner noise from the fit, beside the measured noise.
pub fn noise(fit_px: f64, measured_px: f64) -> String {
    format!("{fit_px:.3} px (fit), {measured_px:.3} px (held still)")
}

/// Principal point by every method: name, value, explanation.
pub fn method_lines(calibration: &Calibration) -> Vec<(&'static str, String, &'static str)> {
    let points = &calibration.principal_point;
    let all = [
        (
            "Bundle adjustment",
            points.bundle,
            "The result: all corners, with the lens model that they support.",
        ),
        (
            "Free homographies",
            points.free_homography,
            "The independent check: assumes no common focal length.",
        ),
        (
            "Principal lines, weighted",
            points.pl_weighted,
            "From raw corners. Pulled by distortion, as expected.",
        ),
        (
            "Principal lines",
            points.pl_unweighted,
            "From raw corners, as in the source paper. Pulled by distortion, as expected.",
        ),
        (
            "Principal lines and ring",
            points.pl_ring,
            "From raw corners, with a common focal length. Pulled by distortion, as expected.",
        ),
        ("Zhang", points.zhang, "Zhang's method with k1, k2 and two focal lengths."),
    ];
    all.into_iter()
        .filter_map(|(name, point, tip)| {
            let point = point?;
            let value = match point.covariance_px2 {
                Some(c) => {
                    let [x, y] = [0, 1].map(|axis| {
                        measured(calibration, point.px[axis], c[(axis, axis)].max(0.0).sqrt(), 2)
                    });
                    format!("({x}, {y}) px")
                }
                None => format!("({:.2}, {:.2}) px", point.px.x, point.px.y),
            };
            Some((name, value, tip))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_without_a_board_are_named() {
        assert_eq!(open_corners([false; 4]), None);
        let one = open_corners([false, true, false, false]).expect("one is open");
        assert!(one.starts_with("The board hardly reached the top right corner"), "{one}");
        let all = open_corners([true; 4]).expect("all are open");
        assert!(all.contains("top left, top right, bottom right and bottom left corners"), "{all}");
        let three = open_corners([true, true, false, true]).expect("three are open");
        assert!(three.contains("top left, top right and bottom left corners"), "{three}");
    }

    #[test]
    fn the_commonest_reasons_are_counted() {
        let asked = [(Prompt::Closer, 12), (Prompt::Glare, 1)];
        let said = most_often(&asked).expect("there are reasons");
        assert_eq!(
            said,
            "Most often: “Come closer” (12 pictures), “Too much glare. Tip the board” (1 picture)."
        );
        assert_eq!(most_often(&[]), None);
    }
}
