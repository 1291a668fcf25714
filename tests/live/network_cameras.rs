//! Cameras on a network: motion JPEG over HTTP from a server of these tests, and RTSP from
//! GStreamer's.

use std::{
    fs,
    io::{BufRead, BufReader, Read, Write},
    net::TcpListener,
    os::unix::fs::PermissionsExt,
    path::Path,
    process::{Child, Command, Output, Stdio},
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    thread::Builder,
    time::{Duration, Instant},
};

use boresight::{
    capture::{Arrival, CaptureError, Ffmpeg, FrameSource},
    device::{CameraEvent, Fault},
};
use image::{GrayImage, Luma, codecs::jpeg::JpegEncoder};
use tempfile::TempDir;

use crate::{
    ffmpeg::{PATIENCE, frame_number, lost, returned, until},
    pictures::{PAIRS, picture, picture_at},
};

/// A network camera: pictures as motion JPEG over HTTP, to everyone who asks, while it is `up`.
fn network_camera(up: &Arc<AtomicBool>, picture: &GrayImage, rate_hz: f64) -> String {
    network_camera_before(up, std::slice::from_ref(picture), rate_hz, Duration::MAX)
}

/// Network camera before a board in a sequence of poses, for `each` duration, repeatedly.
fn network_camera_before(
    up: &Arc<AtomicBool>,
    poses: &[GrayImage],
    rate_hz: f64,
    each: Duration,
) -> String {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = format!("http://{}/video.mjpg", listener.local_addr().expect("bound"));
    let up = Arc::clone(up);
    // Two in turn, as noise would have it: equal pictures would count as one.
    let encoded = |picture: &GrayImage| {
        [90, 91].map(|quality| {
            let mut jpeg = Vec::new();
            let mut encoder = JpegEncoder::new_with_quality(&mut jpeg, quality);
            encoder.encode_image(picture).expect("encodes");
            jpeg
        })
    };
    let poses: Vec<[Vec<u8>; 2]> = poses.iter().map(encoded).collect();
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
            let began = Instant::now();
            for count in 0_u32.. {
                let turn = began.elapsed().as_nanos() / each.as_nanos().max(1);
                let jpeg = &poses[turn as usize % poses.len()][count as usize % 2];
                if sent.is_err() || !up.load(Ordering::SeqCst) {
                    break;
                }
                let head = format!(
                    "--frame\r\nContent-Type: image/jpeg\r\nContent-Length: {}\r\n\r\n",
                    jpeg.len()
                );
                sent = client
                    .write_all(head.as_bytes())
                    .and_then(|()| client.write_all(jpeg))
                    .and_then(|()| client.write_all(b"\r\n"));
                let due = Duration::from_secs_f64(f64::from(count + 1) / rate_hz);
                std::thread::sleep(due.saturating_sub(began.elapsed()));
            }
        }
    };
    Builder::new().name("network camera".into()).spawn(serve).expect("a thread");
    address
}

