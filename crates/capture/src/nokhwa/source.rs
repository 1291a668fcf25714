//! A camera of the library as a frame source.
//!
//! ```text
//!   opening ──▶ streaming ──silence──▶ lost, its thread still waits ──frame──▶ streaming
//!      ▲            │                              │
//!      └── lost ◀───┴────────── error ─────────────┘
//!    looks for the same camera
//! ```

use std::{
    collections::VecDeque,
    sync::Arc,
    thread::sleep,
    time::{Duration, Instant},
};

use super::{
    device::{Loss, Streaming, find, list},
    reader::{Opener, Reader, Said},
};
#[cfg(all(target_os = "linux", feature = "live"))]
use crate::v4l2;
use crate::{Arrival, CaptureError, FrameSource, SourceIdentity, Unpacker, health::Health};
use boresight_geometry::{
    device::{CameraEvent, CameraInfo, Fault, Mode, Wanted},
    frame::{CaptureTime, Frame, FrameId, FrameKind},
};

/// Longest wait for the first frame: the library opens a camera twice, and a person may be asked.
const START_PATIENCE: Duration = Duration::from_secs(10);
/// Longest wait for a later frame.
const STEADY_PATIENCE: Duration = Duration::from_secs(2);
/// Shortest and longest pause between looks for a lost camera.
const SHORTEST_PAUSE: Duration = Duration::from_millis(500);
const LONGEST_PAUSE: Duration = Duration::from_secs(4);
/// Time between two reports of counts.
const COUNTING: Duration = Duration::from_secs(1);
/// Number of last frames compared with a new frame, to skip old ones: the driver's number of
/// buffers.
const BUFFERS: usize = 4;

/// A live camera, read through nokhwa.
pub struct NokhwaCamera {
    name: String,
    facts: CameraInfo,
    open: Opener,
    /// Faults reported before the first frame, and again after each return.
    doubts: Vec<(Fault, String)>,
    mode: Mode,
    reader: Option<Reader>,
    /// Reason of the loss; `None` while running.
    lost: Option<Loss>,
    next_look: Instant,
    pause: Duration,
    /// Time of the last frame, or of the start of the run.
    last_came: Instant,
    came: bool,
    unpacker: Unpacker,
    health: Health,
    last_checksums: VecDeque<u32>,
    events: VecDeque<CameraEvent>,
    began: Instant,
    last_time: CaptureTime,
    next_id: u64,
    dropped: u64,
    rejected: u64,
    told: (u64, u64),
    next_count: Instant,
}

impl NokhwaCamera {
    /// Opens a camera found on Linux, to be found again by the same description.
    ///
    /// # Errors
    ///
    /// [`CaptureError::Camera`] if it cannot be opened or started.
    #[cfg(all(target_os = "linux", feature = "live"))]
    pub fn of(camera: &v4l2::Camera, wanted: &Wanted) -> Result<Self, CaptureError> {
        let (identity, wanted) = (camera.identity(), *wanted);
        let name = camera.stable_name();
        let doubts = [
            (camera.has_twin, Fault::Twin),
            (camera.is_virtual, Fault::Virtual),
            (camera.is_infrared, Fault::Infrared),
        ];
        let doubts = doubts.into_iter().filter(|(applies, _)| *applies);
        let doubts = doubts.map(|(_, fault)| (fault, name.clone())).collect();
        let open: Opener = Arc::new(move || {
            let camera = v4l2::found_again(&mut v4l2::Linux::default(), &identity)?;
            let path = camera.node.path.display().to_string();
            let number = path.strip_prefix("/dev/video").and_then(|number| number.parse().ok());
            let number: u32 = number.ok_or((Fault::NotFound, format!("nokhwa opens no {path}")))?;
            Ok(Box::new(Streaming::open(::nokhwa::utils::CameraIndex::Index(number), &wanted)?))
        });
        let mut source = Self::start(name, open, doubts)?;
        source.facts = camera.facts("nokhwa", source.mode, Vec::new());
        Ok(source)
    }

    /// Opens a camera by a name of [`list`]: `nokhwa:` and an address, name or number.
    ///
    /// # Errors
    ///
    /// [`CaptureError::Camera`] if it cannot be found, opened or started.
    pub fn named(name: &str, wanted: &Wanted) -> Result<Self, CaptureError> {
        let (source, wanted) = (name.to_owned(), *wanted);
        let open: Opener = Arc::new(move || {
            let index = find(&list()?, &source)?.index;
            Ok(Box::new(Streaming::open(index, &wanted)?))
        });
        Self::start(name.into(), open, Vec::new())
    }

