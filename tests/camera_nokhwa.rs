//! The backend nokhwa on the kernel's own USB and camera drivers, in the test machine (`tests/vm/run.sh`).
//!
//! Ignored elsewhere: they would freeze and unplug whatever camera is there.

#![cfg(target_os = "linux")]
#![expect(clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

use std::time::{Duration, Instant};

use boresight::{
    capture::{
        Arrival, FrameSource,
        nokhwa::NokhwaCamera,
        v4l2::{Camera, Linux, discover},
    },
    device::{CameraEvent, Fault, PixelLayout, Wanted},
    frame::ImageSize,
};

const PATIENCE: Duration = Duration::from_millis(100);
/// A test that does not see by then what it waits for has failed.
const LONG: Duration = Duration::from_secs(25);

/// Tells the camera what to do.
fn tell(command: &str) {
    let control = std::env::var("CAMERA_CONTROL").expect("runs in the test machine");
    std::fs::write(control, format!("{command}\n")).expect("the camera listens");
}

fn camera() -> Camera {
    let started = Instant::now();
    loop {
        if let Some(camera) = discover(&mut Linux::default()).cameras.pop() {
            return camera;
        }
        assert!(started.elapsed() < LONG, "there is no camera");
        std::thread::sleep(Duration::from_millis(50));
    }
}

fn open(layout: PixelLayout) -> NokhwaCamera {
    let wanted = Wanted {
        size: Some(ImageSize { width_px: 640, height_px: 480 }),
        rate_hz: Some(30.0),
        layout: Some(layout),
    };
    NokhwaCamera::of(&camera(), &wanted).expect("opens")
}

#[derive(Default)]
struct Seen {
    events: Vec<CameraEvent>,
    frames: u32,
    newest: u64,
}

impl Seen {
    fn lost(&self) -> Option<Fault> {
        self.events.iter().find_map(|event| match event {
            CameraEvent::Lost { fault, .. } => Some(*fault),
            _ => None,
        })
    }

    fn returned(&self) -> bool {
        self.events.iter().any(|event| matches!(event, CameraEvent::Returned { .. }))
    }
}

fn until(source: &mut NokhwaCamera, done: impl Fn(&Seen) -> bool) -> Seen {
    let started = Instant::now();
    let mut seen = Seen::default();
    while !done(&seen) {
        assert!(started.elapsed() < LONG, "{} frames, {:?}", seen.frames, seen.events);
        match source.next_frame(PATIENCE).expect("a camera never breaks") {
            Arrival::Frame(frame) => {
                assert_eq!(frame.image.dimensions(), (640, 480));
                let first = frame.image.as_raw()[0];
                assert!(frame.image.iter().any(|value| value.abs_diff(first) > 40), "a picture");
                seen.frames += 1;
                seen.newest = frame.id.0;
            }
            Arrival::Event(event) => seen.events.push(event),
            Arrival::NothingYet => {}
            Arrival::End => panic!("a camera never ends"),
        }
    }
    seen
}

#[test]
#[ignore = "needs the camera of tests/vm"]
fn pictures_come_and_what_cannot_be_promised_is_said() {
    for layout in [PixelLayout::Yuyv, PixelLayout::Mjpeg] {
        let mut source = open(layout);
        assert_eq!(source.mode().layout, layout);
        let started = Instant::now();
        let seen = until(&mut source, |seen| seen.frames >= 60);
        let secs = started.elapsed().as_secs_f64();
        println!("nokhwa 640x480 {}: {:.1} frames per second", layout.name(), 60.0 / secs);
        assert_eq!(seen.lost(), None);
        let unwatched =
            |e: &CameraEvent| matches!(e, CameraEvent::Doubtful { fault: Fault::Unwatched, .. });
        assert!(seen.events.iter().any(unwatched), "{:?}", seen.events);
    }
}

#[test]
#[ignore = "needs the camera of tests/vm"]
fn a_camera_that_freezes_is_a_time_out_and_the_source_ends_nevertheless() {
    let mut source = open(PixelLayout::Yuyv);
    until(&mut source, |seen| seen.frames >= 3);
    tell("freeze");
    let seen = until(&mut source, |seen| seen.lost().is_some());
    assert_eq!(seen.lost(), Some(Fault::Stalled));
    tell("thaw");
    until(&mut source, |seen| seen.returned() && seen.frames > 0);
    tell("freeze");
    until(&mut source, |seen| seen.lost().is_some());
    // The thread still waits within the library.
    let started = Instant::now();
    drop(source);
    println!("ended {:.1} s after a freeze", started.elapsed().as_secs_f64());
    tell("thaw");
}

#[test]
#[ignore = "needs the camera of tests/vm"]
fn an_unplugged_camera_is_found_again_by_what_it_says_of_itself() {
    let mut source = open(PixelLayout::Mjpeg);
    until(&mut source, |seen| seen.frames >= 3);
    tell("unplug");
    let seen = until(&mut source, |seen| seen.lost().is_some());
    assert_eq!(seen.lost(), Some(Fault::Unplugged));
    tell("plug");
    until(&mut source, |seen| seen.returned() && seen.frames > 0);
}
