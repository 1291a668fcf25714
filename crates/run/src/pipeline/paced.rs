//! Plays a source at the speed of its timestamps.

use std::{
    sync::Arc,
    thread::sleep,
    time::{Duration, Instant},
};

use boresight_capture::{Arrival, CaptureError, FrameSource, SourceIdentity};
use boresight_geometry::{
    device::{Adjustable, Control},
    frame::{CaptureTime, Frame},
};

/// Delay beyond which time has been lost for good, and later frames are not hurried.
const CATCH_UP: Duration = Duration::from_millis(200);

/// Delivers the frames of a source able to wait no sooner than due by timestamp: the simulated
/// camera, and recordings at their speed.
pub struct Paced {
    source: Box<dyn FrameSource>,
    anchor: Option<(Instant, CaptureTime)>,
    early: Option<Arc<Frame>>,
}

impl Paced {
    /// Starts with the first frame.
    pub fn new(source: Box<dyn FrameSource>) -> Self {
        Self { source, anchor: None, early: None }
    }

    fn due(&mut self, frame: &Frame, now: Instant) -> Instant {
        let (started, first) = *self.anchor.get_or_insert((now, frame.captured_at));
        let secs = frame.captured_at.secs_since(first);
        // Photographs and jumps back in time have no pace.
        let due = started + Duration::try_from_secs_f64(secs).unwrap_or_default();
        if due + CATCH_UP < now || due > now + Duration::from_secs(2) {
            self.anchor = Some((now, frame.captured_at));
            return now;
        }
        due
    }
}

impl FrameSource for Paced {
    fn identity(&self) -> SourceIdentity {
        self.source.identity()
    }

    fn adjustables(&mut self) -> Vec<Adjustable> {
        self.source.adjustables()
    }

    fn adjust(&mut self, control: Control, value: i64) {
        self.source.adjust(control, value);
    }

    fn next_frame(&mut self, patience: Duration) -> Result<Arrival, CaptureError> {
        let frame = match self.early.take() {
            Some(frame) => frame,
            None => match self.source.next_frame(patience)? {
                Arrival::Frame(frame) => frame,
                other => return Ok(other),
            },
        };
        let now = Instant::now();
        let wait = self.due(&frame, now).saturating_duration_since(now);
        sleep(wait.min(patience));
        if wait > patience {
            self.early = Some(frame);
            return Ok(Arrival::NothingYet);
        }
        Ok(Arrival::Frame(frame))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use boresight_capture::Recorded;
    use boresight_geometry::frame::{FrameId, FrameKind};

    #[test]
    fn every_frame_comes_in_order_however_impatient_one_is() {
        let frame = |id: u64| Frame {
            id: FrameId(id),
            captured_at: CaptureTime { nanos: id * 5_000_000 },
            kind: FrameKind::Video,
            name: String::new(),
            image: image::GrayImage::new(4, 4),
        };
        let identity = SourceIdentity { name: "recorded".into(), image_size: None };
        let recorded = Recorded::new(identity, (0..6).map(move |id| Ok(frame(id))));
        let mut paced = Paced::new(Box::new(recorded));
        let mut ids = Vec::new();
        loop {
            match paced.next_frame(Duration::from_millis(1)).expect("whole") {
                Arrival::Frame(frame) => ids.push(frame.id.0),
                Arrival::NothingYet | Arrival::Event(_) => {}
                Arrival::End => break,
            }
        }
        assert_eq!(ids, [0, 1, 2, 3, 4, 5]);
    }
}
