//! Page content while a watched camera is pushed back.

use crate::{Step, with_scale, words};
use boresight_guide::session::Gravity;
use boresight_phone::AdjustPage;
use boresight_present::speech::{Rank, Word};
use boresight_watch::Lens;

pub(crate) fn adjust_page(step: &Step<'_>, lens: &Lens) -> AdjustPage {
    let facing = words::facing(&step.advice);
    let [behind, faced] =
        with_scale(lens, |scale| [&step.advice, &facing].map(|advice| words::cue(advice, scale)));
    let gravity = words::gravity(&step.advice);
    let rank = if gravity == Gravity::Good { Rank::Hold } else { Rank::Guidance };
    let aloud = words::aloud(&step.advice).zip(words::aloud(&facing));
    let image = &step.frame.image;
    AdjustPage {
        arrow: [behind.arrow, faced.arrow],
        number: behind.number,
        sentence: [behind.sentence, faced.sentence],
        gravity,
        close: step.closeness,
        aloud: aloud.map(|(text, mirrored)| Word {
            rank,
            text: text.into(),
            mirrored: mirrored.into(),
        }),
        image_size_px: [image.width(), image.height()],
        outline: step.outline.iter().map(|px| [px.x, px.y].map(|v| v.round() as i32)).collect(),
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use boresight_geometry::{
        Camera,
        frame::{CaptureTime, Frame, FrameId, FrameKind, ImageSize},
    };
    use boresight_watch::{Advice, Axis, NoAnswer};
    use image::GrayImage;
    use nalgebra::Point2;
    use serde_json::{Value, to_value};

    use super::*;
    use boresight_phone::{Hub, view};

    fn shown(advice: Advice, closeness: Option<f64>) -> (Value, Value) {
        let frame = Arc::new(Frame {
            id: FrameId(1),
            captured_at: CaptureTime { nanos: 0 },
            kind: FrameKind::Video,
            name: String::new(),
            image: GrayImage::new(64, 48),
        });
        let size = ImageSize::of(&frame.image);
        let lens = Lens::new(Camera::pinhole(60.0, size.centre_px()), None, size);
        let outline = vec![Point2::new(10.4, 20.6)];
        let step = Step { advice, closeness, frame: &frame, outline };
        let hub = Hub::new();
        hub.adjusting(&frame, adjust_page(&step, &lens));
        let state = hub.states().borrow().clone();
        let json = |value: Option<serde_json::Value>| value.expect("JSON");
        (json(to_value(view::live(&state)).ok()), json(to_value(view::plan(&state, None)).ok()))
    }

    #[test]
    fn who_faces_the_camera_pushes_to_the_other_side() {
        let push = Advice::Push { axis: Axis::Pan, off_px: 14.0 };
        let (live, plan) = shown(push, Some(0.25));
        assert_eq!(live["stage"], "adjusting");
        assert_eq!(live["push"], serde_json::json!([["→", "←"], "14 px"]));
        assert_eq!(live["sentence"][0], "Push it to the right.");
        assert_eq!(live["sentence"][1], "Push it to the left.");
        assert_eq!(
            (&live["say"]["text"], &live["say"]["mirrored"]),
            (&"Push it right".into(), &"Push it left".into())
        );
        assert_eq!(live["close"], 0.25);
        assert_eq!(plan["outline"], serde_json::json!([[10, 21]]));
        assert_eq!(plan["size"], serde_json::json!([64, 48]));
        // Up is up for both.
        let (live, _) = shown(Advice::Push { axis: Axis::Tilt, off_px: 3.0 }, Some(0.6));
        assert_eq!(live["push"][0], serde_json::json!(["↑", "↑"]));
    }

    #[test]
    fn a_camera_that_is_lost_has_no_tone_and_no_words() {
        let (live, _) = shown(Advice::Lost(NoAnswer::TooDark), None);
        assert!(live["close"].is_null() && live["say"].is_null());
        assert_eq!(live["tone"], "careful");
    }
}
