//! Streams and video files are read through a child program that always ends.

use std::{
    fs,
    io::{BufRead, BufReader, Read, Write},
    net::TcpListener,
    os::unix::fs::PermissionsExt,
    path::Path,
    process::{Command, Stdio},
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    thread::Builder,
    time::Duration,
};

use boresight::{
    capture::{Arrival, CaptureError, Ffmpeg, FrameSource},
    device::{CameraEvent, Fault},
    frame::CaptureTime,
};
use image::{GrayImage, Luma, codecs::jpeg::JpegEncoder};
use tempfile::TempDir;

use crate::pictures::{PAIRS, picture};

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
    let stands_in = stand_in(place.path(), &format!("{PICTURE}; {halves}"));
    let mut source = Ffmpeg::open_with(&stands_in, "clip.mp4").expect("opens");
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
    let stands_in = stand_in(place.path(), &format!("{PICTURE}; exec sleep 1000"));
    let source = Ffmpeg::open_with(&stands_in, "rtsp://camera/1").expect("opens");
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
        let stands_in = stand_in(place.path(), &format!("{nonsense}; exec sleep 1000"));
        assert_eq!(refused(&stands_in, "clip.mp4"), Fault::ReaderFailed, "{nonsense}");
        assert!(!runs(place.path()));
    }
    // Cut in a picture: the part is no picture.
    let cut = stand_in(place.path(), &format!("{PICTURE}; printf 'P5\\n4 2\\n255\\nabc'"));
    let mut source = Ffmpeg::open_with(&cut, "clip.mp4").expect("opens");
    assert!(matches!(source.next_frame(PATIENCE), Ok(Arrival::Frame(_))));
    assert!(matches!(source.next_frame(PATIENCE), Ok(Arrival::End)));
}

/// Arrivals until one is as wanted.
fn until(source: &mut Ffmpeg, wanted: impl Fn(&Arrival) -> bool) -> Vec<Arrival> {
    let mut seen = Vec::new();
    loop {
        seen.push(source.next_frame(PATIENCE).expect("a stream never breaks"));
        if seen.last().is_some_and(&wanted) {
            return seen;
        }
    }
}

fn frame_number(arrival: &Arrival) -> Option<u64> {
    match arrival {
        Arrival::Frame(frame) => Some(frame.id.0),
        _ => None,
    }
}

fn lost(arrival: &Arrival) -> Option<(Fault, &str)> {
    match arrival {
        Arrival::Event(CameraEvent::Lost { fault, detail }) => Some((*fault, detail)),
        _ => None,
    }
}

fn returned(arrival: &Arrival) -> Option<CaptureTime> {
    match arrival {
        Arrival::Event(CameraEvent::Returned { good_from, .. }) => Some(*good_from),
        _ => None,
    }
}

/// What the program does at its first, second, … start.
fn start_by_start(place: &Path, starts: &[&str]) -> String {
    let count = place.join("starts");
    let count = count.display();
    let cases: Vec<String> =
        starts.iter().enumerate().map(|(at, what)| format!("{}) {what};;", at + 1)).collect();
    let cases = cases.join("\n");
    stand_in(place, &format!("echo >> {count}\ncase $(wc -l < {count}) in\n{cases}\nesac"))
}

#[test]
fn a_silent_stream_is_lost_and_its_program_ended() {
    let place = TempDir::new().expect("folder");
    let stands_in = stand_in(place.path(), &format!("{PICTURE}; exec sleep 1000"));
    let mut source = Ffmpeg::open_with(&stands_in, "rtsp://camera/1").expect("opens");
    until(&mut source, |arrival| frame_number(arrival).is_some());
    let first = fs::read_to_string(place.path().join("pid")).expect("it has run");
    let seen = until(&mut source, |arrival| lost(arrival).is_some());
    let last = seen.last().and_then(lost);
    assert_eq!(last, Some((Fault::StreamLost, "nothing for 5 s")));
    assert!(!Path::new("/proc").join(first.trim()).exists());
    until(&mut source, |arrival| returned(arrival).is_some());
    drop(source);
    assert!(!runs(place.path()));
}

#[test]
fn a_stream_that_ends_is_asked_for_until_it_is_back() {
    let place = TempDir::new().expect("folder");
    let refused = "echo 'Connection refused' >&2; exit 1";
    let smaller = "printf 'P5\\n2 2\\n255\\nabcd'; exec sleep 1000";
    let back = format!("{PICTURE}; exec sleep 1000");
    let starts = [PICTURE, refused, refused, smaller, &back];
    let stands_in = start_by_start(place.path(), &starts);
    let mut source = Ffmpeg::open_with(&stands_in, "http://camera/1").expect("opens");
    let seen = until(&mut source, |arrival| returned(arrival).is_some());
    let told: Vec<Fault> = seen.iter().filter_map(lost).map(|(fault, _)| fault).collect();
    assert_eq!(told, [Fault::StreamLost, Fault::OtherMode], "each reason once: {seen:?}");
    assert!(matches!(seen.first(), Some(Arrival::Event(CameraEvent::Started { .. }))));
    assert_eq!(seen.iter().filter_map(frame_number).collect::<Vec<_>>(), [0]);
    let good_from = seen.last().and_then(returned).expect("it is back");
    let seen = until(&mut source, |arrival| frame_number(arrival).is_some());
    let Some(Arrival::Frame(frame)) = seen.last() else { panic!("a frame") };
    assert!(frame.id.0 > 0, "no number comes twice");
    assert!(frame.captured_at >= good_from);
    // Four pauses, the shortest of half a second.
    assert!(frame.captured_at.nanos > 2_000_000_000, "{:?}", frame.captured_at);
    drop(source);
    assert!(!runs(place.path()));
}