#[test]
fn ffmpeg_itself_loses_a_network_camera_and_finds_it_again() {
    let up = Arc::new(AtomicBool::new(true));
    let picture = GrayImage::from_fn(320, 240, |x, y| Luma([(x ^ y) as u8]));
    let address = network_camera(&up, &picture, 30.0);
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
    let place = TempDir::new().expect("folder");
    let up = Arc::new(AtomicBool::new(true));
    let (tilt_deg, slot_deg) = PAIRS[0];
    let address = network_camera(&up, &picture(tilt_deg, slot_deg), 30.0);
    let address = address.replace("http://", "http://admin:s3cret@") + "?pwd=s3cret";
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
    assert!(
        line.contains("The network stream has stopped") && line.contains("Reconnecting"),
        "{line}"
    );
    up.store(true, Ordering::SeqCst);
    wait_for("The camera is back.");
    let sent = Command::new("kill").arg("-INT").arg(child.id().to_string()).status();
    assert!(sent.expect("kill is there").success());
    wait_for("Result:");
    said.extend(lines.map_while(Result::ok));
    child.wait().expect("ended");
    let journal = fs::read_to_string(place.path().join("session/journal.jsonl")).expect("there");
    assert_eq!(journal.matches("NET-LOST").count(), 1);
    let frames = fs::read_dir(place.path().join("session/frames")).expect("there");
    assert_eq!(frames.count(), 1, "the view is kept");
    // The address is known, its password isn't, and is asked for.
    for file in ["session.toml", "journal.jsonl", "calibration.json", "report.html"] {
        let text = fs::read_to_string(place.path().join("session").join(file)).expect(file);
        assert!(!text.contains("s3cret") && !text.contains("admin"), "{file}");
        assert!(file.starts_with('j') || text.contains("http://127.0.0.1:"), "{file}");
    }
    assert!(!said.concat().contains("s3cret"), "{said:#?}");
    let resumed = Command::new(env!("CARGO_BIN_EXE_boresight"))
        .current_dir(place.path())
        .args(["guide", "--headless", "--session", "session"])
        .output()
        .expect("started");
    let words = String::from_utf8_lossy(&resumed.stderr).into_owned();
    assert_eq!(resumed.status.code(), Some(1), "{words}");
    assert!(words.contains("give the address again") && !words.contains("s3cret"), "{words}");
}

#[test]
fn a_network_camera_that_sends_one_picture_again_and_again_is_frozen() {
    let up = Arc::new(AtomicBool::new(true));
    // Grey is the same in every quality.
    let address = network_camera(&up, &GrayImage::from_pixel(320, 240, Luma([128])), 10.0);
    let mut source = Ffmpeg::open(&address).expect("opens");
    let seen = until(&mut source, |arrival| {
        matches!(arrival, Arrival::Event(CameraEvent::Doubtful { fault: Fault::Frozen, .. }))
    });
    assert_eq!(seen.iter().filter_map(frame_number).count(), 1, "{seen:?}");
}

/// Browsers and notes write schemes in capitals; ffmpeg knows those in small letters.
#[test]
fn an_address_in_capitals_is_read() {
    let up = Arc::new(AtomicBool::new(true));
    let picture = GrayImage::from_fn(320, 240, |x, y| Luma([(x ^ y) as u8]));
    let address = network_camera(&up, &picture, 10.0).replace("http://", "HTTP://");
    let mut source = Ffmpeg::open(&address).expect("opens");
    until(&mut source, |arrival| matches!(arrival, Arrival::Frame(_)));
}

#[test]
fn pictures_over_http_have_the_time_of_their_arrival() {
    for rate_hz in [5.0, 10.0, 15.0, 60.0] {
        let up = Arc::new(AtomicBool::new(true));
        let picture = GrayImage::from_fn(320, 240, |x, y| Luma([(x ^ y) as u8]));
        let address = network_camera(&up, &picture, rate_hz);
        let mut source = Ffmpeg::open(&address).expect("opens");
        let mut times: Vec<(Duration, Duration)> = Vec::new();
        let began = Instant::now();
        // The first ones come at once: they waited while ffmpeg looked at the stream.
        while began.elapsed() < Duration::from_secs(6) {
            if let Arrival::Frame(frame) =
                source.next_frame(PATIENCE).expect("a stream never breaks")
            {
                let captured = Duration::from_nanos(frame.captured_at.nanos);
                if began.elapsed() > Duration::from_secs(2) {
                    times.push((began.elapsed(), captured));
                }
            }
        }
        let (first, last) = (times[0], times[times.len() - 1]);
        let (arrived, captured) = (last.0 - first.0, last.1 - first.1);
        let ratio = captured.as_secs_f64() / arrived.as_secs_f64();
        println!("{rate_hz} pictures per second: {} frames, time runs at {ratio:.3}", times.len());
        assert!((0.85..1.15).contains(&ratio), "{rate_hz}: {ratio}");
        let per_second = times.len() as f64 / arrived.as_secs_f64();
        assert!(per_second < 33.0, "{rate_hz}: {per_second}");
    }
}

/// Eight directions, near enough to make every view informative.
fn poses() -> impl Iterator<Item = GrayImage> {
    (0..8).map(|slot| picture_at(0.25, 40.0, 45.0 * f64::from(slot)))
}

