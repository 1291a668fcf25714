//! Every sentence shown to a person: data in, words out. Nothing is decided here.
//!
//! Directions are as seen in the picture. Each refusal gives the measured and the required value.

pub mod acceptance;
pub mod adjust;
mod boards;
pub mod camera;
pub mod cause;
pub mod certificate;
pub mod charts;
mod controls;
pub mod demo;
pub mod doctor;
mod drift;
mod findings;
mod gauge;
pub mod judgement;
mod misses;
mod numbers;
pub mod paths;
pub mod phone;
pub mod replay;
pub mod report;
pub mod result;
pub mod rig;
mod run;
pub mod session_news;
pub mod sessions;
pub mod settings;
pub mod source;
mod speech;
pub mod start;
mod target;
pub mod terminal;
mod trouble;
mod uncertainty;
pub mod weighed;
pub mod window;

pub use controls::{Act, Control};
pub use drift::{
    NOT_COMPARED, USE_THE_NEW_ONE, board_as_found, compared_with, doubts_of_old, drift,
    drift_is_weak, drift_lines, drift_numbers, first_of_cameras, focal_is_a_mean, focal_varied,
    imported, lock_differs, maybe_other_camera, no_drift, other_camera,
};
pub use findings::{
    FINDING_WORDS, NOT_OF_THE_BOARD, finding, finding_in_session, grade, is_simulated, leaving_out,
    not_calibrated, of_source, verdict, verdict_on,
};
pub use misses::{agreed, miss, misses};
pub use run::{resuming, simulated_gave_up, views_are_safe};
pub use speech::{NO_VOICE, VOICE_TEST, spoken, spoken_after};
pub use target::{
    NO_ROOM_FOR_CODE, board_from_code, code_in_margin, does_not_fit, other_square, target_lines,
    target_steps,
};
pub use trouble::{Trouble, troubles};
pub use uncertainty::{SD_UNKNOWN, is_sd_known, knows_sd, measured, projection};

use crate::grade::Grade;
use boresight_calibrate::Calibration;
use boresight_detect::{OtherBoard, Side};
use boresight_guide::{
    guidance::{Lack, Plan, Refusal, Role},
    session::{Across, Edge, Ending, Outcome, Prompt, Snapshot, Upright, ViewNumber},
};

/// Next action: six words at most and no number, so it can be read from afar at a glance.
pub fn prompt(prompt: Prompt) -> String {
    match prompt {
        Prompt::Complete => "Finished!".into(),
        Prompt::Exhausted => "Stopped. The result says why".into(),
        Prompt::Failed => "The session has stopped".into(),
        Prompt::CameraLost => "Camera lost. Reconnecting…".into(),
        Prompt::Frozen => "The picture is frozen".into(),
        Prompt::LensMoved(control) => {
            format!("{} changed. Set it back", camera::capital(camera::control(control)))
        }
        Prompt::Paused => "Paused".into(),
        Prompt::SourceEnded => "End of recording".into(),
        Prompt::Taken => "Got it!".into(),
        Prompt::ShowBoard => "Show the whole board".into(),
        Prompt::ShowWholeFirst => "Start with the whole board".into(),
        Prompt::CutOff(Side::Left) => "Move right. It's cut off".into(),
        Prompt::CutOff(Side::Right) => "Move left. It's cut off".into(),
        Prompt::CutOff(Side::Top) => "Move down. It's cut off".into(),
        Prompt::CutOff(Side::Bottom) => "Move up. It's cut off".into(),
        Prompt::Uncover => "Uncover it, or tip it less".into(),
        Prompt::Glare => "Too much glare. Tip the board".into(),
        Prompt::OtherBoard(other) => match other {
            OtherBoard::Plain { .. } | OtherBoard::Larger { .. } => {
                "This is a different board".into()
            }
            OtherBoard::Charuco { .. } => "This is a ChArUco board".into(),
            OtherBoard::AprilGrid => "This is an AprilGrid".into(),
            OtherBoard::Circles { .. } => "This is a circle grid".into(),
        },
        Prompt::Mirrored => "Mirrored. Switch the camera's flip off".into(),
        Prompt::OtherMarkers => "Wrong markers. Show the other board".into(),
        Prompt::OtherSquares => "Different ChArUco layout".into(),
        Prompt::Closer => "Come closer".into(),
        Prompt::Farther => "Step back a little".into(),
        Prompt::Blurred => "Blurry. Hold still or refocus".into(),
        Prompt::Dark => "Too dark. Add light".into(),
        Prompt::Busy => "Search too slow. Plainer background?".into(),
        Prompt::Tip(away) => format!("Tip the {} back", part(away)),
        Prompt::TipInstead(away) => format!("Now the {} back", part(away)),
        Prompt::TipFurther(away) => format!("Tip the {} further", part(away)),
        Prompt::TipLess => "Tip it a little less".into(),
        Prompt::TipMore => "Tip the board more".into(),
        Prompt::Shift(across, upright) => {
            let across = across.map(|across| match across {
                Across::Left => "left",
                Across::Right => "right",
            });
            let upright = upright.map(|upright| match upright {
                Upright::Up => "up",
                Upright::Down => "down",
            });
            let ways: Vec<&str> = across.into_iter().chain(upright).collect();
            format!("Move {}", ways.join(" and "))
        }
        Prompt::ToTheMiddle => "Move the board to the middle".into(),
        Prompt::FollowTheOutline => "Match the outline".into(),
        Prompt::Clearer => "Tip it more".into(),
        Prompt::Contradicts => "Is the board bent?".into(),
        Prompt::HoldStill => "Hold still".into(),
        Prompt::SteadyTheBoard => "Rest your elbows on something".into(),
        Prompt::CameraNotReady => "The camera isn't ready".into(),
        Prompt::OtherSize => "The picture size has changed".into(),
    }
}

