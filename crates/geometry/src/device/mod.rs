//! Facts about a live camera, and its events: plain data.
//!
//! [`Fault`] has one stable code for everything that goes wrong with a camera. [`CameraEvent`] is what a camera
//! tells the session, in order; it is recorded and replayed like every other input.

mod event;
mod fault;
mod info;

pub use event::{
    Adjustable, CameraEvent, Control, ControlChange, Lock, Locks, Mode, PixelLayout, Wanted,
};
pub use fault::Fault;
pub use info::{CameraInfo, ControlBefore};
