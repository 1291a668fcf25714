//! What the tests of cameras in other processes share: the process, and arrivals until one is as
//! wanted.

#![expect(clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]
#![allow(dead_code, reason = "no test program uses all of it")]

use std::{
    io::{BufRead, BufReader, Write},
    process::{Child, ChildStdin, ChildStdout, Command, Stdio},
    sync::Arc,
    time::{Duration, Instant},
};

use boresight_capture::{Arrival, FrameSource};
use boresight_geometry::{
    device::{CameraEvent, Fault},
    frame::Frame,
};

pub(crate) const PATIENCE: Duration = Duration::from_millis(100);
/// Time for anything that is waited for: the computer may be busy.
pub(crate) const LONGEST: Duration = Duration::from_secs(60);

/// A camera in another process, which says what happens, a line each.
pub(crate) struct Fake {
    child: Child,
    commands: ChildStdin,
    lines: BufReader<ChildStdout>,
}

impl Fake {
    /// The script beside the tests; `None` if there is no such Python.
    pub(crate) fn script(python: &str, script: &str, arguments: &[&str]) -> Option<Self> {
        let script = format!("{}/tests/{script}", env!("CARGO_MANIFEST_DIR"));
        Self::start(python, &[&[script.as_str()][..], arguments].concat())
    }

    /// `None` if there is no such program.
    pub(crate) fn start(program: &str, arguments: &[&str]) -> Option<Self> {
        let child = Command::new(program)
            .args(arguments)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn();
        let Ok(mut child) = child else {
            skipped(program);
            return None;
        };
        let commands = child.stdin.take().expect("piped");
        let lines = BufReader::new(child.stdout.take().expect("piped"));
        let mut fake = Self { child, commands, lines };
        fake.wait_for("ready");
        Some(fake)
    }

    pub(crate) fn wait_for(&mut self, word: &str) -> String {
        loop {
            let mut line = String::new();
            let read = self.lines.read_line(&mut line).expect("it speaks");
            assert!(read > 0, "it ended before {word:?}");
            if line.starts_with(word) {
                return line;
            }
        }
    }

    pub(crate) fn say(&mut self, command: &str) -> String {
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

pub(crate) fn skipped(what: &str) {
    assert!(std::env::var_os("CI").is_none(), "{what} is missing");
    eprintln!("skipped: {what} is missing");
}

/// Arrivals until one is as wanted.
pub(crate) fn until(
    source: &mut dyn FrameSource,
    wanted: impl Fn(&Arrival) -> bool,
) -> Vec<Arrival> {
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

pub(crate) fn event(arrival: &Arrival) -> Option<&CameraEvent> {
    match arrival {
        Arrival::Event(event) => Some(event),
        _ => None,
    }
}

pub(crate) fn frame(arrival: &Arrival) -> Option<&Arc<Frame>> {
    match arrival {
        Arrival::Frame(frame) => Some(frame),
        _ => None,
    }
}

pub(crate) fn frames(source: &mut dyn FrameSource, count: usize) -> Vec<Arc<Frame>> {
    let mut all = Vec::new();
    while all.len() < count {
        let seen = until(source, |arrival| frame(arrival).is_some());
        all.extend(seen.last().and_then(frame).cloned());
    }
    all
}

pub(crate) fn lost(arrival: &Arrival) -> Option<Fault> {
    match event(arrival) {
        Some(CameraEvent::Lost { fault, .. }) => Some(*fault),
        _ => None,
    }
}

/// The fault by which the camera is lost, as soon as it is.
pub(crate) fn until_lost(source: &mut dyn FrameSource) -> Option<Fault> {
    until(source, |arrival| lost(arrival).is_some()).last().and_then(lost)
}

/// What comes until the camera is back.
pub(crate) fn until_back(source: &mut dyn FrameSource) -> Vec<Arrival> {
    until(source, |arrival| matches!(event(arrival), Some(CameraEvent::Returned { .. })))
}

/// True if the picture is one of the fakes' pattern, every pixel.
pub(crate) fn is_pattern(frame: &Frame) -> bool {
    let first = frame.image.get_pixel(0, 0).0[0];
    first.is_multiple_of(16)
        && frame
            .image
            .enumerate_pixels()
            .all(|(x, y, value)| u32::from(value.0[0]) == (x + y + u32::from(first)) & 255)
}
