//! A rig in words: several cameras with fixed mutual places.

use super::{
    findings::{grade, simulated},
    numbers::{counted, small},
};
use boresight_calibrate::{
    DriftVerdict, NotARig, Pair, PairBound, PairChange, RigCalibration, RigCamera, RigFinding,
};
use boresight_formats::{RigFile, RigWords};
use boresight_geometry::Camera;
use boresight_guide::rig::RigPrompt;

use crate::grade::Grade;

/// Words for the findings of a rig.
pub const RIG_WORDS: RigWords = RigWords { finding, not_a_rig };

/// The camera's name, or "a camera" where either of two may be meant.
fn of(camera: Option<usize>, names: &[String]) -> &str {
    camera.map_or("one of the cameras", |camera| &names[camera])
}

fn finding(finding: &RigFinding, names: &[String]) -> (String, &'static str) {
    match finding {
        RigFinding::InstantsFew { instants, wanted } => (
            format!(
                "{}: the uncertainty is known from {wanted} on",
                counted(*instants, "common place")
            ),
            "Show the board to two cameras at once in more places, tipped by 30 to 50°.",
        ),
        RigFinding::Touched { camera, from } => (
            format!("{} was moved or touched before picture {from}", of(*camera, names)),
            "Tighten its mount, then take all pictures again.",
        ),
        RigFinding::OtherInstant { camera, instant } => (
            format!(
                "picture {instant} of {} wasn't taken at the moment of the others: used for the lenses only",
                of(*camera, names)
            ),
            "Hold the board still, or lean it on something, while all cameras take their picture.",
        ),
        RigFinding::CauseUnclear => (
            "the pictures disagree, and several causes fit alike".into(),
            "Take them again with the board at rest and the cameras tight.",
        ),
        RigFinding::Late { camera, ratio } => (
            format!(
                "corners of {} err {ratio:.1} times as much beside the other cameras as alone: its pictures may be of other moments",
                names[*camera]
            ),
            "Take them again with the board at rest (lean it on a chair), or trigger the cameras together.",
        ),
        RigFinding::PairUncertain { of: [a, b], bound, goal, is_length, .. } => (
            format!(
                "{} and {}: the error may reach {}, the goal is {}",
                names[*a],
                names[*b],
                of_goal(*bound, *is_length),
                of_goal(*goal, *is_length)
            ),
            "Show the board to both in more places, near and far, tipped by 30 to 50°.",
        ),
        RigFinding::PairUnseen { of: [a, b] } => (
            format!(
                "{} and {} share no part of their pictures to be judged by",
                names[*a], names[*b]
            ),
            "Use them through a third camera, or show the board where both see it.",
        ),
    }
}

/// How exact the weakest pair is, 95 % of the time.
pub fn how_exact(within_m: f64, at_m: f64, row_px: Option<f64>) -> String {
    let rows = row_px.map_or(String::new(), |px| {
        format!(" Rows of two pictures agree within {} px.", small(px))
    });
    format!("A distance at {at_m:.2} m is within {} mm.{rows}", small(1000.0 * within_m))
}

/// Where the rig was measured.
pub fn where_valid(near_m: f64, far_m: f64) -> String {
    format!("From {near_m:.2} to {far_m:.2} m, where the boards were.")
}

/// How long the rig holds.
pub fn until_when(check_due: Option<&str>) -> String {
    let due = check_due.map_or(String::new(), |due| format!(" Next check due {due}."));
    format!("Until a camera, its mount or its lens is touched.{due}")
}

/// Row error in pixels, or error of a length in metres.
pub fn of_goal(value: f64, is_length: bool) -> String {
    if is_length { format!("{} mm", small(1000.0 * value)) } else { format!("{} px", small(value)) }
}

fn not_a_rig(reason: &NotARig, names: &[String]) -> (String, String) {
    let list = |cameras: &[usize]| {
        cameras.iter().map(|camera| names[*camera].as_str()).collect::<Vec<_>>().join(", ")
    };
    match reason {
        NotARig::OneCamera => (
            "a rig has two cameras or more".into(),
            "Name a folder for each: boresight calibrate --rig left=FOLDER right=FOLDER.".into(),
        ),
        NotARig::NoLens { camera, reason } => (
            format!("{} gives no lens: {reason}", names[*camera]),
            format!(
                "Add pictures of the board from it, tipped by 30 to 50°, or name its calibration: --known-lens {}=FILE.",
                names[*camera]
            ),
        ),
        NotARig::Unlinked { cameras } => (
            format!("{}: no picture of the same moment as another camera's", list(cameras)),
            "Show the board where two cameras see it at once. Pictures of one moment have one number."
                .into(),
        ),
        NotARig::NotPairs { of, agreeing, instants } => (
            format!(
                "the pictures of {} aren't of the same moments: {agreeing} of {instants} agree",
                list(of)
            ),
            "Check that one number means one moment, then take them again with the board at rest."
                .into(),
        ),
        NotARig::Undetermined => (
            "the pictures determine no rig".into(),
            "Show the board in more places, tipped by 30 to 50°.".into(),
        ),
    }
}

