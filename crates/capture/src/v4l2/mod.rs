//! Cameras of Linux (V4L2), as they are in the field.
//!
//! | file | is |
//! |---|---|
//! | [`kernel`] | the system calls by meaning: what may be asked, and in which words it is answered |
//! | [`linux`] | those calls; the only unsafe code of the program |
//! | `system_files` | what else the system says: nodes, names, who has one open |
//! | [`discovery`] | which cameras are there; by what each is known again |
//! | [`mode`] | what a camera offers and what is granted |
//! | `queue` | the buffers, and who owns each |
//! | `stream` | one run: newest frames, checked, decoded, timed |
//! | `controls` | focus, zoom, exposure, gain, white balance: locked, read back, put back |
//! | [`source`] | all of that as a frame source that outlives its camera's absence |
//!
//! Everything from a device or driver is untrusted: numbers are bounded, names are bytes, lists end.

mod controls;
pub mod discovery;
pub mod kernel;
pub mod linux;
pub mod mode;
mod queue;
pub mod source;
mod stream;
mod system_files;

#[cfg(feature = "gige")]
pub(crate) use controls::ids;
pub use controls::{ControlState, control_states};
pub use discovery::{Camera, Found, discover, find};
pub use linux::Linux;
#[cfg(feature = "gige")]
pub(crate) use queue::BUFFERS;
pub use source::LiveCamera;
pub use source::found_again;