/// A board repeating poses without regard to the targets.
#[test]
fn a_whole_session_is_taken_from_slow_and_fast_network_cameras() {
    let poses: Vec<GrayImage> = poses().collect();
    let run = |rate_hz: f64, each_secs: u64| {
        let place = TempDir::new().expect("folder");
        let up = Arc::new(AtomicBool::new(true));
        let address = network_camera_before(&up, &poses, rate_hz, Duration::from_secs(each_secs));
        let began = Instant::now();
        let ended = guide(place.path(), &address);
        let said = String::from_utf8_lossy(&ended.stderr).into_owned();
        let secs = began.elapsed().as_secs_f64();
        println!("{rate_hz} per second: {} views, {secs:.0} s", said.matches("Taken: ").count());
        assert!(ended.status.code().is_some_and(|code| code == 0 || code == 3), "{said}");
        assert!(said.contains("Result:") && !said.contains("NET-"), "{rate_hz} per second: {said}");
    };
    std::thread::scope(|scope| {
        for (rate_hz, each_secs) in [(1.0, 6), (5.0, 3), (10.0, 3), (15.0, 3), (60.0, 3)] {
            Builder::new().spawn_scoped(scope, move || run(rate_hz, each_secs)).expect("a thread");
        }
    });
}

/// A machine-vision camera losing one packet in a hundred, automatics on.
#[cfg(all(target_os = "linux", feature = "gige"))]
#[test]
fn a_whole_session_is_taken_from_a_machine_vision_camera() {
    let place = TempDir::new().expect("folder");
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/wings/sources/tests/gige_camera.py");
    let mut camera = Command::new("python3");
    camera.args([script, "--address", "127.0.0.31", "--serial", "SESSION", "--size", "640x480"]);
    camera.args(["--loss", "0.01", "--each", "4"]);
    for (at, pose) in poses().enumerate() {
        let file = place.path().join(format!("{at}.raw"));
        fs::write(&file, pose.as_raw()).expect("written");
        camera.arg(file);
    }
    let started = camera.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn();
    let mut camera = started.expect("python3 is there");
    let mut lines = BufReader::new(camera.stdout.take().expect("piped")).lines();
    assert_eq!(lines.next().and_then(Result::ok).as_deref(), Some("ready"));
    let ended = guide(place.path(), "gige:127.0.0.31");
    camera.kill().ok();
    camera.wait().ok();
    let said = String::from_utf8_lossy(&ended.stderr).into_owned();
    assert!(ended.status.code().is_some_and(|code| code == 0 || code == 3), "{said}");
    assert!(said.contains("Result:") && !said.contains("FRM-BAD"), "{said}");
    let header = fs::read_to_string(place.path().join("session/session.toml")).expect("there");
    assert!(header.contains("gige:SESSION") && header.contains("backend = \"gige\""), "{header}");
}

