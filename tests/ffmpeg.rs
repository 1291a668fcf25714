//! Streams and video files are read through a child program that always ends.

#![cfg(unix)]
#![expect(clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

use std::{fs, os::unix::fs::PermissionsExt, path::Path, process::Command, time::Duration};

use boresight::{
    capture::{Arrival, CaptureError, Ffmpeg, FrameSource},
    device::Fault,
};
use tempfile::TempDir;

const PATIENCE: Duration = Duration::from_secs(5);

/// A program in ffmpeg's place that does what `script` says; it writes its number to `pid`.
fn stand_in(place: &Path, script: &str) -> String {
    let path = place.join("ffmpeg");
    let pid = place.join("pid");
    fs::write(&path, format!("#!/bin/sh\necho $$ > {}\n{script}\n", pid.display()))
        .expect("written");
    fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).expect("set");
    path.display().to_string()
}

/// Whether the stand-in still runs.
fn runs(place: &Path) -> bool {
    let pid = fs::read_to_string(place.join("pid")).expect("it has run");
    Path::new("/proc").join(pid.trim()).exists()
}

/// One picture of 4 by 2 pixels.
const PICTURE: &str = "printf 'P5\\n4 2\\n255\\nabcdefgh'";

fn refused(program: &str, name: &str) -> Fault {
    match Ffmpeg::open_with(program, name) {
        Err(CaptureError::Camera { fault, .. }) => fault,
        Err(other) => panic!("{other}"),
        Ok(_) => panic!("it was opened"),
    }
}

#[test]
fn pictures_arrive_whole_and_the_end_is_an_end() {
    let place = TempDir::new().expect("folder");
    let halves = "printf 'P5\\n4 '; sleep 0.1; printf '2\\n255\\nijkl'; sleep 0.1; printf 'mnop'";
    let program = stand_in(place.path(), &format!("{PICTURE}; {halves}"));
    let mut source = Ffmpeg::open_with(&program, "clip.mp4").expect("opens");
    assert!(source.waits());
    let mut seen = Vec::new();
    loop {
        match source.next_frame(PATIENCE).expect("whole") {
            Arrival::Frame(frame) => seen.push(frame.image.as_raw().clone()),
            Arrival::End => break,
            other => panic!("{other:?}"),
        }
    }
    assert_eq!(seen, [b"abcdefgh", b"ijklmnop"]);
}

#[test]
fn the_program_is_ended_with_its_source() {
    let place = TempDir::new().expect("folder");
    let program = stand_in(place.path(), &format!("{PICTURE}; exec sleep 1000"));
    let source = Ffmpeg::open_with(&program, "rtsp://camera/1").expect("opens");
    assert!(!source.waits() && runs(place.path()));
    drop(source);
    assert!(!runs(place.path()));
}

#[test]
fn what_goes_wrong_is_named() {
    let place = TempDir::new().expect("folder");
    assert_eq!(refused("no such program anywhere", "clip.mp4"), Fault::NoReader);
    let says = stand_in(place.path(), "echo 'Connection refused' >&2; exit 1");
    match Ffmpeg::open_with(&says, "rtsp://camera/1") {
        Err(CaptureError::Camera { fault: Fault::ReaderFailed, detail }) => {
            assert_eq!(detail, "Connection refused");
        }
        _ => panic!("another error"),
    }
    for nonsense in
        ["printf 'P6\\n4 2\\n255\\nabcdefgh'", "printf 'P5\\n99999 2\\n255\\n'", "printf 'P5\\nx'"]
    {
        let program = stand_in(place.path(), &format!("{nonsense}; exec sleep 1000"));
        assert_eq!(refused(&program, "clip.mp4"), Fault::ReaderFailed, "{nonsense}");
        assert!(!runs(place.path()));
    }
    // Cut in a picture: the part is no picture.
    let cut = stand_in(place.path(), &format!("{PICTURE}; printf 'P5\\n4 2\\n255\\nabc'"));
    let mut source = Ffmpeg::open_with(&cut, "clip.mp4").expect("opens");
    assert!(matches!(source.next_frame(PATIENCE), Ok(Arrival::Frame(_))));
    assert!(matches!(source.next_frame(PATIENCE), Ok(Arrival::End)));
}

#[test]
fn a_silent_stream_is_given_up() {
    let place = TempDir::new().expect("folder");
    let program = stand_in(place.path(), &format!("{PICTURE}; exec sleep 1000"));
    let mut source = Ffmpeg::open_with(&program, "rtsp://camera/1").expect("opens");
    assert!(matches!(source.next_frame(PATIENCE), Ok(Arrival::Frame(_))));
    let stalled = source.next_frame(PATIENCE);
    assert!(
        matches!(stalled, Err(CaptureError::Camera { fault: Fault::Stalled, .. })),
        "{stalled:?}"
    );
}

#[test]
fn ffmpeg_itself_reads_a_file() {
    let place = TempDir::new().expect("folder");
    let clip = place.path().join("clip.mp4");
    let made = Command::new("ffmpeg")
        .args([
            "-loglevel",
            "error",
            "-f",
            "lavfi",
            "-i",
            "testsrc=size=320x240:rate=30:duration=1",
        ])
        .args(["-c:v", "mpeg4", "-y"])
        .arg(&clip)
        .status();
    if !made.is_ok_and(|status| status.success()) {
        println!("ffmpeg is not installed: its own part is left out");
        return;
    }
    let mut source = Ffmpeg::open(&clip.display().to_string()).expect("opens");
    let mut frames = 0;
    while let Arrival::Frame(frame) = source.next_frame(PATIENCE).expect("whole") {
        assert_eq!(frame.image.dimensions(), (320, 240));
        frames += 1;
    }
    assert!((28..=32).contains(&frames), "{frames} frames");
}
