//! Result of a check of an installed camera, and the next action.

use std::path::Path;

use super::{
    apart, camera,
    judgement::{file_doubt, lens_flaw},
};
use boresight_calibrate::{Drift, DriftVerdict, NoDrift, Shift, Verdict};
use boresight_formats::import::{FileDoubt, OldCalibration};
use boresight_geometry::device::{Control, Lock};

/// Verdict with numbers, and the next action.
pub fn drift(drift: &Drift) -> (String, String) {
    let Shift { px, least_px, most_px, visible_px } = drift.shift;
    let (moved, limit) = apart(px, drift.matters_px, 2);
    let moved = if px < ANYWHERE_PX { moved } else { told_px(px) };
    let [least_px, most_px, visible_px] = [least_px, most_px, visible_px].map(told_px);
    let changed = if drift.lens_changed {
        "the distortion changed; it moves points by"
    } else {
        "changed by"
    };
    let changed = format!("{changed} up to {moved} px ({least_px} to {most_px} px)");
    let hidden =
        format!("{most_px} px could hide (limit {limit} px, smallest detectable {visible_px} px)");
    match (drift.verdict, drift.is_significant) {
        (DriftVerdict::Ok, false) => (
            format!("OK: no change detected, and at most {hidden}"),
            "Keep the calibration.".into(),
        ),
        (DriftVerdict::Ok, true) => (
            format!("OK: {changed}, within the {limit} px limit"),
            "Keep the calibration and check again soon.".into(),
        ),
        (DriftVerdict::CannotTell, false) => {
            (format!("CAN'T TELL: no change detected, but up to {hidden}"), what_would_tell(drift))
        }
        (DriftVerdict::CannotTell, true) => (
            format!("CAN'T TELL: {changed}, around the {limit} px limit"),
            "Recalibrate to be sure, or take more views.".into(),
        ),
        (DriftVerdict::Recalibrate, _) => {
            let action = if drift.lens_changed {
                "Is it the same lens, and is it clean? Look for a changed focus or zoom, and recalibrate."
            } else {
                "Recalibrate. Look for a loose lens or mount, or a changed focus or zoom."
            };
            (format!("RECALIBRATE: {changed}, above the {limit} px limit"), action.into())
        }
    }
}

/// Displacement in pixels beyond which a ray is in no picture.
const ANYWHERE_PX: f64 = 10_000.0;

/// Displacement in pixels, as a number if it may be in a picture.
fn told_px(px: f64) -> String {
    if px < ANYWHERE_PX { format!("{px:.2}") } else { format!("over {ANYWHERE_PX}") }
}

/// Action for a check that could hide a change that matters.
fn what_would_tell(drift: &Drift) -> String {
    match drift.views_needed {
        Some(needed) => format!(
            "To tell, take {} more views like these. Fewer will do if the board is tipped by 30 to 50° and fills the picture.",
            needed.saturating_sub(drift.used.len()).max(1)
        ),
        None => {
            "More views can't tell: the old calibration itself isn't known well enough. Recalibrate with more views."
                .into()
        }
    }
}

/// Measured changes: name and amount.
pub fn drift_lines(drift: &Drift) -> [(&'static str, String); 4] {
    let [f, x, y]: [f64; 3] = drift.change_px.into();
    let [sd_f, sd_x, sd_y]: [f64; 3] = drift.sd_px.into();
    let Shift { px, least_px, most_px, visible_px } = drift.shift;
    let (pp_px, f_px, matters_px) = (drift.visible_pp_px, drift.visible_f_px, drift.matters_px);
    let [px, least_px, most_px, visible_px] = [px, least_px, most_px, visible_px].map(told_px);
    let lens = drift.visible_lens_px.map(|px| format!(", distortion {px:.1} px at the edge"));
    let lens = lens.unwrap_or_default();
    [
        ("focal length", format!("changed by {f:+.2} ± {sd_f:.2} px")),
        ("principal point", format!("changed by ({x:+.2} ± {sd_x:.2}, {y:+.2} ± {sd_y:.2}) px")),
        (
            "picture",
            format!(
                "shifted by up to {px} px ({least_px} to {most_px} px, limit {matters_px:.2} px)"
            ),
        ),
        (
            "smallest detectable change",
            format!(
                "{visible_px} px in the picture: principal point {pp_px:.1} px, focal length {f_px:.1} px{lens}"
            ),
        ),
    ]
}

/// Measured changes, one line each.
pub fn drift_numbers(drift: &Drift) -> [String; 4] {
    drift_lines(drift).map(|(what, how_much)| format!("{what:26}  {how_much}"))
}

/// Action for a change found by a session with a good result.
pub const USE_THE_NEW_ONE: &str =
    "Use the new calibration. Look for a loose lens or mount, or a changed focus or zoom.";

/// Introduction to a comparison's findings.
pub fn compared_with(old: &Path) -> String {
    format!("Compared with {}:", old.display())
}

/// Error of a requested comparison.
pub const NOT_COMPARED: &str = "The result couldn't be compared with the older calibration";

/// Note about a file with another camera's name, which may be the same camera.
pub fn maybe_other_camera(old: &str, new: &str) -> String {
    format!(
        "The older calibration is of {old:?}, this camera is {new:?}. The change is meaningful only if they're the same camera"
    )
}

/// Caveat about a weaker test.
pub fn drift_is_weak() -> &'static str {
    "The old file states no uncertainty. Assumed a typical uncertainty, so small changes can't be detected. A calibration.json from boresight makes the check more sensitive"
}

