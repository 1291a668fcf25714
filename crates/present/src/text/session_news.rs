//! News of a running session, one sentence each.

use super::percent;
use boresight_guide::session::{FarBoard, HeldOutPair, Snapshot};

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
