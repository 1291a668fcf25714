//! A pipe as a frame source.
//!
//! A command counts as a live camera: its newest picture is worth more than an old one, it's lost if it fails or falls
//! silent, and it's started again until it's back. One that ends with status 0 has sent all its pictures. A file at
//! standard input waits for whoever looks at its pictures; another program there is a live camera that nobody can start
//! again.

use std::{
    collections::VecDeque,
    sync::Arc,
    time::{Duration, Instant},
};

use image::GrayImage;
use rustix::event::poll;

use super::{
    cutter::{Cut, Cutter, Packed},
    feed::{Feed, Got, Loss, timespec},
};
use crate::{
    Arrival, CaptureError, Decompressor, FrameSource, RawForm, SourceIdentity,
    address::{addresses_without_secrets, without_secrets},
    health::Health,
};
use boresight_geometry::{
    device::{CameraEvent, CameraInfo, Fault, Mode, PixelLayout},
    frame::{CaptureTime, Frame, FrameId, FrameKind, ImageSize},
};

/// Longest wait for the first picture: cameras take their time, and a command may log in somewhere.
const START_PATIENCE: Duration = Duration::from_secs(15);
/// Longest wait for a later picture.
const STEADY_PATIENCE: Duration = Duration::from_secs(5);
/// Time without bytes after which a picture is whole: what belongs to it is sent at once.
const REST: Duration = Duration::from_millis(5);
/// Shortest and longest pause before a lost command is started again.
const SHORTEST_PAUSE: Duration = Duration::from_millis(500);
const LONGEST_PAUSE: Duration = Duration::from_secs(5);
/// Time between two reports of counts.
const COUNTING: Duration = Duration::from_secs(1);
/// Interval of a file's pictures if it states none, in nanoseconds.
const USUAL_NANOS: u64 = 33_333_333;

/// Pictures that another program writes.
pub struct Pipe {
    /// Name with its secrets, which only the command gets to see.
    name: String,
    /// Words of the command; none for standard input.
    words: Vec<String>,
    raw: Option<RawForm>,
    is_live: bool,
    mode: Mode,
    /// `None` while a lost command isn't started.
    run: Option<Run>,
    decompressor: Decompressor,
    /// A picture that came and was not yet handed over.
    in_hand: Option<GrayImage>,
    health: Health,
    events: VecDeque<CameraEvent>,
    began: Instant,
    last_nanos: u64,
    /// Time of the last whole picture, or of the start of the run.
    last_came: Instant,
    /// Pictures in a row that have another size.
    resized: u32,
    /// Why the pictures are lost, as last reported.
    lost: Option<Fault>,
    next_start: Instant,
    pause: Duration,
    delivered: u64,
    dropped: u64,
    rejected: u64,
    told: (u64, u64),
    next_count: Instant,
}

impl Pipe {
    /// Name of standard input.
    pub const STDIN: &str = "pipe:-";

    /// Opens `pipe:COMMAND`, or [`Self::STDIN`], and waits for the first picture, which sets the size of all. `raw` says
    /// what the pictures are if their bytes don't.
    ///
    /// The command is split into words as a shell does it, with quotes, and started without one.
    ///
    /// # Errors
    ///
    /// [`CaptureError::Camera`] if it can't be started, or sends no picture that can be read.
    pub fn open(name: &str, raw: Option<RawForm>) -> Result<Self, CaptureError> {
        let failed = |(fault, detail): Loss| CaptureError::Camera { fault, detail };
        let command = name.strip_prefix("pipe:").unwrap_or(name);
        let is_stdin = name == Self::STDIN;
        let words = if is_stdin { Some(Vec::new()) } else { shlex::split(command) };
        let words = words.ok_or_else(|| failed((Fault::NoCommand, "a quote has no end".into())))?;
        let (feed, is_file) = if is_stdin {
            Feed::stdin().map_err(failed)?
        } else {
            (Feed::start(&words).map_err(failed)?, false)
        };
        let mut run = Run::new(feed, raw.as_ref());
        let mut decompressor = Decompressor::default();
        let first = run.first(&mut decompressor, !is_file);
        let (image, layout) = first.map_err(|loss| failed(shown(loss, name)))?;
        let mode =
            Mode { size: ImageSize::of(&image), layout, interval_secs: run.cutter.interval_secs() };
        let now = Instant::now();
        let mut source = Self {
            name: name.into(),
            words,
            raw,
            is_live: !is_file,
            mode,
            run: Some(run),
            decompressor,
            in_hand: Some(image),
            health: Health::default(),
            events: VecDeque::new(),
            began: now,
            last_nanos: 0,
            last_came: now,
            resized: 0,
            lost: None,
            next_start: now,
            pause: SHORTEST_PAUSE,
            delivered: 0,
            dropped: 0,
            rejected: 0,
            told: (0, 0),
            next_count: now + COUNTING,
        };
        if source.is_live {
            source.events.push_back(CameraEvent::Started { mode });
            source.doubt_unwatched();
        }
        Ok(source)
    }

