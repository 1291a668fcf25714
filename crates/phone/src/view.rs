//! Program state as the page's JSON: a part that changes with every frame, and a part that changes
//! with a view.

use serde::Serialize;

use super::hub::{AdjustPage, Hub, Offer, Stage, State};
use boresight_present::browser::{self, Plan, PlanSource};

/// Fields that change with every frame.
#[derive(Serialize)]
pub(super) struct Live<'a> {
    #[serde(flatten)]
    live: browser::Live,
    /// Choices for a new session.
    offer: Option<&'a Offer>,
    /// Direction to push a watched camera, also for a person facing the camera, and the amount.
    push: Option<([&'static str; 2], &'a str)>,
}

/// Fields that change with a view.
#[derive(Serialize)]
pub(super) struct PlanOfBoard<'a> {
    #[serde(flatten)]
    plan: Plan,
    board: &'a str,
    /// What several cameras have reached so far.
    reached: &'a str,
}

/// Live part.
pub(super) fn live(state: &State) -> Live<'_> {
    let stage = match state.stage {
        Stage::Waiting(_) => "waiting",
        Stage::Starting => "starting",
        Stage::Guiding => "guiding",
        Stage::Adjusting(_) => "adjusting",
        Stage::Ending => "ending",
        Stage::Ended(_) => "ended",
    };
    let live = match (&state.stage, &state.snapshot) {
        (Stage::Adjusting(page), _) => browser::Live {
            sentence: page.sentence.clone(),
            tone: page.gravity,
            close: page.close.map(|close| (1e3 * close).round() as f32 / 1e3),
            say: page.aloud.clone(),
            ..browser::Live::empty(stage, state.simulated)
        },
        (_, Some(snapshot)) => {
            let live = browser::Live::of(snapshot, stage, state.simulated);
            match (&state.stage, &state.led) {
                (Stage::Guiding, Some(led)) => live.led(led),
                _ => live,
            }
        }
        (_, None) => browser::Live::empty(stage, state.simulated),
    };
    let offer = match &state.stage {
        Stage::Waiting(offer) => Some(&**offer),
        _ => None,
    };
    let push = match &state.stage {
        Stage::Adjusting(page) => Some((page.arrow, page.number.as_str())),
        _ => None,
    };
    Live { live, offer, push }
}

/// Source of the part that changes with a view, with its words; `None` before the first frame, or
/// for a watched camera.
pub(super) fn source(state: &State, hub: &Hub) -> Option<(PlanSource, String)> {
    let snapshot = match state.stage {
        Stage::Adjusting(_) => None,
        _ => state.snapshot.clone(),
    }?;
    let words = format!("{}{}", state.board, state.reached);
    Some((PlanSource { snapshot, refused: hub.refused() }, words))
}

/// Part that changes with a view, or the edges of a watched camera; `None` before the first frame.
pub(super) fn plan<'a>(
    state: &'a State,
    source: Option<&(PlanSource, String)>,
) -> Option<PlanOfBoard<'a>> {
    let plan = if let Stage::Adjusting(page) = &state.stage {
        let AdjustPage { image_size_px: size, ref outline, .. } = **page;
        Plan::of_edges(size, outline.clone())
    } else {
        let plan = Plan::of(&source?.0);
        if state.led.is_some() { plan.led() } else { plan }
    };
    Some(PlanOfBoard { plan, board: &state.board, reached: &state.reached })
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use boresight_geometry::frame::{CaptureTime, Frame, FrameId, FrameKind};
    use boresight_guide::session::Gravity;
    use image::GrayImage;
    use serde_json::{json, to_value};

    use super::*;

    #[test]
    fn a_camera_that_is_pushed_back_has_arrow_amount_and_outline() {
        let page = AdjustPage {
            arrow: ["→", "←"],
            number: "14 px".into(),
            sentence: ["Push it to the right.".into(), "Push it to the left.".into()],
            gravity: Gravity::Plain,
            close: Some(0.25),
            aloud: None,
            image_size_px: [64, 48],
            outline: vec![[10, 21]],
        };
        let frame = Arc::new(Frame {
            id: FrameId(1),
            captured_at: CaptureTime { nanos: 0 },
            kind: FrameKind::Video,
            name: String::new(),
            image: GrayImage::new(64, 48),
        });
        let hub = Hub::new();
        hub.adjusting(&frame, page);
        let state = hub.states().borrow().clone();
        let live = to_value(live(&state)).expect("JSON");
        assert_eq!((&live["stage"], &live["close"]), (&json!("adjusting"), &json!(0.25)));
        assert_eq!(live["push"], json!([["→", "←"], "14 px"]));
        let plan = to_value(plan(&state, None)).expect("JSON");
        assert_eq!((&plan["outline"], &plan["size"]), (&json!([[10, 21]]), &json!([64, 48])));
    }
}
