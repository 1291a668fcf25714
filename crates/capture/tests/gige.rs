//! Machine-vision cameras through the whole of GigE Vision, on this computer's own network: `gige_camera.py`, which
//! shares no code with the client, and Aravis' fake camera (Debian's `aravis-tools`). Without Python or Aravis, a test
//! says that it's skipped; with `CI` set, that's a failure.

#![cfg(target_os = "linux")]
#![expect(clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

use std::{
    io::{BufRead, BufReader, Write},
    process::{Child, ChildStdin, ChildStdout, Command, Stdio},
    sync::Arc,
    time::{Duration, Instant},
};

use boresight_capture::{
    Arrival, CaptureError, FrameSource,
    gige::{Network, find},
    v4l2::LiveCamera,
};
use boresight_geometry::{
    device::{CameraEvent, Control, Fault, Lock, Locks, PixelLayout, Wanted},
    frame::{Frame, ImageSize},
};

const PATIENCE: Duration = Duration::from_millis(100);
/// Time for anything that is waited for: the computer may be busy.
const LONGEST: Duration = Duration::from_secs(60);

/// A camera in another process.
struct Fake {
    child: Child,
    commands: ChildStdin,
    lines: BufReader<ChildStdout>,
}

impl Fake {
    /// `None` if there is no Python.
    fn start(address: &str, serial: &str, more: &[&str]) -> Option<Self> {
        let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/gige_camera.py");
        let child = Command::new("python3")
            .args([script, "--address", address, "--serial", serial])
            .args(more)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn();
        let Ok(mut child) = child else {
            skipped("python3");
            return None;
        };
        let commands = child.stdin.take().expect("piped");
        let lines = BufReader::new(child.stdout.take().expect("piped"));
        let mut fake = Self { child, commands, lines };
        fake.wait_for("ready");
        Some(fake)
    }

    fn wait_for(&mut self, word: &str) -> String {
        loop {
            let mut line = String::new();
            let read = self.lines.read_line(&mut line).expect("it speaks");
            assert!(read > 0, "it ended before {word:?}");
            if line.starts_with(word) {
                return line;
            }
        }
    }

    fn say(&mut self, command: &str) -> String {
        writeln!(self.commands, "{command}").expect("it listens");
        self.wait_for(command.split(' ').next().unwrap_or_default())
    }
}

impl Drop for Fake {
    fn drop(&mut self) {
        self.child.kill().ok();
        self.child.wait().ok();
    }
}

fn skipped(what: &str) {
    assert!(std::env::var_os("CI").is_none(), "{what} is missing");
    eprintln!("skipped: {what} is missing");
}

type Source = LiveCamera<Network>;

fn opened(name: &str, wanted: &Wanted) -> Result<Source, (Fault, String)> {
    let camera = find(name)?;
    let said = |err| match err {
        CaptureError::Camera { fault, detail } => (fault, detail),
        other => panic!("{other}"),
    };
    LiveCamera::open(Network::of_camera(&camera), camera, wanted).map_err(said)
}

fn open(name: &str, wanted: &Wanted) -> Source {
    opened(name, wanted).unwrap_or_else(|(fault, detail)| panic!("{name}: {fault:?}, {detail}"))
}

/// Arrivals until one is as wanted.
fn until(source: &mut Source, wanted: impl Fn(&Arrival) -> bool) -> Vec<Arrival> {
    let began = Instant::now();
    let mut seen = Vec::new();
    while began.elapsed() < LONGEST {
        seen.push(source.next_frame(PATIENCE).expect("a camera never breaks"));
        if seen.last().is_some_and(&wanted) {
            return seen;
        }
    }
    let events: Vec<_> = seen.iter().filter_map(event).collect();
    panic!("never; {} arrivals, of them {events:?}", seen.len())
}

fn event(arrival: &Arrival) -> Option<&CameraEvent> {
    match arrival {
        Arrival::Event(event) => Some(event),
        _ => None,
    }
}

fn frame(arrival: &Arrival) -> Option<&Arc<Frame>> {
    match arrival {
        Arrival::Frame(frame) => Some(frame),
        _ => None,
    }
}

