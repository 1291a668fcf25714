//! Adapters of sources: frames with other numbers, arrivals replayed first. All else passes
//! through.

use std::{collections::VecDeque, sync::Arc, time::Duration};

use super::{Arrival, CaptureError, FrameSource, SourceIdentity};
use boresight_geometry::{
    device::{Adjustable, CameraInfo, Control, ControlBefore},
    frame::FrameId,
};

/// Frames of `source`, numbered from `first`, so a resumed session never sees a number twice.
pub fn renumbered(source: Box<dyn FrameSource>, first: u64) -> impl FrameSource {
    let next = move |source: &mut dyn FrameSource, patience| {
        Ok(match source.next_frame(patience)? {
            Arrival::Frame(mut frame) if first > 0 => {
                // A source with reusable frames holds a second reference; then this copies.
                let id = FrameId(frame.id.0.saturating_add(first));
                Arc::make_mut(&mut frame).id = id;
                Arrival::Frame(frame)
            }
            other => other,
        })
    };
    Adapted { source, next }
}

/// The first `most` frames of `source`, with its events.
pub fn limited(source: Box<dyn FrameSource>, most: u64) -> impl FrameSource {
    let mut left = most;
    let next = move |source: &mut dyn FrameSource, patience| {
        if left == 0 {
            return Ok(Arrival::End);
        }
        let arrival = source.next_frame(patience)?;
        left -= u64::from(matches!(arrival, Arrival::Frame(_)));
        Ok(arrival)
    };
    Adapted { source, next }
}

/// `first`, already taken from `source`, followed by the rest of `source`.
pub fn preceded(
    mut first: VecDeque<Result<Arrival, CaptureError>>,
    source: Box<dyn FrameSource>,
) -> impl FrameSource {
    let next = move |source: &mut dyn FrameSource, patience| {
        first.pop_front().unwrap_or_else(|| source.next_frame(patience))
    };
    Adapted { source, next }
}

struct Adapted<N> {
    source: Box<dyn FrameSource>,
    next: N,
}

impl<N> FrameSource for Adapted<N>
where
    N: FnMut(&mut dyn FrameSource, Duration) -> Result<Arrival, CaptureError> + Send,
{
    fn identity(&self) -> SourceIdentity {
        self.source.identity()
    }

    fn waits(&self) -> bool {
        self.source.waits()
    }

    fn camera_facts(&self) -> Option<CameraInfo> {
        self.source.camera_facts()
    }

    fn adjustables(&mut self) -> Vec<Adjustable> {
        self.source.adjustables()
    }

    fn adjust(&mut self, control: Control, value: i64) {
        self.source.adjust(control, value);
    }

    fn put_back_at_end(&mut self, before: &[ControlBefore]) {
        self.source.put_back_at_end(before);
    }

    fn next_frame(&mut self, patience: Duration) -> Result<Arrival, CaptureError> {
        (self.next)(&mut *self.source, patience)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Recorded;
    use boresight_geometry::frame::{CaptureTime, Frame, FrameKind};

    fn frame(id: u64) -> Frame {
        Frame {
            id: FrameId(id),
            captured_at: CaptureTime { nanos: id * 5_000_000 },
            kind: FrameKind::Video,
            name: format!("{id}.png"),
            image: image::GrayImage::new(4, 4),
        }
    }

    #[test]
    fn a_limited_source_ends_after_its_frames_whatever_lies_between() {
        let identity = SourceIdentity { name: "recorded".into(), image_size: None };
        let frames = || [0, 1, 2].map(|id| Arrival::Frame(frame(id).into()));
        let kinds = |most| {
            let [first, second, third] = frames();
            let arrivals = [first, Arrival::NothingYet, second, third].map(Ok).into();
            let empty = Recorded::new(identity.clone(), std::iter::empty());
            let mut source = limited(Box::new(preceded(arrivals, Box::new(empty))), most);
            let mut next = || match source.next_frame(Duration::ZERO).expect("in memory") {
                Arrival::Frame(_) => 'f',
                Arrival::NothingYet => '-',
                Arrival::Event(_) => 'e',
                Arrival::End => '.',
            };
            (0..6).map(|_| next()).collect::<String>()
        };
        assert_eq!([0, 1, 2, 9].map(kinds), ["......", "f.....", "f-f...", "f-ff.."]);
    }

    #[test]
    fn numbers_continue_and_nothing_else_changes() {
        let identity = SourceIdentity { name: "recorded".into(), image_size: None };
        let recorded =
            Recorded::new(identity.clone(), [0, 1, 5].map(|id| Ok(frame(id))).into_iter());
        let mut source = renumbered(Box::new(recorded), 40);
        assert_eq!(source.identity(), identity);
        let mut seen = Vec::new();
        while let Arrival::Frame(frame) = source.next_frame(Duration::ZERO).expect("in memory") {
            seen.push((frame.id.0, frame.captured_at.nanos, frame.name.clone()));
        }
        let wanted = [(40, 0, "0.png"), (41, 5_000_000, "1.png"), (45, 25_000_000, "5.png")];
        assert_eq!(seen, wanted.map(|(id, nanos, name)| (id, nanos, name.to_owned())));
    }
}