    fn doubt_unwatched(&mut self) {
        let (fault, detail) = (Fault::Unwatched, String::new());
        self.events.push_back(CameraEvent::Doubtful { fault, detail });
    }

    /// Gives up the run and says that the pictures are lost, once for each reason.
    fn lose(&mut self, loss: Loss) {
        let (fault, detail) = shown(loss, &self.name);
        let restarts = !self.words.is_empty();
        if restarts {
            self.run = None;
        }
        let now = Instant::now();
        if self.lost != Some(fault) {
            self.lost = Some(fault);
            self.events.push_back(CameraEvent::Lost { fault, detail });
        } else {
            self.pause = (2 * self.pause).min(LONGEST_PAUSE);
        }
        (self.next_start, self.last_came) = (now + self.pause, now);
    }

    /// Waits at most `patience`, then starts the lost command if it's time.
    fn start_again(&mut self, patience: Duration) {
        let left = self.next_start.saturating_duration_since(Instant::now());
        // A signal may end the wait early; the next look then comes a little sooner.
        poll(&mut [], Some(&timespec(patience.min(left)))).ok();
        if Instant::now() < self.next_start {
            return;
        }
        match Feed::start(&self.words) {
            Ok(feed) => {
                self.run = Some(Run::new(feed, self.raw.as_ref()));
                self.decompressor = Decompressor::default();
                (self.last_came, self.resized) = (Instant::now(), 0);
            }
            Err(loss) => self.lose(loss),
        }
    }

    /// Takes a whole picture; `None` if it isn't to be delivered.
    fn take(&mut self, image: GrayImage) -> Option<Frame> {
        let now = Instant::now();
        if ImageSize::of(&image) != self.mode.size {
            self.resized += 1;
            self.rejected += 1;
            // A single one may be what a torn stream looks like.
            if self.resized > 1 {
                let size = image.dimensions();
                self.lose((Fault::OtherSize, format!("{}x{}", size.0, size.1)));
            }
            return None;
        }
        (self.resized, self.last_came) = (0, now);
        let nanos = if self.is_live {
            (now - self.began).as_nanos() as u64
        } else {
            let interval = self.mode.interval_secs;
            let interval = interval.map(|(n, d)| u64::from(n) * 1_000_000_000 / u64::from(d));
            self.delivered * interval.unwrap_or(USUAL_NANOS)
        };
        self.last_nanos = nanos.max(self.last_nanos + 1);
        let captured_at = CaptureTime { nanos: self.last_nanos };
        if self.lost.take().is_some() {
            self.pause = SHORTEST_PAUSE;
            self.health = Health::default();
            self.in_hand = Some(image);
            self.events
                .push_back(CameraEvent::Returned { mode: self.mode, good_from: captured_at });
            self.doubt_unwatched();
            return None;
        }
        if self.is_live && !self.is_new(&image) {
            return None;
        }
        let id = FrameId(self.delivered + self.dropped + self.rejected);
        self.delivered += 1;
        let (kind, name) = (FrameKind::Video, String::new());
        Some(Frame { id, captured_at, kind, name, image })
    }

    /// Judges how the picture looks; false if it's the one before again, for a sensor has noise.
    fn is_new(&mut self, image: &GrayImage) -> bool {
        let repeats = self.health.repeats(crc32fast::hash(image.as_raw()), self.last_nanos);
        if !repeats {
            self.health.look(image, self.last_nanos);
        }
        !repeats
    }

