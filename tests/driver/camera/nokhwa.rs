//! The backend nokhwa.

use std::{collections::BTreeSet, time::Instant};

use boresight::{
    capture::nokhwa::NokhwaCamera,
    device::{CameraEvent, Fault, PixelLayout},
};

use super::{Seen, cameras, lost, returned, tell, wanted};

fn open(layout: PixelLayout) -> NokhwaCamera {
    NokhwaCamera::of(&cameras(1)[0], &wanted(640, 480, layout)).expect("opens")
}

fn until(source: &mut NokhwaCamera, done: impl Fn(&Seen) -> bool) -> Seen {
    let seen = super::until(source, done);
    assert!(seen.sizes.is_subset(&BTreeSet::from([(640, 480)])), "{:?}", seen.sizes);
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
        assert_eq!(lost(&seen), None);
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
    let seen = until(&mut source, |seen| lost(seen).is_some());
    assert_eq!(lost(&seen), Some(Fault::Stalled));
    tell("thaw");
    until(&mut source, |seen| returned(seen) && seen.frames > 0);
    tell("freeze");
    until(&mut source, |seen| lost(seen).is_some());
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
    let seen = until(&mut source, |seen| lost(seen).is_some());
    assert_eq!(lost(&seen), Some(Fault::Unplugged));
    tell("plug");
    until(&mut source, |seen| returned(seen) && seen.frames > 0);
}
