//! Pictures through pipes: equal to the sent ones, or left out; and every failure of a command.

use std::{fs, os::unix::fs::PermissionsExt, path::Path, process::Command};

use image::{GrayImage, ImageFormat};

use super::*;
use crate::{Arrival, CaptureError, FrameSource, RawForm};
use boresight_geometry::{
    device::{CameraEvent, Fault},
    frame::Frame,
};
use std::{sync::Arc, time::Duration};

const PATIENCE: Duration = Duration::from_millis(200);

/// A picture like a camera's, different for each number.
fn picture(number: u32, width: u32, height: u32) -> GrayImage {
    GrayImage::from_fn(width, height, |x, y| {
        let noise = (x * 7919 + y * 104_729 + number * 1_299_709) % 23;
        image::Luma([(40 + x + 3 * y + noise + number) as u8])
    })
}

fn y4m(pictures: &[GrayImage]) -> Vec<u8> {
    let (width, height) = pictures[0].dimensions();
    let mut bytes = format!("YUV4MPEG2 W{width} H{height} F30:1 Ip A1:1 Cmono\n").into_bytes();
    for picture in pictures {
        bytes.extend(b"FRAME\n");
        bytes.extend(picture.as_raw());
    }
    bytes
}

fn stills(pictures: &[GrayImage], format: ImageFormat) -> Vec<Vec<u8>> {
    let encoded = |picture: &GrayImage| {
        let mut bytes = std::io::Cursor::new(Vec::new());
        picture.write_to(&mut bytes, format).expect("encoded");
        bytes.into_inner()
    };
    pictures.iter().map(encoded).collect()
}

/// A command from the script `text`, with `$D` as the folder; `seen 2` waits until picture 2 was
/// delivered.
fn script(place: &Path, text: &str) -> String {
    let path = place.join("camera");
    let wait = "seen() { until [ -e $D/seen$1 ]; do sleep 0.01; done; }";
    let text = format!("#!/bin/sh\nD={}\n{wait}\n{text}\n", place.display());
    fs::write(&path, text).expect("written");
    fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).expect("set");
    format!("pipe:{}", path.display())
}

/// Arrivals up to the end, a wanted one, or an error. Tells the script below `place` the number of
/// delivered pictures.
fn until(
    source: &mut Pipe,
    place: &Path,
    wanted: impl Fn(&Arrival) -> bool,
) -> (Vec<Arrival>, Option<CaptureError>) {
    let mut seen = Vec::new();
    loop {
        match source.next_frame(PATIENCE) {
            Ok(Arrival::NothingYet) => continue,
            Ok(arrival) => seen.push(arrival),
            Err(err) => return (seen, Some(err)),
        }
        let last = &seen[seen.len() - 1];
        if matches!(last, Arrival::Frame(_)) {
            fs::write(place.join(format!("seen{}", frames(&seen).len())), "").expect("written");
        }
        if matches!(last, Arrival::End) || wanted(last) {
            return (seen, None);
        }
    }
}

fn frames(seen: &[Arrival]) -> Vec<Arc<Frame>> {
    let frame = |arrival: &Arrival| match arrival {
        Arrival::Frame(frame) => Some(Arc::clone(frame)),
        _ => None,
    };
    seen.iter().filter_map(frame).collect()
}

fn lost(seen: &[Arrival]) -> Vec<(Fault, String)> {
    let fault = |arrival: &Arrival| match arrival {
        Arrival::Event(CameraEvent::Lost { fault, detail }) => Some((*fault, detail.clone())),
        _ => None,
    };
    seen.iter().filter_map(fault).collect()
}

fn is_return(arrival: &Arrival) -> bool {
    matches!(arrival, Arrival::Event(CameraEvent::Returned { .. }))
}

fn refused(name: &str, raw: Option<&str>) -> (Fault, String) {
    match Pipe::open(name, raw.map(|raw| raw.parse::<RawForm>().expect("a form"))) {
        Err(CaptureError::Camera { fault, detail }) => (fault, detail),
        Err(other) => panic!("{other}"),
        Ok(_) => panic!("{name} was opened"),
    }
}

