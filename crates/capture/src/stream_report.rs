//! Report of a stream whose camera can't be controlled: pictures, their loss, their appearance, and
//! counts of dropped ones.

use std::{
    collections::VecDeque,
    sync::Arc,
    time::{Duration, Instant},
};

use image::GrayImage;

use super::{Arrival, health::Health};
use boresight_geometry::{
    device::{CameraEvent, CameraInfo, Fault, Mode},
    frame::{CaptureTime, Frame, FrameId, FrameKind, ImageSize},
};

/// Longest wait for the first picture: cameras take their time, and a command may log in somewhere.
pub(super) const START_PATIENCE: Duration = Duration::from_secs(15);
/// Longest wait for a later picture.
pub(super) const STEADY_PATIENCE: Duration = Duration::from_secs(5);
/// Time between two reports of counts.
const COUNTING: Duration = Duration::from_secs(1);

/// Reason for missing pictures, with details.
pub(super) type Loss = (Fault, String);

/// Arrivals of a stream, made from pictures. A recording has neither events nor health.
pub(super) struct StreamReport {
    is_live: bool,
    mode: Mode,
    health: Health,
    arrivals: VecDeque<Arrival>,
    began: Instant,
    /// Time of the last whole picture, or of the last attempt to get one.
    last_came: Instant,
    last_nanos: u64,
    /// Number of successive pictures of another size.
    resized: u32,
    /// Reason of the loss, as last reported.
    lost: Option<Fault>,
    delivered: u64,
    dropped: u64,
    rejected: u64,
    told: (u64, u64),
    next_count: Instant,
}

impl StreamReport {
    /// A started stream of pictures in `mode`.
    pub(super) fn new(mode: Mode, is_live: bool) -> Self {
        let now = Instant::now();
        let mut report = Self {
            is_live,
            mode,
            health: Health::default(),
            arrivals: VecDeque::new(),
            began: now,
            last_came: now,
            last_nanos: 0,
            resized: 0,
            lost: None,
            delivered: 0,
            dropped: 0,
            rejected: 0,
            told: (0, 0),
            next_count: now + COUNTING,
        };
        if is_live {
            report.begin(CameraEvent::Started { mode });
        }
        report
    }

    fn begin(&mut self, event: CameraEvent) {
        let (fault, detail) = (Fault::Unwatched, String::new());
        let doubt = CameraEvent::Doubtful { fault, detail };
        self.arrivals.extend([event, doubt].map(Arrival::Event));
    }

    pub(super) fn mode(&self) -> Mode {
        self.mode
    }

    /// Facts about the camera behind the stream, with a `name` and a `backend`; `None` for a
    /// recording.
    pub(super) fn facts(&self, name: &str, backend: &'static str) -> Option<CameraInfo> {
        self.is_live.then(|| CameraInfo {
            name: name.into(),
            usb_id: None,
            serial: String::new(),
            place: String::new(),
            backend,
            mode: self.mode,
            controls: Vec::new(),
        })
    }

    /// Next arrival to hand over.
    pub(super) fn next(&mut self) -> Option<Arrival> {
        self.arrivals.pop_front()
    }

    /// Reports the end of the pictures.
    pub(super) fn end(&mut self) {
        self.arrivals.push_back(Arrival::End);
    }

    /// Nanoseconds since the stream began.
    pub(super) fn now_nanos(&self) -> u64 {
        self.began.elapsed().as_nanos() as u64
    }

    /// Pictures handed over so far.
    pub(super) fn delivered(&self) -> u64 {
        self.delivered
    }

    /// True after too long without a picture.
    pub(super) fn is_silent(&self, patience: Duration) -> bool {
        self.last_came.elapsed() >= patience
    }

    /// Begins a new wait for a picture.
    pub(super) fn wait_again(&mut self) {
        (self.last_came, self.resized) = (Instant::now(), 0);
    }

