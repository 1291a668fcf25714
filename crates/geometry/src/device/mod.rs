//! Facts about a live camera, and events: plain data.
//!
//! [`Fault`] has a stable code for every fault of a camera. [`CameraEvent`]s inform the session
//! about the camera, in order; they are recorded and replayed like every other input.

mod event;
mod fault;
mod info;

pub use event::{
    Adjustable, CameraEvent, Control, ControlChange, Lock, Locks, Mode, PixelLayout, Wanted,
};
pub use fault::Fault;
pub use info::{CameraInfo, ControlBefore};
