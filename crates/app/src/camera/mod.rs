//! Which live camera a name means.
//!
//! | file | in builds |
//! |---|---|
//! | `v4l2` | for Linux with the feature `live` |
//! | `nokhwa` | for other systems, or without `live`, with the feature `nokhwa` |
//! | `none` | without live cameras |

#[cfg(not(any(all(target_os = "linux", feature = "live"), feature = "nokhwa")))]
#[path = "none.rs"]
mod backend;
#[cfg(all(not(all(target_os = "linux", feature = "live")), feature = "nokhwa"))]
#[path = "nokhwa.rs"]
mod backend;
#[cfg(all(target_os = "linux", feature = "live"))]
#[path = "v4l2.rs"]
mod backend;
#[cfg(any(all(target_os = "linux", feature = "live"), feature = "nokhwa"))]
mod wanted;

use super::host::UserError;

pub use backend::{ChosenCamera, is_name, modes, names, near};

/// A camera that is there and can't be used: its node, its name, and why.
pub type Unusable = (String, String, UserError);