/// Cuts `bytes`, in pieces of `piece` bytes, and counts torn pictures.
fn cut(bytes: &[u8], piece: usize, raw: Option<&RawForm>) -> (Vec<GrayImage>, usize) {
    let mut cutter = cutter::Cutter::new(raw);
    let mut decompressor = crate::Decompressor::default();
    let (mut pictures, mut torn) = (Vec::new(), 0);
    let mut pieces = bytes.chunks(piece);
    let mut rests = false;
    loop {
        match cutter.cut(rests) {
            cutter::Cut::Picture(packed) => match packed.unpack(&mut decompressor) {
                Ok(picture) => pictures.push(picture),
                Err(_) => torn += 1,
            },
            cutter::Cut::Torn => torn += 1,
            cutter::Cut::Foreign(what) => panic!("{what}"),
            cutter::Cut::Ripe | cutter::Cut::Nothing => match pieces.next() {
                Some(piece) => cutter.bytes().extend(piece),
                None if rests && cutter.give_up() => torn += 1,
                None if rests => return (pictures, torn),
                None => rests = true,
            },
        }
    }
}

#[test]
fn every_stream_is_its_pictures_however_it_comes_in_pieces() {
    let sent: Vec<GrayImage> = (0..5).map(|number| picture(number, 40, 30)).collect();
    let raw: RawForm = "40x30:gray@30".parse().expect("a form");
    let rows: Vec<u8> = sent.iter().flat_map(|picture| picture.as_raw().clone()).collect();
    for piece in [1, 7, 100, 1 << 20] {
        for (bytes, raw) in [
            (y4m(&sent), None),
            (rows.clone(), Some(&raw)),
            (stills(&sent, ImageFormat::Png).concat(), None),
            ([b"Welcome to the camera!\n".to_vec(), y4m(&sent)].concat(), None),
            ([y4m(&sent[..2]), y4m(&sent[2..])].concat(), None),
        ] {
            assert_eq!(cut(&bytes, piece, raw), (sent.clone(), 0), "in pieces of {piece}");
        }
        let jpegs = stills(&sent, ImageFormat::Jpeg);
        let (pictures, torn) = cut(&jpegs.concat(), piece, None);
        assert_eq!((pictures.len(), torn), (5, 0), "in pieces of {piece}");
        let with_words = jpegs.join(&b"\r\n--next\r\nContent-Type: image/jpeg\r\n\r\n"[..]);
        assert_eq!(cut(&with_words, piece, None), (pictures, 0));
    }
}

#[test]
fn no_picture_with_bytes_lost_or_added_is_a_picture() {
    let sent: Vec<GrayImage> = (0..4).map(|number| picture(number, 40, 30)).collect();
    let pngs = stills(&sent, ImageFormat::Png);
    for whole in [y4m(&sent), pngs.concat()] {
        let mut harmed = 0;
        for at in (60..whole.len() - 1).step_by(29) {
            for count in [1, 5, 300] {
                let lost = [&whole[..at], &whole[(at + count).min(whole.len())..]].concat();
                let added = [&whole[..at], &vec![b'#'; count], &whole[at..]].concat();
                for bytes in [lost, added] {
                    let (pictures, torn) = cut(&bytes, 4096, None);
                    let of_sent = pictures.iter().all(|picture| sent.contains(picture));
                    assert!(of_sent, "{count} at {at} of {}", whole.len());
                    assert!(pictures.len() >= 2, "the rest is found again: {count} at {at}");
                    harmed += torn;
                }
            }
        }
        assert!(harmed > 0);
    }
}

