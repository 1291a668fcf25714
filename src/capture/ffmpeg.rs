//! Anything that ffmpeg reads: network streams and video files, through the program itself.
//!
//! Linking ffmpeg would bring a decoder for every format of the world into this process; as a child it can
//! crash, hang or be fed nonsense and costs no more than a frame. It is always ended: when this source is
//! dropped, when it is silent for too long, and when it ends by itself.
//!
//! A file ends. A network stream is lost, and asked for again until it is back: cameras on a network
//! restart, and cables are pulled.

use std::{
    collections::VecDeque,
    fs::File,
    io::{Read, Seek},
    process::{Child, ChildStdout, Command, Stdio},
    sync::Arc,
    time::Duration,
};

use image::GrayImage;
use rustix::event::{PollFd, PollFlags, Timespec, poll};

use super::{Arrival, CaptureError, FrameSource, SourceIdentity, is_address};
use crate::{
    device::{CameraEvent, Fault, Mode, PixelLayout},
    frame::{CaptureTime, Frame, FrameId, FrameKind, ImageSize},
};

/// The program, found by the system's search path.
const PROGRAM: &str = "ffmpeg";
/// Longest wait for the first picture: cameras on a network take their time.
const START_PATIENCE: Duration = Duration::from_secs(15);
/// Longest wait for the next one.
const STEADY_PATIENCE: Duration = Duration::from_secs(5);
/// Largest side of a picture.
const LARGEST_SIDE_PX: u32 = 8192;
/// What is kept of the program's words.
const MOST_WORDS: u64 = 4096;
/// Bytes taken from the pipe at once.
const CHUNK: usize = 1 << 18;
/// Pictures per second that files and streams are read as; more brings work and no views.
const RATE_HZ: u64 = 30;

/// Pauses before a lost stream is asked for again.
const SHORTEST_PAUSE: Duration = Duration::from_millis(500);
const LONGEST_PAUSE: Duration = Duration::from_secs(5);

/// A network stream or a video file.
pub struct Ffmpeg {
    program: String,
    name: String,
    is_live: bool,
    size: ImageSize,
    /// `None` while a lost stream is not asked for.
    run: Option<Run>,
    /// A picture that came and was not yet handed over.
    in_hand: Option<GrayImage>,
    /// Pictures of the runs before this one.
    count_before: u64,
    /// Time for which there was no stream.
    away: Duration,
    /// Silence, or pause, so far.
    waited: Duration,
    pause: Duration,
    /// Why the stream is lost, as it was told.
    lost: Option<Fault>,
    events: VecDeque<CameraEvent>,
}

impl Ffmpeg {
    /// Starts the program and waits for the first picture, which tells the size of all.
    ///
    /// # Errors
    ///
    /// [`CaptureError::Camera`] if the program is not installed or reads nothing.
    pub fn open(name: &str) -> Result<Self, CaptureError> {
        Self::open_with(PROGRAM, name)
    }

    /// As [`Ffmpeg::open`], with another program.
    ///
    /// # Errors
    ///
    /// As there.
    pub fn open_with(program: &str, name: &str) -> Result<Self, CaptureError> {
        let failed = |(fault, detail): Loss| CaptureError::Camera { fault, detail };
        let is_live = is_address(name);
        let mut run = Run::start(program, name, is_live).map_err(failed)?;
        let first = match run.pictures.next(START_PATIENCE, false) {
            Ok(Next::Picture(first)) => first,
            Ok(Next::Nothing) => return Err(failed((Fault::NoFirstFrame, name.to_owned()))),
            Ok(Next::End) => return Err(failed((Fault::ReaderFailed, run.pictures.words()))),
            Err(err) => {
                let detail = format!("{err}; {}", run.pictures.words());
                return Err(failed((Fault::ReaderFailed, detail)));
            }
        };
        let mut source = Self {
            program: program.into(),
            name: name.into(),
            is_live,
            size: ImageSize::of(&first),
            run: Some(run),
            in_hand: Some(first),
            count_before: 0,
            away: Duration::ZERO,
            waited: Duration::ZERO,
            pause: SHORTEST_PAUSE,
            lost: None,
            events: VecDeque::new(),
        };
        if is_live {
            source.events.push_back(CameraEvent::Started { mode: source.mode() });
        }
        Ok(source)
    }

