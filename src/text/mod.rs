//! Every sentence a person reads: data in, words out. Nothing is decided here.
//!
//! Directions are as seen in the picture. Each refusal names what was measured and what is wanted.

pub mod acceptance;
pub mod adjust;
pub mod backend;
pub mod camera;
pub mod charts;
mod controls;
pub mod doctor;
mod drift;
pub mod explore;
mod findings;
mod gauge;
mod numbers;
pub mod replay;
pub mod report;
pub mod result;
mod run;
pub mod session_news;
pub mod settings;
pub mod source;
mod target;
pub mod window;

pub use controls::{Act, Control};
pub use drift::{
    NOT_COMPARED, USE_THE_NEW_ONE, compared_with, doubts_of_old, drift, drift_is_weak, drift_lines,
    drift_numbers, focal_is_a_mean, focal_varied, lock_differs, maybe_other_camera, no_drift,
    other_camera,
};
pub use findings::{
    FINDING_WORDS, finding, finding_in_session, is_simulated, not_calibrated, of_source, verdict,
};
pub use run::{resuming, views_are_safe};
pub use target::{does_not_fit, other_square, target_lines, target_steps};

use crate::{
    detection::{Miss, Side},
    guidance::{Advice, Progress, Refusal, Role, direction_difference_rad},
    session::{Outcome, Snapshot, ViewNumber},
};

/// What to do next, in one sentence; `no_board` is why the newest frame shows none.
pub fn advice(advice: &Advice, no_board: Option<&Miss>) -> String {
    match *advice {
        Advice::ShowBoard => no_board.map_or_else(|| miss(&Miss::NoBoard), miss),
        Advice::TipTowards { tilt_azimuth_rad: None, wanted_rad } => {
            format!("Tip the {} edge away", edge(wanted_rad))
        }
        Advice::TipTowards { tilt_azimuth_rad: Some(now_rad), wanted_rad } => {
            let (now, wanted) = (edge(now_rad), edge(wanted_rad));
            if now == wanted {
                let turn_rad = direction_difference_rad(wanted_rad, now_rad);
                let way = if turn_rad > 0.0 { "clockwise" } else { "counterclockwise" };
                format!("Tip the {wanted} edge away, {}° more {way}", deg(turn_rad.abs()))
            } else {
                format!("Tip the {wanted} edge away, not the {now}")
            }
        }
        Advice::Tilt { tilt_rad, wanted_rad, tilt_azimuth_rad } => {
            let way = if tilt_rad < wanted_rad { "away" } else { "back" };
            format!(
                "Tip the {} edge {way}: {}°, want {}°",
                edge(tilt_azimuth_rad),
                deg(tilt_rad),
                deg(wanted_rad)
            )
        }
        Advice::Distance { span_fraction, wanted } => {
            let way = if span_fraction < wanted { "Come closer" } else { "Step back" };
            format!("{way}: board {}, want {}", percent(span_fraction), percent(wanted))
        }
        Advice::Shift { right_px, down_px } => {
            let (x, y) = (right_px.abs().round(), down_px.abs().round());
            let across = if right_px < 0.0 { "left" } else { "right" };
            let down = if down_px < 0.0 { "up" } else { "down" };
            match (x >= 10.0, y >= 10.0) {
                (true, false) => format!("Move {across}: {x} px"),
                (false, true) => format!("Move {down}: {y} px"),
                _ => format!("Move {across} {x} px and {down} {y} px"),
            }
        }
        Advice::HoldStill { .. } => "Hold still".into(),
        Advice::SteadyTheBoard => "Rest your elbows, or lean the board on something".into(),
        Advice::Holding { progress } => format!("Hold still: {}", percent(progress)),
        Advice::Mend { refusal: ref reason } => refusal(reason),
        Advice::Finished => "Finished".into(),
    }
}