#[test]
fn a_jpeg_that_is_cut_anywhere_is_no_picture_and_the_next_one_is() {
    // JPEG has no checksum, so a loss within a picture may go unnoticed; see `integrity`.
    let sent: Vec<GrayImage> = (0..3).map(|number| picture(number, 40, 30)).collect();
    let jpegs = stills(&sent, ImageFormat::Jpeg);
    let (whole, _) = cut(&jpegs.concat(), 4096, None);
    let mut lost = 0;
    for end in 4..jpegs[1].len() {
        let bytes = [&jpegs[0], &jpegs[1][..end], &jpegs[2]].concat();
        let (pictures, _) = cut(&bytes, 4096, None);
        // Cut just before the end of a header, it takes the start of the next picture with it.
        lost += usize::from(pictures.len() == 1);
        let good = [&whole[0], &whole[2]];
        assert!(!pictures.is_empty() && pictures.iter().eq(good.into_iter().take(pictures.len())));
    }
    // Headers are most of so small a picture.
    assert!(lost < jpegs[1].len() / 20, "{lost} of {}", jpegs[1].len());
}

#[test]
fn pictures_of_a_command_arrive_and_its_end_is_an_end() {
    let place = tempfile::tempdir().expect("a folder");
    let sent: Vec<GrayImage> = (0..3).map(|number| picture(number, 64, 48)).collect();
    fs::write(place.path().join("a.y4m"), y4m(&sent)).expect("written");
    // A picture at a time, so that none is replaced by a newer one.
    let one = 6 + 64 * 48;
    let head = y4m(&sent).len() - 3 * one;
    let name = script(
        place.path(),
        &format!(
            "head -c {head} $D/a.y4m; for n in 0 1 2; do tail -c +$(({head} + 1 + n * {one})) $D/a.y4m | head -c {one}; seen $((n + 1)); done"
        ),
    );
    let mut source = Pipe::open(&name, None).expect("opens");
    assert!(!source.waits() && source.camera_facts().is_some_and(|facts| facts.backend == "pipe"));
    assert_eq!(source.identity().name, name);
    let (seen, error) = until(&mut source, place.path(), |_| false);
    assert!(error.is_none() && lost(&seen).is_empty(), "{error:?}");
    let got: Vec<GrayImage> = frames(&seen).iter().map(|frame| frame.image.clone()).collect();
    assert_eq!(got, sent);
    let times: Vec<u64> = frames(&seen).iter().map(|frame| frame.captured_at.nanos).collect();
    assert!(times.windows(2).all(|pair| pair[0] < pair[1]), "{times:?}");
    assert!(matches!(seen[0], Arrival::Event(CameraEvent::Started { .. })));
    let unwatched = |arrival: &Arrival| {
        matches!(arrival, Arrival::Event(CameraEvent::Doubtful { fault: Fault::Unwatched, .. }))
    };
    assert!(seen.iter().any(unwatched), "nobody locks this camera");
}

/// `cat` sends a second of pictures at once: they're seen at the rate of their header.
#[test]
fn a_stored_stream_is_read_at_its_rate() {
    let place = tempfile::tempdir().expect("a folder");
    let sent: Vec<GrayImage> = (0..60).map(|number| picture(number, 64, 48)).collect();
    fs::write(place.path().join("a.y4m"), y4m(&sent)).expect("written");
    let name = format!("pipe:cat {}", place.path().join("a.y4m").display());
    let began = std::time::Instant::now();
    let mut source = Pipe::open(&name, None).expect("opens");
    let (seen, error) = until(&mut source, place.path(), |_| false);
    let count = frames(&seen).len();
    assert!(error.is_none() && count >= 45, "{count} of 60: {error:?}");
    assert!(began.elapsed() > Duration::from_millis(1500), "{:?}", began.elapsed());
}

