//! Streams and video files, read through a child program of guaranteed end.

use std::{fs, os::unix::fs::PermissionsExt, path::Path, process::Command, time::Duration};

use boresight::{
    capture::{Arrival, CaptureError, Ffmpeg, FrameSource},
    device::{CameraEvent, Fault},
    frame::CaptureTime,
};
use tempfile::TempDir;

pub(crate) const PATIENCE: Duration = Duration::from_secs(5);

/// A program in ffmpeg's place running `script`; it writes its number to `pid`.
fn stand_in(place: &Path, script: &str) -> String {
    let path = place.join("ffmpeg");
    let pid = place.join("pid");
    fs::write(&path, format!("#!/bin/sh\necho $$ > {}\n{script}\n", pid.display()))
        .expect("written");
    fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).expect("set");
    path.display().to_string()
}

/// True while the stand-in runs.
fn runs(place: &Path) -> bool {
    let pid = fs::read_to_string(place.join("pid")).expect("it has run");
    Path::new("/proc").join(pid.trim()).exists()
}

/// A picture of 4 by 2 pixels.
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
fn a_file_whose_times_run_back_ends_after_all_its_pictures() {
    let place = TempDir::new().expect("folder");
    // ffmpeg 5.1's messages about a remuxed AVI, and about a cut file.
    let times = "[image2pipe @ 0x55f6] Application provided invalid, non monotonically increasing dts to muxer in stream 0: 9 >= 6";
    let cut = "[matroska,webm @ 0x55f6] File ended prematurely";
    for (said, is_whole) in [(times, true), (cut, false)] {
        let stands_in = stand_in(place.path(), &format!("{PICTURE}; echo '{said}' >&2"));
        let mut source = Ffmpeg::open_with(&stands_in, "clip.mp4").expect("opens");
        assert!(matches!(source.next_frame(PATIENCE), Ok(Arrival::Frame(_))));
        let end = source.next_frame(PATIENCE);
        assert_eq!(matches!(end, Ok(Arrival::End)), is_whole, "{said}: {end:?}");
    }
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
        Err(CaptureError::Camera { fault: Fault::Unreachable, detail }) => {
            assert_eq!(detail, "connection refused");
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

/// Arrivals up to the first `wanted` arrival.
pub(crate) fn until(source: &mut Ffmpeg, wanted: impl Fn(&Arrival) -> bool) -> Vec<Arrival> {
    let mut seen = Vec::new();
    loop {
        seen.push(source.next_frame(PATIENCE).expect("a stream never breaks"));
        if seen.last().is_some_and(&wanted) {
            return seen;
        }
    }
}

pub(crate) fn frame_number(arrival: &Arrival) -> Option<u64> {
    match arrival {
        Arrival::Frame(frame) => Some(frame.id.0),
        _ => None,
    }
}

pub(crate) fn lost(arrival: &Arrival) -> Option<(Fault, &str)> {
    match arrival {
        Arrival::Event(CameraEvent::Lost { fault, detail }) => Some((*fault, detail)),
        _ => None,
    }
}

pub(crate) fn returned(arrival: &Arrival) -> Option<CaptureTime> {
    match arrival {
        Arrival::Event(CameraEvent::Returned { good_from, .. }) => Some(*good_from),
        _ => None,
    }
}

/// Scripts of the program for the first, second, … start.
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
fn a_file_that_falls_silent_is_no_camera_to_unplug() {
    let place = TempDir::new().expect("folder");
    let stands_in = stand_in(place.path(), &format!("{PICTURE}; exec sleep 1000"));
    let mut source = Ffmpeg::open_with(&stands_in, "clip.mp4").expect("opens");
    let loss = loop {
        match source.next_frame(PATIENCE) {
            Ok(Arrival::Frame(_) | Arrival::NothingYet) => {}
            Err(CaptureError::Camera { fault, detail }) => break (fault, detail),
            other => panic!("{other:?}"),
        }
    };
    assert_eq!(loss, (Fault::ReaderFailed, "nothing for 5 s".into()));
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
    assert_eq!(told, [Fault::StreamLost, Fault::OtherSize], "each reason once: {seen:?}");
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
    // The program ends at once at each restart; the person is told once.
    let quiet = || fs::read_to_string(place.path().join("starts")).map_or(0, |text| text.len()) < 3;
    while quiet() {
        let arrival = source.next_frame(PATIENCE).expect("goes on");
        assert!(matches!(arrival, Arrival::NothingYet), "{arrival:?}");
    }
    drop(source);
    assert!(!runs(place.path()));
}

#[test]
fn words_of_the_program_are_for_people() {
    let place = TempDir::new().expect("folder");
    let says = stand_in(
        place.path(),
        "echo '[h264 @ 0x55ff01] co located POCs unavailable' >&2; \
         echo '[tcp @ 0x55ff02] Nothing good from tcp://admin:s3cret@cam:554?timeout=0' >&2; \
         echo 'rtsp://admin:s3cret@cam/1: It is odd' >&2; \
         echo 'rtsp://admin:s3cret@cam/1: It is odd' >&2; exit 1",
    );
    match Ffmpeg::open_with(&says, "rtsp://admin:s3cret@cam/1") {
        Err(CaptureError::Camera { fault: Fault::ReaderFailed, detail }) => {
            assert_eq!(detail, "Nothing good from tcp://cam:554; rtsp://cam/1: It is odd");
        }
        _ => panic!("another error"),
    }
}

#[test]
fn a_file_that_breaks_off_is_told_from_one_that_is_none() {
    let place = TempDir::new().expect("folder");
    let fails = "echo 'clip.mp4: Invalid data found when processing input' >&2; exit 1";
    let none = stand_in(place.path(), fails);
    match Ffmpeg::open_with(&none, "clip.mp4") {
        Err(CaptureError::Camera { fault: Fault::ReaderFailed, detail }) => {
            assert_eq!(detail, "not a video that ffmpeg can read");
        }
        _ => panic!("it was opened"),
    }
    let cut = stand_in(place.path(), &format!("{PICTURE}; {fails}"));
    let mut source = Ffmpeg::open_with(&cut, "clip.mp4").expect("opens");
    assert!(matches!(source.next_frame(PATIENCE), Ok(Arrival::Frame(_))));
    match source.next_frame(PATIENCE) {
        Err(CaptureError::Camera { fault: Fault::ReaderFailed, detail }) => {
            assert_eq!(detail, "it's damaged after picture 1");
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_header_without_an_end_is_given_up() {
    let place = TempDir::new().expect("folder");
    let digits = stand_in(place.path(), "printf 'P5\\n'; exec tr '\\0' 1 < /dev/zero");
    assert_eq!(refused(&digits, "clip.mp4"), Fault::ReaderFailed);
    assert!(!runs(place.path()));
}

/// A clip made by ffmpeg from `filter`.
fn clip(place: &Path, filter: &str) -> String {
    let path = place.join("clip.mkv").display().to_string();
    let made = Command::new("ffmpeg")
        .args(["-loglevel", "error", "-f", "lavfi", "-i", filter, "-fps_mode", "passthrough"])
        .args(["-c:v", "mpeg4", "-q:v", "2", "-y", &path])
        .status();
    assert!(made.expect("ffmpeg is installed").success(), "{filter}");
    path
}

/// Times of all frames of a file, in milliseconds from the first.
fn times_ms(path: &str) -> Vec<u64> {
    let mut source = Ffmpeg::open(path).expect("opens");
    let mut times = Vec::new();
    loop {
        match source.next_frame(PATIENCE).expect("whole") {
            Arrival::Frame(frame) => {
                assert_eq!(frame.image.dimensions(), (320, 240));
                times.push(frame.captured_at.nanos);
            }
            Arrival::NothingYet => {}
            Arrival::End => break,
            other => panic!("{other:?}"),
        }
    }
    times.iter().map(|nanos| (nanos - times[0] + 500_000) / 1_000_000).collect()
}

#[test]
fn a_slow_file_has_its_own_frames_and_times() {
    let place = TempDir::new().expect("folder");
    let path = clip(place.path(), "testsrc=size=320x240:rate=10:duration=2");
    assert_eq!(times_ms(&path), (0..20).map(|n| 100 * n).collect::<Vec<u64>>());
}

#[test]
fn an_uneven_file_has_its_own_times() {
    let place = TempDir::new().expect("folder");
    // Of 20 frames per second, those left out make gaps of 100 and 150 ms.
    let path = clip(
        place.path(),
        "testsrc=size=320x240:rate=20:duration=1,select='eq(n,0)+eq(n,1)+eq(n,3)+eq(n,6)+eq(n,7)'",
    );
    assert_eq!(times_ms(&path), [0, 50, 150, 300, 350]);
}

#[test]
fn a_fast_file_is_thinned_to_30_per_second_at_most() {
    let place = TempDir::new().expect("folder");
    let path = clip(place.path(), "testsrc=size=320x240:rate=60:duration=1");
    let times = times_ms(&path);
    assert_eq!(times.len(), 30, "{times:?}");
    assert!(times.windows(2).all(|pair| (33..=34).contains(&(pair[1] - pair[0]))), "{times:?}");
}

#[test]
fn a_picture_that_comes_again_is_not_another_frame() {
    let place = TempDir::new().expect("folder");
    let other = "printf 'P5\\n4 2\\n255\\nijklmnop'";
    let stands_in = stand_in(place.path(), &format!("{PICTURE}; {PICTURE}; {PICTURE}; {other}"));
    let mut source = Ffmpeg::open_with(&stands_in, "clip.mp4").expect("opens");
    let mut seen = Vec::new();
    loop {
        match source.next_frame(PATIENCE).expect("whole") {
            Arrival::Frame(frame) => seen.push(frame.image.as_raw().clone()),
            Arrival::NothingYet => {}
            Arrival::End => break,
            other => panic!("{other:?}"),
        }
    }
    assert_eq!(seen, [b"abcdefgh", b"ijklmnop"]);
}

#[test]
fn a_talkative_program_is_neither_stopped_nor_stored() {
    let place = TempDir::new().expect("folder");
    // Far more than a pipe holds, before the first picture and after it.
    let talk = "i=0; while [ $i -lt 4000 ]; do echo \"message $i: a packet was lost on the way\" >&2; i=$((i+1)); done";
    let stands_in = stand_in(place.path(), &format!("{talk}; {PICTURE}; {talk}; exit 1"));
    let mut source = Ffmpeg::open_with(&stands_in, "clip.mp4").expect("opens");
    let detail = loop {
        match source.next_frame(PATIENCE) {
            Ok(Arrival::Frame(_) | Arrival::NothingYet) => {}
            Err(CaptureError::Camera { fault: Fault::ReaderFailed, detail }) => break detail,
            other => panic!("{other:?}"),
        }
    };
    assert!(detail.len() <= 8192, "{} bytes", detail.len());
    assert!(detail.ends_with("message 3999: a packet was lost on the way"), "{detail}");
}