fn frames(source: &mut Source, count: usize) -> Vec<Arc<Frame>> {
    let mut all = Vec::new();
    while all.len() < count {
        let seen = until(source, |arrival| frame(arrival).is_some());
        all.extend(seen.last().and_then(frame).cloned());
    }
    all
}

fn locked(source: &mut Source) -> Locks {
    let is_locked = |arrival: &Arrival| matches!(event(arrival), Some(CameraEvent::Locked { .. }));
    match until(source, is_locked).last().and_then(event) {
        Some(CameraEvent::Locked { locks }) => *locks,
        _ => Locks::default(),
    }
}

/// True if the picture is one of the fake camera's pattern, every pixel.
fn is_pattern(frame: &Frame) -> bool {
    let first = frame.image.get_pixel(0, 0).0[0];
    first.is_multiple_of(16)
        && frame
            .image
            .enumerate_pixels()
            .all(|(x, y, value)| u32::from(value.0[0]) == (x + y + u32::from(first)) & 255)
}

fn lost(arrival: &Arrival) -> Option<Fault> {
    match event(arrival) {
        Some(CameraEvent::Lost { fault, .. }) => Some(*fault),
        _ => None,
    }
}

fn is_back(arrival: &Arrival) -> bool {
    matches!(event(arrival), Some(CameraEvent::Returned { .. }))
}

#[test]
fn pictures_in_every_depth_and_packing_are_as_they_were_sent() {
    let Some(_fake) = Fake::start("127.0.0.11", "PIXELS", &[]) else { return };
    for layout in [PixelLayout::Grey, PixelLayout::Y10, PixelLayout::Y12, PixelLayout::Y16] {
        let wanted = Wanted { layout: Some(layout), ..Wanted::default() };
        let mut source = open("gige:127.0.0.11", &wanted);
        assert_eq!(source.mode().layout, layout);
        let frames = frames(&mut source, 5);
        assert!(frames.iter().all(|frame| is_pattern(frame)), "{layout:?}");
    }
    let wanted = Wanted { layout: Some(PixelLayout::Bayer), ..Wanted::default() };
    for frame in frames(&mut open("gige:127.0.0.11", &wanted), 5) {
        let first = frame.image.get_pixel(0, 0).0[0];
        assert!(first.is_multiple_of(16) && frame.image.pixels().all(|value| value.0[0] == first));
    }
}

/// Pictures, and how many were rejected, of a camera that loses this share of its packets.
fn lossy(address: &str, loss: &str, more: &[&str]) -> Option<(Vec<Arc<Frame>>, u64, String)> {
    let more: Vec<&str> = more.iter().copied().chain(["--loss", loss]).collect();
    let mut fake = Fake::start(address, "LOSSY", &more)?;
    let mut source = open(&format!("gige:{address}"), &Wanted::default());
    let frames = frames(&mut source, 60);
    let mut rejected = 0;
    let until_count = Instant::now() + Duration::from_secs(2);
    while Instant::now() < until_count {
        let arrival = source.next_frame(PATIENCE).expect("a camera never breaks");
        if let Some(CameraEvent::Counted { rejected: now, .. }) = event(&arrival) {
            rejected = *now;
        }
    }
    Some((frames, rejected, fake.say("stats")))
}

#[test]
fn a_picture_with_a_hole_never_becomes_a_picture() {
    for (address, loss, more) in [
        ("127.0.0.12", "0.01", &[] as &[&str]),
        ("127.0.0.12", "0.05", &[]),
        ("127.0.0.12", "0.01", &["--no-resend"]),
    ] {
        let Some((frames, rejected, stats)) = lossy(address, loss, more) else { return };
        let torn = frames.iter().filter(|frame| !is_pattern(frame)).count();
        println!(
            "loss {loss} {more:?}: {} pictures, {torn} torn, {rejected} rejected; {stats}",
            frames.len()
        );
        assert_eq!(torn, 0);
        assert!(stats.contains("'lost': ") && !stats.contains("'lost': 0"), "{stats}");
        assert_eq!(stats.contains("'resent': 0"), !more.is_empty(), "{stats}");
        assert!(more.is_empty() || rejected > 0, "holes are counted");
    }
}

