//! A camera back with another mode, and torn frames.

use std::time::Duration;

use boresight::device::{Fault, PixelLayout};

use super::{frames, lost, open, rejected, returned, row, small, tell, until, wanted, words};

#[test]
#[ignore = "needs the camera of tests/vm"]
fn a_camera_that_returns_with_another_mode_is_waited_for() {
    let mut source = open(&small());
    frames(&mut source, 3);
    tell("only 320x240");
    tell("unplug");
    until(&mut source, |seen| lost(seen) == Some(Fault::Unplugged));
    tell("plug");
    let seen = until(&mut source, |seen| lost(seen) == Some(Fault::OtherMode));
    assert!(!returned(&seen) && seen.frames == 0, "{:?}", seen.events);
    tell("only");
    let seen = until(&mut source, |seen| returned(seen) && seen.frames > 0);
    assert_eq!(seen.sizes.into_iter().collect::<Vec<_>>(), [(640, 480)]);
    row("returns with another mode", &words(Fault::OtherMode), seen.took);
}

/// Undetectable in such a frame; the calibration weighs such a view by its noise.
#[test]
#[ignore = "needs the camera of tests/vm"]
fn torn_frames_are_whole_to_the_driver() {
    let mut source = open(&wanted(640, 480, PixelLayout::Yuyv));
    let before = rejected(&frames(&mut source, 10));
    tell("torn 10");
    let seen = frames(&mut source, 20);
    assert_eq!((lost(&seen), rejected(&seen)), (None, before), "{:?}", seen.events);
    row("10 torn frames", "nothing; the result weighs a torn view by its noise", Duration::ZERO);
}
