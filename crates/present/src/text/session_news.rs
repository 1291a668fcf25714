//! News of a running session, one sentence each.

use super::{apart, camera::capital, knows_sd, percent};
use boresight_guide::{
    guidance::{Lack, Plan},
    session::{Ending, FarBoard, HeldOutPair, Session, Snapshot, precision_of},
};

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

/// Goals in effect beside the requested ones, with the reason, if the corner noise is too large for
/// the latter; `None` otherwise.
pub fn coarser_goals(snapshot: &Snapshot) -> Option<String> {
    let (set, now) = (&snapshot.setup.guidance, &snapshot.limits);
    let coarser = |set_px: f64, now_px: f64| {
        (now_px > set_px).then(|| format!("{} ({} was set)", px(now_px), px(set_px)))
    };
    let pp = coarser(set.stop_pp_sigma_px, now.stop_pp_sigma_px);
    let corners = set.stop_corner_sigma_px.zip(now.stop_corner_sigma_px);
    let corners = corners.and_then(|(set_px, now_px)| coarser(set_px, now_px));
    let goals = match (pp, corners) {
        (None, None) => return None,
        (Some(pp), None) => format!("the principal point's goal is {pp}"),
        (None, Some(corners)) => format!("the goal for the picture's corners is {corners}"),
        (Some(pp), Some(corners)) => {
            format!(
                "the principal point's goal is {pp}, and the one for the picture's corners {corners}"
            )
        }
    };
    let noise_px = snapshot.calibration.as_ref()?.noise_px;
    Some(format!("{} From now on, {goals}.", why_coarse(noise_px, snapshot.moved_px)))
}

/// Reason for a session without views, if pictures came faster than anybody could look.
pub fn unseen(count: u64) -> String {
    format!(
        "{count} pictures came too fast to be looked at. Send them slower, or record them to a file first."
    )
}

/// End of a session, with every goal that was missed: "Stopped: …. The principal point is known to
/// 0.94 px; the goal is 0.50 px".
pub fn ending(session: &Session) -> String {
    let said = super::ending(session.ending(), session.lack());
    match missed_goals(session) {
        Some(missed) => format!("{said}. {missed}"),
        None => said.into(),
    }
}

/// Goals that the session's calibration misses, each with what was reached; `None` without such a
/// goal, or if something else is lacking.
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
    let reached = precision_of(calibration, session.setup().image_size);
    let pp_goal_px = Some(limits.pp_goal_px(reached.f_to_width)).filter(|_| !limits.is_far());
    let own_corner_goal_px = set.stop_corner_sigma_px.filter(|_| set.corner_goal_is_set);
    let corner_goal_px = own_corner_goal_px.or(limits.stop_corner_sigma_px);
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
            corner_goal_px.filter(|_| !limits.is_far()),
        ),
    ]
    .into_iter()
    .filter_map(|(what, reached_px, goal_px)| {
        let goal_px = goal_px.filter(|goal_px| reached_px > *goal_px)?;
        let (reached, goal) = apart(reached_px, goal_px, 2);
        Some(format!("{what} {reached} px; the goal is {goal} px"))
    })
    .collect();
    (!missed.is_empty()).then(|| capital(&missed.join(", and ")))
}

/// Larger cause of coarse corners: the camera's `noise_px`, or moving boards.
fn why_coarse(noise_px: f64, moved_px: f64) -> String {
    if moved_px > noise_px {
        let moved = px(moved_px);
        return format!(
            "The boards moved while the camera read its rows: corners are known to {moved}. Hold stiller for better."
        );
    }
    let noise = px(noise_px);
    format!("This camera measures corners to {noise} only. More light may help.")
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
            why_coarse(0.017, 0.144),
            "The boards moved while the camera read its rows: corners are known to 0.14 px. Hold stiller for better."
        );
        assert_eq!(
            why_coarse(0.21, 0.02),
            "This camera measures corners to 0.21 px only. More light may help."
        );
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
