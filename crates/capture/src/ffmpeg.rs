//! Network streams and video files, read by the program ffmpeg.
//!
//! Linking ffmpeg would bring a decoder for every format of the world into this process; as a child
//! it can crash, hang or be fed nonsense and costs no more than a frame. The child is always ended:
//! when the source is dropped, after too long a silence, and after its own end.
//!
//! A file ends. A lost network stream is reopened until it is back: cameras on a network restart,
//! and cables are pulled.

use std::{
    collections::VecDeque,
    io::Read,
    process::{ChildStderr, ChildStdout, Command, Stdio},
    sync::Arc,
    time::{Duration, Instant},
};

use image::GrayImage;
use rustix::event::{PollFd, PollFlags, poll};

use super::{
    Arrival, CaptureError, FrameSource, SourceIdentity,
    address::{is_address, without_secrets},
    health::Health,
    programs::{LOOK, Program, is_ending, read_more, timespec},
    reader_words::{known, meaning, refusal},
};
use boresight_geometry::{
    device::{CameraEvent, Fault, Mode, PixelLayout},
    frame::{CaptureTime, Frame, FrameId, FrameKind, ImageSize},
};

/// Name of the program on the system's search path.
const PROGRAM: &str = "ffmpeg";
/// Longest wait for the first picture: cameras on a network take their time.
const START_PATIENCE: Duration = Duration::from_secs(15);
/// Longest wait for a later picture.
const STEADY_PATIENCE: Duration = Duration::from_secs(5);
/// Largest side of a picture.
const LARGEST_SIDE_PX: u32 = 8192;
/// Bytes kept of the program's last messages.
const MESSAGES_KEPT: usize = 4096;
/// Filters to drop pictures less than 1/31 s after the last (they cost work and add no views),
/// unless the stream's time restarts, or doesn't advance although the stream has times; then print
/// the stream's own time, in microseconds, for every picture kept. The stream's own metadata, such
/// as a time code, would be printed, too, so is deleted.
fn filters(has_times: bool) -> String {
    let stands_still = if has_times { "+eq(t\\,prev_t)" } else { "" };
    format!(
        "settb=1/1000000,\
         select=isnan(prev_selected_t)+gte(t-prev_selected_t\\,1/31)+lt(t\\,prev_selected_t){stands_still},\
         metadata=mode=delete,metadata=mode=add:key=boresight:value=1,metadata=mode=print:file=pipe\\\\:2:direct=1"
    )
}

/// Largest allocation of ffmpeg: enough for a picture of the largest size with colours. An endless
/// picture hidden in a stream otherwise fills the memory.
const MOST_AT_ONCE: &str = "268435456";

/// Formats of files with moving pictures, by content: none names other files, as a script or a
/// playlist would.
const FILE_FORMATS: &str =
    "mov,matroska,avi,mjpeg,mpegts,mpeg,mpegvideo,asf,flv,ogg,gif,m4v,h264,hevc";
/// Further formats of network streams. ffmpeg's playlists of the network open no file.
const STREAM_FORMATS: &str = "rtsp,rtp,sdp,hls,dash,mpjpeg,jpeg_pipe,png_pipe,live_flv,rm,nut";

/// Number of consecutive pictures of a file with equal times, from which the file counts as having
/// none.
const WITHOUT_TIMES: u32 = 10;

/// Shortest and longest pause before reopening a lost stream.
const SHORTEST_PAUSE: Duration = Duration::from_millis(500);
const LONGEST_PAUSE: Duration = Duration::from_secs(5);

/// A network stream or a video file.
pub struct Ffmpeg {
    program: String,
    /// Name with user and password, shown to the program only.
    name: String,
    is_live: bool,
    size: ImageSize,
    /// `None` while a lost stream is not being opened.
    run: Option<Run>,
    /// A received picture not handed over yet.
    in_hand: Option<Timed>,
    /// Pictures of the earlier runs.
    count_before: u64,
    /// Time of the run's first picture.
    run_began_nanos: u64,
    /// Time of the newest picture.
    last_nanos: u64,
    /// Health of the run's pictures; a file's is not reported.
    health: Health,
    /// Time since the stream was lost.
    away: Duration,
    /// Silence, or pause, so far.
    waited: Duration,
    pause: Duration,
    /// Reason of the loss, as last reported.
    lost: Option<Fault>,
    events: VecDeque<CameraEvent>,
}

