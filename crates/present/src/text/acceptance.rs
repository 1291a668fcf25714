//! Sentences about a calibration's goal, in the goal's unit.

use super::uncertainty::knows_sd;
use boresight_calibrate::{Acceptance, AcceptanceGoal, Calibration, ErrorBound};

/// Verdict and action for a goal while standard deviations are unknown.
pub const TOO_EARLY: (&str, &str) = (
    "Your goal can't be judged: fewer than four different views",
    "Take more views, tipped in different directions.",
);

/// Verdict and action for the goal of `calibration`; the action is empty if the goal is met. `None`
/// without a goal.
pub fn on_goal(calibration: &Calibration) -> Option<(String, &'static str)> {
    let judged = calibration.acceptance.as_ref()?;
    let (what, action) = TOO_EARLY;
    Some(if knows_sd(calibration) { acceptance(judged) } else { (what.into(), action) })
}

/// Verdict and action for a goal; the action is empty if the goal is met.
pub fn acceptance(judged: &Acceptance) -> (String, &'static str) {
    let goal = judged.goal;
    let Some(bound) = &judged.bound else {
        return match goal {
            AcceptanceGoal::Projection { .. } => (
                "Your goal can't be judged: the lens model doesn't cover the whole picture".into(),
                "Take views that reach into the corners of the picture.",
            ),
            AcceptanceGoal::Length { length_m, at_m, .. } => (
                format!(
                    "Your goal can't be judged: {} doesn't fit into the picture",
                    a_length(length_m, at_m)
                ),
                "Set a goal for a shorter length, or for one farther away.",
            ),
        };
    };
    let reached = match goal {
        AcceptanceGoal::Projection { .. } => {
            format!("{} in 95 % of the picture", error(goal, bound.total))
        }
        AcceptanceGoal::Length { length_m, at_m, .. } => {
            format!("{} to ±{}", a_length(length_m, at_m), error(goal, bound.total))
        }
    };
    let wanted = limit(goal);
    if judged.is_met() {
        return (format!("Meets your goal: {reached} (goal {wanted})"), "");
    }
    let parts = parts(goal, bound).map(|parts| format!(": {parts}")).unwrap_or_default();
    let what = format!("Doesn't meet your goal: {reached} (goal {wanted}){parts}");
    let action = if judged.is_out_of_reach() {
        "More views won't help. Measure several squares with a caliper, divide, and give the remaining error with --board-scale-error."
    } else {
        "Take more views that fill the picture."
    };
    (what, action)
}

/// Sentence before the first view about a goal out of reach of any view. `None` if the goal can be
/// reached.
pub fn out_of_reach(goal: AcceptanceGoal, scale_sd: f64) -> Option<String> {
    let scale = goal.scale_part(scale_sd);
    (scale >= goal.limit()).then(|| {
        format!(
            "The goal of {} is out of reach with this board: its squares are known to {} % (sd), which alone gives ±{}. Measure several squares with a caliper, divide, and give the remaining error, for example --board-scale-error 0.01%.",
            limit(goal),
            rounded(100.0 * scale_sd),
            error(goal, scale)
        )
    })
}

/// Error bound and goal, short: "±0.61 mm (goal 0.5 mm)"; "±?" while standard deviations are
/// unknown.
pub fn progress(judged: &Acceptance, is_sd_known: bool) -> String {
    let goal = judged.goal;
    let wanted = limit(goal);
    match judged.bound {
        Some(_) if !is_sd_known => format!("±? (goal {wanted})"),
        Some(bound) => format!("±{} (goal {wanted})", error(goal, bound.total)),
        None => "goal can't be judged".into(),
    }
}

fn parts(goal: AcceptanceGoal, bound: &ErrorBound) -> Option<String> {
    (bound.scale > 0.0).then(|| {
        format!(
            "the lens ±{}, the size of the board's squares ±{}",
            error(goal, bound.lens),
            error(goal, bound.scale)
        )
    })
}

/// The length that a goal is about.
pub(super) fn named_length(goal: AcceptanceGoal) -> Option<String> {
    match goal {
        AcceptanceGoal::Projection { .. } => None,
        AcceptanceGoal::Length { length_m, at_m, .. } => Some(a_length(length_m, at_m)),
    }
}

fn a_length(length_m: f64, at_m: f64) -> String {
    let length = rounded(1000.0 * length_m);
    format!("a length of {length} mm at {} m", rounded(at_m))
}

/// Rounds to a millionth, which drops digits from rounding errors.
fn rounded(value: f64) -> f64 {
    (1e6 * value).round() / 1e6
}

/// Pixels, or millimetres of metres.
fn in_unit(goal: AcceptanceGoal, value: f64) -> f64 {
    match goal {
        AcceptanceGoal::Projection { .. } => value,
        AcceptanceGoal::Length { .. } => 1000.0 * value,
    }
}

fn unit(goal: AcceptanceGoal) -> &'static str {
    match goal {
        AcceptanceGoal::Projection { .. } => "px",
        AcceptanceGoal::Length { .. } => "mm",
    }
}

pub(super) fn error(goal: AcceptanceGoal, value: f64) -> String {
    format!("{} {}", small(in_unit(goal, value)), unit(goal))
}

/// Largest accepted error, with all digits.
pub(super) fn limit(goal: AcceptanceGoal) -> String {
    format!("{} {}", rounded(in_unit(goal, goal.limit())), unit(goal))
}

/// Positive number to two significant digits: 1.6, 0.32, 0.5, 12.
pub(crate) fn small(value: f64) -> String {
    if !(value.is_finite() && value > 0.0) {
        return format!("{value}");
    }
    let places = (1.0 - libm::log10(value).floor()).clamp(0.0, 6.0);
    let text = format!("{value:.0$}", places as usize);
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').into() } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Point2;

    fn judged(goal: &str, lens: f64, scale: f64) -> Acceptance {
        let place_px = [Point2::origin(); 2];
        let total = libm::hypot(lens, scale);
        Acceptance {
            goal: goal.parse().expect("a goal"),
            bound: Some(ErrorBound { total, lens, scale, place_px }),
        }
    }

    #[test]
    fn the_verdict_speaks_the_unit_of_the_goal() {
        let goal = "length 800mm at 2m <= 0.5mm";
        let (met, action) = acceptance(&judged(goal, 0.0003, 0.0001));
        assert_eq!(met, "Meets your goal: a length of 800 mm at 2 m to ±0.32 mm (goal 0.5 mm)");
        assert_eq!(action, "");
        let (missed, action) = acceptance(&judged(goal, 0.0006, 0.0001));
        assert!(missed.starts_with("Doesn't meet your goal"), "{missed}");
        assert!(missed.ends_with("the lens ±0.6 mm, the size of the board's squares ±0.1 mm"));
        assert!(action.contains("more views that"));
        let (_, action) = acceptance(&judged(goal, 0.0001, 0.0016));
        assert!(action.contains("--board-scale-error"));
        let (met, _) = acceptance(&judged("0.2px", 0.181, 0.0));
        assert_eq!(met, "Meets your goal: 0.18 px in 95 % of the picture (goal 0.2 px)");
        assert_eq!(progress(&judged(goal, 0.0006, 0.0001), true), "±0.61 mm (goal 0.5 mm)");
        let goal = goal.parse().expect("a goal");
        assert!(out_of_reach(goal, 1e-3).is_some_and(|said| said.contains("±1.6 mm")));
        assert_eq!(out_of_reach(goal, 1e-4), None);
    }
}