#[test]
fn what_cannot_be_opened_says_why() {
    let place = tempfile::tempdir().expect("a folder");
    let name = |text: &str| script(place.path(), text);
    assert_eq!(
        refused("pipe:no-such-program -x", None),
        (Fault::NoCommand, "no-such-program: not found".into())
    );
    let plain = place.path().join("plain");
    fs::write(&plain, "").expect("written");
    let (fault, detail) = refused(&format!("pipe:{}", plain.display()), None);
    assert!(fault == Fault::NoCommand && detail.ends_with("not executable"), "{detail}");
    assert_eq!(refused("pipe:", None).0, Fault::NoCommand);
    assert_eq!(refused("pipe:a 'b", None), (Fault::NoCommand, "a quote has no end".into()));
    assert_eq!(refused(&name("exit 0"), None), (Fault::CommandEnded, "without a picture".into()));
    let silent = (Fault::CommandEnded, "without a picture: Device or resource busy".into());
    assert_eq!(refused(&name("echo Device or resource busy >&2"), None), silent);
    assert_eq!(
        refused(&name("echo starting >&2; echo 'no cameras available' >&2; exit 3"), None),
        (Fault::CommandEnded, "exit status 3: no cameras available".into())
    );
    assert_eq!(
        refused(&name("kill -9 $$"), None),
        (Fault::CommandEnded, "ended by signal 9".into())
    );
    assert_eq!(
        refused(&name("echo 'rtsp://u:s3cret@cam/1: no route' >&2; exit 1"), None),
        (Fault::CommandEnded, "exit status 1: rtsp://cam/1: no route".into())
    );
    for (prints, what) in [
        ("printf '\\000\\000\\000\\001g'", "this is H.264 or H.265"),
        ("printf '\\032\\105\\337\\243'", "this is Matroska or WebM"),
        ("echo 'Usage: camera [-o FILE]'", "it begins with the text \"Usage: camera [-o FILE]\""),
        ("printf '\\001\\002\\003\\004\\005'", "it begins with the bytes 01 02 03 04"),
        ("echo 'YUV4MPEG2 W64 H48 F30:1 It C420'", "interlaced"),
        ("echo 'YUV4MPEG2 W64 H48 F30:1 C333'", "in \"333\", which can't be read"),
        ("echo 'YUV4MPEG2 F30:1'", "states no size"),
    ] {
        let (fault, detail) = refused(&name(prints), None);
        assert!(
            fault == Fault::NotPictures && detail.contains(what),
            "{prints}: {fault:?} {detail}"
        );
    }
    let (fault, detail) = refused(&name("head -c 99 /dev/zero"), Some("64x48:gray"));
    assert_eq!((fault, detail.as_str()), (Fault::CommandEnded, "without a picture"));
}

#[test]
fn a_command_that_dies_is_started_again_and_nothing_is_lost() {
    let place = tempfile::tempdir().expect("a folder");
    let sent: Vec<GrayImage> = (0..2).map(|number| picture(number, 64, 48)).collect();
    fs::write(place.path().join("a.y4m"), y4m(&sent[..1])).expect("written");
    fs::write(place.path().join("b.y4m"), y4m(&sent[1..])).expect("written");
    // First death within the second picture; then a failed start; then a return, and a good end.
    let name = script(
        place.path(),
        "echo >> $D/starts
case $(wc -l < $D/starts) in
1) cat $D/a.y4m; seen 1; printf 'FRAME\\nhalf'; echo 'device lost' >&2; exit 7;;
2) exit 5;;
*) cat $D/b.y4m;;
esac",
    );
    let mut source = Pipe::open(&name, None).expect("opens");
    let (seen, error) = until(&mut source, place.path(), is_return);
    assert!(error.is_none());
    assert_eq!(lost(&seen), [(Fault::CommandEnded, "exit status 7: device lost".into())]);
    assert_eq!(frames(&seen).len(), 1, "half a picture is none");
    let (rest, error) = until(&mut source, place.path(), |_| false);
    assert!(error.is_none() && matches!(rest.last(), Some(Arrival::End)));
    let after = frames(&rest);
    assert_eq!((after.len(), &after[0].image), (1, &sent[1]));
    assert!(after[0].id > frames(&seen)[0].id, "numbers continue");
}