/// Request to the person; `sentence` is that of a camera's session, if there was a picture.
pub fn prompt(
    prompt: &RigPrompt,
    names: &[String],
    sentence: impl FnOnce(usize) -> Option<String>,
) -> String {
    match *prompt {
        RigPrompt::OfCamera { camera } => match sentence(camera) {
            Some(sentence) => format!("{}: {sentence}", names[camera]),
            None => format!("{}: waiting for its first picture", names[camera]),
        },
        RigPrompt::Unseen { camera } => {
            format!("Now where {} sees the whole board, too", names[camera])
        }
        RigPrompt::ShowToTwo => "Show the board to two cameras at once".into(),
        RigPrompt::Link { linked } => {
            let any_of = |is_linked: bool| {
                let of = |(camera, _): &(usize, &String)| (linked >> camera & 1 == 1) == is_linked;
                let names = names.iter().enumerate().filter(of).map(|(_, name)| name.as_str());
                names.collect::<Vec<_>>().join(" or ")
            };
            format!("Show the board to {} and {} at once", any_of(true), any_of(false))
        }
        RigPrompt::Rest => "Lean the board on something, and let go".into(),
        RigPrompt::Resting { .. } => "Leave it".into(),
        RigPrompt::Taken => "Got it".into(),
        RigPrompt::Elsewhere => "Show the board somewhere else".into(),
        RigPrompt::Complete => "Done: every pair of cameras meets the goal".into(),
    }
}

/// Number of places taken.
pub fn places(count: usize) -> String {
    counted(count, "place")
}

/// Label of the button that closes the window.
pub const CLOSE: &str = "Close";

/// Sentence at the end, until the result is there.
pub const CALIBRATING: &str = "Calibrating the rig";

/// News of a place: cameras and the number of places so far.
pub fn taken(cameras: &[&str], places: usize) -> String {
    format!("Taken: place {places}, seen by {}", cameras.join(", "))
}

/// News of a place that was taken back.
pub fn place_removed(places: usize) -> String {
    let left = if places == 1 { "place is" } else { "places are" };
    format!("The newest place is removed; {places} {left} left")
}

/// How far the weakest pair is from the goal, after `places` places.
pub fn so_far(found: Result<&RigCalibration, &NotARig>, names: &[String]) -> Option<String> {
    let rig = found.ok()?;
    // What a few places contradict is mended by more of them.
    let is_known = rig.covariance.is_some();
    let worst = rig.findings.iter().find(|finding| is_known || finding.is_of_too_few())?;
    let (message, _) = finding(worst, names);
    Some(format!("  So far: {message}"))
}

/// Error of a pair against its goal, in a few letters.
pub fn link(pair: &Pair, bound: Option<PairBound>) -> String {
    match bound {
        Some(PairBound { bound, goal, is_length }) if bound > goal => {
            format!("{}, goal {}", of_goal(bound, is_length), of_goal(goal, is_length))
        }
        Some(PairBound { bound, is_length, .. }) => of_goal(bound, is_length),
        None => places(pair.instants),
    }
}

/// Keys of a rig's session.
pub const KEYS: &str = "Keys: U takes the newest place back, Q ends";

/// Verdict on the rig in a file; marked if the cameras were simulated.
pub fn verdict(rig: &RigFile) -> String {
    let of_rig = Grade::of_rig(rig);
    let what = match of_rig {
        Grade::Good => "every pair of cameras meets the goal",
        Grade::Care => "see the warnings below",
        Grade::Unfinished => "more places of the board make it usable",
        Grade::NotTrustworthy => "don't use this rig",
    };
    let verdict = format!("{}: {what}", grade(of_rig));
    if rig.simulated { simulated(&verdict) } else { verdict }
}

/// A camera's numbers.
pub fn camera(name: &str, lens: &Camera, of: &RigCamera) -> String {
    let alone = of.alone_rms_px.map_or(String::new(), |px| format!(", {px:.3} px alone"));
    format!(
        "  {name}: focal length {:.2} px, principal point ({:.2}, {:.2}), residual {:.3} px{alone}, {}",
        lens.f_px.x,
        lens.pp_px.x,
        lens.pp_px.y,
        of.rms_px,
        counted(of.views, "picture")
    )
}

/// Distance of two cameras.
pub fn baseline(baseline_m: f64, sd_m: Option<f64>) -> String {
    let sd_mm = sd_m.map_or_else(|| UNKNOWN.to_owned(), |sd_m| small(1000.0 * sd_m));
    format!("{:.2} ± {sd_mm} mm", 1000.0 * baseline_m)
}