#[test]
fn a_stream_that_is_away_can_be_left() {
    let place = TempDir::new().expect("folder");
    let stands_in = start_by_start(place.path(), &[PICTURE]);
    let mut source = Ffmpeg::open_with(&stands_in, "http://camera/1").expect("opens");
    let seen = until(&mut source, |arrival| lost(arrival).is_some());
    assert_eq!(seen.last().and_then(lost), Some((Fault::StreamLost, "")));
    // It ends at once whenever it is asked for again; nobody is told twice.
    let quiet = || fs::read_to_string(place.path().join("starts")).map_or(0, |text| text.len()) < 3;
    while quiet() {
        let arrival = source.next_frame(PATIENCE).expect("goes on");
        assert!(matches!(arrival, Arrival::NothingYet), "{arrival:?}");
    }
    drop(source);
    assert!(!runs(place.path()));
}

fn has_ffmpeg() -> bool {
    let found = Command::new("ffmpeg").arg("-version").output().is_ok();
    if !found {
        println!("ffmpeg is not installed: its own part is left out");
    }
    found
}

/// A network camera: pictures as motion JPEG over HTTP, to everyone who asks, while it is `up`.
fn network_camera(up: &Arc<AtomicBool>, picture: &GrayImage) -> String {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = format!("http://{}/video.mjpg", listener.local_addr().expect("bound"));
    let up = Arc::clone(up);
    let mut jpeg = Vec::new();
    JpegEncoder::new_with_quality(&mut jpeg, 90).encode_image(picture).expect("encodes");
    let serve = move || {
        for client in listener.incoming() {
            let mut client = client.expect("a client");
            if !up.load(Ordering::SeqCst) {
                continue;
            }
            let mut request = [0; 2048];
            let head = "HTTP/1.0 200 OK\r\nContent-Type: multipart/x-mixed-replace; boundary=frame\r\n\r\n";
            let began = client.read(&mut request).and_then(|_| client.write_all(head.as_bytes()));
            let mut sent = began;
            while sent.is_ok() && up.load(Ordering::SeqCst) {
                let head = format!(
                    "--frame\r\nContent-Type: image/jpeg\r\nContent-Length: {}\r\n\r\n",
                    jpeg.len()
                );
                sent = client
                    .write_all(head.as_bytes())
                    .and_then(|()| client.write_all(&jpeg))
                    .and_then(|()| client.write_all(b"\r\n"));
                // The camera's rate.
                std::thread::sleep(Duration::from_millis(33));
            }
        }
    };
    Builder::new().name("network camera".into()).spawn(serve).expect("a thread");
    address
}

#[test]
fn ffmpeg_itself_loses_a_network_camera_and_finds_it_again() {
    if !has_ffmpeg() {
        return;
    }
    let up = Arc::new(AtomicBool::new(true));
    let picture = GrayImage::from_fn(320, 240, |x, y| Luma([(x ^ y) as u8]));
    let address = network_camera(&up, &picture);
    let mut source = Ffmpeg::open(&address).expect("opens");
    for _ in 0..2 {
        until(&mut source, |arrival| frame_number(arrival).is_some());
        up.store(false, Ordering::SeqCst);
        let seen = until(&mut source, |arrival| lost(arrival).is_some());
        assert_eq!(seen.last().and_then(lost).map(|(fault, _)| fault), Some(Fault::StreamLost));
        up.store(true, Ordering::SeqCst);
        let seen = until(&mut source, |arrival| returned(arrival).is_some());
        assert!(seen.iter().all(|arrival| frame_number(arrival).is_none()), "{seen:?}");
    }
    let seen = until(&mut source, |arrival| frame_number(arrival).is_some());
    let Some(Arrival::Frame(frame)) = seen.last() else { panic!("a frame") };
    assert_eq!(frame.image.dimensions(), (320, 240));
}

#[test]
fn a_session_outlives_its_network_camera() {
    if !has_ffmpeg() {
        return;
    }
    let place = TempDir::new().expect("folder");
    let up = Arc::new(AtomicBool::new(true));
    let (tilt_deg, slot_deg) = PAIRS[0];
    let address = network_camera(&up, &picture(tilt_deg, slot_deg));
    let arguments = ["guide", "--headless", "--out", "session", "--source", &address];
    let mut child = Command::new(env!("CARGO_BIN_EXE_boresight"))
        .current_dir(place.path())
        .args(arguments)
        .stdin(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .expect("started");
    let mut lines = BufReader::new(child.stderr.take().expect("piped")).lines();
    let mut said = Vec::new();
    let mut wait_for = |words: &str| {
        while !said.last().is_some_and(|line: &String| line.contains(words)) {
            let line = lines.next().and_then(Result::ok);
            said.push(line.unwrap_or_else(|| panic!("never {words:?}: {said:#?}")));
        }
        said.last().cloned().unwrap_or_default()
    };
    wait_for("Taken: view 1");
    up.store(false, Ordering::SeqCst);
    let line = wait_for("NET-LOST");
    assert!(line.contains("The network stream has stopped") && line.contains("Wait:"), "{line}");
    up.store(true, Ordering::SeqCst);
    wait_for("The camera is back.");
    let sent = Command::new("kill").arg("-INT").arg(child.id().to_string()).status();
    assert!(sent.expect("kill is there").success());
    wait_for("Result:");
    lines.for_each(drop);
    child.wait().expect("ended");
    let journal = fs::read_to_string(place.path().join("session/journal.jsonl")).expect("there");
    assert_eq!(journal.matches("NET-LOST").count(), 1);
    let frames = fs::read_dir(place.path().join("session/frames")).expect("there");
    assert_eq!(frames.count(), 1, "the view is kept");
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
