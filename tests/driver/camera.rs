//! The capture code on the kernel's own USB and camera drivers, in the test machine
//! (`tests/vm/run.sh`).
//!
//! The camera is `uvcsim`, controlled by lines written to `$CAMERA_CONTROL`. Each test waits for
//! its condition. Ignored elsewhere: the tests would plug and unplug real cameras.

mod nokhwa;
mod odd_frames;
mod rates;
mod refused;
mod replugs;
mod time_stamps;
mod vivid;

use std::{
    collections::BTreeSet,
    time::{Duration, Instant},
};

use boresight::{
    capture::{
        Arrival, CaptureError, FrameSource,
        v4l2::{
            Camera, Linux, LiveCamera, discover,
            kernel::{Format, Kernel},
        },
    },
    device::{CameraEvent, Control, Fault, Lock, PixelLayout, Wanted},
    frame::ImageSize,
    text,
};

const PATIENCE: Duration = Duration::from_millis(100);
/// Time limit of a test's condition.
const LONG: Duration = Duration::from_secs(25);

/// Tells the camera what to do.
fn tell(command: &str) {
    let control = std::env::var("CAMERA_CONTROL").expect("runs in the test machine");
    std::fs::write(control, format!("{command}\n")).expect("the camera listens");
}

/// The cameras, once there are `count`.
fn cameras(count: usize) -> Vec<Camera> {
    let started = Instant::now();
    loop {
        let found = discover(&mut Linux::default()).cameras;
        if found.len() == count {
            return found;
        }
        assert!(started.elapsed() < LONG, "{} cameras, want {count}", found.len());
        std::thread::sleep(Duration::from_millis(50));
    }
}

fn wanted(width_px: u32, height_px: u32, layout: PixelLayout) -> Wanted {
    Wanted {
        size: Some(ImageSize { width_px, height_px }),
        rate_hz: Some(30.0),
        layout: Some(layout),
    }
}

fn small() -> Wanted {
    wanted(640, 480, PixelLayout::Mjpeg)
}

fn open(wanted: &Wanted) -> LiveCamera<Linux> {
    let camera = cameras(1).remove(0);
    LiveCamera::open(Linux::default(), camera, wanted).expect("opens")
}

/// Observations of a camera until a test's condition held.
#[derive(Default)]
struct Seen {
    events: Vec<CameraEvent>,
    frames: u32,
    /// Number of the newest frame; skipped frames are counted.
    newest: u64,
    /// Of the pictures.
    sizes: BTreeSet<(u32, u32)>,
    took: Duration,
}

fn until(source: &mut impl FrameSource, mut done: impl FnMut(&Seen) -> bool) -> Seen {
    let started = Instant::now();
    let mut seen = Seen::default();
    while !done(&seen) {
        seen.took = started.elapsed();
        assert!(seen.took < LONG, "{} frames, {:?}", seen.frames, seen.events);
        match source.next_frame(PATIENCE).expect("a camera never breaks") {
            Arrival::Frame(frame) => {
                let first = frame.image.as_raw()[0];
                assert!(frame.image.iter().any(|value| value.abs_diff(first) > 40), "a picture");
                seen.frames += 1;
                seen.newest = frame.id.0;
                seen.sizes.insert(frame.image.dimensions());
            }
            Arrival::Event(event) => seen.events.push(event),
            Arrival::NothingYet => {}
            Arrival::End => panic!("a camera never ends"),
        }
    }
    seen.took = started.elapsed();
    seen
}

fn frames(source: &mut impl FrameSource, count: u32) -> Seen {
    until(source, |seen| seen.frames >= count)
}

fn lost(seen: &Seen) -> Option<Fault> {
    seen.events.iter().find_map(|event| match event {
        CameraEvent::Lost { fault, .. } => Some(*fault),
        _ => None,
    })
}

fn returned(seen: &Seen) -> bool {
    seen.events.iter().any(|event| matches!(event, CameraEvent::Returned { .. }))
}

fn rejected(seen: &Seen) -> u64 {
    let count = |event: &CameraEvent| match event {
        CameraEvent::Counted { rejected, .. } => Some(*rejected),
        _ => None,
    };
    seen.events.iter().rev().find_map(count).unwrap_or(0)
}

/// A line of the table for a person: the fault, its message, and the time to recovery.
fn row(fault: &str, saw: &str, recovered: Duration) {
    let recovered = match recovered {
        Duration::ZERO => "at once".into(),
        time => format!("{:.1} s", time.as_secs_f64()),
    };
    println!("| {fault} | {saw} | {recovered} |");
}