/// Refusals of a server, and messages for the person.
#[test]
fn refusals_of_a_server_are_told_apart() {
    for (status, code, words) in [
        ("401 Unauthorized", "NET-LOGIN", "user name or password"),
        ("403 Forbidden", "NET-LOGIN", "user name or password"),
        ("404 Not Found", "NET-PATH", "no stream at this address"),
        ("503 Service Unavailable", "FFM-END", "the server reports an error"),
        ("200 OK", "FFM-END", "not a video"),
    ] {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
        let address = listener.local_addr().expect("bound");
        let serve = move || {
            for client in listener.incoming() {
                let mut client = client.expect("a client");
                let page = "<html>a page</html>";
                let answer = format!(
                    "HTTP/1.0 {status}\r\nContent-Type: text/html\r\nContent-Length: {}\r\n\r\n{page}",
                    page.len()
                );
                client.read(&mut [0; 2048]).and_then(|_| client.write_all(answer.as_bytes())).ok();
            }
        };
        Builder::new().name("server".into()).spawn(serve).expect("a thread");
        let place = TempDir::new().expect("folder");
        let ended = guide(place.path(), &format!("http://admin:s3cret@{address}/video.mjpg"));
        let said = String::from_utf8_lossy(&ended.stderr).into_owned();
        println!("{said}");
        assert_eq!(ended.status.code(), Some(1), "{said}");
        assert!(said.contains(code) && said.contains(words), "{status}: {said}");
        for internal in ["0x", "@", "s3cret", "[http", "tcp:"] {
            assert!(
                !said.replace("for @", "").replace("PASSWORD@", "").contains(internal),
                "{said}"
            );
        }
    }
    let free = TcpListener::bind("127.0.0.1:0").and_then(|l| l.local_addr()).expect("a port");
    let place = TempDir::new().expect("folder");
    match Ffmpeg::open(&format!("http://{free}/")) {
        Err(CaptureError::Camera { fault, detail }) => {
            assert_eq!((fault, detail.as_str()), (Fault::Unreachable, "connection refused"));
        }
        _ => panic!("nobody listens"),
    }
    let cut = place.path().join("cut.mp4");
    fs::write(&cut, b"\0\0\0\x18ftypisom\0\0\0\0isomiso2\0\0\x10\0mdat").expect("written");
    match Ffmpeg::open(&cut.display().to_string()) {
        Err(CaptureError::Camera { fault: Fault::ReaderFailed, detail }) => {
            assert_eq!(detail, "the file is incomplete");
        }
        _ => panic!("it has no end"),
    }
}

/// An endless picture: its data isn't collected without limit.
#[test]
#[ignore = "sends 270 MB"]
fn long_an_endless_picture_does_not_fill_the_memory() {
    let mut jpeg = Vec::new();
    JpegEncoder::new(&mut jpeg).encode_image(&picture(PAIRS[0].0, PAIRS[0].1)).expect("encodes");
    jpeg.truncate(jpeg.len() / 2);
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = format!("http://{}/video.mjpg", listener.local_addr().expect("bound"));
    let serve = move || {
        let mut client = listener.accept().expect("a client").0;
        let head = "HTTP/1.0 200 OK\r\nContent-Type: multipart/x-mixed-replace; boundary=frame\r\n\r\n--frame\r\nContent-Type: image/jpeg\r\n\r\n";
        let asked = client.read(&mut [0; 2048]);
        asked.and_then(|_| client.write_all(head.as_bytes())).expect("asked");
        client.write_all(&jpeg).expect("begun");
        while client.write_all(&[0x55; 1 << 20]).is_ok() {}
    };
    Builder::new().name("server".into()).spawn(serve).expect("a thread");
    // ffmpeg, with its number written down.
    let place = TempDir::new().expect("folder");
    let (program, number) = (place.path().join("ffmpeg"), place.path().join("number"));
    let script = format!("#!/bin/sh\necho $$ > {}\nexec ffmpeg \"$@\"\n", number.display());
    fs::write(&program, script).expect("written");
    fs::set_permissions(&program, fs::Permissions::from_mode(0o755)).expect("allowed");
    let largest_kb = Builder::new().spawn(move || {
        let status = || {
            let number = fs::read_to_string(&number).ok()?;
            fs::read_to_string(format!("/proc/{}/status", number.trim())).ok()
        };
        let began = Instant::now();
        let mut largest_kb = 0_u64;
        while largest_kb == 0 || status().is_some_and(|status| status.contains("VmHWM")) {
            assert!(began.elapsed().as_secs() < 60, "ffmpeg didn't start, or didn't end");
            let status = status().unwrap_or_default();
            let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
            let kb = line.and_then(|line| line.trim().trim_end_matches(" kB").parse().ok());
            largest_kb = largest_kb.max(kb.unwrap_or(0));
            std::thread::sleep(Duration::from_millis(5));
        }
        largest_kb
    });
    let opened = Ffmpeg::open_with(&program.display().to_string(), &address);
    let largest_kb = largest_kb.expect("a thread").join().expect("ended");
    let Err(CaptureError::Camera { detail, .. }) = opened else { panic!("it isn't a picture") };
    println!("{} MB at most: {detail}", largest_kb / 1024);
    // A picture of the largest size, and the program itself.
    assert!(largest_kb < 340 << 10, "{largest_kb} kB");
}

