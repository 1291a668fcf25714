//! Machine-vision cameras on the network: GigE Vision, with their features as GenICam names them.
//!
//! [`Network`] answers the requests that [`Kernel`](crate::v4l2::kernel::Kernel) makes of a driver, so that
//! [`LiveCamera`](crate::v4l2::LiveCamera) settles, locks, watches, loses and finds these cameras as it does others:
//! same faults, same words.
//!
//! | file | is |
//! |---|---|
//! | `network` | the requests: opening, format and rate, buffers, waits |
//! | `device` | a camera that is open, and its stream |
//! | `discovery` | which cameras answer on the network, and their names |
//! | `meant` | the camera that a name means |
//! | `features` | exposure, gain and white balance among the camera's features, and their automatics |
//! | `pixels` | the camera's pixel formats, packed ones too, as the layouts that are read elsewhere |
//!
//! Packets, resends and the heartbeat are the library's (telegenic). A frame that it couldn't complete is marked as bad
//! and never becomes a picture.

mod device;
mod discovery;
mod features;
mod meant;
mod network;
mod pixels;

pub use discovery::{Seen, near};
pub use meant::find;
pub use network::Network;