impl Ffmpeg {
    /// Starts the program and waits for the first picture, whose size is required of all.
    ///
    /// # Errors
    ///
    /// [`CaptureError::Camera`] if the program is not installed or reads nothing.
    pub fn open(name: &str) -> Result<Self, CaptureError> {
        Self::open_with(PROGRAM, name)
    }

    /// Opens like [`Ffmpeg::open`], with another program.
    ///
    /// # Errors
    ///
    /// As there.
    pub fn open_with(program: &str, name: &str) -> Result<Self, CaptureError> {
        let failed = |(fault, detail): Loss| CaptureError::Camera { fault, detail };
        let is_live = is_address(name);
        // ffmpeg knows schemes in small letters only.
        let plain = name.split_once("://").filter(|_| is_live);
        let plain = plain.map(|(scheme, rest)| format!("{}://{rest}", scheme.to_ascii_lowercase()));
        let name = plain.as_deref().unwrap_or(name);
        let mut run = Run::start(program, name, is_live).map_err(failed)?;
        let until = Instant::now() + START_PATIENCE;
        let first = loop {
            match run.pictures.next(LOOK, false) {
                Ok(Next::Nothing) if Instant::now() < until && !is_ending() => {}
                other => break other,
            }
        };
        let first = match first {
            Ok(Next::Picture(first)) => first,
            Ok(Next::Nothing | Next::Changed) => {
                let detail = format!("no picture came within {} s", START_PATIENCE.as_secs());
                return Err(failed((Fault::ReaderFailed, detail)));
            }
            Ok(Next::End) => {
                let (fault, detail) = meaning(&run.pictures.words(), name);
                let says_nothing = detail.is_empty() && fault == Fault::ReaderFailed;
                let none = || "it ended without a picture".to_owned();
                return Err(failed((fault, if says_nothing { none() } else { detail })));
            }
            Err(err) => return Err(failed((Fault::ReaderFailed, err.to_string()))),
        };
        let mut source = Self {
            program: program.into(),
            name: name.into(),
            is_live,
            size: ImageSize::of(&first.image),
            run: Some(run),
            in_hand: Some(first),
            count_before: 0,
            run_began_nanos: 1,
            last_nanos: 0,
            health: Health::default(),
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

    /// ffmpeg doesn't report the frame rate of a live stream.
    fn mode(&self) -> Mode {
        Mode { size: self.size, layout: PixelLayout::Decoded, interval_secs: None }
    }

    /// Number of the newest picture.
    fn id(&self) -> FrameId {
        let count = self.run.as_ref().map_or(0, |run| run.pictures.count);
        FrameId((self.count_before + count).saturating_sub(1))
    }

    /// Time of a picture: the stream's own, counted from the first picture, and always later than
    /// the previous picture's.
    fn time(&mut self, since_first: Duration) -> CaptureTime {
        let nanos = self.run_began_nanos.saturating_add(since_first.as_nanos() as u64);
        self.last_nanos = nanos.max(self.last_nanos + 1);
        CaptureTime { nanos: self.last_nanos }
    }

    /// Ends the program and reports the loss of the stream, once for each reason.
    fn lose(&mut self, (fault, detail): Loss) {
        self.count_before += self.run.take().map_or(0, |run| run.pictures.count);
        // A returning stream may begin with its last picture; this counts as a new frame.
        self.health = Health::default();
        self.away += std::mem::take(&mut self.waited);
        if self.lost != Some(fault) {
            self.lost = Some(fault);
            self.events.push_back(CameraEvent::Lost { fault, detail });
        } else {
            self.pause = (2 * self.pause).min(LONGEST_PAUSE);
        }
    }

    /// Waits at most `patience`, then reopens the lost stream if due.
    fn ask_again(&mut self, patience: Duration) {
        let wait = patience.min(self.pause.saturating_sub(self.waited));
        // A signal may end the wait early; the next look then comes a little sooner.
        poll(&mut [], Some(&timespec(wait))).ok();
        self.waited += wait;
        if self.waited < self.pause {
            return;
        }
        self.away += std::mem::take(&mut self.waited);
        match Run::start(&self.program, &self.name, self.is_live) {
            Ok(run) => self.run = Some(run),
            Err(loss) => self.lose(loss),
        }
    }

    /// Handles the lack of a next picture: a stream is lost, a file is broken.
    fn broken(&mut self, loss: Loss) -> Result<Arrival, CaptureError> {
        if self.is_live {
            self.lose(loss);
            return Ok(Arrival::NothingYet);
        }
        let (fault, detail) = loss;
        Err(CaptureError::Camera { fault, detail })
    }
}

/// Reason for missing pictures, with details.
type Loss = (Fault, String);

/// The running program.
struct Run {
    /// Ends it on drop.
    _program: Program,
    pictures: Pictures,
}

impl Run {
    fn start(program: &str, name: &str, is_live: bool) -> Result<Self, Loss> {
        let broken = |err: std::io::Error| {
            let missing = err.kind() == std::io::ErrorKind::NotFound;
            (if missing { Fault::NoReader } else { Fault::ReaderFailed }, err.to_string())
        };
        // Nothing of ffmpeg's needs time to end.
        let mut program = Program::start(command(program, name, is_live), false).map_err(broken)?;
        let (Some(out), Some(err)) = (program.child.stdout.take(), program.child.stderr.take())
        else {
            return Err((Fault::ReaderFailed, "it has no output".into()));
        };
        let pictures = Pictures {
            out,
            bytes: Vec::new(),
            ended: false,
            count: 0,
            messages: Messages { err, line: Vec::new(), kept: Vec::new(), ended: false },
            times: VecDeque::new(),
            changed: false,
            has_times: !has_no_times(name),
            first: None,
            newest: None,
            equal_times: 0,
        };
        Ok(Self { _program: program, pictures })
    }
}

/// The command: brightness only, in a plain container with the size stated once, then whole
/// pictures.
fn command(program: &str, name: &str, is_live: bool) -> Command {
    let mut command = Command::new(program);
    command.args(["-nostdin", "-hide_banner", "-loglevel", "error", "-max_alloc", MOST_AT_ONCE]);
    if name.starts_with("rtsp") {
        // Lost packets would be damaged pictures.
        command.args(["-rtsp_transport", "tcp"]);
    }
    if is_live {
        command.args(["-fflags", "nobuffer", "-flags", "low_delay"]);
    }
    if is_live {
        command.args(["-format_whitelist", &format!("{FILE_FORMATS},{STREAM_FORMATS}")]);
    } else {
        command.args(["-format_whitelist", FILE_FORMATS, "-protocol_whitelist", "file"]);
    }
    if has_no_times(name) {
        // ffmpeg would assume 25 pictures per second of every stream. This way it counts pictures
        // in steps of 1/25 s, enough to leave some out; their times are times of arrival.
        command.args(["-use_wallclock_as_timestamps", "1"]);
    }
    // A damaged picture is left out, not repaired. Pictures stay as delivered by the sensor, like
    // those of files.
    command.args([
        "-noautorotate",
        "-err_detect",
        "explode",
        "-fflags",
        "+discardcorrupt",
        "-i",
        name,
    ]);
    command.args(["-an", "-sn", "-dn", "-map", "0:v:0"]);
    // Neither repeats pictures nor drops any, at every rate of the stream.
    command.args(["-fps_mode", "passthrough", "-vf", &filters(!has_no_times(name))]);
    // In units of the frame rate, two pictures may have one time; that would be an error.
    command.args(["-enc_time_base", "1:1000000"]);
    command.args(["-f", "image2pipe", "-c:v", "pgm", "-pix_fmt", "gray", "-"]);
    command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

/// True for a stream of plain pictures without times, such as motion JPEG over HTTP.
fn has_no_times(name: &str) -> bool {
    const TIMED: [&str; 8] = [".m3u8", ".mpd", ".ts", ".mp4", ".flv", ".mkv", ".webm", ".m4s"];
    let name = without_secrets(name).to_ascii_lowercase();
    let is_http = ["http://", "https://"].iter().any(|scheme| name.starts_with(scheme));
    is_http && !TIMED.iter().any(|ending| name.ends_with(ending))
}

/// A picture, with the time since the run's first picture.
#[derive(Debug)]
struct Timed {
    image: GrayImage,
    since_first: Duration,
}

/// The program's output.
struct Pictures {
    out: ChildStdout,
    /// Bytes of an incomplete picture.
    bytes: Vec<u8>,
    ended: bool,
    /// Number of pictures so far, including those replaced by newer ones.
    count: u64,
    messages: Messages,
    /// Times in the stream of pictures to come.
    times: VecDeque<PictureTime>,
    /// True once the stream's pictures differ in size or format from the first, to which ffmpeg
    /// would stretch them.
    changed: bool,
    /// True if the stream's times are better than the times of arrival.
    has_times: bool,
    /// Time in the stream and arrival of the first picture.
    first: Option<(Option<i64>, Instant)>,
    /// Time in the stream of the newest picture, and the number of pictures before with an equal
    /// time.
    newest: Option<i64>,
    equal_times: u32,
}

/// The filter's output for a picture: the number since the setup of the filters, and the time in
/// the stream.
type PictureTime = (u64, Option<i64>);

enum Next {
    Picture(Timed),
    /// The pictures have another form from now on.
    Changed,
    Nothing,
    End,
}

impl Pictures {
    /// Waits at most `patience` for a picture; for the newest available if `newest`.
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
                self.ended = read_more(&self.out, &mut self.bytes)? == 0;
                continue;
            }
            return Ok(match picture {
                Some(_) if self.changed => Next::Changed,
                Some(picture) => Next::Picture(picture),
                None if self.ended => Next::End,
                None => Next::Nothing,
            });
        }
    }