/// Why a view was not taken: what was measured and what is wanted.
pub fn refusal(refusal: &Refusal) -> String {
    match *refusal {
        Refusal::NotFound => "No board found".into(),
        Refusal::NoLine => "The board faces the camera: tip it".into(),
        Refusal::OutsideLens { outside, of } => format!(
            "{outside} of {of} corners are where the lens isn't known yet: move the board to the middle"
        ),
        Refusal::TooFlat { tilt_rad, wanted_rad } => {
            format!("Tip the board more: {}°, want at least {}°", deg(tilt_rad), deg(wanted_rad))
        }
        Refusal::TooSteep { tilt_rad, wanted_rad } => {
            format!("Tip the board less: {}°, want at most {}°", deg(tilt_rad), deg(wanted_rad))
        }
        Refusal::Unclear { sigma_rad, wanted_rad } => format!(
            "Its direction is unclear by {:.1}°, want {:.1}°: come closer or tip it more",
            sigma_rad.to_degrees(),
            wanted_rad.to_degrees()
        ),
        Refusal::TooFar { span_fraction, wanted } => {
            let (board, wanted) = (percent(span_fraction), percent(wanted));
            format!("Come closer: board {board}, want at least {wanted}")
        }
        Refusal::AtTheEdge { margin_px, wanted_px } => format!(
            "Too close to the picture's edge: {margin_px:.0} px, want {wanted_px:.0} px; step back"
        ),
        Refusal::Blurred { blur_px, wanted_px } => format!(
            "Blurred: {blur_px:.1} px, want at most {wanted_px:.1} px; hold still or focus the lens"
        ),
        Refusal::AlreadyCovered { nearest_rad, wanted_rad } => format!(
            "This direction is there already: {}° from the nearest, want {}°",
            deg(nearest_rad),
            deg(wanted_rad)
        ),
        Refusal::PartnerOff { offset_px, wanted_px } => format!(
            "Opposite, but {offset_px:.0} px beside the mirrored place, want at most {wanted_px:.0} px"
        ),
        Refusal::TellsLittle { worth, wanted } => format!(
            "Follow the outline: this view tells {} of what that one would; it needs {} now",
            percent(worth),
            percent(wanted)
        ),
        Refusal::Inconsistent { sigmas, wanted } => format!(
            "This view contradicts the others by {sigmas:.1} sd, limit {wanted:.1}: is the board flat, the focus unchanged?"
        ),
        Refusal::Moving { smear_px: Some(smear_px), wanted_smear_px: Some(wanted_px), .. }
            if smear_px > wanted_px =>
        {
            format!("Hold still: smeared by {smear_px:.1} px, limit {wanted_px:.1} px")
        }
        Refusal::Moving { speed_px_per_s: Some(speed_px_per_s), wanted_px_per_s, .. } => {
            format!("Hold still: {speed_px_per_s:.0} px/s, limit {wanted_px_per_s:.0} px/s")
        }
        Refusal::Moving { speed_px_per_s: None, .. } => "Hold still".into(),
        Refusal::Holding { progress } => format!("Hold still: {}", percent(progress)),
        Refusal::OtherSize { size_px, wanted_px } => format!(
            "This picture is {}x{}, the session's are {}x{}",
            size_px.0, size_px.1, wanted_px.0, wanted_px.1
        ),
        Refusal::CameraNotReady => "The camera is not ready".into(),
        Refusal::NotCollecting => "Not taking views now".into(),
    }
}

/// Why no board was found, with what to do.
pub fn miss(miss: &Miss) -> String {
    match *miss {
        Miss::NoBoard => "Show the whole board".into(),
        Miss::PartialBoard { found, wanted, cut_off_by: Some(side) } => {
            let side = match side {
                Side::Left => "left",
                Side::Right => "right",
                Side::Top => "top",
                Side::Bottom => "bottom",
            };
            format!(
                "The {side} edge of the picture cuts the board off: {found} of {wanted} corners"
            )
        }
        Miss::PartialBoard { found, wanted, cut_off_by: None } => {
            format!("Some corners are hidden: {found} of {wanted} found")
        }
        Miss::Glare { found, wanted } => format!(
            "Light blinds the camera on the board: {found} of {wanted} corners; turn it out of the reflection"
        ),
        Miss::OtherBoard { columns, rows } => format!(
            "I see a board of {columns}x{rows} inner corners, not the one you named: try --board {columns}x{rows}"
        ),
        Miss::TooSmall { square_px, needed_px } => {
            format!("Come closer: squares of {square_px:.0} px, want {needed_px:.0} px")
        }
        Miss::Blurred { blur_px, limit_px } => format!(
            "Too blurred to measure: {blur_px:.1} px, want at most {limit_px:.1} px; hold still or focus the lens"
        ),
        Miss::LowContrast { contrast, needed } => {
            format!("Too little contrast: {contrast:.0} grey levels, want {needed:.0}; more light")
        }
        Miss::OutOfTime => {
            "The picture is too busy to search in time: a plainer background helps".into()
        }
    }
}