/// Message of a fault.
fn words(fault: Fault) -> String {
    format!("{}: {}", fault.code(), text::camera::fault(fault).0)
}

#[test]
#[ignore = "needs the camera of tests/vm"]
fn faults_of_the_stream_are_survived() {
    let mut source = open(&small());
    frames(&mut source, 3);

    tell("freeze");
    let seen = until(&mut source, |seen| lost(seen).is_some());
    assert_eq!(lost(&seen), Some(Fault::Stalled));
    tell("thaw");
    let seen = until(&mut source, |seen| returned(seen) && seen.frames > 0);
    row("no frames come", &words(Fault::Stalled), seen.took);

    let mut before = rejected(&frames(&mut source, 40));
    for (command, why, most) in [
        ("short 5", "5 cut frames", 5),
        ("badjpeg 5", "5 frames with changed bytes", 5),
        ("errbit 5", "5 frames with the error bit", 5),
    ] {
        tell(command);
        let seen = frames(&mut source, 60);
        assert_eq!(lost(&seen), None, "{command}: {:?}", seen.events);
        // Counted when reported.
        let count = rejected(&seen).max(before) - before;
        assert!(count <= most, "{command}: {count}");
        before += count;
        row(why, &format!("nothing: {count} rejected, none shown"), Duration::ZERO);
    }

    tell("drop 20");
    let seen = frames(&mut source, 40);
    row("20 frames lost", &lost(&seen).map_or("a gap".into(), words), Duration::ZERO);

    tell("nodht 1");
    let seen = frames(&mut source, 40);
    assert_eq!((lost(&seen), rejected(&seen)), (None, 0));
    row("JPEG without Huffman tables", "nothing: they are put in", Duration::ZERO);
    tell("nodht 0");

    tell("stall_stream");
    let seen = frames(&mut source, 30);
    row("stalled endpoint", &lost(&seen).map_or("a gap".into(), words), seen.took);
}

#[test]
#[ignore = "needs the camera of tests/vm"]
fn a_camera_that_cannot_start_says_so() {
    let camera = cameras(1).remove(0);
    tell("stall_commit 1");
    // The pipe is read in order, but not at once.
    let started = Instant::now();
    let fault = loop {
        match LiveCamera::open(Linux::default(), camera.clone(), &small()) {
            Err(CaptureError::Camera { fault, .. }) => break fault,
            Err(other) => panic!("{other}"),
            Ok(_) => assert!(started.elapsed() < LONG),
        }
    };
    tell("stall_commit 0");
    assert_eq!(fault, Fault::Transfer);
    let started = Instant::now();
    while LiveCamera::open(Linux::default(), camera.clone(), &small()).is_err() {
        assert!(started.elapsed() < LONG);
    }
    row("the start is refused", &words(fault), started.elapsed());
}

#[test]
#[ignore = "needs the camera of tests/vm"]
fn a_mode_that_another_program_left_behind_does_no_harm() {
    let camera = cameras(1).remove(0);
    let mut kernel = Linux::default();
    let device = kernel.open(&camera.node.path).expect("opens");
    let odd =
        Format { width: 640, height: 360, fourcc: *b"YUYV", bytes_per_line: 0, size_image: 0 };
    kernel.set_format(device, odd).expect("granted");
    kernel.set_interval(device, (2, 15)).expect("granted");
    kernel.close(device);
    let mut source = open(&small());
    frames(&mut source, 10);
    assert_eq!(source.mode().interval_secs, Some((1, 30)));
    row("left at 640x360 YUYV, 7.5 fps", "nothing", Duration::ZERO);
}

