//! What the detector's thread does with a frame.

use std::time::{Duration, Instant};

use image::GrayImage;

use crate::{
    board::Checkerboard,
    detection::{Detection, Detector, DetectorParams, Miss, Search, Track},
    frame::{Frame, FrameId, ImageSize},
    session::Observation,
};

/// What looks for the board in each frame, on the detector's thread.
pub trait BoardFinder: Send {
    /// The board in `image`, as [`Detector::search`] finds it.
    ///
    /// # Errors
    ///
    /// [`Miss`]: the reason why it is not found.
    fn look(
        &mut self,
        image: &GrayImage,
        board: &Checkerboard,
        search: Search<'_>,
    ) -> Result<Detection, Miss>;
}

impl BoardFinder for Detector {
    fn look(
        &mut self,
        image: &GrayImage,
        board: &Checkerboard,
        search: Search<'_>,
    ) -> Result<Detection, Miss> {
        self.search(image, board, search)
    }
}

/// The detector itself.
pub(super) fn detector() -> Box<dyn BoardFinder> {
    Box::new(Detector::new(DetectorParams::default()))
}

/// BoardFinder for the board in `frame`, first where `track` expects it; a look that lasts longer than
/// `longest_look` is given up.
pub(super) fn observe(
    looks: &mut dyn BoardFinder,
    track: &mut Track,
    board: &Checkerboard,
    frame: &Frame,
    (first_frame, longest_look): (u64, Option<Duration>),
) -> Observation {
    let started = Instant::now();
    let near = track.predict(frame.kind, frame.captured_at);
    let keep_on = || longest_look.is_none_or(|limit| started.elapsed() < limit);
    let search = Search { near: near.as_ref(), keep_on: &keep_on };
    let observation = Observation {
        frame_id: FrameId(frame.id.0 + first_frame),
        captured_at: frame.captured_at,
        kind: frame.kind,
        name: frame.name.clone(),
        image_size: ImageSize::of(&frame.image),
        seen: looks.look(&frame.image, board, search),
    };
    track.add(frame.kind, frame.captured_at, &observation.seen);
    observation
}