#[test]
fn automatics_are_switched_off_and_what_changes_behind_the_back_is_told_and_put_right() {
    let Some(mut fake) = Fake::start("127.0.0.13", "LOCKED", &[]) else { return };
    let mut source = open("gige:127.0.0.13", &Wanted::default());
    let locks = locked(&mut source);
    let Lock::Locked { value: exposure } = locks.exposure else { panic!("{locks:?}") };
    assert!((8000..=8200).contains(&exposure), "{locks:?}");
    assert_eq!(locks.gain, Lock::Locked { value: 3000 });
    assert_eq!(locks.white_balance, Lock::Locked { value: 1250 });
    assert_eq!((locks.focus, locks.zoom), (Lock::Absent, Lock::Absent));
    assert!((source.mode().rate_hz().unwrap_or_default() - 30.0).abs() < 0.01);
    frames(&mut source, 1);
    fake.say("set ExposureTime 20000");
    let is_change = |arrival: &Arrival| {
        matches!(event(arrival), Some(CameraEvent::ControlChanged(change))
            if change.control == Control::Exposure && change.to == 20000)
    };
    until(&mut source, is_change);
    until(&mut source, |arrival| {
        matches!(
            event(arrival),
            Some(CameraEvent::ControlRestored { control: Control::Exposure, .. })
        )
    });
    // An automatic of the black level is one that changes the picture's brightness as gain does.
    fake.say("set BlackLevelAuto 2");
    until(
        &mut source,
        |arrival| matches!(event(arrival), Some(CameraEvent::ControlChanged(change)) if change.control == Control::Gain),
    );
    until(&mut source, |arrival| {
        matches!(event(arrival), Some(CameraEvent::ControlRestored { control: Control::Gain, .. }))
    });
    source.adjust(Control::Exposure, 5000);
    let set = until(&mut source, |arrival| {
        matches!(event(arrival), Some(CameraEvent::ControlSet { .. }))
    });
    // The camera takes steps of 0.7 µs: 7143 of them.
    let Some(Some(CameraEvent::ControlSet { lock, .. })) = set.last().map(event) else { return };
    assert_eq!(*lock, Lock::Locked { value: 5000 });
}

#[test]
fn a_camera_that_is_unplugged_comes_back_as_it_was_locked() {
    let Some(mut fake) = Fake::start("127.0.0.14", "GONE", &[]) else { return };
    let mut source = open("gige:GONE", &Wanted::default());
    let Lock::Locked { value: exposure } = locked(&mut source).exposure else {
        panic!("not locked")
    };
    frames(&mut source, 3);
    fake.say("silent");
    let seen = until(&mut source, |arrival| lost(arrival).is_some());
    assert_eq!(seen.last().and_then(lost), Some(Fault::Unplugged));
    // Power-up: every setting is forgotten.
    fake.say("reset");
    fake.say("speaking");
    until(&mut source, is_back);
    assert!(frames(&mut source, 3).iter().all(|frame| is_pattern(frame)));
    let changed = source.next_frame(PATIENCE).expect("goes on");
    assert!(
        !matches!(event(&changed), Some(CameraEvent::ControlChanged(_))),
        "{exposure}: {changed:?}"
    );
    // The plug out and in at once: nothing was silent, but the stream is gone.
    fake.say("reset");
    let seen = until(&mut source, |arrival| lost(arrival).is_some());
    assert_eq!(seen.last().and_then(lost), Some(Fault::Unplugged));
    until(&mut source, is_back);
    frames(&mut source, 1);
    // Killed, and another one of the same serial number at another address.
    drop(fake);
    until(&mut source, |arrival| lost(arrival).is_some());
    let _again = Fake::start("127.0.0.15", "GONE", &[]);
    until(&mut source, is_back);
    frames(&mut source, 1);
}

