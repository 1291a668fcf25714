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

pub use backend::{ChosenCamera, modes, names};

use super::Announcer;
#[cfg(not(all(target_os = "linux", feature = "live", feature = "nokhwa")))]
use super::MissingFeature;
#[cfg(any(all(target_os = "linux", feature = "live"), feature = "nokhwa"))]
use crate::{config::Config, device::Wanted};

/// Whether `name` can only mean a live camera.
pub fn is_name(name: &str) -> bool {
    backend::NAMES.iter().any(|start| name.starts_with(start))
}

/// The mode that the configuration asks for; it was checked when it was read.
#[cfg(any(all(target_os = "linux", feature = "live"), feature = "nokhwa"))]
fn wanted(config: &Config) -> Wanted {
    config.camera.wanted().unwrap_or_default()
}

/// Says which of several cameras could be meant.
#[cfg(any(all(target_os = "linux", feature = "live"), feature = "nokhwa"))]
fn several(names: &[(String, String)]) -> anyhow::Error {
    let lines: Vec<String> =
        names.iter().map(|(source, name)| format!("  {source}  {name}")).collect();
    anyhow::anyhow!("there are several cameras; say which with --source:\n{}", lines.join("\n"))
}
