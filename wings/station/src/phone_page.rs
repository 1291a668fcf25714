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

    use super::*;

    fn shown(advice: Advice, closeness: Option<f64>) -> AdjustPage {
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
        adjust_page(&Step { advice, closeness, frame: &frame, outline }, &lens)
    }

    #[test]
    fn who_faces_the_camera_pushes_to_the_other_side() {
        let page = shown(Advice::Push { axis: Axis::Pan, off_px: 14.0 }, Some(0.25));
        assert_eq!((page.arrow, page.number.as_str()), (["→", "←"], "14 px"));
        assert_eq!(page.sentence, ["Push it to the right.", "Push it to the left."]);
        let aloud = page.aloud.expect("words");
        assert_eq!((&*aloud.text, &*aloud.mirrored), ("Push it right", "Push it left"));
        assert_eq!(page.close, Some(0.25));
        assert_eq!((page.outline, page.image_size_px), (vec![[10, 21]], [64, 48]));
        // Up is up for both.
        let page = shown(Advice::Push { axis: Axis::Tilt, off_px: 3.0 }, Some(0.6));
        assert_eq!(page.arrow, ["↑", "↑"]);
    }

    #[test]
    fn a_camera_that_is_lost_has_no_tone_and_no_words() {
        let page = shown(Advice::Lost(NoAnswer::TooDark), None);
        assert!(page.close.is_none() && page.aloud.is_none());
        assert_eq!(page.gravity, Gravity::Careful);
    }
}