    /// How fast the stream is, nobody says.
    fn mode(&self) -> Mode {
        Mode { size: self.size, layout: PixelLayout::Decoded, interval_secs: None }
    }

    /// Number of the newest picture.
    fn id(&self) -> FrameId {
        let count = self.run.as_ref().map_or(0, |run| run.pictures.count);
        FrameId((self.count_before + count).saturating_sub(1))
    }

    /// The program delivers an even rate; its own clock is the stream's.
    fn time(&self) -> CaptureTime {
        let playing_nanos = (self.id().0 + 1) * 1_000_000_000 / RATE_HZ;
        CaptureTime { nanos: playing_nanos + self.away.as_nanos() as u64 }
    }

    /// Ends the program and says that the stream is lost, once for each reason.
    fn lose(&mut self, (fault, detail): Loss) {
        self.count_before += self.run.take().map_or(0, |run| run.pictures.count);
        self.away += self.waited;
        self.waited = Duration::ZERO;
        if self.lost != Some(fault) {
            self.lost = Some(fault);
            self.events.push_back(CameraEvent::Lost { fault, detail });
        } else {
            self.pause = (2 * self.pause).min(LONGEST_PAUSE);
        }
    }

    /// Waits at most `patience`, then asks for the lost stream again if it is time.
    fn ask_again(&mut self, patience: Duration) {
        let wait = patience.min(self.pause.saturating_sub(self.waited));
        // A signal may end it early; then the next time comes a little sooner.
        poll(&mut [], Some(&timespec(wait))).ok();
        self.waited += wait;
        if self.waited < self.pause {
            return;
        }
        self.away += self.waited;
        self.waited = Duration::ZERO;
        match Run::start(&self.program, &self.name, self.is_live) {
            Ok(run) => self.run = Some(run),
            Err(loss) => self.lose(loss),
        }
    }

    /// There is no next picture: a stream is lost, a file is broken.
    fn broken(&mut self, loss: Loss) -> Result<Arrival, CaptureError> {
        if self.is_live {
            self.lose(loss);
            return Ok(Arrival::NothingYet);
        }
        let (fault, detail) = loss;
        Err(CaptureError::Camera { fault, detail })
    }
}

/// Why there are no pictures, and what is known besides.
type Loss = (Fault, String);

/// The program at work; dropping it ends it.
struct Run {
    child: Child,
    pictures: Pictures,
}

impl Run {
    fn start(program: &str, name: &str, is_live: bool) -> Result<Self, Loss> {
        let broken = |err: std::io::Error| {
            let missing = err.kind() == std::io::ErrorKind::NotFound;
            (if missing { Fault::NoReader } else { Fault::ReaderFailed }, err.to_string())
        };
        // A file takes any number of words; a pipe that nobody empties would stop the program.
        let words = tempfile::tempfile().map_err(broken)?;
        let mut command = command(program, name, is_live);
        command.stderr(words.try_clone().map_err(broken)?);
        let mut child = command.spawn().map_err(broken)?;
        let Some(out) = child.stdout.take() else {
            end(&mut child);
            return Err((Fault::ReaderFailed, "it has no output".into()));
        };
        let pictures = Pictures { out, words, bytes: Vec::new(), ended: false, count: 0 };
        Ok(Self { child, pictures })
    }
}

impl Drop for Run {
    fn drop(&mut self) {
        end(&mut self.child);
    }
}

