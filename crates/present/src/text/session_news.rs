//! News of a running session, one sentence each.

use super::{acceptance, apart, camera::capital, knows_sd, numbers::counted, percent};
use boresight_guide::{
    guidance::{Lack, Plan, views_by_noise},
    session::{Ending, FarBoard, HeldOutPair, Session, Snapshot, precision_of},
};

/// Said while the pictures of the views are compared.
pub const ASKS_SCENE: &str =
    "The focal length seems to differ between views. Looking at the scene behind the board …";

/// Standard deviation of the principal point after two good pairs of views, in errors of a measured
/// corner.
const PP_TO_NOISE: f64 = 20.0;

/// Attainable precision of a board that stays small: "The board fills 28 % of the picture. …".
pub fn far_board(far: &FarBoard) -> String {
    let (pp, projection) = (px(far.reach.pp_sigma_px), px(far.reach.projection_sigma_px));
    let size = percent(far.span_fraction);
    let twice = far.twice_the_size.map_or(String::new(), |twice| {
        format!(
            " With a board twice the size: {} and {}.",
            px(twice.pp_sigma_px),
            px(twice.projection_sigma_px)
        )
    });
    format!(
        "At {size} of the picture, this board can measure the principal point to about {pp}, with a typical error of {projection} in the picture.{twice}"
    )
}

/// Noise that makes the principal point's goal take many views, with its reason and remedy; `None`
/// otherwise.
pub fn coarse_corners(snapshot: &Snapshot) -> Option<String> {
    let calibration = snapshot.calibration.as_ref()?;
    let reached = precision_of(calibration, snapshot.setup.image_size);
    let goal_px = snapshot.limits.pp_goal_px(reached.f_to_width);
    let has_goal = snapshot.limits.plan == Plan::Adaptive && !snapshot.limits.is_far();
    let why = why_coarse(calibration.noise_px, snapshot.moved_px, goal_px)?;
    let is_alone = has_goal && calibration.acceptance.is_none();
    is_alone.then(|| {
        format!("{why} Otherwise, a principal point of ±{} takes more views.", px(goal_px))
    })
}

/// Reason for a session without views, if pictures came faster than anybody could look.
pub fn unseen(count: u64) -> String {
    let pictures = counted(usize::try_from(count).unwrap_or(usize::MAX), "picture");
    format!(
        "{pictures} came too fast to be looked at. Send them slower, or record them to a file first."
    )
}

/// End of a session, with everything planned that was missed and what would reach it: "Stopped
/// short of the plan. The principal point is known to 1.70 px; planned was 1.00 px. The picture is
/// too noisy: more light, or about 20 more views". The goal is the typical error's, as on the
/// result.
pub fn ending(session: &Session) -> String {
    let result = session.calibration().map(AsRef::as_ref);
    let said = super::ending(session.ending(), session.lack(), session.limits().plan, result);
    match missed_goals(session) {
        Some(missed) if session.ending() == Ending::Stopped => {
            format!("Stopped short of the plan. {missed}{}", remedy(session))
        }
        Some(missed) => format!("{said}. {missed}"),
        None => said.into(),
    }
}

/// What would reach the goals that were missed; empty without any remedy.
fn remedy(session: &Session) -> String {
    let Some(calibration) = session.calibration() else { return String::new() };
    let (limits, views) = (session.limits(), session.accepted().len());
    let reached = precision_of(calibration, session.setup().image_size);
    let more = views_by_noise(views, &reached, limits).saturating_sub(views);
    if more == 0 {
        return String::new();
    }
    let goal_px = limits.pp_goal_px(reached.f_to_width);
    match why_coarse(calibration.noise_px, session.moved_px(), goal_px) {
        Some(_) if session.moved_px() > calibration.noise_px => {
            format!(". The boards moved: hold stiller, or take about {more} more views")
        }
        Some(_) => format!(". The picture is too noisy: more light, or about {more} more views"),
        None => format!(". About {more} more views would reach it"),
    }
}

