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
    /// True if the last search was of everything, in a live stream, and found nothing like a board.
    /// The next one is quick then: every second picture does until there's something to see.
    pub(super) saw_nothing: bool,
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
        let saw_nothing = std::mem::take(&mut self.saw_nothing);
        let is_quick = saw_nothing && near.is_none() && frame.kind == FrameKind::Video;
        let keep_on = || limit.is_none_or(|limit| started.elapsed() < limit);
        let search = Search { near: near.as_ref(), keep_on: &keep_on, is_quick };
        let seen = self.finder.find(&frame.image, &self.board, search);
        self.saw_nothing = !is_quick && !self.unhurried && matches!(seen, Err(Miss::NoBoard));
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

#[cfg(test)]
mod tests {
    use std::sync::Mutex;

    use boresight_geometry::frame::FrameId;

    use super::*;

    /// Sees what it's told to see, and notes whether it was asked quickly.
    struct Noting(Arc<Mutex<Vec<bool>>>, Vec<Miss>);

    impl BoardFinder for Noting {
        fn find(
            &mut self,
            _: &GrayImage,
            _: &Board,
            search: Search<'_>,
        ) -> Result<Detection, Miss> {
            let mut asked = self.0.lock().expect("unbroken");
            asked.push(search.is_quick);
            Err(self.1[(asked.len() - 1) % self.1.len()])
        }
    }

    fn quick(unhurried: bool, kind: FrameKind, misses: &[Miss]) -> Vec<bool> {
        let asked = Arc::default();
        let finder = Box::new(Noting(Arc::clone(&asked), misses.to_vec()));
        let (pictures, _pictures) = crossbeam_channel::bounded(1);
        let (inbox, _inbox) = crossbeam_channel::bounded(1);
        let board = Board::new(9, 6, 0.025).expect("valid");
        let rest = Arc::default();
        let saw_nothing = false;
        let mut stage =
            DetectorStage { finder, board, unhurried, pictures, inbox, rest, saw_nothing };
        for number in 0..6 {
            let frame = Frame {
                id: FrameId(number),
                captured_at: CaptureTime { nanos: number * 33_000_000 },
                kind,
                name: String::new(),
                image: GrayImage::new(8, 8),
            };
            stage.observe(&mut Track::default(), &frame, None);
        }
        let asked = asked.lock().expect("unbroken");
        asked.clone()
    }

    #[test]
    fn every_second_picture_of_a_live_stream_without_a_board_is_searched_quickly() {
        let halves = [false, true, false, true, false, true];
        assert_eq!(quick(false, FrameKind::Video, &[Miss::NoBoard]), halves);
        // A file's result depends on its pictures alone; each photograph is searched as a whole.
        assert_eq!(quick(true, FrameKind::Video, &[Miss::NoBoard]), [false; 6]);
        assert_eq!(quick(false, FrameKind::Photograph, &[Miss::NoBoard]), [false; 6]);
        // Something like a board needs every picture.
        assert_eq!(quick(false, FrameKind::Video, &[Miss::Mirrored]), [false; 6]);
        let part = [Miss::NoBoard, Miss::Mirrored, Miss::Mirrored];
        let mixed = [false, true, false, false, true, false];
        assert_eq!(quick(false, FrameKind::Video, &part), mixed);
    }
}