    fn count(&mut self, came: u64, torn: u64) {
        self.rejected += torn;
        let rate_hz = self.mode.rate_hz().filter(|_| self.is_live);
        let torn = u32::try_from(torn).unwrap_or(u32::MAX);
        self.health.count(came, torn, rate_hz, (Instant::now() - self.began).as_nanos() as u64);
        let changes = self.health.changes();
        self.events.extend(changes.into_iter().map(|(fault, detail)| match detail {
            Some(detail) => CameraEvent::Doubtful { fault, detail },
            None => CameraEvent::Dispelled { fault },
        }));
        let counts = (self.dropped, self.rejected);
        if counts != self.told && Instant::now() >= self.next_count {
            let (dropped, rejected) = counts;
            self.events.push_back(CameraEvent::Counted { dropped, rejected });
            (self.told, self.next_count) = (counts, Instant::now() + COUNTING);
        }
    }

    /// Asks the running pipe.
    fn listen(&mut self, patience: Duration) -> Result<Arrival, CaptureError> {
        let Some(run) = &mut self.run else { return Ok(Arrival::NothingYet) };
        let next = run.next(patience, self.is_live);
        let (replaced, torn) = std::mem::take(&mut run.counts);
        self.dropped += replaced;
        let (mut came, mut damaged) = (replaced + torn, torn);
        let arrival = match next {
            Ok(Next::Picture(packed)) => {
                came += 1;
                match packed.unpack(&mut self.decompressor) {
                    Ok(image) => self
                        .take(image)
                        .map_or(Arrival::NothingYet, |frame| Arrival::Frame(Arc::new(frame))),
                    Err(_) => {
                        damaged += 1;
                        Arrival::NothingYet
                    }
                }
            }
            Ok(Next::Nothing) => {
                let limit = if run.count == 0 { START_PATIENCE } else { STEADY_PATIENCE };
                if self.last_came.elapsed() >= limit {
                    self.broken((Fault::NoPictures, format!("nothing for {} s", limit.as_secs())))?;
                }
                Arrival::NothingYet
            }
            Ok(Next::End) => {
                let has_sent = run.count > 0;
                match run.feed.failure() {
                    None if has_sent => Arrival::End,
                    None => {
                        self.broken((Fault::CommandEnded, "without a picture".into()))?;
                        Arrival::NothingYet
                    }
                    Some(how) => {
                        self.broken((Fault::CommandEnded, how))?;
                        Arrival::NothingYet
                    }
                }
            }
            Ok(Next::Foreign(what)) => {
                self.broken((Fault::NotPictures, what))?;
                Arrival::NothingYet
            }
            Err(err) => {
                self.broken((Fault::CommandEnded, err.to_string()))?;
                Arrival::NothingYet
            }
        };
        if came > 0 {
            self.count(came, damaged);
        }
        Ok(arrival)
    }

    /// Handles the lack of a next picture: a camera is lost, a file is broken.
    fn broken(&mut self, loss: Loss) -> Result<(), CaptureError> {
        if self.is_live {
            self.lose(loss);
            return Ok(());
        }
        let (fault, detail) = loss;
        Err(CaptureError::Camera { fault, detail })
    }
}

/// `loss` with what may be shown of the command's words.
fn shown((fault, detail): Loss, name: &str) -> Loss {
    (fault, addresses_without_secrets(&detail.replace(name, &without_secrets(name))))
}

/// One run of the command.
struct Run {
    feed: Feed,
    cutter: Cutter,
    ended: bool,
    /// Whole pictures so far.
    count: u64,
    /// Pictures that newer ones replaced, and torn ones, not yet counted by the source.
    counts: (u64, u64),
}

enum Next {
    Picture(Packed),
    Nothing,
    End,
    Foreign(String),
}

impl Run {
    fn new(feed: Feed, raw: Option<&RawForm>) -> Self {
        Self { feed, cutter: Cutter::new(raw), ended: false, count: 0, counts: (0, 0) }
    }

