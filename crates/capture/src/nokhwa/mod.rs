//! Cameras through the library nokhwa: on systems without V4L2, and on Linux on request.
//!
//! | file | is |
//! |---|---|
//! | `device` | what nokhwa is asked, and what its words mean |
//! | `reader` | the thread on which it is asked: it may wait for ever, or panic |
//! | `source` | that as a frame source which outlives its camera's absence |
//!
//! `boresight devices` states the limits of nokhwa: it hands frames over without number, length and error mark, with a
//! time of the wall clock, which may jump; and its names for focus and zoom mean other controls than those that lock
//! them.

mod device;
mod reader;
mod source;

pub use device::{Listed, find, list};
pub use source::NokhwaCamera;
