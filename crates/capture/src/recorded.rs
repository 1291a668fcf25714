//! Frames in memory, or fetched one by one, such as a recording's.

use std::{sync::Arc, time::Duration};

use super::{Arrival, CaptureError, FrameSource, SourceIdentity};
use boresight_geometry::frame::Frame;

/// Plays frames from an iterator.
pub struct Recorded<I> {
    identity: SourceIdentity,
    frames: I,
}

impl<I: Iterator<Item = Result<Frame, CaptureError>> + Send> Recorded<I> {
    /// Source with the given `identity` and `frames`.
    pub fn new(identity: SourceIdentity, frames: I) -> Self {
        Self { identity, frames }
    }
}

impl<I: Iterator<Item = Result<Frame, CaptureError>> + Send> FrameSource for Recorded<I> {
    fn identity(&self) -> SourceIdentity {
        self.identity.clone()
    }

    fn next_frame(&mut self, _patience: Duration) -> Result<Arrival, CaptureError> {
        self.frames
            .next()
            .transpose()
            .map(|frame| frame.map_or(Arrival::End, |frame| Arrival::Frame(Arc::new(frame))))
    }
}