#[test]
#[ignore = "needs the camera of tests/vm"]
fn focus_zoom_and_exposure_are_locked_watched_and_put_back() {
    let mut source = open(&small());
    let locked = |seen: &Seen| {
        seen.events.iter().find_map(|event| match event {
            CameraEvent::Locked { locks } => Some(*locks),
            _ => None,
        })
    };
    let seen = until(&mut source, |seen| locked(seen).is_some() && seen.frames > 3);
    let locks = locked(&seen).expect("locked");
    assert_eq!(locks.focus, Lock::Locked { value: 30 });
    assert_eq!(locks.zoom, Lock::Locked { value: 100 });
    assert!(matches!(locks.exposure, Lock::Locked { .. }), "{:?}", locks.exposure);
    for (command, control) in
        [("set zoom 180", Control::Zoom), ("set focus_auto 1", Control::Focus)]
    {
        tell(command);
        let seen = until(&mut source, |seen| {
            seen.events
                .iter()
                .any(|e| matches!(e, CameraEvent::ControlChanged(c) if c.control == control))
        });
        let noticed = seen.took;
        let seen = until(&mut source, |seen| {
            seen.events.iter().any(
                |e| matches!(e, CameraEvent::ControlRestored { control: c, .. } if *c == control),
            )
        });
        row(command, &format!("{}, put back", words(Fault::GeometryMoved)), noticed + seen.took);
    }
    // A person sets a control, within the driver's limits.
    let listed = source.adjustables();
    let zoom = listed.iter().find(|one| one.control == Control::Zoom).expect("can be set");
    source.adjust(Control::Zoom, zoom.max);
    let set = |seen: &Seen| {
        seen.events.iter().find_map(|event| match event {
            CameraEvent::ControlSet { control: Control::Zoom, lock, .. } => Some(*lock),
            _ => None,
        })
    };
    let seen = until(&mut source, |seen| set(seen).is_some() && seen.frames > 3);
    assert_eq!(set(&seen), Some(Lock::Locked { value: zoom.max }), "as read back");
    row("zoom set by hand", "read back, and pictures again", seen.took);
    drop(source);
    let mut kernel = Linux::default();
    let device = kernel.open(&cameras(1)[0].node.path).expect("opens");
    assert_eq!(kernel.control(device, 0x009a_090c), Ok(1), "autofocus is on again");
    assert_eq!(kernel.control(device, 0x009a_090d), Ok(100), "zoom is as it was");
    assert_eq!(kernel.control(device, 0x009a_0901), Ok(3), "exposure is automatic again");
    kernel.close(device);
}

#[test]
#[ignore = "needs the camera of tests/vm"]
fn another_camera_in_its_place_is_not_used_and_odd_names_do_no_harm() {
    let mut source = open(&small());
    frames(&mut source, 3);
    tell("unplug");
    until(&mut source, |seen| lost(seen) == Some(Fault::Unplugged));
    tell("serial 0002");
    tell("plug");
    let seen = until(&mut source, |seen| lost(seen) == Some(Fault::OtherCamera));
    row("another camera in its place", &words(Fault::OtherCamera), seen.took);
    tell("unplug");
    cameras(0);
    tell("serial 0001");
    tell("plug");
    let seen = until(&mut source, |seen| returned(seen) && seen.frames > 0);
    row("the first one again", "it is back", seen.took);
    drop(source);

    tell("unplug");
    cameras(0);
    // The kernel cuts names after 31 bytes: here within a character.
    tell("name Kamera für die Prüfung äöüäöüäöü");
    tell("plug");
    let camera = cameras(1).remove(0);
    row("a name cut within a character", &format!("{:?}", camera.name), Duration::ZERO);
    let mut source = open(&small());
    frames(&mut source, 3);
    drop(source);
    tell("unplug");
    cameras(0);
    tell("name uvcsim HD camera");
    tell("plug");
    cameras(1);
}

#[test]
#[ignore = "needs two cameras of tests/vm"]
fn two_equal_cameras_are_known_by_their_ports() {
    let found = cameras(2);
    assert!(found.iter().all(|camera| camera.has_twin));
    let names: Vec<String> = found.iter().map(Camera::stable_name).collect();
    assert_ne!(names[0], names[1]);
    let mut source = LiveCamera::open(Linux::default(), found[0].clone(), &small()).expect("opens");
    let twin = |e: &CameraEvent| matches!(e, CameraEvent::Doubtful { fault: Fault::Twin, .. });
    let seen = until(&mut source, |seen| seen.events.iter().any(twin) && seen.frames > 3);
    row("two equal cameras", &format!("{} ({})", words(Fault::Twin), names[0]), seen.took);
    // Its twin stays, and is not taken for it.
    tell("unplug");
    let seen = until(&mut source, |seen| lost(seen).is_some());
    if source.camera().node.place != found[1].node.place {
        assert_eq!(lost(&seen), Some(Fault::Unplugged));
    }
    tell("plug");
    let seen = until(&mut source, |seen| returned(seen) && seen.frames > 0);
    row("one of them unplugged and back", &words(Fault::Unplugged), seen.took);
    assert_eq!(source.camera().node.place, found[0].node.place);
}
