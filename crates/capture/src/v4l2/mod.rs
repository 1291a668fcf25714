//! Cameras of Linux (V4L2), including faulty ones.
//!
//! | file | is |
//! |---|---|
//! | [`kernel`] | the system calls by meaning: questions, and the form of the answers |
//! | [`linux`] | those calls; the only unsafe code of the program |
//! | `system_files` | other facts of the system: nodes, names, programs using them |
//! | [`discovery`] | connected cameras, and marks to recognise them by |
//! | [`mode`] | offered and granted modes |
//! | `queue` | the buffers, and their owners |
//! | `stream` | one run: newest frames, checked, decoded, timed |
//! | `controls` | focus, zoom, exposure, gain, white balance: locked, read back, restored |
//! | [`source`] | all of that as a frame source that outlives its camera's absence |
//!
//! Everything from a device or driver is untrusted: numbers are bounded, names are bytes, lists
//! end.

mod controls;
pub mod discovery;
pub mod kernel;
pub mod linux;
pub mod mode;
mod queue;
pub mod source;
mod stream;
mod system_files;

pub use controls::ids;
pub use controls::{ControlState, control_states};
pub use discovery::{Camera, Found, discover, find};
pub use linux::Linux;
pub use queue::BUFFERS;
pub use source::LiveCamera;
pub use source::found_again;
