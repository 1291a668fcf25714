//! Faulty videos: ffmpeg reads them in its own way, and its hidden errors are found out.

use std::{
    fs,
    os::unix::fs::PermissionsExt,
    path::Path,
    process::Command,
    time::{Duration, Instant},
};

use boresight::{
    capture::{Arrival, CaptureError, Ffmpeg, FrameSource},
    device::Fault,
};
use tempfile::TempDir;

use crate::ffmpeg::PATIENCE;

fn ffmpeg(place: &Path, arguments: &str) {
    let made = Command::new("ffmpeg")
        .current_dir(place)
        .args(["-loglevel", "error", "-y"])
        .args(arguments.split_whitespace())
        .status();
    assert!(made.expect("ffmpeg is installed").success(), "{arguments}");
}

/// Widths and heights of pictures, in pixels.
type Sizes = Vec<(u32, u32)>;

/// Sizes of the frames until the end, or the final error.
fn read(place: &Path, name: &str) -> (Sizes, Option<(Fault, String)>) {
    let mut sizes = Vec::new();
    let mut source = Ffmpeg::open(&place.join(name).display().to_string()).expect("opens");
    loop {
        match source.next_frame(PATIENCE) {
            Ok(Arrival::Frame(frame)) => sizes.push(frame.image.dimensions()),
            Ok(Arrival::End) => return (sizes, None),
            Ok(_) => {}
            Err(CaptureError::Camera { fault, detail }) => return (sizes, Some((fault, detail))),
            Err(other) => panic!("{other}"),
        }
    }
}

#[test]
fn time_codes_and_makers_are_no_failure() {
    let place = TempDir::new().expect("folder");
    ffmpeg(
        place.path(),
        "-f lavfi -i testsrc=size=320x240:rate=10:duration=1 -c:v mpeg2video -q:v 2 tape.ts",
    );
    let (sizes, end) = read(place.path(), "tape.ts");
    assert_eq!(end, None);
    assert!(sizes.len() >= 9, "{sizes:?}");
}

#[test]
fn a_size_that_changes_in_the_stream_is_not_stretched() {
    let place = TempDir::new().expect("folder");
    for (name, size) in [("a.ts", "320x240"), ("b.ts", "320x180")] {
        let clip =
            format!("-f lavfi -i testsrc=size={size}:rate=10:duration=1 -pix_fmt yuv420p {name}");
        ffmpeg(place.path(), &clip);
    }
    let [mut both, more] =
        ["a.ts", "b.ts"].map(|name| fs::read(place.path().join(name)).expect("made"));
    both.extend(more);
    fs::write(place.path().join("both.ts"), both).expect("written");
    let (sizes, end) = read(place.path(), "both.ts");
    let (fault, detail) = end.expect("it stops");
    assert_eq!(fault, Fault::OtherSize);
    assert!(detail.contains(&format!("after picture {}", sizes.len())), "{detail}");
    assert!((8..=10).contains(&sizes.len()) && sizes.iter().all(|size| *size == (320, 240)));
}

#[test]
fn pictures_nearer_in_time_than_the_frame_rate_says_are_all_read() {
    let place = TempDir::new().expect("folder");
    ffmpeg(place.path(), "-f lavfi -i testsrc=size=320x240:rate=10:duration=2 -c:v mpeg4 slow.mkv");
    ffmpeg(place.path(), "-itsscale 0.5 -i slow.mkv -c copy fast.mkv");
    let (sizes, end) = read(place.path(), "fast.mkv");
    assert_eq!((sizes.len(), end), (20, None));
}

/// A script opens the files that it names: only what holds pictures itself is a video.
#[test]
fn a_script_that_is_named_like_a_video_opens_no_other_file() {
    let place = TempDir::new().expect("folder");
    ffmpeg(place.path(), "-f lavfi -i testsrc=size=320x240:rate=10:duration=1 other.avi");
    let path = place.path().join("script.mp4");
    for script in [
        "ffconcat version 1.0\nfile other.avi\n",
        "#EXTM3U\n#EXT-X-TARGETDURATION:9\n#EXTINF:9,\nother.avi\n#EXT-X-ENDLIST\n",
    ] {
        fs::write(&path, script).expect("written");
        match Ffmpeg::open(&path.display().to_string()) {
            Err(CaptureError::Camera { fault: Fault::ReaderFailed, detail }) => {
                assert_eq!(detail, "not a video that ffmpeg can read");
            }
            other => panic!("{script}: {:?}", other.err()),
        }
    }
}

#[test]
fn pictures_without_times_are_said_to_have_none() {
    let place = TempDir::new().expect("folder");
    ffmpeg(
        place.path(),
        "-f lavfi -i testsrc=size=320x240:rate=10:duration=4 -c:v mjpeg moving.mkv",
    );
    ffmpeg(place.path(), "-i moving.mkv -c copy -bsf:v setts=ts=0 still.mkv");
    let (_, end) = read(place.path(), "still.mkv");
    let (fault, detail) = end.expect("it stops");
    assert!(fault == Fault::ReaderFailed && detail.contains("the same time"), "{detail}");
}

#[test]
fn pictures_stay_as_the_sensor_delivered_them() {
    let place = TempDir::new().expect("folder");
    ffmpeg(
        place.path(),
        "-f lavfi -i testsrc=size=320x240:rate=10:duration=1 -c:v mpeg4 -q:v 2 upright.mp4",
    );
    ffmpeg(place.path(), "-i upright.mp4 -c copy -metadata:s:v:0 rotate=90 turned.mp4");
    let (sizes, end) = read(place.path(), "turned.mp4");
    assert!(end.is_none() && !sizes.is_empty());
    assert!(sizes.iter().all(|size| *size == (320, 240)), "{sizes:?}");
}

#[test]
fn pictures_that_are_too_wide_are_named_so() {
    let place = TempDir::new().expect("folder");
    let path = place.path().join("ffmpeg");
    fs::write(&path, "#!/bin/sh\nprintf 'P5\\n8194 2\\n255\\n'; exec sleep 1000\n")
        .expect("written");
    fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).expect("set");
    match Ffmpeg::open_with(&path.display().to_string(), "clip.mp4") {
        Err(CaptureError::Camera { fault: Fault::ReaderFailed, detail }) => {
            assert!(detail.contains("8194x2") && detail.contains("8192"), "{detail}");
        }
        _ => panic!("another error"),
    }
}

#[test]
fn what_the_program_starts_ends_with_it() {
    let place = TempDir::new().expect("folder");
    let (path, pid) = (place.path().join("ffmpeg"), place.path().join("pid"));
    let script = format!(
        "#!/bin/sh\nsleep 1000 & echo $! > {}\nprintf 'P5\\n4 2\\n255\\nabcdefgh'\nwait\n",
        pid.display()
    );
    fs::write(&path, script).expect("written");
    fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).expect("set");
    let source = Ffmpeg::open_with(&path.display().to_string(), "rtsp://camera/1").expect("opens");
    let child = fs::read_to_string(pid).expect("it has run");
    let stat = Path::new("/proc").join(child.trim()).join("stat");
    assert!(stat.exists());
    drop(source);
    // An adopting process has to collect it: until then it's a zombie.
    let is_gone =
        || fs::read_to_string(&stat).is_ok_and(|stat| stat.contains(") Z ")) || !stat.exists();
    let until = Instant::now() + Duration::from_secs(30);
    while !is_gone() {
        assert!(Instant::now() < until, "it still runs");
        std::thread::yield_now();
    }
}