/// Sentence while no pictures arrive.
pub const NO_PICTURE: &str = "No picture";

/// Reason for not taking a view, with the measured value and the limit.
pub fn refusal(refusal: &Refusal) -> String {
    match *refusal {
        Refusal::NotFound => "No board found".into(),
        Refusal::NoLine => "The board faces the camera. Tip it".into(),
        Refusal::OutsideLens { outside, of } => format!(
            "Move the board to the middle: {outside} of {of} corners are beyond the part of the lens measured so far"
        ),
        Refusal::TooFlat { tilt_rad, wanted_rad } => {
            let (tilt, least) = apart(tilt_rad.to_degrees(), wanted_rad.to_degrees(), 0);
            format!("Tip the board more: {tilt}° ({least}° is asked for)")
        }
        Refusal::Unclear { sigma_rad, wanted_rad } => {
            let (sigma, most) = apart(sigma_rad.to_degrees(), wanted_rad.to_degrees(), 1);
            format!(
                "Tip it more, or come closer: its direction is uncertain by {sigma}° (limit {most}°)"
            )
        }
        Refusal::AlreadyCovered { nearest_rad, wanted_rad } => {
            let (nearest, least) = apart(nearest_rad.to_degrees(), wanted_rad.to_degrees(), 0);
            format!("Already have this angle: {nearest}° from the nearest view (at least {least}°)")
        }
        Refusal::TellsLittle { worth, wanted } => {
            let (worth, least) = apart(100.0 * worth, 100.0 * wanted, 0);
            format!(
                "Not close enough to the outline: worth {worth} % of that view (at least {least} %)"
            )
        }
        Refusal::Inconsistent { sigmas, wanted } => {
            let (sigmas, most) = apart(sigmas, wanted, 1);
            format!(
                "This view doesn't fit the others: off by {sigmas} sd (limit {most}). Is the board flat? Did the focus move?"
            )
        }
        Refusal::Moving { speed_px_per_s: Some(speed_px_per_s), wanted_px_per_s, .. } => {
            let (speed, most) = apart(speed_px_per_s, wanted_px_per_s, 0);
            format!("Too fast: {speed} px/s (a calm hand stays below {most} px/s)")
        }
        Refusal::Moving { speed_px_per_s: None, .. } => "Hold still".into(),
        Refusal::Holding { progress } => format!("Hold still: {}", percent(progress)),
        Refusal::OtherSize { size_px, wanted_px } => format!(
            "This picture is {}x{}, the session's are {}x{}",
            size_px.0, size_px.1, wanted_px.0, wanted_px.1
        ),
        Refusal::CameraNotReady => "The camera isn't ready".into(),
        Refusal::NotCollecting => "No views are being taken now".into(),
    }
}

/// Name of a view: "view 3".
pub fn view_name(number: ViewNumber) -> String {
    format!("view {number}")
}