    fn start(name: String, open: Opener, doubts: Vec<Loss>) -> Result<Self, CaptureError> {
        let failed = |(fault, detail): Loss| CaptureError::Camera { fault, detail };
        let reader = Reader::start(&open).map_err(failed)?;
        let mode = match reader.next(START_PATIENCE) {
            Said::Started(mode) => mode,
            Said::Ended(loss) => return Err(failed(loss)),
            Said::Frame { .. } | Said::Nothing => {
                return Err(failed((Fault::NoFirstFrame, name)));
            }
        };
        let now = Instant::now();
        let facts = CameraInfo {
            name: name.clone(),
            usb_id: None,
            serial: String::new(),
            place: String::new(),
            backend: "nokhwa",
            mode,
            controls: Vec::new(),
        };
        let mut source = Self {
            name,
            facts,
            open,
            doubts,
            mode,
            reader: Some(reader),
            lost: None,
            next_look: now,
            pause: SHORTEST_PAUSE,
            last_came: now,
            came: false,
            unpacker: Unpacker::new(mode.layout, mode.size, 0),
            health: Health::default(),
            last_checksums: VecDeque::new(),
            events: VecDeque::from([CameraEvent::Started { mode }]),
            began: now,
            last_time: CaptureTime { nanos: 0 },
            next_id: 0,
            dropped: 0,
            rejected: 0,
            told: (0, 0),
            next_count: now + COUNTING,
        };
        source.tell_doubts();
        Ok(source)
    }

    /// The mode of the session.
    pub fn mode(&self) -> Mode {
        self.mode
    }

    fn tell_doubts(&mut self) {
        self.doubts.push((Fault::Unwatched, String::new()));
        self.doubts.dedup();
        self.events.extend(self.doubts.iter().map(|(fault, detail)| CameraEvent::Doubtful {
            fault: *fault,
            detail: detail.clone(),
        }));
    }

    fn nanos(&self, time: Instant) -> u64 {
        time.saturating_duration_since(self.began).as_nanos() as u64 + 1
    }

    /// Reports the loss of the camera, once for each reason.
    fn lose(&mut self, loss: Loss) {
        // "Not found" after a loss is the same loss, not a new one.
        let still_away = self.lost.is_some() && loss.0 == Fault::NotFound;
        if !still_away && self.lost.as_ref() != Some(&loss) {
            let (fault, detail) = loss.clone();
            self.events.push_back(CameraEvent::Lost { fault, detail });
            self.lost = Some(loss);
        }
    }

    /// Takes the reader's news, waiting at most `patience`.
    fn listen(&mut self, patience: Duration) -> Option<Arc<Frame>> {
        let reader = self.reader.as_ref()?;
        let limit = if self.came { STEADY_PATIENCE } else { START_PATIENCE };
        let due = self.last_came + limit;
        let left = due.saturating_duration_since(Instant::now());
        let wait = if self.lost.is_some() { patience } else { patience.min(left) };
        match reader.next(wait) {
            Said::Started(mode) => self.granted(mode),
            Said::Frame { bytes, came_at, replaced } => {
                self.dropped += replaced;
                self.last_came = came_at;
                self.came = true;
                if self.lost.take().is_some() {
                    // Tell the session of the return before it sees the next frame.
                    self.returned(came_at);
                    return None;
                }
                return self.picture(&bytes, came_at);
            }
            Said::Ended(loss) => {
                self.reader = None;
                self.lose(loss);
                self.next_look = Instant::now() + self.pause;
                self.pause = (2 * self.pause).min(LONGEST_PAUSE);
            }
            Said::Nothing if Instant::now() >= due => {
                let fault = if self.came { Fault::Stalled } else { Fault::NoFirstFrame };
                self.lose((fault, String::new()));
            }
            Said::Nothing => {}
        }
        None
    }

    /// Takes over the mode of a returning camera: must be the session's mode.
    fn granted(&mut self, mode: Mode) {
        self.last_came = Instant::now();
        if (mode.size, mode.layout) != (self.mode.size, self.mode.layout) {
            let detail = format!("granted {} {}", mode.size, mode.layout.name());
            self.reader = None;
            self.lose((Fault::OtherMode, detail));
            self.next_look = Instant::now() + LONGEST_PAUSE;
        }
    }

    fn returned(&mut self, now: Instant) {
        let good_from = CaptureTime { nanos: self.nanos(now) };
        self.events.push_back(CameraEvent::Returned { mode: self.mode, good_from });
        self.health = Health::default();
        self.pause = SHORTEST_PAUSE;
        self.tell_doubts();
    }

