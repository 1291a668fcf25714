//! What a window takes from the threads. Nothing waits for a window.

use std::sync::Arc;

use crossbeam_channel::{Receiver, Sender, bounded};

use super::latest::{LatestReceiver, LatestSender, latest};
use crate::{
    frame::Frame,
    session::{Snapshot, ViewNumber},
};

/// Pictures of views that a window may lag behind by; more than the largest plan.
const TAKEN_CAPACITY: usize = 256;

/// A view was taken, and this is its picture.
#[derive(Clone, Debug)]
pub struct AcceptedPicture {
    /// Number of the view.
    pub view: ViewNumber,
    /// The picture.
    pub frame: Arc<Frame>,
}

/// The newest picture, the newest snapshot, and the pictures of the views taken.
#[derive(Debug)]
pub struct LiveFeed {
    frames: LatestReceiver<Arc<Frame>>,
    snapshots: LatestReceiver<Snapshot>,
    taken: Receiver<AcceptedPicture>,
}

impl LiveFeed {
    pub(super) fn new(
        frames: LatestReceiver<Arc<Frame>>,
        snapshots: LatestReceiver<Snapshot>,
        taken: Receiver<AcceptedPicture>,
    ) -> Self {
        Self { frames, snapshots, taken }
    }

    /// The newest picture, if it has not been taken from here before. Never waits.
    pub fn newest_frame(&self) -> Option<Arc<Frame>> {
        self.frames.try_recv()
    }

    /// The newest snapshot, if it has not been taken from here before. Never waits.
    pub fn newest_snapshot(&self) -> Option<Snapshot> {
        self.snapshots.try_recv()
    }

    /// The next view that was taken, in order. Never waits.
    pub fn next_taken(&self) -> Option<AcceptedPicture> {
        self.taken.try_recv().ok()
    }

    /// Whether the session thread has ended and everything it showed has been taken from here.
    pub fn has_ended(&self) -> bool {
        self.snapshots.is_closed()
    }
}

type Links = (
    LatestSender<Arc<Frame>>,
    Sender<AcceptedPicture>,
    LatestReceiver<Arc<Frame>>,
    Receiver<AcceptedPicture>,
);

pub(super) fn showing() -> Links {
    let (frames, frames_out) = latest();
    let (taken, taken_out) = bounded(TAKEN_CAPACITY);
    (frames, taken, frames_out, taken_out)
}
