//! Sentences about a watched camera. Left and right are as seen from behind it.

use std::path::Path;

use crate::store::Recovered;
use boresight_guide::session::Gravity;
use boresight_watch::{Advice, Axis, Cause, Decision, Finding, NoAnswer, State};

/// Conversion of pixels to degrees, and of seconds to dates.
pub struct Scale<'a> {
    /// Focal lengths along x and y, px.
    pub f_px: [f64; 2],
    /// Half diagonal of the picture, px.
    pub half_diagonal_px: f64,
    /// Formats a time (seconds since 1970).
    pub when: &'a dyn Fn(f64) -> String,
    /// Formats the day of a time (seconds since 1970).
    pub day: &'a dyn Fn(f64) -> String,
}

/// Parts below this share of the largest part aren't mentioned.
const WORTH_A_WORD: f64 = 1.0 / 3.0;
/// Part of a move, with the action that undoes it.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    /// Size in pixels of the picture, for sorting.
    pub size_px: f64,
    /// "points 14 px (0.8°) to the left of where it was on 12 March".
    pub what: String,
    /// "Push it back to the right.", or empty for a zoom.
    pub action: String,
}

/// Visible parts of a move, the largest first, without comparatively small parts.
pub fn parts(decision: &Decision, scale: &Scale<'_>) -> Vec<Part> {
    let since = (scale.day)(decision.reference_secs);
    let off = decision.off_px;
    let angle = |px: f64, per_rad: f64| (px.abs() / per_rad).to_degrees();
    let points = |px: f64, f_px: f64, [where_to, back]: [&str; 2]| Part {
        size_px: px.abs(),
        what: format!(
            "points {} ({}) {where_to} where it was on {since}",
            pixels(px),
            degrees(angle(px, f_px))
        ),
        action: format!("Push it back {back}."),
    };
    let pan = if off[0] > 0.0 {
        ["to the left of", "to the right"]
    } else {
        ["to the right of", "to the left"]
    };
    let tilt = if off[1] > 0.0 { ["below", "up"] } else { ["above", "down"] };
    let turned =
        if off[2] > 0.0 { ["anticlockwise", "clockwise"] } else { ["clockwise", "anticlockwise"] };
    let larger = if off[3] > 0.0 { "larger" } else { "smaller" };
    let all = [
        points(off[0], scale.f_px[0], pan),
        points(off[1], scale.f_px[1], tilt),
        Part {
            size_px: off[2].abs(),
            what: format!(
                "is turned {} {}",
                degrees(angle(off[2], scale.half_diagonal_px)),
                turned[0]
            ),
            action: format!("Turn it back {}.", turned[1]),
        },
        Part {
            size_px: off[3].abs(),
            what: format!(
                "shows everything {:.2} % {larger}",
                100.0 * off[3].abs() / scale.half_diagonal_px
            ),
            action: String::new(),
        },
    ];
    let largest_px = off.amax();
    let visible_px = decision.smallest_visible_px;
    let is_said =
        |(i, part): &(usize, Part)| part.size_px >= visible_px[*i].max(WORTH_A_WORD * largest_px);
    let mut said: Vec<Part> =
        all.into_iter().enumerate().filter(is_said).map(|(_, part)| part).collect();
    said.sort_by(|a, b| b.size_px.total_cmp(&a.size_px));
    said
}

/// Sentence and next action while a camera's first pictures are taken for a pin.
pub(crate) const PINNING: (&str, &str) =
    ("Its first six pictures are its pin.", "Leave it alone for a minute.");