    /// Reports the loss of the pictures, once for each reason. True if they were lost before.
    pub(super) fn lose(&mut self, (fault, detail): Loss) -> bool {
        self.wait_again();
        let before = self.lost.replace(fault);
        if before != Some(fault) {
            self.arrivals.push_back(Arrival::Event(CameraEvent::Lost { fault, detail }));
        }
        before.is_some()
    }

    /// Takes a whole picture, taken `nanos` after the stream began.
    ///
    /// # Errors
    ///
    /// [`Fault::OtherSize`] at the second successive picture of another size: a single one may be
    /// due to a torn stream.
    pub(super) fn take(&mut self, image: GrayImage, nanos: u64) -> Result<(), Loss> {
        let size = ImageSize::of(&image);
        if size != self.mode.size {
            self.resized += 1;
            self.count(0, 1);
            return if self.resized > 1 {
                Err((Fault::OtherSize, size.to_string()))
            } else {
                Ok(())
            };
        }
        self.wait_again();
        self.last_nanos = nanos.max(self.last_nanos + 1);
        let captured_at = CaptureTime { nanos: self.last_nanos };
        if self.lost.take().is_some() {
            self.health = Health::default();
            self.begin(CameraEvent::Returned { mode: self.mode, good_from: captured_at });
        }
        // A sensor has noise: equal bytes are the same picture.
        let repeats =
            self.is_live && self.health.repeats(crc32fast::hash(image.as_raw()), self.last_nanos);
        if !repeats {
            if self.is_live {
                self.health.look(&image, self.last_nanos);
            }
            let id = FrameId(self.delivered + self.dropped + self.rejected);
            self.delivered += 1;
            let (kind, name) = (FrameKind::Video, String::new());
            let frame = Frame { id, captured_at, kind, name, image };
            self.arrivals.push_back(Arrival::Frame(Arc::new(frame)));
        }
        self.judge(1, 0);
        Ok(())
    }

    /// Counts skipped pictures: `dropped` for newer ones, `torn` not whole.
    pub(super) fn count(&mut self, dropped: u64, torn: u64) {
        self.dropped += dropped;
        self.rejected += torn;
        if dropped + torn > 0 {
            self.judge(dropped + torn, torn);
        }
    }