/// Numbers of two cameras; `scale_sd` is the relative standard deviation of the board's squares.
pub fn pair(pair: &Pair, names: &[String], scale_sd: f64) -> String {
    let [a, b] = pair.of.map(|camera| &names[camera]);
    let baseline_mm = 1000.0 * pair.second_from_first.translation.vector.norm();
    let mut line = format!("  {a} to {b}: {baseline_mm:.2}");
    match &pair.sd {
        Some(sd) => {
            let of_scale = scale_sd * baseline_mm;
            line += &format!(
                " ± {} mm (± {} with the squares' size)",
                small(1000.0 * sd.baseline_m),
                small(libm::hypot(1000.0 * sd.baseline_m, of_scale))
            );
            if let Some(px) = sd.row_px {
                line += &format!(", rows ± {} px", small(px));
            }
            line += &format!(", distances ± {} % at {:.2} m", small(100.0 * sd.distance), sd.at_m);
        }
        None => line += " ± ? mm",
    }
    line + ", " + &counted(pair.instants, "common place")
}

/// Captions of a pair's pictures.
pub const AS_TAKEN: &str = "As taken: a line crosses different points of the board.";
/// See [`AS_TAKEN`].
pub const RECTIFIED: &str = "Rectified: each point is on one line in both pictures.";
/// See [`AS_TAKEN`].
pub const ROWS_NOTE: &str =
    "The pair with the least certain rows, by the lenses and places of this calibration.";
/// Titles of the drawings of a rig.
pub const FROM_ABOVE: &str = "From above; the first camera looks away from you, up the page";
/// See [`FROM_ABOVE`].
pub const FROM_THE_SIDE: &str = "From the side; the first camera looks to the right";
/// In place of a number that isn't known.
pub const UNKNOWN: &str = "?";
/// Columns of the table of pairs.
pub const PAIR_COLUMNS: [&str; 6] =
    ["Baseline, mm", "Rows ±, px", "Rows rms, px", "Distances ±, %", "at, m", "Places"];
/// Note below the table of pairs.
pub const PAIR_NOTE: &str = "The weakest pair first. ± is one standard deviation from the pictures; the size of the board's squares comes on top. Rows rms: how far the corners of both pictures miss each other's row after rectification.";
/// Columns of the table of cameras.
pub const CAMERA_COLUMNS: [&str; 7] =
    ["fx, px", "fy, px", "cx, px", "cy, px", "Residual, px", "alone, px", "Pictures"];
/// Axes of the chart of distances.
pub const DISTANCE_AXES: [&str; 2] = ["distance, m", "± of a distance, mm"];
/// Note below the chart of distances.
pub const DISTANCE_NOTE: &str = "By the calibration alone, between the cameras' axes: the error of a corner in a picture comes on top.";
/// Axes of the chart of residuals.
pub const RESIDUAL_AXES: [&str; 2] = ["place of the board", "residual, px"];
/// Note below the chart of residuals.
pub const RESIDUAL_NOTE: &str = "Root mean square of each picture. A picture far above the others of its camera was taken at another moment, or its camera was touched.";
/// In place of a chart without an uncertainty.
pub const NO_UNCERTAINTY: &str = "Not known: too few common places of the board.";

/// Length of a scale bar.
pub fn length(m: f64) -> String {
    if m < 1.0 { format!("{:.0} mm", 1000.0 * m) } else { format!("{m} m") }
}

/// Name of two cameras.
pub fn pair_name(a: &str, b: &str) -> String {
    format!("{a} to {b}")
}

/// Change of two cameras since an earlier calibration.
pub fn change(change: &PairChange, names: &[String], limit_px: f64) -> String {
    let [a, b] = change.of.map(|camera| &names[camera]);
    let PairChange { turn_rad, shift_m, displaced_px, interval_px: [least, most], .. } = change;
    let answer = match change.verdict {
        DriftVerdict::Ok => "OK",
        DriftVerdict::Recalibrate => "MOVED",
        DriftVerdict::CannotTell => "CAN'T TELL",
    };
    format!(
        "  {a} to {b}: {answer}, displaced by {displaced_px:.2} px ({least:.2} to {most:.2} px, limit {limit_px} px): turned by {:.3}°, shifted by {:.1} mm",
        turn_rad.to_degrees(),
        1000.0 * shift_m
    )
}

/// Whether a camera has moved against the others, and the next action.
pub fn changed(changes: &[PairChange], moved: Option<usize>, names: &[String]) -> String {
    let is = |verdict| changes.iter().any(|change| change.verdict == verdict);
    if let Some(camera) = moved {
        format!("MOVED: {}. Tighten its mount, then calibrate the rig again.", names[camera])
    } else if is(DriftVerdict::Recalibrate) {
        "MOVED: the cameras' mutual places have changed. Tighten the mounts, then calibrate the rig again."
            .into()
    } else if changes.is_empty() || is(DriftVerdict::CannotTell) {
        "CAN'T TELL. Show the board to two cameras at once in more places, tipped by 30 to 50°."
            .into()
    } else {
        "OK: no camera has moved against another.".into()
    }
}