/// Effect on the views, if any; if `mirrored`, left and right are exchanged for a person facing the
/// camera.
pub fn outcome(outcome: &Outcome, snapshot: &Snapshot, mirrored: bool) -> Option<String> {
    match *outcome {
        Outcome::Accepted { view, role, .. } => {
            let what = match role {
                Role::NewDirection => "a new direction".into(),
                Role::Partner { of } => match snapshot.views.get(of) {
                    Some(partner) => format!("the opposite of {}", view_name(partner.number)),
                    None => "the opposite of an earlier view".into(),
                },
                Role::Further => "a further view of a direction".into(),
                Role::Forced => "taken by hand".into(),
            };
            let slot = snapshot.views.iter().find(|summary| summary.number == view).map_or(
                String::new(),
                |summary| {
                    let away = part_away(summary.tilt_azimuth_rad, mirrored);
                    let tilt =
                        summary.tilt_rad.map(|tilt_rad| format!(", tilt {}°", deg(tilt_rad)));
                    format!(", {away} away{}", tilt.unwrap_or_default())
                },
            );
            Some(format!("Taken: {}, {what}{slot}", view_name(view)))
        }
        Outcome::Removed { view } => Some(format!("Removed: {}", removed(view, snapshot))),
        Outcome::Restored { view } => Some(format!("Brought back: {}", view_name(view))),
        Outcome::Refused { .. } | Outcome::Noted => None,
    }
}

/// Names of the views removed by the newest decision, among them `newest`.
fn removed(newest: ViewNumber, snapshot: &Snapshot) -> String {
    match snapshot.just_removed.as_slice() {
        [earlier @ .., last] if !earlier.is_empty() => {
            let earlier: Vec<String> = earlier.iter().map(ViewNumber::to_string).collect();
            format!("views {} and {last}", earlier.join(", "))
        }
        _ => view_name(newest),
    }
}

/// Sentence for the end of a session; for an early end, with the lack. No goal is reached by a
/// `result` that isn't trustworthy, is unfinished, or misses a goal that was set for it.
pub fn ending(
    ending: Ending,
    lack: Option<Lack>,
    plan: Plan,
    result: Option<&Calibration>,
) -> &'static str {
    let grade = result.map(Grade::of);
    let is_missed = result.is_some_and(|result| result.acceptance.is_some_and(|it| !it.is_met()));
    match ending {
        Ending::Finished | Ending::WithoutCorners if grade == Some(Grade::NotTrustworthy) => {
            "Ended: the findings say why the result can't be used"
        }
        Ending::Finished | Ending::WithoutCorners
            if grade == Some(Grade::Unfinished) || is_missed =>
        {
            "Ended: it needs more views"
        }
        Ending::Finished if plan != Plan::Adaptive => "Finished: all views of the plan are taken",
        Ending::Finished => "Finished: the goal is reached",
        Ending::WithoutCorners => {
            "Finished without the corners: they aren't known well enough, and what's stated there rests on the lens model"
        }
        Ending::Early => match lack {
            Some(Lack::Views) => "Ended early: it needs more views",
            Some(Lack::Opposites) => "Ended early: a view lacks its opposite",
            Some(Lack::Trust) => "Ended early: what was found calls for more views",
            Some(Lack::Coverage) => "Ended early: parts of the picture aren't known well enough",
            Some(Lack::Corners) => {
                "Ended early: the corners of the picture aren't known well enough"
            }
            Some(Lack::Precision) | None => "Ended early: more views were planned",
        },
        Ending::Stopped => "Stopped short of the plan: the findings say why",
    }
}

/// Name of a direction in the picture, by the board's edge or corner that is tipped away.
pub fn direction_name(direction_rad: f64, mirrored: bool) -> &'static str {
    edge(towards(direction_rad, mirrored))
}

/// Edge or corner of the board that is tipped away in a direction of the picture.
pub fn part_away(direction_rad: f64, mirrored: bool) -> String {
    part(towards(direction_rad, mirrored))
}

fn towards(direction_rad: f64, mirrored: bool) -> Edge {
    Edge::towards(if mirrored { std::f64::consts::PI - direction_rad } else { direction_rad })
}

/// Part of the board, in words: a rectangle has four edges and four corners.
fn part(towards: Edge) -> String {
    let kind = match towards {
        Edge::Right | Edge::Bottom | Edge::Left | Edge::Top => "edge",
        Edge::BottomRight | Edge::BottomLeft | Edge::TopLeft | Edge::TopRight => "corner",
    };
    format!("{} {kind}", edge(towards))
}

/// Direction of an edge or a corner, in words.
fn edge(edge: Edge) -> &'static str {
    match edge {
        Edge::Right => "right",
        Edge::BottomRight => "bottom right",
        Edge::Bottom => "bottom",
        Edge::BottomLeft => "bottom left",
        Edge::Left => "left",
        Edge::TopLeft => "top left",
        Edge::Top => "top",
        Edge::TopRight => "top right",
    }
}

fn deg(angle_rad: f64) -> String {
    format!("{:.0}", angle_rad.to_degrees())
}

pub(crate) fn percent(share: f64) -> String {
    format!("{:.0} %", 100.0 * share)
}