/// What was planned and the session's calibration misses, each with what was reached; `None`
/// without such a plan, or if something else is lacking.
fn missed_goals(session: &Session) -> Option<String> {
    let calibration = session.calibration().filter(|calibration| knows_sd(calibration))?;
    let (set, limits) = (&session.setup().guidance, session.limits());
    let lacks_precision = match session.ending() {
        Ending::Finished => false,
        Ending::WithoutCorners | Ending::Stopped => true,
        Ending::Early => matches!(session.lack(), Some(Lack::Precision | Lack::Corners)),
    };
    if !lacks_precision || calibration.acceptance.is_some() || limits.plan != Plan::Adaptive {
        return None;
    }
    /// Place of the typical error below.
    const TYPICAL: usize = 1;
    let reached = precision_of(calibration, session.setup().image_size);
    let pp_goal_px = Some(limits.pp_goal_px(reached.f_to_width)).filter(|_| !limits.is_far());
    let missed: Vec<String> = [
        ("the principal point is known to", reached.pp_sigma_px, pp_goal_px),
        (
            "the typical error in the picture is",
            reached.projection_sigma_px,
            Some(limits.stop_projection_sigma_px),
        ),
        (
            "the largest error in the picture's corners is",
            reached.corner_sigma_px,
            set.stop_corner_sigma_px.filter(|_| !limits.is_far()),
        ),
    ]
    .into_iter()
    .enumerate()
    .filter_map(|(place, (what, reached_px, goal_px))| {
        let goal_px = goal_px.filter(|goal_px| reached_px > *goal_px)?;
        let (reached, goal) = apart(reached_px, goal_px, 2);
        let goal = match place {
            // As on the result.
            TYPICAL => format!("the goal is {}", acceptance::small(goal_px)),
            _ => format!("planned was {goal}"),
        };
        Some(format!("{what} {reached} px; {goal} px"))
    })
    .collect();
    (!missed.is_empty()).then(|| capital(&missed.join(", and ")))
}

/// Larger cause of corners too coarse for a principal point of `goal_px` in four views: the
/// camera's `noise_px`, or moving boards. `None` if they aren't.
fn why_coarse(noise_px: f64, moved_px: f64, goal_px: f64) -> Option<String> {
    if PP_TO_NOISE * libm::hypot(noise_px, moved_px) <= goal_px {
        return None;
    }
    if moved_px > noise_px {
        let moved = px(moved_px);
        return Some(format!(
            "Your hands moved a little: corners are known to {moved}. Hold stiller for a sharper result."
        ));
    }
    let noise = px(noise_px);
    Some(format!("The picture is noisy: corners are known to {noise}. More light helps."))
}

/// Prediction error of the newest pair: "Check: views 3 and 4 agree with the earlier ones to 0.11
/// px".
pub fn held_out(pair: &HeldOutPair, snapshot: &Snapshot) -> Option<String> {
    let [first, second] = pair.views.map(|index| snapshot.views.get(index));
    let (first, second) = (first?.number, second?.number);
    Some(format!(
        "Check: views {first} and {second} agree with the earlier ones to {}",
        px(pair.rms_px)
    ))
}

fn px(value_px: f64) -> String {
    match value_px {
        small if small < 0.995 => format!("{value_px:.2} px"),
        middle if middle < 9.95 => format!("{value_px:.1} px"),
        _ => format!("{value_px:.0} px"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use boresight_guide::guidance::Reach;

    #[test]
    fn coarse_corners_have_their_true_reason() {
        assert_eq!(
            why_coarse(0.017, 0.144, 1.0).as_deref(),
            Some(
                "Your hands moved a little: corners are known to 0.14 px. Hold stiller for a sharper result."
            )
        );
        assert_eq!(
            why_coarse(0.21, 0.02, 1.0).as_deref(),
            Some("The picture is noisy: corners are known to 0.21 px. More light helps.")
        );
        assert_eq!(why_coarse(0.03, 0.02, 1.0), None);
    }

    #[test]
    fn a_small_board_is_announced_with_what_it_reaches() {
        let reach = Reach { pp_sigma_px: 6.24, projection_sigma_px: 1.21 };
        let twice = Reach { pp_sigma_px: 1.6, projection_sigma_px: 0.31 };
        let far = FarBoard { span_fraction: 0.28, reach, twice_the_size: Some(twice) };
        assert_eq!(
            far_board(&far),
            "At 28 % of the picture, this board can measure the principal point to about 6.2 px, with a typical error of 1.2 px in the picture. With a board twice the size: 1.6 px and 0.31 px."
        );
        let alone = far_board(&FarBoard { twice_the_size: None, ..far });
        assert!(alone.ends_with("a typical error of 1.2 px in the picture."), "{alone}");
    }
}