    /// The frame as a picture; `None` for a damaged or an old frame.
    fn picture(&mut self, bytes: &[u8], came_at: Instant) -> Option<Arc<Frame>> {
        let now = self.nanos(came_at);
        let checksum = crc32fast::hash(bytes);
        let repeats = self.health.repeats(checksum, now);
        let is_old = repeats || self.last_checksums.contains(&checksum);
        if self.last_checksums.len() == BUFFERS {
            self.last_checksums.pop_front();
        }
        self.last_checksums.push_back(checksum);
        let picture = if is_old { None } else { Some(self.unpacker.unpack(bytes)) };
        self.dropped += u64::from(is_old);
        let damaged = u32::from(matches!(picture, Some(Err(_))));
        self.rejected += u64::from(damaged);
        self.health.count(1, damaged, self.mode.rate_hz(), now);
        let image = picture.and_then(Result::ok);
        if let Some(image) = &image {
            self.health.look(image, now);
        }
        self.events.extend(self.health.changes());
        self.last_time = CaptureTime { nanos: now.max(self.last_time.nanos + 1) };
        // The gap in the numbers counts the frames known to be lost.
        let id = FrameId(self.dropped + self.next_id);
        self.next_id += 1;
        let (kind, name) = (FrameKind::Video, String::new());
        let captured_at = self.last_time;
        Some(Arc::new(Frame { id, captured_at, kind, name, image: image? }))
    }

    /// Reports counts. Damage comes with the next good frame, because the person may be able to act
    /// on it.
    fn tell_counts(&mut self, is_frame: bool) {
        let now = Instant::now();
        let counts = (self.dropped, self.rejected);
        let due = now >= self.next_count || (is_frame && counts.1 != self.told.1);
        if due && counts != self.told {
            let (dropped, rejected) = counts;
            self.events.push_back(CameraEvent::Counted { dropped, rejected });
            (self.told, self.next_count) = (counts, now + COUNTING);
        }
    }

    /// Looks for the lost camera.
    fn look_for_it(&mut self) {
        match Reader::start(&self.open) {
            Ok(reader) => {
                (self.reader, self.came, self.last_came) = (Some(reader), false, Instant::now());
            }
            Err(loss) => {
                self.lose(loss);
                self.next_look = Instant::now() + LONGEST_PAUSE;
            }
        }
    }
}

impl FrameSource for NokhwaCamera {
    fn identity(&self) -> SourceIdentity {
        SourceIdentity { name: self.name.clone(), image_size: Some(self.mode.size) }
    }

    fn waits(&self) -> bool {
        false
    }

    fn camera_facts(&self) -> Option<CameraInfo> {
        Some(self.facts.clone())
    }