/// State in a sentence, and the next action; the action is empty if nothing needs doing.
pub fn state(decision: &Decision, scale: &Scale<'_>) -> (String, String) {
    let since = || (scale.when)(decision.since_secs);
    match decision.state {
        State::Learning { pictures, hours } => (
            format!(
                "It's learning where the camera points: {pictures} pictures in {hours:.0} hours so far."
            ),
            "Wait for 60 pictures in 20 hours; after three days it's surest.".into(),
        ),
        State::Ok => ("The camera points where it did.".into(), String::new()),
        State::Moved(Cause::Knocked) => (
            format!(
                "The picture has shifted since {}, but not as when a camera turns: its lens was knocked.",
                since()
            ),
            "Calibrate again.".into(),
        ),
        State::Moved(cause) => {
            let all = parts(decision, scale);
            // Pushing doesn't undo a zoom.
            let all: Vec<&Part> = all.iter().filter(|part| !part.action.is_empty()).collect();
            if all.is_empty() {
                return (
                    format!(
                        "The camera has moved since {}, and is off by less than the smallest visible change.",
                        since()
                    ),
                    "Wait, and don't push it.".into(),
                );
            }
            let what: Vec<&str> = all.iter().map(|part| part.what.as_str()).collect();
            let actions: Vec<&str> = all.iter().map(|part| part.action.as_str()).collect();
            let doubt = match cause {
                Cause::Either => " Or its lens was knocked: check with a board.",
                Cause::Turned | Cause::Knocked => "",
            };
            (
                format!("The camera {}.", what.join(", and ")),
                format!("{}{doubt}", actions.join(" ")),
            )
        }
        State::Zoom => {
            let percent = 100.0 * decision.off_px[3].abs() / scale.half_diagonal_px;
            let larger = if decision.off_px[3] > 0.0 { "larger" } else { "smaller" };
            (
                format!(
                    "Everything has been {percent:.2} % {larger} since {}: zoom or focus has changed.",
                    since()
                ),
                "Calibrate again.".into(),
            )
        }
        State::Blurred => (
            format!("The picture has been blurred since {}: focus or a wet glass.", since()),
            "Wipe the glass. If that doesn't help, focus and calibrate again.".into(),
        ),
        State::CannotTell { reason, before } => {
            let (what, action) = no_answer(reason);
            let said = format!("Can't tell since {}: {what}.", since());
            match before.map(no_answer) {
                None => (said, action.into()),
                Some((lacked, first)) => (
                    format!("{said} The newest one had no answer: {lacked}."),
                    format!("{action} {first}"),
                ),
            }
        }
    }
}

/// Reason for having no answer, and the next action.
pub fn no_answer(reason: NoAnswer) -> (String, &'static str) {
    match reason {
        NoAnswer::TooDark => (
            "too dark, or too little contrast, to compare".into(),
            "Wait for light, or check whether the lens is covered.",
        ),
        NoAnswer::FewFound { found, of } => (
            format!("only {found} of {of} patches of the scene are found"),
            "Check whether the camera is covered or points elsewhere.",
        ),
        NoAnswer::Disagree { agree, found } => (
            format!("only {agree} of {found} patches of the scene agree"),
            "Check whether something large is in front of the camera, or whether it was shifted.",
        ),
        NoAnswer::TwoMotions { agree, other, .. } => (
            format!("{agree} patches of the scene moved one way and {other} another"),
            "Check whether part of the mount or of a window is in the picture. Once learned, the watch leaves out what stays while the scene moves.",
        ),
        NoAnswer::LittleSeen { agree, of } => (
            format!("only {agree} of {of} patches of the scene agree, fewer than usual"),
            "Check whether the camera is covered or points elsewhere.",
        ),
        NoAnswer::OneCorner => (
            "only one corner of the picture shows what it did".into(),
            "Check whether something large is in front of the camera.",
        ),
        NoAnswer::Shakes => ("the camera shakes".into(), "Tighten its mount."),
        NoAnswer::NoReferences => ("there are no references yet".into(), "Wait."),
        NoAnswer::OtherSize => (
            "the pictures have another size than the calibration".into(),
            "Set the camera to the size it was calibrated in.",
        ),
        NoAnswer::BetweenPresets => {
            ("the camera doesn't look there".into(), "Check whether it still visits this preset.")
        }
        NoAnswer::WrongClock => (
            "its clock is wrong: its pictures have times to come, or from before".into(),
            "Set the camera's clock, or this computer's. If both are right now, accept the camera.",
        ),
        NoAnswer::Unsure => (
            "it may have moved by what is just visible".into(),
            "Wait: a lasting change is found within two days.",
        ),
        NoAnswer::Unconfirmed => {
            ("its answers have only just come back".into(), "Wait for three answers in a row.")
        }
        NoAnswer::NotLoggedIn => (
            "the camera asks for another user name or password".into(),
            "Name them in the source, as in rtsp://USER:PASSWORD@CAMERA/PATH.",
        ),
        NoAnswer::NotReached => (
            "the camera isn't reached".into(),
            "Check whether it's switched on, its address and the network.",
        ),
        NoAnswer::Frozen => (
            "the same picture comes again and again".into(),
            "Restart the camera, or what stores its pictures.",
        ),
        NoAnswer::NoPicture => ("no picture comes".into(), "Check the camera and its connection."),
    }
}

/// Smallest visible change.
pub fn smallest_visible(decision: &Decision, scale: &Scale<'_>) -> String {
    let v = decision.smallest_visible_px;
    if !v[0].is_finite() {
        return "Smallest visible change: not known yet.".into();
    }
    format!(
        "Smallest visible change: {} along, {} across, {} turned, {:.2} % larger or smaller.",
        pixels(v[0]),
        pixels(v[1]),
        degrees((v[2] / scale.half_diagonal_px).to_degrees()),
        100.0 * v[3] / scale.half_diagonal_px
    )
}

