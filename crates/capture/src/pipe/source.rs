//! A pipe as a frame source.
//!
//! A command counts as a live camera: its newest picture is worth more than an old one, it's lost
//! if it fails or falls silent, and it's restarted until it's back. A command ending with status 0
//! has sent all its pictures. A command far faster than the rate that its stream states plays a
//! stored stream, and is read at that rate. A file at standard input waits for the consumer;
//! another program there is a live camera that can't be restarted.

use std::time::{Duration, Instant};

use image::GrayImage;
use rustix::event::poll;

use super::{
    cutter::{Cut, Cutter, Packed},
    feed::{Feed, Got},
};
use crate::{
    Arrival, CaptureError, Decompressor, FrameSource, RawForm, SourceIdentity,
    address::{addresses_without_secrets, without_secrets},
    programs::{LOOK, is_ending, timespec},
    stream_report::{Loss, START_PATIENCE, STEADY_PATIENCE, StreamReport},
};
use boresight_geometry::{
    device::{CameraInfo, Fault, Mode, PixelLayout},
    frame::ImageSize,
};

/// Time without bytes after which a picture is whole: its bytes are sent at once.
const REST: Duration = Duration::from_millis(5);
/// Shortest and longest pause before restarting a lost command.
const SHORTEST_PAUSE: Duration = Duration::from_millis(500);
const LONGEST_PAUSE: Duration = Duration::from_secs(5);
/// Lead over the stated rate, from which a command plays a stored stream: cameras send a few
/// pictures at once when they start.
const LEAD: Duration = Duration::from_millis(300);
/// Longest interval in seconds that is believed: some programs state one picture per second of
/// every camera.
const SLOWEST: f64 = 0.2;
/// Default interval of a file's pictures, in nanoseconds.
const USUAL_NANOS: u64 = 33_333_333;

/// Pictures from another program.
pub struct Pipe {
    /// Name with secrets, shown to the command only.
    name: String,
    /// Words of the command; none for standard input.
    words: Vec<String>,
    raw: Option<RawForm>,
    is_live: bool,
    /// `None` while a lost command isn't running.
    run: Option<Run>,
    decompressor: Decompressor,
    report: StreamReport,
    next_start: Instant,
    pause: Duration,
}

impl Pipe {
    /// Name of standard input.
    pub const STDIN: &str = "pipe:-";