#[test]
fn a_command_that_falls_silent_is_started_again() {
    let place = tempfile::tempdir().expect("a folder");
    fs::write(place.path().join("a.y4m"), y4m(&[picture(0, 64, 48)])).expect("written");
    let name = script(
        place.path(),
        "echo >> $D/starts; cat $D/a.y4m; [ $(wc -l < $D/starts) = 2 ] || exec sleep 1000",
    );
    let mut source = Pipe::open(&name, None).expect("opens");
    let (seen, error) = until(&mut source, place.path(), |_| false);
    assert!(error.is_none() && seen.iter().any(is_return));
    assert_eq!(lost(&seen), [(Fault::NoPictures, "nothing for 5 s".into())]);
    assert_eq!(frames(&seen).len(), 2);
}

#[test]
fn another_size_is_never_taken_for_the_session_s() {
    let place = tempfile::tempdir().expect("a folder");
    let small: Vec<GrayImage> = (0..3).map(|number| picture(number, 32, 24)).collect();
    fs::write(place.path().join("a.y4m"), y4m(&[picture(0, 64, 48)])).expect("written");
    fs::write(place.path().join("b.y4m"), y4m(&small)).expect("written");
    let name = script(
        place.path(),
        "echo >> $D/starts
case $(wc -l < $D/starts) in
1) cat $D/a.y4m; seen 1; while cat $D/b.y4m; do sleep 0.01; done;;
*) cat $D/a.y4m;;
esac",
    );
    let mut source = Pipe::open(&name, None).expect("opens");
    let (seen, _) = until(&mut source, place.path(), |_| false);
    assert_eq!(lost(&seen), [(Fault::OtherSize, "32x24".into())]);
    assert!(seen.iter().any(is_return));
    assert!(frames(&seen).iter().all(|frame| frame.image.dimensions() == (64, 48)));
}

/// True while the process with the number in `file` runs.
fn runs(place: &Path, file: &str) -> bool {
    let pid = fs::read_to_string(place.join(file)).expect("it has run");
    let state = fs::read_to_string(format!("/proc/{}/stat", pid.trim())).unwrap_or_default();
    !state.is_empty() && !state.contains(") Z ")
}

#[test]
fn what_a_command_leaves_behind_ends_with_the_source() {
    let place = tempfile::tempdir().expect("a folder");
    fs::write(place.path().join("a.y4m"), y4m(&[picture(0, 64, 48)])).expect("written");
    // The child ignores the request; the command ends, by itself or when asked.
    let deaf = "sh -c 'trap \"\" TERM; echo $$ > '$D'/child; while :; do sleep 1; done' > /dev/null 2>&1 &";
    for rest in ["cat $D/a.y4m; exit 0", "cat $D/a.y4m; exec sleep 1000"] {
        let wait = "until [ -s $D/child ]; do sleep 0.01; done";
        let name = script(place.path(), &format!("{deaf}\n{wait}\n{rest}"));
        let mut source = Pipe::open(&name, None).expect("opens");
        let _ = until(&mut source, place.path(), |arrival| matches!(arrival, Arrival::Frame(_)));
        assert!(runs(place.path(), "child"), "{rest}");
        drop(source);
        // The system takes its time to end it.
        while runs(place.path(), "child") {
            std::thread::sleep(Duration::from_millis(10));
        }
        fs::remove_file(place.path().join("child")).expect("there");
    }
}

#[test]
fn the_command_and_what_it_started_end_with_the_source() {
    let place = tempfile::tempdir().expect("a folder");
    fs::write(place.path().join("a.y4m"), y4m(&[picture(0, 64, 48)])).expect("written");
    let name = script(
        place.path(),
        "sleep 1000 & echo $! > $D/child; echo $$ > $D/own; cat $D/a.y4m; wait",
    );
    let source = Pipe::open(&name, None).expect("opens");
    let runs = |file| runs(place.path(), file);
    assert!(runs("own") && runs("child"));
    drop(source);
    assert!(!runs("own"));
    // It was asked to end with the command, and takes its time.
    while runs("child") {
        std::thread::sleep(Duration::from_millis(10));
    }
}