/// Finding in a sentence.
pub fn finding(finding: &Finding) -> String {
    match finding {
        Finding::Pinned => {
            "It's pinned: compared with its first pictures, with wide limits until it's learned."
                .into()
        }
        Finding::AlsoShifted => "It was also shifted: the direction is approximate.".into(),
        Finding::SwaysMore { was_px, is_px } => {
            format!(
                "It sways more than at first: {is_px:.2} px instead of {was_px:.2} px; small changes are seen later."
            )
        }
        Finding::LeftOut { percent } => format!(
            "{percent} % of the picture is left out: it stays while the scene moves, as the camera's own mount does. If that is wrong, accept the camera."
        ),
        Finding::Shakes { by_px } => format!("It shakes by {by_px:.1} px."),
    }
}

fn pixels(px: f64) -> String {
    let px = px.abs();
    if px < 10.0 { format!("{px:.1} px") } else { format!("{px:.0} px") }
}

fn degrees(deg: f64) -> String {
    let deg = deg.abs();
    if deg < 1.0 { format!("{deg:.2}°") } else { format!("{deg:.1}°") }
}

/// Single step for the person pushing the camera back: an arrow, a number, a sentence.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Cue {
    /// `←`, `→`, `↑`, `↓`, `↺`, `↻`, `●` if aligned, `?` if unknown.
    pub arrow: &'static str,
    /// Amount with unit, or duration.
    pub number: String,
    /// Action in a sentence.
    pub sentence: String,
}

/// Advice as seen by a person facing the camera: left and right, and the sense of rotation, are
/// exchanged.
pub fn facing(advice: &Advice) -> Advice {
    match *advice {
        Advice::Push { axis: axis @ (Axis::Pan | Axis::Roll), off_px } => {
            Advice::Push { axis, off_px: -off_px }
        }
        other => other,
    }
}

/// Words of an advice.
pub fn cue(advice: &Advice, scale: &Scale<'_>) -> Cue {
    let say =
        |arrow, number: String, sentence: &str| Cue { arrow, number, sentence: sentence.into() };
    match *advice {
        Advice::Lost(reason) => {
            let (what, _) = no_answer(reason);
            say("?", String::new(), &format!("Can't tell: {what}."))
        }
        Advice::Push { axis: Axis::Pan, off_px } if off_px > 0.0 => {
            say("→", pixels(off_px), "Push it to the right.")
        }
        Advice::Push { axis: Axis::Pan, off_px } => {
            say("←", pixels(off_px), "Push it to the left.")
        }
        Advice::Push { axis: Axis::Tilt, off_px } if off_px > 0.0 => {
            say("↑", pixels(off_px), "Push it up.")
        }
        Advice::Push { axis: Axis::Tilt, off_px } => say("↓", pixels(off_px), "Push it down."),
        Advice::Push { axis: Axis::Roll, off_px } => {
            let number = degrees((off_px / scale.half_diagonal_px).to_degrees());
            if off_px > 0.0 {
                say("↻", number, "Turn it clockwise.")
            } else {
                say("↺", number, "Turn it anticlockwise.")
            }
        }
        Advice::Hold { left_secs } => say("●", format!("{left_secs:.0} s"), "Hold it there."),
        Advice::Tighten { left_secs, off_px } => say(
            "●",
            format!("{left_secs:.0} s"),
            &format!("Tighten the mount. It's off by {}.", pixels(off_px)),
        ),
        Advice::Right => say("●", String::new(), "It's tight, and it points where it should."),
    }
}

/// Gravity of an advice.
pub fn gravity(advice: &Advice) -> Gravity {
    match advice {
        Advice::Lost(_) => Gravity::Careful,
        Advice::Push { .. } => Gravity::Plain,
        Advice::Hold { .. } | Advice::Tighten { .. } | Advice::Right => Gravity::Good,
    }
}

/// Checkbox for a person facing the camera.
pub const FACES: &str = "I face the camera";

/// Few spoken words without numbers; `None` while the camera's pointing is unknown.
pub fn aloud(advice: &Advice) -> Option<&'static str> {
    Some(match *advice {
        Advice::Lost(_) => return None,
        Advice::Push { axis: Axis::Pan, off_px } if off_px > 0.0 => "Push it right",
        Advice::Push { axis: Axis::Pan, .. } => "Push it left",
        Advice::Push { axis: Axis::Tilt, off_px } if off_px > 0.0 => "Push it up",
        Advice::Push { axis: Axis::Tilt, .. } => "Push it down",
        Advice::Push { axis: Axis::Roll, off_px } if off_px > 0.0 => "Turn it clockwise",
        Advice::Push { axis: Axis::Roll, .. } => "Turn it anticlockwise",
        Advice::Hold { .. } => "Hold it there",
        Advice::Tighten { .. } => "Tighten the mount",
        Advice::Right => "It points where it should",
    })
}