    /// Waits at most `patience` for bytes of pictures. Messages are read meanwhile: a full pipe
    /// would stop the program.
    fn is_readable(&mut self, patience: Duration) -> std::io::Result<bool> {
        let until = Instant::now() + patience;
        loop {
            let wait = timespec(until.saturating_duration_since(Instant::now()));
            let mut sources = [
                PollFd::new(&self.out, PollFlags::IN),
                PollFd::new(&self.messages.err, PollFlags::IN),
            ];
            let watched = if self.messages.ended { 1 } else { 2 };
            match poll(&mut sources[..watched], Some(&wait)) {
                Ok(0) => return Ok(false),
                Ok(_) => {}
                // A signal came between; the caller asks again.
                Err(rustix::io::Errno::INTR) => return Ok(false),
                Err(err) => return Err(err.into()),
            }
            let [pictures, messages] = sources.map(|source| !source.revents().is_empty());
            if messages {
                self.times.extend(self.messages.read());
            }
            if pictures {
                return Ok(true);
            }
        }
    }

    /// Takes a whole picture from the bytes; `None` if incomplete.
    fn cut_off(&mut self) -> std::io::Result<Option<Timed>> {
        let bad = |what: &str| std::io::Error::new(std::io::ErrorKind::InvalidData, what);
        let Some((numbers, header)) = header(&self.bytes).map_err(bad)? else { return Ok(None) };
        let [width, height, largest] = numbers;
        let believable = |side: u32| (1..=LARGEST_SIDE_PX).contains(&side);
        if largest != 255 {
            return Err(bad("not a picture of bytes"));
        }
        if !believable(width) || !believable(height) {
            let limit = format!(
                "its pictures have {width}x{height} pixels; a side has {LARGEST_SIDE_PX} at most"
            );
            return Err(bad(&limit));
        }
        let end = header + width as usize * height as usize;
        if self.bytes.len() < end {
            return Ok(None);
        }
        let pixels = self.bytes[header..end].to_vec();
        self.bytes.drain(..end);
        self.count += 1;
        let since_first = self.since_first();
        Ok(GrayImage::from_raw(width, height, pixels).map(|image| Timed { image, since_first }))
    }

