//! Sentences of the numbers beside the picture.

use super::{acceptance, knows_sd, percent, uncertainty::sd_of};
use boresight_geometry::{LensParameter, LensValues};
use boresight_guide::{
    guidance::{GuidanceParams, Plan},
    session::{Snapshot, ViewSummary},
};

/// Principal point: "653.4 ± 0.2, 348.2 ± 0.2 px".
pub fn principal_point(snapshot: &Snapshot) -> String {
    match &snapshot.calibration {
        Some(calibration) => {
            let pp_px = calibration.camera.pp_px;
            let [sd_x, sd_y] = calibration.sd().of(LensParameter::PP);
            let [sd_x, sd_y] = [sd_x, sd_y].map(|sd| sd_of(calibration, small(sd)));
            format!("{:.1} ± {sd_x}, {:.1} ± {sd_y} px", pp_px.x, pp_px.y)
        }
        None => "unknown yet".into(),
    }
}

/// `count` of `what`, a regular noun.
pub(super) fn counted(count: usize, what: &str) -> String {
    if count == 1 { format!("1 {what}") } else { format!("{count} {what}s") }
}

/// Standard deviation to two significant digits at most.
pub(super) fn small(sd: f64) -> String {
    match sd {
        tiny if tiny < 0.0095 => format!("{sd:.3}"),
        small if small < 0.095 => format!("{sd:.2}"),
        _ => format!("{sd:.1}"),
    }
}

/// Focal length: "980.0 ± 0.2 px".
pub fn focal_length(snapshot: &Snapshot) -> String {
    match &snapshot.calibration {
        Some(calibration) => {
            let f_px = calibration.camera.f_px.x;
            let [sd_px] = calibration.sd().of([LensParameter::Fx]);
            format!("{f_px:.1} ± {} px", sd_of(calibration, small(sd_px)))
        }
        None => "unknown yet".into(),
    }
}

/// Number of views and the forecast: "3 taken, about 3 more".
pub fn views(snapshot: &Snapshot) -> String {
    let views = snapshot.views.len();
    match snapshot.views_to_go {
        Some(0) | None => format!("{views} taken"),
        Some(more) => format!("{views} taken, about {more} more"),
    }
}

/// Accuracy of the principal point, or the error bound of a goal, with the required value; `None`
/// without a calibration.
pub fn precision(snapshot: &Snapshot) -> Option<String> {
    let calibration = snapshot.calibration.as_ref()?;
    if let Some(judged) = &calibration.acceptance {
        return Some(acceptance::progress(judged, knows_sd(calibration)));
    }
    let sd = calibration.sd();
    let reached = sd_of(calibration, small(sd[2].max(sd[3])));
    Some(match pp_goal(snapshot, &snapshot.limits) {
        Some(goal) => format!("{reached} px (plan {goal})"),
        None => format!("{reached} px"),
    })
}

/// Planned error of the principal point by `guidance`; `None` without a calibration, or if the plan
/// has none.
fn pp_goal(snapshot: &Snapshot, guidance: &GuidanceParams) -> Option<String> {
    let f_px = snapshot.calibration.as_ref()?.camera.f_px.x;
    let size = snapshot.setup.image_size;
    let f_to_width = f_px / f64::from(size.width_px.max(size.height_px));
    match guidance.plan {
        Plan::Adaptive => Some(format!("{:.1} px", guidance.pp_goal_px(f_to_width))),
        Plan::Quick | Plan::Full => None,
    }
}

/// Name of [`precision_over_picture`] everywhere.
pub const TYPICAL_ERROR: &str = "Typical error";