#[test]
fn cameras_are_told_apart_by_every_name_and_one_in_use_says_so() {
    let Some(mut one) = Fake::start("127.0.0.16", "TWO-1", &["--name", "left"]) else { return };
    let Some(_two) = Fake::start("127.0.0.17", "TWO-2", &["--size", "160x120", "--packet", "1500"])
    else {
        return;
    };
    let any = Wanted::default();
    let mut first = open("gige:left", &any);
    let mut second = open("gige:TWO-2", &any);
    assert_eq!(first.identity().name, "gige:TWO-1");
    assert_eq!(second.mode().size, ImageSize { width_px: 160, height_px: 120 });
    for _ in 0..3 {
        assert!(frames(&mut first, 1).iter().all(|frame| is_pattern(frame)));
        assert!(frames(&mut second, 1).iter().all(|frame| is_pattern(frame)));
    }
    let (fault, _) = opened("gige:127.0.0.16", &any).err().expect("it's in use");
    assert_eq!(fault, Fault::Busy);
    drop(first);
    one.wait_for("stopped");
    one.wait_for("released");
    assert_eq!(opened("gige:127.0.0.18", &any).err().map(|err| err.0), Some(Fault::Unreachable));
    let (fault, detail) = opened("gige:nobody", &any).err().expect("nobody");
    assert_eq!(fault, Fault::NotFound);
    assert!(detail.contains("gige:TWO-2"), "{detail}");
}

#[test]
fn times_are_the_cameras_own() {
    let Some(_fake) = Fake::start("127.0.0.19", "TIMES", &[]) else { return };
    let wanted = Wanted { rate_hz: Some(20.0), ..Wanted::default() };
    let frames = frames(&mut open("gige:127.0.0.19", &wanted), 60);
    let times: Vec<u64> = frames.iter().map(|frame| frame.captured_at.nanos).collect();
    assert!(times.is_sorted_by(|a, b| a < b));
    // Whenever they came, they were taken 50 ms apart, or a multiple of it. While one comes sooner than all before, the
    // camera's clock is only being found.
    let period = 50_000_000;
    let off = |pair: &[u64]| {
        let passed = pair[1] - pair[0];
        passed.abs_diff((passed + period / 2) / period * period)
    };
    let even = times[30..].windows(2).filter(|pair| off(pair) < period / 25).count();
    assert!(even >= 20, "{even} of 29: {times:?}");
}

/// Aravis' fake camera: another make, with its own pattern and its own description of itself.
#[test]
fn aravis_fake_camera_is_read_to_the_bit() {
    struct Killed(Child);
    impl Drop for Killed {
        fn drop(&mut self) {
            self.0.kill().ok();
            self.0.wait().ok();
        }
    }
    let fake = Command::new("arv-fake-gv-camera-0.8")
        .args(["-i", "127.0.0.1", "-s", "ARAVIS", "-r", "3"])
        .spawn();
    let Ok(_fake) = fake.map(Killed) else { return skipped("aravis-tools") };
    let size = ImageSize { width_px: 512, height_px: 512 };
    let began = Instant::now();
    let mut source = loop {
        match opened("gige:127.0.0.1", &Wanted { size: Some(size), ..Wanted::default() }) {
            Ok(source) => break source,
            Err(_) if began.elapsed() < LONGEST => {}
            Err((fault, detail)) => panic!("{fault:?}, {detail}"),
        }
    };
    assert_eq!(source.identity().name, "gige:ARAVIS");
    let locks = locked(&mut source);
    assert!(matches!(locks.exposure, Lock::Locked { .. }), "{locks:?}");
    assert!(matches!(locks.gain, Lock::Locked { .. }), "{locks:?}");
    // A ramp that moves by one from picture to picture. It loses three packets of a thousand, and sends none again.
    for frame in frames(&mut source, 40) {
        let (width, _) = frame.image.dimensions();
        let first = u32::from(frame.image.get_pixel(0, 0).0[0]);
        let wrong = frame
            .image
            .enumerate_pixels()
            .filter(|(x, y, value)| u32::from(value.0[0]) != (x + first + y) % 255);
        assert_eq!(wrong.count(), 0, "{width} px wide, first {first}");
    }
}