    /// Time of the next picture since the first one: in the stream, or of arrival if the stream
    /// states none.
    fn since_first(&mut self) -> Duration {
        // The filter writes a picture's time before the encoder writes the picture.
        while self.times.is_empty() && self.messages.is_readable() {
            self.times.extend(self.messages.read());
        }
        let (number, time) = self.times.pop_front().unwrap_or((self.count, None));
        // Filters are set up again for pictures of another form.
        self.changed |= number == 0 && self.count > 1;
        let time = time.filter(|_| self.has_times);
        let is_equal = time.is_some() && self.newest == time;
        self.equal_times = if is_equal { self.equal_times + 1 } else { 0 };
        self.newest = time;
        let (first, came) = *self.first.get_or_insert((time, Instant::now()));
        match time.zip(first) {
            Some((time, first)) => {
                Duration::from_micros(time.saturating_sub(first).try_into().unwrap_or(0))
            }
            None => came.elapsed(),
        }
    }

    /// The program's last messages.
    fn words(&mut self) -> String {
        while self.messages.is_readable() {
            self.times.extend(self.messages.read());
        }
        let text = [&self.messages.kept[..], &self.messages.line[..]].concat();
        String::from_utf8_lossy(&text).into_owned()
    }
}

/// The program's standard error: the time of each picture, and messages.
struct Messages {
    err: ChildStderr,
    /// The incomplete last line.
    line: Vec<u8>,
    /// The last complete lines without times.
    kept: Vec<u8>,
    ended: bool,
}