/// Reason for having no verdict, and the action.
pub fn no_drift(reason: &NoDrift) -> (String, &'static str) {
    match *reason {
        NoDrift::OtherSize { new, old } => (
            format!("NO VERDICT: the pictures are {new}, the calibration is for {old}"),
            "Set the camera to the mode it was calibrated in. Other modes may crop or scale the picture.",
        ),
        NoDrift::FewViews { different, outside: 0 } => (
            format!("Not finished: {different} of 4 different views"),
            "Match the outline once more.",
        ),
        NoDrift::FewViews { different, outside } => (
            format!(
                "Not finished: {different} of 4 different views; {outside} more lie outside the part of the picture that the old calibration covers"
            ),
            "Hold the board where it was for the old calibration, or recalibrate.",
        ),
        NoDrift::Mixed { odd_views } => (
            format!("NO VERDICT: {odd_views} of the views are from another camera or mode"),
            "Switch off automatic rotation, zoom and framing, and check again.",
        ),
        NoDrift::FocusMoved { relative_sd } => (
            format!(
                "NO VERDICT: focus or zoom moved; the focal length varies by {:.2} % (sd)",
                100.0 * relative_sd
            ),
            "Lock focus and zoom, and check again.",
        ),
        NoDrift::Impossible(flaw) => (
            format!("NO VERDICT: the file isn't a lens that can be right: {}", lens_flaw(&flaw)),
            "Don't use the file. Calibrate the camera.",
        ),
        NoDrift::NotJudged => (
            "NO VERDICT: the file states no uncertainty, and may never have been right".into(),
            "Judge it by the pictures that it was made from, and check against their lens: boresight judge FILE PICTURES --out calibration.json",
        ),
        NoDrift::Undetermined => (
            "NO VERDICT: the views aren't enough to measure focal length and principal point"
                .into(),
            "Tip the board by 30 to 50°, in opposed pairs.",
        ),
    }
}

/// Reason for having no verdict on another camera, and the action.
pub fn other_camera(old: &str, new: &str) -> (String, &'static str) {
    (
        format!("NO VERDICT: the calibration is of {old:?}, this camera is {new:?}"),
        "If it's the same camera under a different name, add --same-camera.",
    )
}

/// Reason for having no verdict with a focal length per view, and the action.
pub fn focal_varied() -> (String, &'static str) {
    (
        "NO VERDICT: the old calibration has a separate focal length for each view".into(),
        "Lock focus and zoom and recalibrate. Then you can check it.",
    )
}

/// Caveats about an old calibration, before any comparison.
pub fn doubts_of_old(old: &OldCalibration) -> Vec<String> {
    let mut doubts = Vec::new();
    if old.verdict == Some(Verdict::Untrustworthy) {
        doubts.push("The old calibration isn't trustworthy; its findings say why".into());
    }
    if old.camera_count > 1 {
        doubts.push(first_of_cameras(old.camera_count));
    }
    if old.covariance.is_none() {
        doubts.extend(FileDoubt::of(old).iter().map(file_doubt));
    } else if old.outlines.is_empty() {
        doubts.push(
            "The old file doesn't say where its boards were. Hold the board where it was then; elsewhere a change can't be detected"
                .into(),
        );
    }
    doubts
}

/// Note that only the first of a file's cameras is used.
pub fn first_of_cameras(count: usize) -> String {
    format!("The file has {count} cameras; the first is used")
}

/// Finding and action for a calibration in another program's file.
pub fn imported(format: &str) -> (String, &'static str) {
    let message =
        format!("The lens comes from a {format} file, which doesn't say how certain it is");
    (message, "To learn whether it's true: boresight judge FILE PICTURES")
}

/// Note about a lens and the board that it was found with, which isn't flat or even by up to
/// `off_mm`.
pub fn board_as_found(off_mm: f64) -> String {
    format!(
        "The board isn't flat and even: its points lie up to {off_mm:.2} mm elsewhere. Use this lens with the points as found (board.points_mm in calibration.json)."
    )
}

/// Note that the export of such a calibration holds the mean.
pub fn focal_is_a_mean() -> &'static str {
    "Each view has a separate focal length; the file gets the mean. views-csv lists them all"
}

/// Note about a control whose state differs from the old calibration's; `None` if equal.
pub fn lock_differs(control: Control, was: i64, is: Lock) -> Option<String> {
    if is == (Lock::Locked { value: was }) {
        return None;
    }
    let (name, is) = (camera::control(control), camera::lock(is));
    Some(format!("The {name} was locked at {was} when the camera was calibrated, now it's {is}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_a_control_that_differs_is_reported() {
        assert_eq!(lock_differs(Control::Focus, 30, Lock::Locked { value: 30 }), None);
        let said = lock_differs(Control::Focus, 30, Lock::Locked { value: 0 });
        assert!(said.is_some_and(|said| said.contains("30") && said.contains("locked at 0")));
        assert!(lock_differs(Control::Zoom, 100, Lock::Unknown).is_some());
    }
}
