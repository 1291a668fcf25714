//! Machine-vision cameras on the network: GigE Vision, with GenICam features.
//!
//! [`Network`] answers the requests of [`Kernel`](boresight_capture::v4l2::kernel::Kernel) to a
//! driver, so [`LiveCamera`](boresight_capture::v4l2::LiveCamera) settles, locks, watches, loses
//! and finds these cameras like others: same faults, same words.
//!
//! | file | is |
//! |---|---|
//! | `network` | the requests: opening, format and rate, buffers, waits |
//! | `device` | an open camera, and its stream |
//! | `discovery` | cameras answering on the network, and their names |
//! | `meant` | lookup of a camera by name |
//! | `features` | exposure, gain and white balance among the features, and their automatics |
//! | `pixels` | the camera's pixel formats, packed ones too, as common layouts |
//!
//! Packets, resends and the heartbeat are the library's (telegenic). An incomplete frame is marked
//! as bad and never becomes a picture.

mod device;
mod discovery;
mod features;
mod meant;
mod network;
mod pixels;

pub use discovery::{Seen, near};
pub use meant::find;
pub use network::Network;