#[test]
fn a_flood_of_messages_neither_stops_the_command_nor_grows() {
    let place = tempfile::tempdir().expect("a folder");
    let sent: Vec<GrayImage> = (0..2).map(|number| picture(number, 64, 48)).collect();
    fs::write(place.path().join("a.y4m"), y4m(&sent)).expect("written");
    let name = script(place.path(), "head -c 3000000 /dev/zero | tr '\\0' 'x' >&2; cat $D/a.y4m");
    let mut source = Pipe::open(&name, None).expect("opens");
    let (seen, error) = until(&mut source, place.path(), |_| false);
    assert!(error.is_none() && !frames(&seen).is_empty());
}

/// Output of another program; `None` if not installed.
fn output(command: &str) -> Option<Vec<u8>> {
    let words = shlex::split(command).expect("words");
    let output = Command::new(&words[0]).args(&words[1..]).output().ok()?;
    output.status.success().then_some(output.stdout)
}

#[test]
fn pictures_of_ffmpeg_and_gstreamer_are_equal_bit_for_bit() {
    let sources = "ffmpeg -v error -f lavfi -i testsrc2=s=322x182:r=30:d=0.2 -pix_fmt";
    for (format, tag) in [("gray", "gray"), ("yuv420p", "yuv420p"), ("yuv444p", "yuv444p")] {
        let Some(stream) = output(&format!("{sources} {format} -f yuv4mpegpipe -strict -1 -"))
        else {
            continue;
        };
        let bytes = output(&format!("{sources} {format} -f rawvideo -")).expect("it's there");
        let raw: RawForm = format!("322x182:{tag}@30").parse().expect("a form");
        let (of_raw, _) = cut(&bytes, 65_536, Some(&raw));
        let (of_stream, torn) = cut(&stream, 65_536, None);
        assert_eq!((of_stream.len(), torn), (6, 0), "{format}");
        assert_eq!(of_stream, of_raw);
        // The plane of brightness, as ffmpeg lays it out.
        let step = bytes.len() / 6;
        for (picture, bytes) in of_raw.iter().zip(bytes.chunks(step)) {
            assert_eq!(picture.as_raw(), &bytes[..322 * 182], "{format}");
        }
    }
    let gst = "gst-launch-1.0 -q videotestsrc num-buffers=6 pattern=smpte ! video/x-raw,width=320,height=240,framerate=30/1,format=";
    for (format, raw) in [("I420", "i420"), ("GRAY8", "gray8"), ("YUY2", "yuy2"), ("UYVY", "uyvy")]
    {
        let Some(bytes) = output(&format!("{gst}{format} ! fdsink")) else { continue };
        let raw: RawForm = format!("320x240:{raw}@30").parse().expect("a form");
        let (pictures, torn) = cut(&bytes, 65_536, Some(&raw));
        assert_eq!((pictures.len(), torn), (6, 0), "{format}");
        let plane: Vec<u8> = match format {
            "YUY2" => bytes.chunks(2).take(320 * 240).map(|pair| pair[0]).collect(),
            "UYVY" => bytes.chunks(2).take(320 * 240).map(|pair| pair[1]).collect(),
            _ => bytes[..320 * 240].to_vec(),
        };
        assert_eq!(pictures[0].as_raw(), &plane, "{format}");
    }
    if let Some(bytes) = output(&format!("{gst}I420 ! y4menc ! fdsink")) {
        assert_eq!(cut(&bytes, 65_536, None).0.len(), 6);
    }
    if let Some(bytes) = output(&format!("{gst}I420 ! jpegenc ! fdsink")) {
        assert_eq!(cut(&bytes, 65_536, None).0.len(), 6);
    }
    if let Some(bytes) = output(&format!("{sources} rgb24 -f image2pipe -c:v png -")) {
        assert_eq!(cut(&bytes, 65_536, None).0.len(), 6);
    }
    if let Some(bytes) = output(&format!("{sources} yuvj420p -f mjpeg -q:v 2 -")) {
        let (pictures, torn) = cut(&bytes, 65_536, None);
        assert_eq!((pictures.len(), torn), (6, 0));
    }
}
