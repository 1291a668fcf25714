//! What a check of an installed camera found, and what to do.

use std::path::Path;

use super::camera;
use crate::{
    calibration::{Drift, DriftVerdict, NoDrift, Verdict, import::OldCalibration},
    device::{Control, Lock},
};

/// The verdict with its numbers, and the next action.
pub fn drift(drift: &Drift) -> (String, &'static str) {
    let moved_px = drift.displacement_px;
    if drift.lens_changed {
        return (
            format!(
                "RECALIBRATE: the old distortion does not fit, residuals are {:.1} times as large as with a new one",
                drift.residual_ratio
            ),
            "Is it the same lens, and is it clean? Calibrate anew.",
        );
    }
    match drift.verdict {
        DriftVerdict::Ok => {
            ("OK: no change that these views could show".into(), "Keep the calibration.")
        }
        DriftVerdict::Watch => (
            format!(
                "WATCH: the camera has changed, by up to {moved_px:.2} px in the picture, less than the {:.2} px that matter",
                drift.matters_px
            ),
            "Keep the calibration, and check again soon.",
        ),
        DriftVerdict::Recalibrate => (
            format!(
                "RECALIBRATE: the camera has changed, by up to {moved_px:.1} px in the picture, more than the {:.2} px that matter",
                drift.matters_px
            ),
            "Calibrate anew; look for a loose lens, mount, or a changed focus or zoom.",
        ),
    }
}

/// The measured changes: what, and how much.
pub fn drift_lines(drift: &Drift) -> [(&'static str, String); 4] {
    let [f, x, y]: [f64; 3] = drift.change_px.into();
    let [sd_f, sd_x, sd_y]: [f64; 3] = drift.sd_px.into();
    let (moved_px, matters_px) = (drift.displacement_px, drift.matters_px);
    let (pp_px, f_px) = (drift.visible_pp_px, drift.visible_f_px);
    [
        ("focal length", format!("changed by {f:+.2} ± {sd_f:.2} px")),
        ("principal point", format!("changed by ({x:+.2} ± {sd_x:.2}, {y:+.2} ± {sd_y:.2}) px")),
        ("projection", format!("moves by up to {moved_px:.2} px; {matters_px:.2} px matter")),
        (
            "smallest change",
            format!(
                "that would have been seen: {pp_px:.1} px of the principal point, {f_px:.1} px of the focal length"
            ),
        ),
    ]
}

/// The measured changes, one line each.
pub fn drift_numbers(drift: &Drift) -> [String; 4] {
    drift_lines(drift).map(|(what, how_much)| format!("{what:15}  {how_much}"))
}

/// What to do about a change that a session has found whose own result is good.
pub const USE_THE_NEW_ONE: &str =
    "Use the new calibration; look for a loose lens, mount, or a changed focus or zoom.";

/// Before what a comparison found.
pub fn compared_with(old: &Path) -> String {
    format!("Compared with {}:", old.display())
}

/// A comparison that was asked for could not be made.
pub const NOT_COMPARED: &str = "The result could not be compared with the older calibration";

/// The file names another camera, which may be the same one.
pub fn maybe_other_camera(old: &str, new: &str) -> String {
    format!(
        "The older calibration is of {old:?}, this camera is {new:?}: only if they are the same camera does the change mean anything"
    )
}

/// What makes the test weaker than it could be.
pub fn drift_is_weak() -> &'static str {
    "The old file states no uncertainty: a usual one was assumed, so that only larger changes are told. A calibration.json of this program makes the test sharper"
}

/// Why there is no verdict, and what to do.
pub fn no_drift(reason: &NoDrift) -> (String, &'static str) {
    match *reason {
        NoDrift::OtherSize { new, old } => (
            format!(
                "NO VERDICT: the pictures are {}x{}, the calibration is for {}x{}",
                new.width_px, new.height_px, old.width_px, old.height_px
            ),
            "Set the camera to the mode that it was calibrated in; another mode may crop or scale the sensor.",
        ),
        NoDrift::FewViews { usable, outside: 0 } => (
            format!("NO VERDICT: {usable} usable views, two opposed pairs are wanted"),
            "Show the poses that are asked for.",
        ),
        NoDrift::FewViews { usable, outside } => (
            format!(
                "NO VERDICT: {outside} views lie where the old calibration has seen no board, {usable} can be used, 4 are wanted"
            ),
            "Hold the board where the old boards were, or calibrate anew: outside of them the test is blind.",
        ),
        NoDrift::Undetermined => (
            "NO VERDICT: the views do not determine focal length and principal point".into(),
            "Tip the board 30 to 50°, in opposed pairs.",
        ),
    }
}

/// Why another camera gets no verdict, and what to do.
pub fn other_camera(old: &str, new: &str) -> (String, &'static str) {
    (
        format!("NO VERDICT: the calibration is of {old:?}, this camera is {new:?}"),
        "If it is the same camera under another name, say --same-camera.",
    )
}

/// Why a calibration with a focal length for every view gets no verdict, and what to do.
pub fn focal_varied() -> (String, &'static str) {
    (
        "NO VERDICT: in the old calibration each view has its own focal length".into(),
        "Lock focus and zoom, and calibrate anew; then it can be checked.",
    )
}

/// What a person should know of an old calibration before it is compared with anything.
pub fn doubts_of_old(old: &OldCalibration) -> Vec<String> {
    let mut doubts = Vec::new();
    if old.verdict == Some(Verdict::Untrustworthy) {
        doubts.push("The old calibration itself is NOT TRUSTWORTHY; its findings say why".into());
    }
    if old.camera_count > 1 {
        doubts.push(format!("The file has {} cameras; this is about the first", old.camera_count));
    }
    if old.outlines.is_empty() {
        doubts.push(
            "The old file does not say where its boards were: hold the board where they were, elsewhere the test is blind"
                .into(),
        );
    }
    doubts
}

/// What an export of such a calibration holds.
pub fn focal_is_a_mean() -> &'static str {
    "Each view has its own focal length; the file gets their mean. views-csv has them all"
}

/// That a control stands otherwise than when the old calibration was made; `None` if it does not.
pub fn lock_differs(control: Control, was: i64, is: Lock) -> Option<String> {
    if is == (Lock::Locked { value: was }) {
        return None;
    }
    let (name, is) = (camera::control(control), camera::lock(is));
    Some(format!("The {name} was locked at {was} when the camera was calibrated; now it is {is}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_a_control_that_stands_otherwise_is_told() {
        assert_eq!(lock_differs(Control::Focus, 30, Lock::Locked { value: 30 }), None);
        let told = lock_differs(Control::Focus, 30, Lock::Locked { value: 0 });
        assert!(told.is_some_and(|told| told.contains("30") && told.contains("locked at 0")));
        assert!(lock_differs(Control::Zoom, 100, Lock::Unknown).is_some());
    }
}
