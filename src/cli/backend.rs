//! The name of a camera backend as an argument.

use clap::ValueEnum;

use boresight_run::config::Backend;

/// Through what a live camera is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum BackendName {
    /// The kernel's own interface, on Linux only: controls are locked and watched, every frame is checked and timed
    V4l,
    /// The library nokhwa, on every system: controls are neither locked nor watched, frames carry no number and are
    /// timed as they arrive; `boresight devices` lists its other limits
    Nokhwa,
}

impl From<BackendName> for Backend {
    fn from(name: BackendName) -> Self {
        match name {
            BackendName::V4l => Self::V4l,
            BackendName::Nokhwa => Self::Nokhwa,
        }
    }
}