impl Messages {
    /// True if bytes can be read without waiting.
    fn is_readable(&self) -> bool {
        let zero = timespec(Duration::ZERO);
        !self.ended
            && poll(&mut [PollFd::new(&self.err, PollFlags::IN)], Some(&zero)).is_ok_and(|n| n > 0)
    }

    /// Reads the waiting bytes, and returns the times in them.
    fn read(&mut self) -> Vec<PictureTime> {
        let mut chunk = [0; 4096];
        let got = self.err.read(&mut chunk).unwrap_or(0);
        self.ended = got == 0;
        let mut times = Vec::new();
        for byte in &chunk[..got] {
            // Bounds a line without an end.
            if *byte != b'\n' && self.line.len() < MESSAGES_KEPT {
                self.line.push(*byte);
                continue;
            }
            let line = std::mem::take(&mut self.line);
            match picture_time(&String::from_utf8_lossy(&line)) {
                Some(time) => times.push(time),
                None if line.starts_with(METADATA.as_bytes()) => {}
                None => {
                    self.kept.extend(line);
                    self.kept.push(b'\n');
                    let surplus = self.kept.len().saturating_sub(MESSAGES_KEPT);
                    self.kept.drain(..surplus);
                }
            }
        }
        times
    }
}

/// The line after a picture's time.
const METADATA: &str = "boresight=";

/// Number and time in a line such as `frame:3 pts:1200000 pts_time:1.2`, in microseconds; no time
/// if the stream states none. `pts_time` has six digits only: a tenth of a second after three
/// hours.
fn picture_time(line: &str) -> Option<PictureTime> {
    let (_, rest) = line.split_once("frame:")?;
    let (number, rest) = rest.split_once("pts:")?;
    let number = number.trim().parse().ok()?;
    let time = rest.split_whitespace().next().and_then(|time| time.parse().ok());
    rest.contains("pts_time:").then_some((number, time))
}

/// Longest header of a picture.
const HEADER_BYTES: usize = 64;