    fn next_frame(&mut self, patience: Duration) -> Result<Arrival, CaptureError> {
        let until = Instant::now() + patience;
        loop {
            if let Some(event) = self.events.pop_front() {
                return Ok(Arrival::Event(event));
            }
            let now = Instant::now();
            let left = until.saturating_duration_since(now);
            if self.reader.is_some() {
                if let Some(frame) = self.listen(left) {
                    self.tell_counts(true);
                    return Ok(Arrival::Frame(frame));
                }
                self.tell_counts(false);
            } else if now >= self.next_look {
                self.look_for_it();
            } else {
                sleep(left.min(self.next_look - now));
            }
            if self.events.is_empty() && Instant::now() >= until {
                return Ok(Arrival::NothingYet);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::{
        Mutex,
        mpsc::{Receiver, Sender, channel},
    };

    use super::*;
    use crate::nokhwa::device::Blocking;
    use boresight_geometry::{device::PixelLayout, frame::ImageSize};

    const PATIENCE: Duration = Duration::from_millis(20);
    const MODE: Mode = Mode {
        size: ImageSize { width_px: 4, height_px: 2 },
        layout: PixelLayout::Grey,
        interval_secs: Some((1, 30)),
    };

    /// Scripted answer of a call. Without an answer, the call doesn't return.
    type Word = Result<Vec<u8>, &'static str>;

    struct Scripted {
        words: Arc<Mutex<Receiver<Word>>>,
        drops_badly: bool,
    }

    impl Blocking for Scripted {
        fn mode(&self) -> Mode {
            MODE
        }

        fn frame(&mut self) -> Result<Vec<u8>, Loss> {
            let word = self.words.lock().expect("whole").recv();
            match word.unwrap_or(Err("unplugged")) {
                Ok(bytes) => Ok(bytes),
                Err("panic") => panic!("within the library"),
                Err(words) => Err((Fault::Unplugged, words.into())),
            }
        }
    }

    impl Drop for Scripted {
        fn drop(&mut self) {
            assert!(!self.drops_badly, "the stream could not be stopped");
        }
    }

    fn camera(drops_badly: bool) -> (NokhwaCamera, Sender<Word>) {
        let (script, words) = channel();
        let words = Arc::new(Mutex::new(words));
        let open: Opener =
            Arc::new(move || Ok(Box::new(Scripted { words: Arc::clone(&words), drops_badly })));
        (NokhwaCamera::start("test".into(), open, Vec::new()).expect("opens"), script)
    }

    fn grey(first: u8) -> Word {
        Ok((first..first + 8).collect())
    }

    /// Arrivals up to the first wanted.
    fn until(source: &mut NokhwaCamera, wanted: impl Fn(&Arrival) -> bool) -> Vec<Arrival> {
        let mut seen = Vec::new();
        loop {
            seen.push(source.next_frame(PATIENCE).expect("a camera never breaks"));
            if seen.last().is_some_and(&wanted) {
                return seen;
            }
        }
    }

    fn is_frame(arrival: &Arrival) -> bool {
        matches!(arrival, Arrival::Frame(_))
    }

    fn lost(arrival: &Arrival) -> Option<Fault> {
        match arrival {
            Arrival::Event(CameraEvent::Lost { fault, .. }) => Some(*fault),
            _ => None,
        }
    }

    fn is_return(arrival: &Arrival) -> bool {
        matches!(arrival, Arrival::Event(CameraEvent::Returned { .. }))
    }

    #[test]
    fn a_call_that_does_not_return_is_a_time_out_and_the_camera_may_come_back() {
        let (mut source, script) = camera(false);
        script.send(grey(1)).expect("heard");
        let seen = until(&mut source, is_frame);
        let said = |fault| {
            seen.iter().any(|arrival| {
                matches!(arrival, Arrival::Event(CameraEvent::Doubtful { fault: f, .. }) if *f == fault)
            })
        };
        assert!(said(Fault::Unwatched), "{seen:?}");
        let seen = until(&mut source, |arrival| lost(arrival).is_some());
        assert_eq!(seen.last().and_then(lost), Some(Fault::Stalled));
        script.send(grey(20)).expect("heard");
        until(&mut source, is_return);
        script.send(grey(40)).expect("heard");
        until(&mut source, is_frame);
        // The reader's thread still waits in a call: the end of the source does not.
        drop(source);
    }

    #[test]
    fn a_panic_in_the_library_is_a_loss_and_the_camera_is_opened_again() {
        for drops_badly in [false, true] {
            let (mut source, script) = camera(drops_badly);
            script.send(Err("panic")).expect("heard");
            let seen = until(&mut source, |arrival| lost(arrival).is_some());
            assert_eq!(seen.last().and_then(lost), Some(Fault::DriverBroken));
            script.send(grey(1)).expect("heard");
            until(&mut source, is_return);
            script.send(Err("No such device")).expect("heard");
            let seen = until(&mut source, |arrival| lost(arrival).is_some());
            assert_eq!(seen.last().and_then(lost), Some(Fault::Unplugged));
        }
    }

    #[test]
    fn an_old_frame_that_comes_again_and_one_that_is_cut_are_not_shown() {
        let (mut source, script) = camera(false);
        let mut shown = Vec::new();
        // One by one: an untaken frame is replaced by the next.
        for first in [1, 20, 40] {
            script.send(grey(first)).expect("heard");
            shown.extend(until(&mut source, is_frame).pop());
        }
        script.send(grey(20)).expect("heard");
        while source.dropped == 0 {
            assert!(!is_frame(&source.next_frame(PATIENCE).expect("goes on")));
        }
        script.send(Ok(vec![1, 2, 3])).expect("heard");
        while source.rejected == 0 {
            assert!(!is_frame(&source.next_frame(PATIENCE).expect("goes on")));
        }
        script.send(grey(60)).expect("heard");
        shown.extend(until(&mut source, is_frame).pop());
        let numbers: Vec<u64> = shown
            .iter()
            .filter_map(|arrival| match arrival {
                Arrival::Frame(frame) => Some(frame.id.0),
                _ => None,
            })
            .collect();
        assert_eq!(numbers.len(), 4);
        assert!(numbers.is_sorted_by(|a, b| a < b), "{numbers:?}");
        assert_eq!((source.dropped, source.rejected), (1, 1));
    }
}