/// A session with a quick plan from `address`, in `place`/session.
fn guide(place: &Path, address: &str) -> Output {
    Command::new(env!("CARGO_BIN_EXE_boresight"))
        .current_dir(place)
        .args(["guide", "--headless", "--out", "session", "--set", "guidance.plan=quick"])
        .args(["--source", address])
        .stdin(Stdio::null())
        .output()
        .expect("started")
}

/// GStreamer's RTSP server, until dropped.
struct RtspServer {
    child: Child,
    port: u16,
}

impl RtspServer {
    /// Serves the video `file` at `/camera` to the user `admin` with the password `s3cret`; `None`
    /// if Debian's packages for it aren't installed.
    fn start(file: &Path) -> Option<Self> {
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/live/rtsp_server.py");
        let started = Command::new("/usr/bin/python3")
            .arg(script)
            .args([file.as_os_str(), "admin".as_ref(), "s3cret".as_ref()])
            .stdout(Stdio::piped())
            .spawn();
        let mut child = started.ok()?;
        let mut line = String::new();
        BufReader::new(child.stdout.take()?).read_line(&mut line).expect("text");
        match line.trim().parse() {
            Ok(port) => Some(Self { child, port }),
            Err(_) => {
                child.wait().expect("ended");
                None
            }
        }
    }

    fn address(&self, user: &str, path: &str) -> String {
        format!("rtsp://{user}127.0.0.1:{}{path}", self.port)
    }
}

impl Drop for RtspServer {
    fn drop(&mut self) {
        self.child.kill().ok();
        self.child.wait().ok();
    }
}

/// The server ends the stream with the file and begins again at the next request, as a restarting
/// camera.
#[test]
fn a_whole_session_is_taken_over_rtsp() {
    let place = TempDir::new().expect("folder");
    let list = place.path().join("list.txt");
    let mut order = String::new();
    for (number, picture) in poses().enumerate() {
        let file = place.path().join(format!("{number}.png"));
        picture.save(&file).expect("written");
        order += &format!("file {}\nduration 3\n", file.display());
    }
    // The duration of the last one doesn't count.
    order += &format!("file {}\n", place.path().join("7.png").display());
    fs::write(&list, order).expect("written");
    let video = place.path().join("poses.mp4");
    // Grain makes the bytes of all pictures different.
    let made = Command::new("ffmpeg")
        .args(["-loglevel", "error", "-f", "concat", "-safe", "0", "-i"])
        .arg(&list)
        .args(["-vf", "fps=10,noise=alls=3:allf=t,format=yuv420p", "-c:v", "mpeg4", "-q:v", "2"])
        .arg(&video)
        .status();
    assert!(made.expect("ffmpeg is installed").success());
    let Some(server) = RtspServer::start(&video) else {
        assert!(std::env::var_os("CI").is_none(), "GStreamer's RTSP server is not installed");
        println!("skipped: GStreamer's RTSP server is not installed");
        return;
    };
    let began = Instant::now();
    let ended = guide(place.path(), &server.address("admin:s3cret@", "/camera"));
    let said = String::from_utf8_lossy(&ended.stderr).into_owned();
    let secs = began.elapsed().as_secs_f64();
    println!("RTSP: {} views, {secs:.0} s", said.matches("Taken: ").count());
    assert!(ended.status.code().is_some_and(|code| code == 0 || code == 3), "{said}");
    assert!(said.contains("Result:"), "{said}");
    for (user, path, fault) in [
        ("admin:wrong@", "/camera", Fault::NotLoggedIn),
        ("", "/camera", Fault::NotLoggedIn),
        ("admin:s3cret@", "/other", Fault::NoSuchStream),
    ] {
        match Ffmpeg::open(&server.address(user, path)) {
            Err(CaptureError::Camera { fault: told, detail }) => {
                assert_eq!((told, detail.as_str()), (fault, ""), "{user}{path}");
            }
            _ => panic!("{user}{path} was served"),
        }
    }
}