fn timespec(wait: Duration) -> Timespec {
    Timespec {
        tv_sec: wait.as_secs().try_into().unwrap_or(i64::MAX),
        tv_nsec: wait.subsec_nanos().into(),
    }
}

/// Brightness only, in a plain container that says the size once and then sends whole pictures.
fn command(program: &str, name: &str, is_live: bool) -> Command {
    let mut command = Command::new(program);
    command.args(["-nostdin", "-hide_banner", "-loglevel", "error"]);
    if name.starts_with("rtsp") {
        // Lost packets would be damaged pictures.
        command.args(["-rtsp_transport", "tcp"]);
    }
    if is_live {
        command.args(["-fflags", "nobuffer", "-flags", "low_delay"]);
    }
    // A damaged picture is left out instead of mended.
    command.args(["-err_detect", "explode", "-fflags", "+discardcorrupt", "-i", name]);
    command.args(["-an", "-sn", "-dn", "-map", "0:v:0", "-r"]).arg(RATE_HZ.to_string());
    command.args(["-f", "image2pipe", "-c:v", "pgm", "-pix_fmt", "gray", "-"]);
    command.stdin(Stdio::null()).stdout(Stdio::piped());
    command
}

/// What the program has sent.
struct Pictures {
    out: ChildStdout,
    words: File,
    /// Bytes that are not yet a whole picture.
    bytes: Vec<u8>,
    ended: bool,
    /// Pictures so far, also those that newer ones replaced.
    count: u64,
}

enum Next {
    Picture(GrayImage),
    Nothing,
    End,
}

impl Pictures {
    /// Waits at most `patience` for a picture; the newest one that is there if `newest`.
    fn next(&mut self, patience: Duration, newest: bool) -> std::io::Result<Next> {
        let mut picture = None;
        loop {
            while newest || picture.is_none() {
                match self.cut_off()? {
                    Some(next) => picture = Some(next),
                    None => break,
                }
            }
            let wait = if picture.is_some() { Duration::ZERO } else { patience };
            let more = (newest || picture.is_none()) && !self.ended && self.is_readable(wait)?;
            if more {
                let before = self.bytes.len();
                self.bytes.resize(before + CHUNK, 0);
                let got = self.out.read(&mut self.bytes[before..]);
                self.bytes.truncate(before + *got.as_ref().unwrap_or(&0));
                self.ended = got? == 0;
                continue;
            }
            return Ok(match picture {
                Some(picture) => Next::Picture(picture),
                None if self.ended => Next::End,
                None => Next::Nothing,
            });
        }
    }

    fn is_readable(&self, patience: Duration) -> std::io::Result<bool> {
        match poll(&mut [PollFd::new(&self.out, PollFlags::IN)], Some(&timespec(patience))) {
            Ok(ready) => Ok(ready > 0),
            // A signal came between; the caller asks again.
            Err(rustix::io::Errno::INTR) => Ok(false),
            Err(err) => Err(err.into()),
        }
    }

    /// Takes a whole picture from the bytes; `None` while there is none.
    fn cut_off(&mut self) -> std::io::Result<Option<GrayImage>> {
        let bad = |what: &str| std::io::Error::new(std::io::ErrorKind::InvalidData, what);
        let Some((numbers, header)) = header(&self.bytes).map_err(bad)? else { return Ok(None) };
        let [width, height, largest] = numbers;
        let believable = |side: u32| (1..=LARGEST_SIDE_PX).contains(&side);
        if !believable(width) || !believable(height) || largest != 255 {
            return Err(bad("not a picture of bytes"));
        }
        let end = header + width as usize * height as usize;
        if self.bytes.len() < end {
            return Ok(None);
        }
        let pixels = self.bytes[header..end].to_vec();
        self.bytes.drain(..end);
        self.count += 1;
        Ok(GrayImage::from_raw(width, height, pixels))
    }

