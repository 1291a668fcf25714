//! Cameras through the library nokhwa: on systems without V4L2, and on Linux on request.
//!
//! | file | is |
//! |---|---|
//! | `device` | requests to nokhwa, and the meaning of its words |
//! | `reader` | the thread of these requests: a call may wait for ever, or panic |
//! | `source` | all of that as a frame source that outlives its camera's absence |
//!
//! `boresight devices` states the limits of nokhwa: its frames lack number, length and error mark,
//! with a time of the wall clock, which may jump; and its names for focus and zoom mean other
//! controls than the lockable ones.

mod device;
mod reader;
mod source;

pub use device::{Listed, find, list};
pub use source::NokhwaCamera;
