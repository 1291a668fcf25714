//! Machine-vision cameras through the whole of GigE Vision, on this computer's own network:
//! `gige_camera.py`, which shares no code with the client, and Aravis' fake camera (Debian's
//! `aravis-tools`). Without Python or Aravis, a test says that it's skipped; with `CI` set, that's
//! a failure.

#![cfg(target_os = "linux")]
#![expect(clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

mod common;

use std::{
    process::{Child, Command},
    sync::Arc,
    time::{Duration, Instant},
};

use boresight_capture::{Arrival, CaptureError, FrameSource, v4l2::LiveCamera};
use boresight_geometry::{
    device::{CameraEvent, Control, Fault, Lock, Locks, PixelLayout, Wanted},
    frame::{Frame, ImageSize},
};
use boresight_sources::gige::{Network, find};
use common::{
    Fake, LONGEST, PATIENCE, event, frame, frames, is_pattern, skipped, until, until_back,
    until_lost,
};

/// A camera of `gige_camera.py`; `None` if there is no Python.
fn started(address: &str, serial: &str, more: &[&str]) -> Option<Fake> {
    let named = ["--address", address, "--serial", serial];
    Fake::script("python3", "gige_camera.py", &[&named[..], more].concat())
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

fn locked(source: &mut Source) -> Locks {
    let is_locked = |arrival: &Arrival| matches!(event(arrival), Some(CameraEvent::Locked { .. }));
    match until(source, is_locked).last().and_then(event) {
        Some(CameraEvent::Locked { locks }) => *locks,
        _ => Locks::default(),
    }
}

#[test]
fn pictures_in_every_depth_and_packing_are_as_they_were_sent() {
    let Some(_fake) = started("127.0.0.11", "PIXELS", &[]) else { return };
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
    let mut fake = started(address, "LOSSY", &more)?;
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
    let Some(mut fake) = started("127.0.0.13", "LOCKED", &[]) else { return };
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
    let Some(mut fake) = started("127.0.0.14", "GONE", &[]) else { return };
    let mut source = open("gige:GONE", &Wanted::default());
    let Lock::Locked { value: exposure } = locked(&mut source).exposure else {
        panic!("not locked")
    };
    frames(&mut source, 3);
    fake.say("silent");
    assert_eq!(until_lost(&mut source), Some(Fault::Unplugged));
    // Power-up: every setting is forgotten.
    fake.say("reset");
    fake.say("speaking");
    until_back(&mut source);
    assert!(frames(&mut source, 3).iter().all(|frame| is_pattern(frame)));
    let changed = source.next_frame(PATIENCE).expect("goes on");
    assert!(
        !matches!(event(&changed), Some(CameraEvent::ControlChanged(_))),
        "{exposure}: {changed:?}"
    );
    // The plug out and in at once: nothing was silent, but the stream is gone.
    fake.say("reset");
    assert_eq!(until_lost(&mut source), Some(Fault::Unplugged));
    until_back(&mut source);
    frames(&mut source, 1);
    // Killed, and another one of the same serial number at another address.
    drop(fake);
    until_lost(&mut source);
    let _again = started("127.0.0.15", "GONE", &[]);
    until_back(&mut source);
    frames(&mut source, 1);
}

#[test]
fn what_is_wrong_with_pictures_is_told_until_it_is_over() {
    let Some(mut fake) = started("127.0.0.21", "LOOKS", &[]) else { return };
    let mut source = open("gige:LOOKS", &Wanted::default());
    locked(&mut source);
    frames(&mut source, 1);
    for (look, doubt) in [
        ("frozen", Fault::Frozen),
        ("black", Fault::Dark),
        ("blinking", Fault::Infrared),
        ("slow", Fault::Slow),
        ("cut", Fault::DamagedFrames),
    ] {
        fake.say(&format!("look {look}"));
        until(
            &mut source,
            |arrival| matches!(event(arrival), Some(CameraEvent::Doubtful { fault, .. }) if *fault == doubt),
        );
        fake.say("look usual");
        until(
            &mut source,
            |arrival| matches!(event(arrival), Some(CameraEvent::Dispelled { fault }) if *fault == doubt),
        );
    }
    assert!(frames(&mut source, 3).iter().all(|frame| is_pattern(frame)));
    // It answers, and sends nothing.
    fake.say("look none");
    assert_eq!(until_lost(&mut source), Some(Fault::Stalled));
    fake.say("look usual");
    until_back(&mut source);
    frames(&mut source, 1);
}

#[test]
fn a_camera_without_pictures_and_another_in_its_place_are_not_used() {
    let Some(mut fake) = started("127.0.0.22", "FIRST", &[]) else { return };
    fake.say("look none");
    let mut source = open("gige:FIRST", &Wanted::default());
    assert_eq!(until_lost(&mut source), Some(Fault::NoFirstFrame));
    fake.say("look usual");
    until_back(&mut source);
    frames(&mut source, 1);
    drop(fake);
    assert_eq!(until_lost(&mut source), Some(Fault::Unplugged));
    // At an address is whoever was given it: the first camera is waited for, wherever it is.
    let Some(mut other) = started("127.0.0.22", "OTHER", &[]) else { return };
    other.say("look black");
    let _first = started("127.0.0.23", "FIRST", &[]);
    let away = until_back(&mut source);
    assert!(away.iter().filter_map(frame).all(|frame| is_pattern(frame)));
    assert_eq!(source.identity().name, "gige:FIRST");
    frames(&mut source, 1);
}

#[test]
fn cameras_are_told_apart_by_every_name_and_one_in_use_says_so() {
    let Some(mut one) = started("127.0.0.16", "TWO-1", &["--name", "left"]) else { return };
    let Some(_two) = started("127.0.0.17", "TWO-2", &["--size", "160x120", "--packet", "1500"])
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
fn pictures_that_the_link_carries_too_slowly_are_not_taken_unasked() {
    let more = ["--size", "640x480", "--sensor", "4096x4096"];
    let Some(_fake) = started("127.0.0.20", "LARGE", &more) else { return };
    // A gigabit has 7 pictures of 16 megabytes a second, and 15 are wanted.
    let camera = find("gige:LARGE").expect("it's there");
    let large = ImageSize { width_px: 4096, height_px: 4096 };
    let intervals = camera.offers.iter().filter(|offer| offer.size == large).map(|it| it.interval);
    let rates: Vec<f64> = intervals.flatten().map(|(n, d)| f64::from(d) / f64::from(n)).collect();
    assert!(!rates.is_empty() && rates.iter().all(|rate| *rate < 7.5), "{rates:?}");
    let source = open("gige:LARGE", &Wanted::default());
    assert_eq!(source.mode().size, ImageSize { width_px: 640, height_px: 480 });
}

#[test]
fn times_are_the_cameras_own() {
    let Some(_fake) = started("127.0.0.19", "TIMES", &[]) else { return };
    let wanted = Wanted { rate_hz: Some(20.0), ..Wanted::default() };
    let frames = frames(&mut open("gige:127.0.0.19", &wanted), 60);
    let times: Vec<u64> = frames.iter().map(|frame| frame.captured_at.nanos).collect();
    assert!(times.is_sorted_by(|a, b| a < b));
    // Whenever they came, they were taken 50 ms apart, or a multiple of it. While one comes sooner
    // than all before, the camera's clock is only being found.
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
    // A ramp that moves by one from picture to picture. It loses three packets of a thousand, and
    // sends none again.
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
