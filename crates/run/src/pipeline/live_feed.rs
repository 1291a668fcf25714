//! Latest-value feeds for the window; a slow window never blocks the pipeline.

use std::sync::Arc;

use crossbeam_channel::{Receiver, Sender, bounded};

use super::latest::{LatestReceiver, LatestSender, latest};
use boresight_geometry::frame::Frame;
use boresight_guide::session::{Snapshot, ViewNumber};

/// Most pictures of accepted views that a window may lag behind by; more than the largest plan.
const ACCEPTED_CAPACITY: usize = 256;

/// The picture of a view that was just accepted.
#[derive(Clone, Debug)]
pub struct AcceptedPicture {
    /// Number of the view.
    pub view: ViewNumber,
    /// Picture of the newest frame.
    pub frame: Arc<Frame>,
}

/// The newest picture, the newest snapshot, and the pictures of the accepted views.
#[derive(Debug)]
pub struct LiveFeed {
    frames: LatestReceiver<Arc<Frame>>,
    snapshots: LatestReceiver<Snapshot>,
    accepted: Receiver<AcceptedPicture>,
}

impl LiveFeed {
    /// The newest picture, unless it was read from this feed before. Never waits.
    pub fn newest_frame(&self) -> Option<Arc<Frame>> {
        self.frames.try_recv()
    }

    /// The newest snapshot, unless it was read from this feed before. Never waits.
    pub fn newest_snapshot(&self) -> Option<Snapshot> {
        self.snapshots.try_recv()
    }

    /// The next accepted view, in order. Never waits.
    pub fn next_accepted(&self) -> Option<AcceptedPicture> {
        self.accepted.try_recv().ok()
    }

    /// True if the session thread has ended and every snapshot has been read from this feed.
    pub fn has_ended(&self) -> bool {
        self.snapshots.is_closed()
    }
}

/// The pipeline's ends of a feed.
pub(super) struct FeedSenders {
    pub(super) frames: LatestSender<Arc<Frame>>,
    pub(super) accepted: Sender<AcceptedPicture>,
}

/// Links of a feed: the pipeline's ends, and a function that makes the feed once the snapshots are known.
pub(super) fn feed_links() -> (FeedSenders, impl FnOnce(LatestReceiver<Snapshot>) -> LiveFeed) {
    let (frames, frames_out) = latest();
    let (accepted, accepted_out) = bounded(ACCEPTED_CAPACITY);
    let feed = |snapshots| LiveFeed { frames: frames_out, snapshots, accepted: accepted_out };
    (FeedSenders { frames, accepted }, feed)
}