    /// What the program said of itself.
    fn words(&mut self) -> String {
        let mut said = Vec::new();
        self.words.rewind().ok();
        (&mut self.words).take(MOST_WORDS).read_to_end(&mut said).ok();
        String::from_utf8_lossy(&said).trim().replace('\n', "; ")
    }
}

/// Width, height and largest value of a binary PGM picture, and where its pixels begin; `None` while the
/// bytes do not reach so far.
fn header(bytes: &[u8]) -> Result<Option<([u32; 3], usize)>, &'static str> {
    if !bytes.starts_with(&b"P5"[..bytes.len().min(2)]) {
        return Err("not a picture");
    }
    let (mut numbers, mut at) = ([0_u32; 3], 2);
    for number in &mut numbers {
        while bytes.get(at).is_some_and(u8::is_ascii_whitespace) {
            at += 1;
        }
        let digits = at;
        while let Some(digit) = bytes.get(at).filter(|byte| byte.is_ascii_digit()) {
            *number = number.saturating_mul(10).saturating_add(u32::from(digit - b'0'));
            at += 1;
        }
        match bytes.get(at) {
            None => return Ok(None),
            Some(byte) if byte.is_ascii_whitespace() && at > digits => {}
            Some(_) => return Err("not a picture"),
        }
    }
    Ok(Some((numbers, at + 1)))
}

fn end(child: &mut Child) {
    // It may have ended by itself; it is waited for in any case, so that nothing of it is left.
    child.kill().ok();
    child.wait().ok();
}

impl FrameSource for Ffmpeg {
    fn identity(&self) -> SourceIdentity {
        SourceIdentity { name: self.name.clone(), image_size: Some(self.size) }
    }

    fn waits(&self) -> bool {
        !self.is_live
    }

    fn next_frame(&mut self, patience: Duration) -> Result<Arrival, CaptureError> {
        if let Some(event) = self.events.pop_front() {
            return Ok(Arrival::Event(event));
        }
        let Some(run) = &mut self.run else {
            self.ask_again(patience);
            return Ok(Arrival::NothingYet);
        };
        let next = match self.in_hand.take() {
            Some(picture) => Ok(Next::Picture(picture)),
            None => run.pictures.next(patience, self.is_live),
        };
        let image = match next {
            Ok(Next::Picture(image)) => image,
            Ok(Next::Nothing) => {
                self.waited += patience;
                let limit = if run.pictures.count == 0 { START_PATIENCE } else { STEADY_PATIENCE };
                if self.waited < limit {
                    return Ok(Arrival::NothingYet);
                }
                let fault = if self.is_live { Fault::StreamLost } else { Fault::Stalled };
                let detail = format!("nothing for {} s", limit.as_secs());
                return self.broken((fault, detail));
            }
            Ok(Next::End) => {
                let words = run.pictures.words();
                return match (self.is_live, words.is_empty()) {
                    (true, _) => self.broken((Fault::StreamLost, words)),
                    (false, false) => self.broken((Fault::ReaderFailed, words)),
                    (false, true) => Ok(Arrival::End),
                };
            }
            Err(err) => {
                let detail = format!("{err}; {}", run.pictures.words());
                return self.broken((Fault::ReaderFailed, detail));
            }
        };
        let waited = std::mem::take(&mut self.waited);
        if self.lost.is_some() {
            self.away += waited;
        }
        if ImageSize::of(&image) != self.size {
            let detail = format!("the pictures are now {:?}", image.dimensions());
            return self.broken((Fault::OtherMode, detail));
        }
        let (id, captured_at) = (self.id(), self.time());
        if self.lost.take().is_some() {
            self.pause = SHORTEST_PAUSE;
            self.in_hand = Some(image);
            let mode = self.mode();
            return Ok(Arrival::Event(CameraEvent::Returned { mode, good_from: captured_at }));
        }
        let (kind, name) = (FrameKind::Video, String::new());
        Ok(Arrival::Frame(Arc::new(Frame { id, captured_at, kind, name, image })))
    }
}