/// Measured value and limit with `places` decimals, or with up to three more until they differ.
fn apart(measured: f64, limit: f64, places: usize) -> (String, String) {
    let both = |places: usize| (format!("{measured:.places$}"), format!("{limit:.places$}"));
    (places..places + 3)
        .map(both)
        .find(|(measured, limit)| measured != limit)
        .unwrap_or_else(|| both(places + 3))
}

#[cfg(test)]
mod tests {
    use boresight_detect::Miss;

    use super::*;
    use boresight_geometry::{
        device::Control,
        markers::{CircleRows, Dictionary},
    };

    #[test]
    fn a_session_that_ended_early_says_what_it_lacks() {
        let early = |lack| ending(Ending::Early, Some(lack), Plan::Adaptive, None);
        assert_eq!(early(Lack::Opposites), "Ended early: a view lacks its opposite");
        let all = [
            Lack::Views,
            Lack::Opposites,
            Lack::Trust,
            Lack::Precision,
            Lack::Coverage,
            Lack::Corners,
        ];
        let said: std::collections::BTreeSet<&str> = all.into_iter().map(early).collect();
        assert_eq!(said.len(), all.len());
    }

    #[test]
    fn a_prompt_has_six_words_at_most_and_no_number() {
        let edges = [Edge::Right, Edge::BottomLeft, Edge::TopRight];
        let shifts = [
            Prompt::Shift(Some(Across::Left), Some(Upright::Down)),
            Prompt::Shift(Some(Across::Right), None),
            Prompt::Shift(None, Some(Upright::Up)),
        ];
        let all = edges
            .into_iter()
            .flat_map(|edge| {
                [Prompt::Tip(edge), Prompt::TipInstead(edge), Prompt::TipFurther(edge)]
            })
            .chain(shifts)
            .chain([Side::Left, Side::Right, Side::Top, Side::Bottom].map(Prompt::CutOff))
            .chain(Control::ALL.map(Prompt::LensMoved))
            .chain([
                Prompt::Complete,
                Prompt::Exhausted,
                Prompt::Failed,
                Prompt::CameraLost,
                Prompt::Frozen,
                Prompt::Paused,
                Prompt::SourceEnded,
                Prompt::Taken,
                Prompt::ShowBoard,
                Prompt::ShowWholeFirst,
                Prompt::Uncover,
                Prompt::Glare,
                Prompt::OtherBoard(OtherBoard::Plain { columns: 7, rows: 5 }),
                Prompt::OtherBoard(OtherBoard::Charuco {
                    dictionary: Dictionary::default(),
                    is_usual_side: true,
                }),
                Prompt::OtherBoard(OtherBoard::AprilGrid),
                Prompt::OtherBoard(OtherBoard::Circles {
                    columns: 7,
                    rows: 5,
                    layout: CircleRows::Symmetric,
                }),
                Prompt::Closer,
                Prompt::Farther,
                Prompt::Blurred,
                Prompt::Dark,
                Prompt::Busy,
                Prompt::TipLess,
                Prompt::TipMore,
                Prompt::ToTheMiddle,
                Prompt::FollowTheOutline,
                Prompt::Clearer,
                Prompt::Contradicts,
                Prompt::HoldStill,
                Prompt::SteadyTheBoard,
                Prompt::CameraNotReady,
                Prompt::OtherSize,
            ]);
        for asked in all {
            let words = prompt(asked);
            assert!(words.split_whitespace().count() <= 6, "{words}");
            assert!(!words.contains(|c: char| c.is_ascii_digit()), "{words}");
            let said = spoken(asked);
            assert!(said.split_whitespace().count() <= 6, "{said}");
            assert!(!said.contains(|c: char| c.is_ascii_digit() || "…:".contains(c)), "{said}");
        }
    }

    /// A slow computer runs out of time before a plain wall, too.
    #[test]
    fn a_search_that_took_too_long_blames_no_background() {
        let asked = Prompt::Busy;
        for said in [prompt(asked), spoken(asked), miss(&Miss::OutOfTime)] {
            let said = said.to_lowercase();
            assert!(said.contains("search") && !said.contains("busy"), "{said}");
        }
    }

    #[test]
    fn a_value_never_reads_like_the_limit_that_it_misses() {
        assert_eq!(apart(39.7, 40.0, 0), ("39.7".into(), "40.0".into()));
        assert_eq!(apart(22.0, 40.0, 0), ("22".into(), "40".into()));
        assert_eq!(apart(2.004, 2.0, 1), ("2.004".into(), "2.000".into()));
        let flat = Refusal::TooFlat { tilt_rad: 0.0995, wanted_rad: 0.1 };
        assert_eq!(refusal(&flat), "Tip the board more: 5.70° (5.73° is asked for)");
    }
}