/// Width, height and largest value of a binary PGM picture, and the index of the first pixel;
/// `None` for an incomplete header.
fn header(bytes: &[u8]) -> Result<Option<([u32; 3], usize)>, &'static str> {
    if !bytes.starts_with(&b"P5"[..bytes.len().min(2)]) {
        return Err("not a picture");
    }
    // Without a bound, digits without end would be read again with every chunk.
    let bytes = &bytes[..bytes.len().min(HEADER_BYTES)];
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
            None if bytes.len() == HEADER_BYTES => return Err("not a picture"),
            None => return Ok(None),
            Some(byte) if byte.is_ascii_whitespace() && at > digits => {}
            Some(_) => return Err("not a picture"),
        }
    }
    Ok(Some((numbers, at + 1)))
}

impl FrameSource for Ffmpeg {
    fn identity(&self) -> SourceIdentity {
        SourceIdentity { name: without_secrets(&self.name), image_size: Some(self.size) }
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
        let picture = match next {
            Ok(Next::Picture(picture)) => picture,
            Ok(Next::Changed) => {
                let before = run.pictures.count - 1;
                let detail = format!("after picture {before}, the stream changes");
                return self.broken((Fault::OtherSize, detail));
            }
            Ok(Next::Nothing) => {
                self.waited += patience;
                let limit = if run.pictures.count == 0 { START_PATIENCE } else { STEADY_PATIENCE };
                if self.waited < limit {
                    return Ok(Arrival::NothingYet);
                }
                let fault = if self.is_live { Fault::StreamLost } else { Fault::ReaderFailed };
                let detail = format!("nothing for {} s", limit.as_secs());
                return self.broken((fault, detail));
            }
            Ok(Next::End) => {
                let words = run.pictures.words();
                if self.is_live {
                    let fault = refusal(&words).unwrap_or(Fault::StreamLost);
                    return self.broken((fault, String::new()));
                }
                let count = run.pictures.count;
                if count > 0 && known(&words).is_some() {
                    let detail = format!("it's damaged after picture {count}");
                    return self.broken((Fault::ReaderFailed, detail));
                }
                return match meaning(&words, &self.name) {
                    (_, detail) if detail.is_empty() => Ok(Arrival::End),
                    loss => self.broken(loss),
                };
            }
            Err(err) => {
                return self.broken((Fault::ReaderFailed, err.to_string()));
            }
        };
        let waited = std::mem::take(&mut self.waited);
        if self.lost.is_some() {
            self.away += waited;
        }
        let size = ImageSize::of(&picture.image);
        if size != self.size {
            let detail = format!("the pictures are now {size}");
            return self.broken((Fault::OtherSize, detail));
        }
        if self.lost.take().is_some() {
            self.pause = SHORTEST_PAUSE;
            let away = std::mem::take(&mut self.away);
            self.run_began_nanos = self.last_nanos + (away.as_nanos() as u64).max(1);
            let good_from = CaptureTime { nanos: self.run_began_nanos };
            self.in_hand = Some(picture);
            let mode = self.mode();
            return Ok(Arrival::Event(CameraEvent::Returned { mode, good_from }));
        }
        let Timed { image, since_first } = picture;
        let stands_still =
            self.run.as_ref().is_some_and(|run| run.pictures.equal_times >= WITHOUT_TIMES);
        if stands_still && !self.is_live {
            let detail = "its pictures all have the same time; give it times, for example: ffmpeg -r 30 -i FILE NEW";
            return self.broken((Fault::ReaderFailed, detail.into()));
        }
        // A sensor has noise: equal bytes are the same picture, sent again.
        let (id, captured_at) = (self.id(), self.time(since_first));
        let repeats = self.health.repeats(crc32fast::hash(image.as_raw()), captured_at.nanos);
        if !repeats && self.is_live {
            self.health.look(&image, captured_at.nanos);
        }
        let changes = self.health.changes();
        self.events.extend(changes.into_iter().filter(|_| self.is_live));
        if repeats {
            return Ok(Arrival::NothingYet);
        }
        let (kind, name) = (FrameKind::Video, String::new());
        Ok(Arrival::Frame(Arc::new(Frame { id, captured_at, kind, name, image })))
    }
}