/// What people call a view, everywhere: "view 3".
pub fn view_name(number: ViewNumber) -> String {
    format!("view {number}")
}

/// What happened to the views, if anything did.
pub fn outcome(outcome: &Outcome, snapshot: &Snapshot) -> Option<String> {
    match *outcome {
        Outcome::Accepted { view, role, .. } => {
            let what = match role {
                Role::NewDirection => "a new direction".into(),
                Role::Partner { of } => match snapshot.views.get(of) {
                    Some(partner) => format!("the opposite of {}", view_name(partner.number)),
                    None => "the opposite of an earlier view".into(),
                },
                Role::Forced => "taken by hand".into(),
            };
            let slot = snapshot.views.iter().find(|summary| summary.number == view).map_or(
                String::new(),
                |summary| {
                    let tilt = summary.tilt_rad.map_or("?".into(), deg);
                    format!(", {} edge away, tilt {tilt}°", edge(summary.tilt_azimuth_rad))
                },
            );
            Some(format!("Taken: {}, {what}{slot}", view_name(view)))
        }
        Outcome::Removed { view } => Some(format!("Removed: {}", view_name(view))),
        Outcome::Restored { view } => Some(format!("Brought back: {}", view_name(view))),
        Outcome::Refused { .. } | Outcome::Noted => None,
    }
}

/// How a session ended.
pub fn progress(progress: Progress) -> &'static str {
    match progress {
        Progress::Collecting => "The session ended before the plan was complete",
        Progress::Complete => "The plan is complete",
        Progress::Exhausted => {
            "No further view would help, and the wanted precision is not reached"
        }
    }
}

/// The edge of the board that points towards `direction_rad` in the picture, in words.
fn edge(direction_rad: f64) -> &'static str {
    const EDGES: [&str; 8] =
        ["right", "bottom right", "bottom", "bottom left", "left", "top left", "top", "top right"];
    let eighth = (direction_rad / std::f64::consts::FRAC_PI_4).round().rem_euclid(8.0);
    EDGES[eighth as usize % EDGES.len()]
}

fn deg(angle_rad: f64) -> String {
    format!("{:.0}", angle_rad.to_degrees())
}

fn percent(share: f64) -> String {
    format!("{:.0} %", 100.0 * share)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn edges_go_clockwise_from_the_right() {
        assert_eq!(edge(0.0), "right");
        assert_eq!(edge(90_f64.to_radians()), "bottom");
        assert_eq!(edge(-0.1), "right");
        assert_eq!(edge(359_f64.to_radians()), "right");
        assert_eq!(edge(315_f64.to_radians()), "top right");
    }

    #[test]
    fn nobody_is_told_to_tip_an_edge_and_not_to() {
        let off = |from: f64, to: f64| Advice::TipTowards {
            tilt_azimuth_rad: Some(from.to_radians()),
            wanted_rad: to.to_radians(),
        };
        assert_eq!(advice(&off(0.0, 180.0), None), "Tip the left edge away, not the right");
        let clockwise = "Tip the bottom left edge away, 18° more clockwise";
        assert_eq!(advice(&off(120.0, 138.0), None), clockwise);
        let back = "Tip the right edge away, 20° more counterclockwise";
        assert_eq!(advice(&off(5.0, 345.0), None), back);
    }

    #[test]
    fn sentences_say_measured_and_wanted() {
        let tilt = Advice::Tilt {
            tilt_rad: 22_f64.to_radians(),
            wanted_rad: 40_f64.to_radians(),
            tilt_azimuth_rad: 270_f64.to_radians(),
        };
        assert_eq!(advice(&tilt, None), "Tip the top edge away: 22°, want 40°");
        let far = Advice::Distance { span_fraction: 0.38, wanted: 0.65 };
        assert_eq!(advice(&far, None), "Come closer: board 38 %, want 65 %");
    }
}