    /// The first picture that is whole, and its layout.
    fn first(
        &mut self,
        decompressor: &mut Decompressor,
        newest: bool,
    ) -> Result<(GrayImage, PixelLayout), Loss> {
        let until = Instant::now() + START_PATIENCE;
        let mut flaw = None;
        loop {
            let left = until.saturating_duration_since(Instant::now());
            match self.next(left, newest) {
                Ok(Next::Picture(packed)) => match packed.unpack(decompressor) {
                    Ok(image) => {
                        let layout = packed
                            .pixels()
                            .map_or(PixelLayout::Mjpeg, crate::pixels::Pixels::layout);
                        return Ok((image, layout));
                    }
                    Err(why) => flaw = Some(why),
                },
                Ok(Next::Foreign(what)) => return Err((Fault::NotPictures, what)),
                Ok(Next::End) => {
                    let detail = match (self.feed.failure(), flaw) {
                        (Some(how), _) => how,
                        (None, Some(_)) => return Err((Fault::NotPictures, DAMAGED.into())),
                        (None, None) => "without a picture".into(),
                    };
                    return Err((Fault::CommandEnded, detail));
                }
                Ok(Next::Nothing) if Instant::now() < until => {}
                Ok(Next::Nothing) if flaw.is_some() => {
                    return Err((Fault::NotPictures, DAMAGED.into()));
                }
                Ok(Next::Nothing) => {
                    let nothing = format!("nothing for {} s", START_PATIENCE.as_secs());
                    let words = self.feed.last_words();
                    let detail =
                        if words.is_empty() { nothing } else { format!("{nothing}: {words}") };
                    return Err((Fault::NoPictures, detail));
                }
                Err(err) => return Err((Fault::CommandEnded, err.to_string())),
            }
        }
    }

    /// Waits at most `patience` for a picture; for the newest one that has come if `newest`.
    fn next(&mut self, patience: Duration, newest: bool) -> std::io::Result<Next> {
        let until = Instant::now() + patience;
        let mut picture: Option<Packed> = None;
        let mut rests = false;
        loop {
            let cut = if newest || picture.is_none() {
                self.cutter.cut(rests || self.ended)
            } else {
                Cut::Nothing
            };
            let is_ripe = matches!(cut, Cut::Ripe);
            match cut {
                Cut::Picture(next) => {
                    self.count += 1;
                    self.counts.0 += u64::from(picture.replace(next).is_some());
                    continue;
                }
                Cut::Torn => {
                    self.counts.1 += 1;
                    continue;
                }
                Cut::Foreign(what) => return Ok(Next::Foreign(what)),
                Cut::Ripe | Cut::Nothing => {}
            }
            if let Some(picture) = picture.take_if(|_| self.ended || !newest) {
                return Ok(Next::Picture(picture));
            }
            if self.ended {
                if self.cutter.give_up() {
                    self.counts.1 += 1;
                    continue;
                }
                return Ok(Next::End);
            }
            let left = until.saturating_duration_since(Instant::now());
            let wait = match &picture {
                _ if is_ripe => REST,
                Some(_) => Duration::ZERO,
                None => left,
            };
            match self.feed.read(self.cutter.bytes(), wait)? {
                Got::Bytes => rests = false,
                Got::End => self.ended = true,
                Got::Nothing if is_ripe => rests = true,
                Got::Nothing => {
                    return Ok(picture.map_or(Next::Nothing, Next::Picture));
                }
            }
            // Bytes that never become a picture don't keep the caller.
            if picture.is_none() && !is_ripe && Instant::now() >= until && !self.ended {
                return Ok(Next::Nothing);
            }
        }
    }
}

/// When every picture was refused.
const DAMAGED: &str = "every picture is damaged, or in a kind of JPEG that no camera sends";

impl FrameSource for Pipe {
    fn identity(&self) -> SourceIdentity {
        SourceIdentity { name: without_secrets(&self.name), image_size: Some(self.mode.size) }
    }

    fn waits(&self) -> bool {
        !self.is_live
    }

    fn camera_facts(&self) -> Option<CameraInfo> {
        self.is_live.then(|| CameraInfo {
            name: without_secrets(&self.name),
            usb_id: None,
            serial: String::new(),
            place: String::new(),
            backend: "pipe",
            mode: self.mode,
            controls: Vec::new(),
        })
    }

    fn next_frame(&mut self, patience: Duration) -> Result<Arrival, CaptureError> {
        if let Some(event) = self.events.pop_front() {
            return Ok(Arrival::Event(event));
        }
        if let Some(image) = self.in_hand.take() {
            self.count(1, 0);
            return Ok(self
                .take(image)
                .map_or(Arrival::NothingYet, |frame| Arrival::Frame(Arc::new(frame))));
        }
        if self.run.is_none() {
            self.start_again(patience);
            return Ok(Arrival::NothingYet);
        }
        self.listen(patience)
    }
}
