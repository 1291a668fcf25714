//! Sentences of the numbers beside the picture.

use super::{acceptance, percent};
use crate::{
    guidance::Plan,
    session::{Snapshot, ViewSummary},
};

/// Principal point: "653.4 ± 0.2, 348.2 ± 0.2 px".
pub fn principal_point(snapshot: &Snapshot) -> String {
    match &snapshot.calibration {
        Some(calibration) => {
            let [_, _, x, y, ..] = calibration.camera.lens_parameters();
            let [_, _, sd_x, sd_y, ..] = calibration.sd();
            format!("{x:.1} ± {}, {y:.1} ± {} px", small(sd_x), small(sd_y))
        }
        None => "not known yet".into(),
    }
}

/// A standard deviation to two significant digits at most.
fn small(sd: f64) -> String {
    if sd < 0.095 { format!("{sd:.2}") } else { format!("{sd:.1}") }
}

/// Focal length: "980.0 ± 0.2 px".
pub fn focal_length(snapshot: &Snapshot) -> String {
    match &snapshot.calibration {
        Some(calibration) => {
            let (f_px, sd_px) = (calibration.camera.f_px.x, calibration.sd()[0]);
            format!("{f_px:.1} ± {} px", small(sd_px))
        }
        None => "not known yet".into(),
    }
}

/// Number of views and the forecast: "5, about 3 to go".
pub fn views(snapshot: &Snapshot) -> String {
    let views = snapshot.views.len();
    match snapshot.views_to_go {
        Some(to_go) => format!("{views}, about {to_go} to go"),
        None => format!("{views}"),
    }
}

/// Precision reached and wanted; `None` without a calibration.
pub fn precision(snapshot: &Snapshot) -> Option<String> {
    let calibration = snapshot.calibration.as_ref()?;
    if let Some(judged) = &calibration.acceptance {
        return Some(acceptance::progress(judged));
    }
    let sd = calibration.sd();
    let guidance = &snapshot.setup.guidance;
    let size = snapshot.setup.image_size;
    let f_to_width = calibration.camera.f_px.x / f64::from(size.width_px.max(size.height_px));
    let reached = sd[2].max(sd[3]);
    let (reached, over_all) = (small(reached), small(calibration.projection_sd.mean_px));
    Some(match guidance.plan {
        Plan::Adaptive => format!(
            "{reached} of {:.1} px, all {over_all} of {:.1} px",
            guidance.pp_goal_px(f_to_width),
            guidance.stop_projection_sigma_px
        ),
        Plan::Quick | Plan::Full => format!("{reached} px, all {over_all} px"),
    })
}

/// How well the newest pair was predicted by the views before it; `None` before two pairs.
pub fn predicted(snapshot: &Snapshot) -> Option<String> {
    snapshot.held_out.map(|pair| format!("{} px", small(pair.rms_px)))
}

/// Noise of a corner, measured while the board was held; `None` until a hold has shown enough of it.
pub fn measured_noise(snapshot: &Snapshot) -> Option<String> {
    snapshot.measured_noise_px.map(|noise_px| format!("{} px", small(noise_px)))
}

/// To a tenth of a pixel, with its sign; zero has none.
pub(super) fn signed(px: f64) -> String {
    let tenths = (10.0 * px).round();
    if tenths == 0.0 { "0.0".into() } else { format!("{:+.1}", tenths / 10.0) }
}

/// What the newest opposed pair leaves uncancelled, with the names of its views.
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
pub const NUMBERS: [(&str, &str); 9] = [
    (
        "PP",
        "Principal point: where the optical axis meets the picture, with one standard deviation.",
    ),
    ("f", "Focal length with one standard deviation, from all views together."),
    (
        "sd",
        "Standard deviation of the principal point on its worse axis, and of projection over the whole picture; and what is wanted. With a goal (--accept), the 95 % bound of its error instead.",
    ),
    ("Views", "Taken so far, and the forecast of how many it will take."),
    (
        "Pair",
        "How far the newest opposed pair's lines pass the principal point on average: 0 if what the lens does to them cancels.",
    ),
    ("Area", "Share of the picture in which a board has stood."),
    (
        "f here",
        "Focal length from the newest accepted view alone: a jump says that focus or zoom moved.",
    ),
    (
        "Unseen",
        "How well the views before the newest pair predicted it: root mean square distance of its corners.",
    ),
    ("Noise", "Error of a corner from picture to picture, measured while the board was held."),
];

/// Focal length of the newest view alone.
pub fn newest_focal(views: &[ViewSummary]) -> String {
    match views.iter().rev().find_map(|view| view.focal) {
        Some(focal) => format!("{:.0} ± {:.0} px", focal.f_px, focal.sigma_px),
        None => "not known yet".into(),
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
