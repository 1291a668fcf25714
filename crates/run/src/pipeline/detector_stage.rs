//! The detector thread: predict, search, and report one observation per frame.

use std::{
    sync::Arc,
    time::{Duration, Instant},
};

use crossbeam_channel::Sender;
use image::GrayImage;

use super::{latest::LatestReceiver, rest::Rest};
use boresight_detect::{Detection, Detector, DetectorParams, Miss, OtherBoard, Search, Track};
use boresight_geometry::{
    boards::Board,
    frame::{CaptureTime, Frame, FrameId, FrameKind, ImageSize},
};
use boresight_guide::session::{Input, Observation};

/// Longest search in a frame of a live stream, unless the next frame comes later. Far more than any
/// picture needs on an idle machine; on a busy machine the next frame is worth more.
const LONGEST_SEARCH: Duration = Duration::from_millis(250);

/// Finds the board in each frame, on the detector thread.
pub trait BoardFinder: Send {
    /// Finds the board in `image`, like [`Detector::search`].
    ///
    /// # Errors
    ///
    /// [`Miss`]: the reason why it was not found.
    fn find(
        &mut self,
        image: &GrayImage,
        board: &Board,
        search: Search<'_>,
    ) -> Result<Detection, Miss>;

    /// Searches `image` for other boards than `board`, like [`Detector::recognise_from`].
    fn recognise(
        &mut self,
        _step: &mut usize,
        _image: &GrayImage,
        _board: &Board,
        _keep_on: &dyn Fn() -> bool,
    ) -> Option<OtherBoard> {
        None
    }
}

impl BoardFinder for Detector {
    fn find(
        &mut self,
        image: &GrayImage,
        board: &Board,
        search: Search<'_>,
    ) -> Result<Detection, Miss> {
        self.search(image, board, search)
    }

    fn recognise(
        &mut self,
        step: &mut usize,
        image: &GrayImage,
        board: &Board,
        keep_on: &dyn Fn() -> bool,
    ) -> Option<OtherBoard> {
        self.recognise_from(step, image, Some(board), keep_on)
    }
}

/// The detector with default parameters.
pub(super) fn default_finder() -> Box<dyn BoardFinder> {
    Box::new(Detector::new(DetectorParams::default()))
}

/// The state of the detector thread.
pub(super) struct DetectorStage {
    pub(super) finder: Box<dyn BoardFinder>,
    pub(super) board: Board,
    /// True if a search may take any time: results then don't depend on the machine's speed.
    pub(super) unhurried: bool,
    /// Frames to the recorder, sent before the observations.
    pub(super) pictures: Sender<Arc<Frame>>,
    pub(super) inbox: Sender<Input>,
    pub(super) rest: Arc<Rest>,
}

impl DetectorStage {
    /// Searches frame after frame until no more come. `on_start` is called at the start of each
    /// search.
    pub(super) fn run(
        mut self,
        frames: &LatestReceiver<Arc<Frame>>,
        on_start: impl Fn(&LatestReceiver<Arc<Frame>>),
    ) {
        let mut track = Track::default();
        let (mut last, mut step) = (None, 0);
        while let Some(frame) = frames.recv() {
            // A source that can wait does so in a pause; other sources' pictures are skipped.
            if self.unhurried {
                self.rest.wait_for_end();
            } else if self.rest.is_on() {
                continue;
            }
            on_start(frames);
            let limit = (!self.unhurried).then(|| LONGEST_SEARCH.max(interval(last, &frame)));
            last = Some((frame.id, frame.captured_at));
            let mut observation = self.observe(&mut track, &frame, limit);
            let (kind, now) = (frame.kind, frame.captured_at);
            let is_open = matches!(&observation.seen, Err(miss) if miss.leaves_open());
            let seeks = is_open && track.seeks_others(kind, now);
            // Photographs aren't a sequence: what another one shows says nothing of this one.
            let is_photograph = kind == FrameKind::Photograph;
            if seeks && is_photograph {
                let other = self.finder.recognise(&mut step, &frame.image, &self.board, &|| true);
                track.add_other(now, other);
            }
            if is_open
                && (seeks || !is_photograph)
                && let Some(other) = track.other(now)
            {
                observation.seen = Err(Miss::OtherBoard(other));
            }
            if self.pictures.send(Arc::clone(&frame)).is_err()
                || self.inbox.send(Input::Observed(observation)).is_err()
            {
                return;
            }
            if seeks && !is_photograph {
                let is_idle = || self.unhurried || !frames.has_news();
                let other = self.finder.recognise(&mut step, &frame.image, &self.board, &is_idle);
                if step == 0 {
                    track.add_other(now, other);
                }
            }
        }
    }

    /// Searches `frame` for the board, first at the prediction of `track`; gives up after `limit`.
    fn observe(
        &mut self,
        track: &mut Track,
        frame: &Frame,
        limit: Option<Duration>,
    ) -> Observation {
        let started = Instant::now();
        let near = track.predict(frame.kind, frame.captured_at);
        let keep_on = || limit.is_none_or(|limit| started.elapsed() < limit);
        let search = Search { near: near.as_ref(), keep_on: &keep_on };
        let seen = self.finder.find(&frame.image, &self.board, search);
        track.add(frame.kind, frame.captured_at, &seen);
        Observation {
            frame_id: frame.id,
            captured_at: frame.captured_at,
            kind: frame.kind,
            name: frame.name.clone(),
            image_size: ImageSize::of(&frame.image),
            seen,
        }
    }
}

/// Mean interval between the frames of a stream from `last` to `frame`; zero without `last`.
fn interval(last: Option<(FrameId, CaptureTime)>, frame: &Frame) -> Duration {
    let Some((id, time)) = last else { return Duration::ZERO };
    let frames = frame.id.0.saturating_sub(id.0).max(1);
    Duration::from_nanos(frame.captured_at.nanos.saturating_sub(time.nanos) / frames)
}