/// Accuracy of projection over the whole picture, with the required value; over the picture's
/// corners while boards are requested beyond its edge. `None` without a calibration, and if a goal
/// replaces this accuracy.
pub fn precision_over_picture(snapshot: &Snapshot) -> Option<String> {
    let calibration = snapshot.calibration.as_ref()?;
    if calibration.acceptance.is_some() {
        return None;
    }
    let guidance = &snapshot.limits;
    let is_beyond_edge = snapshot.target.as_ref().is_some_and(|target| target.leaves_picture);
    if let Some(goal_px) = guidance.stop_corner_sigma_px.filter(|_| is_beyond_edge) {
        let reached = sd_of(calibration, small(calibration.projection_sd.max_px));
        return Some(format!("corners {reached} px (plan {})", small(goal_px)));
    }
    let reached = sd_of(calibration, small(calibration.projection_sd.mean_px));
    Some(match guidance.plan {
        Plan::Adaptive => {
            let goal = acceptance::small(guidance.stop_projection_sigma_px);
            format!("{reached} px (goal {goal} px)")
        }
        Plan::Quick | Plan::Full => format!("{reached} px"),
    })
}

/// Prediction error of the newest pair by the views before it; `None` before two pairs.
pub fn predicted(snapshot: &Snapshot) -> Option<String> {
    snapshot.held_out.map(|pair| format!("{} px", small(pair.rms_px)))
}

/// Corner noise measured during holds; `None` until the holds show enough of it.
pub fn measured_noise(snapshot: &Snapshot) -> Option<String> {
    snapshot.measured_noise_px.map(|noise_px| format!("{} px", small(noise_px)))
}

/// Number to a tenth of a pixel, with a sign; zero has none.
pub(super) fn signed(px: f64) -> String {
    let tenths = (10.0 * px).round();
    if tenths == 0.0 { "0.0".into() } else { format!("{:+.1}", tenths / 10.0) }
}

/// Remainder of the newest opposed pair after cancellation, with the names of the two views.
pub fn pair_balance(snapshot: &Snapshot) -> String {
    match snapshot.pairs.last() {
        Some(pair) => {
            let [first, second] = [pair.first, pair.second].map(|at| snapshot.views[at].number);
            format!("{} px, views {first} and {second}", signed(pair.balance_px))
        }
        None => "no pair yet".into(),
    }
}

/// Share of the picture covered by boards.
pub fn coverage(snapshot: &Snapshot) -> String {
    percent(snapshot.calibration.as_ref().map_or(0.0, |calibration| calibration.coverage))
}

/// Labels and tooltips of the numbers beside the picture.
pub const NUMBERS: [(&str, &str); 10] = [
    (
        "Principal point",
        "Principal point: where the optical axis meets the picture, with one standard deviation, from four views on.",
    ),
    (
        "Focal length",
        "Focal length from all views, with one standard deviation, from four views on.",
    ),
    (
        "Point error",
        "Standard deviation of the principal point on its worse axis. With --accept: the 95 % error bound.",
    ),
    (
        TYPICAL_ERROR,
        "How far a point of the picture is off: one standard deviation, on average over the picture, or in its corners if they need more.",
    ),
    ("Views", "Views taken so far, and how many more are likely needed."),
    (
        "Pair balance",
        "How far the newest opposed pair's lines miss the principal point on average. 0 if the lens errors cancel.",
    ),
    ("Covered", "Share of the picture covered by the board so far."),
    (
        "This view",
        "Focal length from the newest view alone. A jump means that focus or zoom moved.",
    ),
    (
        "Prediction",
        "How well the earlier views predicted the newest pair (RMS distance of its corners).",
    ),
    ("Noise", "Corner error from picture to picture, measured while the board was held."),
];

/// Focal length of the newest view alone.
pub fn newest_focal(views: &[ViewSummary]) -> String {
    match views.iter().rev().find_map(|view| view.focal) {
        Some(focal) => format!("{:.0} ± {:.0} px", focal.f_px, focal.sigma_px),
        None => "unknown yet".into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_has_no_sign() {
        assert_eq!([-0.04, 0.04, -0.06, 1.26].map(signed), ["0.0", "0.0", "-0.1", "+1.3"]);
    }
}