    /// Opens `pipe:COMMAND`, or [`Self::STDIN`], and waits for the first picture, whose size is
    /// required of all. `raw` describes the pictures if their bytes don't.
    ///
    /// The command is split into words like in a shell, with quotes, and started without one.
    ///
    /// # Errors
    ///
    /// [`CaptureError::Camera`] if it can't be started, or sends no readable picture.
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
        let mut source = Self {
            name: name.into(),
            words,
            raw,
            is_live: !is_file,
            run: Some(run),
            decompressor,
            report: StreamReport::new(mode, !is_file),
            next_start: Instant::now(),
            pause: SHORTEST_PAUSE,
        };
        source.take(image)?;
        Ok(source)
    }

    /// Gives up the run and reports the loss of the pictures.
    fn lose(&mut self, loss: Loss) {
        if !self.words.is_empty() {
            self.run = None;
        }
        let was_lost = self.report.lose(shown(loss, &self.name));
        self.pause = if was_lost { (2 * self.pause).min(LONGEST_PAUSE) } else { SHORTEST_PAUSE };
        self.next_start = Instant::now() + self.pause;
    }

    /// Waits at most `patience`, then restarts the lost command if due.
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
                self.report.wait_again();
            }
            Err(loss) => self.lose(loss),
        }
    }

    /// Takes a whole picture.
    fn take(&mut self, image: GrayImage) -> Result<(), CaptureError> {
        let nanos = if self.is_live {
            self.report.now_nanos()
        } else {
            let interval = self.report.mode().interval_secs;
            let interval = interval.map(|(n, d)| u64::from(n) * 1_000_000_000 / u64::from(d));
            self.report.delivered() * interval.unwrap_or(USUAL_NANOS)
        };
        match self.report.take(image, nanos) {
            Ok(()) => Ok(()),
            Err(loss) => self.broken(loss),
        }
    }

    /// Reads from the running pipe.
    fn listen(&mut self, patience: Duration) -> Result<(), CaptureError> {
        let Some(run) = &mut self.run else { return Ok(()) };
        let next = run.next(patience, self.is_live);
        let (replaced, torn) = std::mem::take(&mut run.counts);
        self.report.count(replaced, torn);
        match next {
            Ok(Next::Picture(packed)) => match packed.unpack(&mut self.decompressor) {
                Ok(image) => self.take(image)?,
                Err(_) => self.report.count(0, 1),
            },
            Ok(Next::Nothing) => {
                let patience = if run.count == 0 { START_PATIENCE } else { STEADY_PATIENCE };
                if self.report.is_silent(patience) {
                    let nothing = format!("nothing for {} s", patience.as_secs());
                    let detail = run.feed.with_last_words(nothing);
                    self.broken((Fault::NoPictures, detail))?;
                }
            }
            Ok(Next::End) => match (run.feed.failure(), run.count) {
                (None, 0) => {
                    let detail = run.feed.with_last_words(NO_PICTURE.into());
                    self.broken((Fault::CommandEnded, detail))?;
                }
                (None, _) => self.report.end(),
                (Some(how), _) => self.broken((Fault::CommandEnded, how))?,
            },
            Ok(Next::Foreign(what)) => self.broken((Fault::NotPictures, what))?,
            Err(err) => self.broken((Fault::CommandEnded, err.to_string()))?,
        }
        Ok(())
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

/// `loss` without secrets in the command's words.
fn shown((fault, detail): Loss, name: &str) -> Loss {
    (fault, addresses_without_secrets(&detail.replace(name, &without_secrets(name))))
}

/// A run of the command.
struct Run {
    feed: Feed,
    cutter: Cutter,
    ended: bool,
    /// Number of whole pictures so far.
    count: u64,
    /// Numbers of replaced and of torn pictures, not yet counted by the source.
    counts: (u64, u64),
    /// Time of the first picture.
    began: Option<Instant>,
    /// True for a stored stream, played faster than recorded.
    is_stored: bool,
}

enum Next {
    Picture(Packed),
    Nothing,
    End,
    Foreign(String),
}

impl Run {
    fn new(feed: Feed, raw: Option<&RawForm>) -> Self {
        Self {
            feed,
            cutter: Cutter::new(raw),
            ended: false,
            count: 0,
            counts: (0, 0),
            began: None,
            is_stored: false,
        }
    }

    /// Time until the next picture is due by the stated rate; none unless the stream is stored.
    fn lead(&mut self) -> Duration {
        let interval = self.cutter.interval_secs().map(|(n, d)| f64::from(n) / f64::from(d));
        let interval = interval.filter(|secs| *secs <= SLOWEST);
        let (Some(secs), Some(began)) = (interval, self.began) else { return Duration::ZERO };
        let due = Duration::try_from_secs_f64(secs * self.count as f64).unwrap_or_default();
        let since = began.elapsed();
        let lead = due.saturating_sub(since);
        self.is_stored |= lead > LEAD && due > 2 * since;
        if self.is_stored { lead } else { Duration::ZERO }
    }

    /// The first whole picture, and the layout.
    fn first(
        &mut self,
        decompressor: &mut Decompressor,
        newest: bool,
    ) -> Result<(GrayImage, PixelLayout), Loss> {
        let until = Instant::now() + START_PATIENCE;
        let mut flaw = None;
        loop {
            let left = until.saturating_duration_since(Instant::now());
            match self.next(left.min(LOOK), newest) {
                _ if is_ending() => return Err((Fault::NoPictures, STOPPED.into())),
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
                        (None, None) => self.feed.with_last_words(NO_PICTURE.into()),
                    };
                    return Err((Fault::CommandEnded, detail));
                }
                Ok(Next::Nothing) if Instant::now() < until => {}
                Ok(Next::Nothing) if flaw.is_some() => {
                    return Err((Fault::NotPictures, DAMAGED.into()));
                }
                Ok(Next::Nothing) => {
                    let nothing = format!("nothing for {} s", START_PATIENCE.as_secs());
                    return Err((Fault::NoPictures, self.feed.with_last_words(nothing)));
                }
                Err(err) => return Err((Fault::CommandEnded, err.to_string())),
            }
        }
    }

    /// Waits at most `patience` for a picture; for the newest available if `newest`.
    fn next(&mut self, patience: Duration, newest: bool) -> std::io::Result<Next> {
        let until = Instant::now() + patience;
        let lead = if newest { self.lead() } else { Duration::ZERO };
        if !lead.is_zero() {
            poll(&mut [], Some(&timespec(lead.min(patience)))).ok();
            if lead > patience {
                return Ok(Next::Nothing);
            }
        }
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
                    self.began.get_or_insert_with(Instant::now);
                    self.counts.0 += u64::from(picture.replace(next).is_some());
                    if newest && !self.lead().is_zero() {
                        // The program waits, and the picture isn't replaced.
                        return Ok(picture.map_or(Next::Nothing, Next::Picture));
                    }
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

/// Detail of a command with a good end, but without pictures.
const NO_PICTURE: &str = "without a picture";
/// Detail if the program was asked to end before the first picture.
const STOPPED: &str = "stopped before the first one";
/// Detail if every picture was refused.
const DAMAGED: &str = "every picture is damaged, or in a kind of JPEG that no camera sends";

impl FrameSource for Pipe {
    fn identity(&self) -> SourceIdentity {
        SourceIdentity {
            name: without_secrets(&self.name),
            image_size: Some(self.report.mode().size),
        }
    }

    fn waits(&self) -> bool {
        !self.is_live
    }

    fn camera_facts(&self) -> Option<CameraInfo> {
        self.report.facts(&without_secrets(&self.name), "pipe")
    }

    fn next_frame(&mut self, patience: Duration) -> Result<Arrival, CaptureError> {
        if let Some(arrival) = self.report.next() {
            return Ok(arrival);
        }
        match self.run {
            Some(_) => self.listen(patience)?,
            None => self.start_again(patience),
        }
        Ok(self.report.next().unwrap_or(Arrival::NothingYet))
    }
}