    fn judge(&mut self, came: u64, torn: u64) {
        let rate_hz = self.mode.rate_hz().filter(|_| self.is_live);
        let torn = u32::try_from(torn).unwrap_or(u32::MAX);
        self.health.count(came, torn, rate_hz, self.now_nanos());
        self.arrivals.extend(self.health.changes().into_iter().map(Arrival::Event));
        let (dropped, rejected) = (self.dropped, self.rejected);
        if (dropped, rejected) != self.told && Instant::now() >= self.next_count {
            self.arrivals.push_back(Arrival::Event(CameraEvent::Counted { dropped, rejected }));
            (self.told, self.next_count) = ((dropped, rejected), Instant::now() + COUNTING);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use boresight_geometry::device::PixelLayout;

    const SIZE: ImageSize = ImageSize { width_px: 32, height_px: 24 };
    const SECOND: u64 = 1_000_000_000;

    fn stream(is_live: bool) -> StreamReport {
        let (layout, interval_secs) = (PixelLayout::Decoded, None);
        StreamReport::new(Mode { size: SIZE, layout, interval_secs }, is_live)
    }

    fn told(report: &mut StreamReport) -> (Vec<CameraEvent>, Vec<Arc<Frame>>) {
        let (mut events, mut frames) = (Vec::new(), Vec::new());
        while let Some(arrival) = report.next() {
            match arrival {
                Arrival::Event(event) => events.push(event),
                Arrival::Frame(frame) => frames.push(frame),
                _ => {}
            }
        }
        (events, frames)
    }

    /// Doubts after six seconds of pictures, 20 a second, with the given light in picture n.
    fn doubts(is_live: bool, light: impl Fn(u64) -> (u8, bool)) -> Vec<Fault> {
        let mut report = stream(is_live);
        let mut doubts = Vec::new();
        for n in 0..120 {
            let (light, has_noise) = light(n);
            let noise = |x: u32| if has_noise { ((u64::from(x) + n) % 5) as u8 } else { 0 };
            let image = GrayImage::from_fn(32, 24, |x, _| image::Luma([light + noise(x)]));
            report.take(image, n * SECOND / 20).expect("of that size");
            doubts.extend(told(&mut report).0.into_iter().filter_map(|event| match event {
                CameraEvent::Doubtful { fault, .. } => Some(fault),
                _ => None,
            }));
        }
        doubts.retain(|fault| *fault != Fault::Unwatched);
        doubts
    }

    #[test]
    fn how_pictures_look_is_judged_if_they_come_from_a_camera() {
        type Light = fn(u64) -> (u8, bool);
        let looks: [(Light, &[Fault]); 4] = [
            (|_| (120, true), &[]),
            (|_| (120, false), &[Fault::Frozen]),
            (|_| (3, true), &[Fault::Dark]),
            (|n| (if n % 2 == 0 { 40 } else { 160 }, true), &[Fault::Infrared]),
        ];
        for (light, wanted) in looks {
            assert_eq!(doubts(true, light), wanted);
            assert!(doubts(false, light).is_empty(), "a recording is as it was recorded");
        }
    }

    #[test]
    fn a_stream_that_is_slower_than_it_says_is_a_doubt() {
        let interval_secs = Some((1, 100));
        let mut report = StreamReport::new(
            Mode { size: SIZE, layout: PixelLayout::Decoded, interval_secs },
            true,
        );
        report.count(1, 0);
        // As if four seconds had passed.
        report.began -= Duration::from_secs(4);
        report.count(1, 0);
        let slow =
            |event: &CameraEvent| matches!(event, CameraEvent::Doubtful { fault: Fault::Slow, .. });
        assert!(told(&mut report).0.iter().any(slow));
    }

    #[test]
    fn the_same_picture_again_is_no_news_from_a_camera_and_is_from_a_recording() {
        for (is_live, count) in [(true, 1), (false, 3)] {
            let mut report = stream(is_live);
            for n in 0..3 {
                report.take(GrayImage::new(32, 24), n).expect("of that size");
            }
            assert_eq!(told(&mut report).1.len(), count);
        }
    }

    #[test]
    fn pictures_of_another_size_are_lost_and_the_first_right_one_is_back() {
        let mut report = stream(true);
        let other = || GrayImage::new(64, 48);
        assert_eq!(report.take(other(), 1), Ok(()), "a torn one may look so");
        let loss = report.take(other(), 2).expect_err("a second one");
        assert_eq!(loss, (Fault::OtherSize, "64x48".into()));
        assert!(!report.lose(loss.clone()) && report.lose(loss));
        let (events, frames) = told(&mut report);
        let is_loss = |event: &&CameraEvent| matches!(event, CameraEvent::Lost { .. });
        assert_eq!((events.iter().filter(is_loss).count(), frames.len()), (1, 0), "said once");
        report.take(GrayImage::new(32, 24), 7).expect("of that size");
        let (events, frames) = told(&mut report);
        let good_from = CaptureTime { nanos: 7 };
        assert_eq!(events[0], CameraEvent::Returned { mode: report.mode(), good_from });
        assert_eq!((frames.len(), frames[0].captured_at), (1, good_from));
    }

    #[test]
    fn most_pictures_torn_is_a_doubt_and_times_never_run_back() {
        let mut report = stream(true);
        report.count(0, 40);
        let damaged = |event: &CameraEvent| {
            matches!(event, CameraEvent::Doubtful { fault: Fault::DamagedFrames, .. })
        };
        assert!(told(&mut report).0.iter().any(damaged));
        for (n, nanos) in [(1, 50), (2, 20), (3, 60)] {
            let image = GrayImage::from_pixel(32, 24, image::Luma([100 + n]));
            report.take(image, nanos).expect("of that size");
        }
        let times: Vec<u64> =
            told(&mut report).1.iter().map(|frame| frame.captured_at.nanos).collect();
        assert_eq!(times, [50, 51, 60]);
    }
}
