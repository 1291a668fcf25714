//! Latest-value feeds for the window; a slow window never blocks the pipeline.

use std::sync::Arc;

use crossbeam_channel::{Receiver, Sender, bounded};

use super::latest::{LatestReceiver, LatestSender, latest};
use boresight_geometry::frame::Frame;
use boresight_guide::session::{Snapshot, ViewNumber};

/// Most pictures of accepted views queued for a slow window; more than the largest plan.
const ACCEPTED_CAPACITY: usize = 256;

/// Picture of a newly accepted view.
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
    /// The newest picture, unless already read from the feed. Never waits.
    pub fn newest_frame(&self) -> Option<Arc<Frame>> {
        self.frames.try_recv()
    }

    /// The newest snapshot, unless already read from the feed. Never waits.
    pub fn newest_snapshot(&self) -> Option<Snapshot> {
        self.snapshots.try_recv()
    }

    /// The next accepted view, in order. Never waits.
    pub fn next_accepted(&self) -> Option<AcceptedPicture> {
        self.accepted.try_recv().ok()
    }

    /// Snapshots alone: pictures are then kept for nobody.
    pub fn into_snapshots(self) -> LatestReceiver<Snapshot> {
        self.snapshots
    }

    /// True if the session thread has ended and every snapshot has been read from the feed.
    pub fn has_ended(&self) -> bool {
        self.snapshots.is_closed()
    }
}

/// The pipeline's ends of a feed.
pub(super) struct FeedSenders {
    pub(super) frames: LatestSender<Arc<Frame>>,
    pub(super) snapshots: LatestSender<Snapshot>,
    pub(super) accepted: Sender<AcceptedPicture>,
}

/// Both ends of a feed.
pub(super) fn feed_links() -> (FeedSenders, LiveFeed) {
    let (frames, frames_out) = latest();
    let (snapshots, snapshots_out) = latest();
    let (accepted, accepted_out) = bounded(ACCEPTED_CAPACITY);
    let feed = LiveFeed { frames: frames_out, snapshots: snapshots_out, accepted: accepted_out };
    (FeedSenders { frames, snapshots, accepted }, feed)
}