/// Note while a phone still shows the end of the way back.
pub const LINGERING: &str = "The phone's page stays until it's closed. Ctrl-C ends at once.";

/// Question before accepting a camera as it is.
pub const WHY: &str = "Why may it stay like this? (one line)";

/// Sentence after accepting a camera.
pub fn accepted(name: &str) -> String {
    format!("{name} stays as it is. It learns again from the next picture, for three days.")
}

/// Sentence after recovering a store.
pub fn recovered(folder: &Path, found: &Recovered) -> String {
    let [kept, left_out] = found.lines;
    let learned = if found.is_relearned {
        "Its references are lost: it learns again where the camera points. Check whether it has moved."
    } else {
        "Its references are whole."
    };
    format!("{folder:?}: {kept} lines are kept, {left_out} were damaged. {learned}")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn moved(off_px: [f64; 4]) -> Decision {
        Decision {
            state: State::Moved(Cause::Turned),
            since_secs: 0.0,
            off_px: off_px.into(),
            smallest_visible_px: [0.85; 4].into(),
            reference_secs: 0.0,
            answered_secs: None,
            usual_seen: None,
            lacks: None,
            findings: Vec::new(),
        }
    }

    fn say(decision: &Decision) -> String {
        let when = |_: f64| "12 March".to_owned();
        let scale =
            Scale { f_px: [1000.0, 1000.0], half_diagonal_px: 640.0, when: &when, day: &when };
        let (what, action) = state(decision, &scale);
        format!("{what} {action}").trim().to_owned()
    }

    #[test]
    fn the_largest_part_comes_first_and_small_ones_are_left_out() {
        assert_eq!(
            say(&moved([14.0, 0.2, 0.0, 0.1])),
            "The camera points 14 px (0.80°) to the left of where it was on 12 March. Push it back to the right."
        );
        assert_eq!(
            say(&moved([0.0, -3.0, -5.0, 0.1])),
            "The camera is turned 0.45° clockwise, and points 3.0 px (0.17°) above where it was on 12 March. Turn it back anticlockwise. Push it back down."
        );
    }

    #[test]
    fn what_cant_be_seen_is_no_order_to_push() {
        let said = say(&moved([0.8, 0.1, -0.7, 0.2]));
        assert!(
            said.ends_with("Wait, and don't push it.") && !said.contains("ush it back"),
            "{said}"
        );
        let said = say(&moved([0.84, 1.2, 0.0, 0.0]));
        assert!(said.contains("up") && !said.contains("right"), "{said}");
    }

    #[test]
    fn who_takes_the_words_literally_turns_it_back() {
        for pan in [-9.0, 0.0, 9.0] {
            for tilt in [-7.0, 0.0, 7.0] {
                for roll in [-8.0, 0.0, 8.0] {
                    let mut off = [pan, tilt, roll];
                    if off == [0.0; 3] {
                        continue;
                    }
                    let said = say(&moved([pan, tilt, roll, 0.0]));
                    // Pushing a camera to the right from behind moves the scene to the left, and so
                    // on.
                    for (order, part, by) in [
                        ("Push it back to the right.", 0, -9.0),
                        ("Push it back to the left.", 0, 9.0),
                        ("Push it back up.", 1, -7.0),
                        ("Push it back down.", 1, 7.0),
                        ("Turn it back clockwise.", 2, -8.0),
                        ("Turn it back anticlockwise.", 2, 8.0),
                    ] {
                        if said.contains(order) {
                            off[part] += by;
                        }
                    }
                    assert_eq!(off, [0.0; 3], "{said}");
                }
            }
        }
    }

    #[test]
    fn who_takes_the_cues_literally_turns_it_back() {
        let when = |_: f64| String::new();
        let scale =
            Scale { f_px: [1000.0, 1000.0], half_diagonal_px: 640.0, when: &when, day: &when };
        let mut off = [7.3, -4.1, -6.2];
        let mut way = boresight_watch::Adjust::new(nalgebra::Vector4::repeat(0.5));
        for step in 0..20 {
            let now = nalgebra::Vector4::new(off[0], off[1], off[2], 0.0);
            let cue = cue(&way.handle(f64::from(step) * 0.1, Ok(now)), &scale);
            let (axis, sign) = match cue.arrow {
                "→" => (0, -1.0),
                "←" => (0, 1.0),
                "↑" => (1, -1.0),
                "↓" => (1, 1.0),
                "↻" => (2, -1.0),
                "↺" => (2, 1.0),
                _ => break,
            };
            off[axis] += sign * off[axis].abs().min(3.0);
        }
        assert!(off.iter().all(|left| left.abs() < 0.5), "{off:?}");
    }
}
