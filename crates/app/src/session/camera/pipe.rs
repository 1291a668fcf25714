//! Pictures written by another program: any camera with a program to send its pictures.

use super::backend::{Backend, ChosenCamera};
use boresight_capture::RawForm;

pub(super) const BACKEND: Backend = Backend {
    name: "pipe",
    is: "what another program writes (pipe:COMMAND), or standard input (-)",
    locks: &[],
    cannot: &[
        "Frames have no numbers, so those that the program lost aren't counted. Time stamps are those of arrival, not of capture.",
        "Raw pictures have no marks: bytes that get lost within a stream go unnoticed. YUV4MPEG2, JPEG and PNG don't have that weakness.",
    ],
    begins: &["pipe:"],
    #[cfg(all(unix, feature = "live"))]
    driver: Ok(built::DRIVER),
    #[cfg(all(unix, not(feature = "live")))]
    driver: Err(|| crate::MissingFeature::LIVE.into()),
    #[cfg(not(unix))]
    driver: Err(|| anyhow::anyhow!("the pipe backend is available on Linux and macOS only")),
};

/// Camera behind the command `name`, not started yet; `raw` describes headerless pictures.
#[cfg_attr(
    not(all(unix, feature = "live")),
    allow(clippy::unnecessary_wraps, reason = "as in a build that reads pipes")
)]
pub(super) fn chosen(name: &str, raw: Option<RawForm>) -> anyhow::Result<ChosenCamera> {
    #[cfg(all(unix, feature = "live"))]
    return Ok(built::chosen(name, raw));
    #[cfg(not(all(unix, feature = "live")))]
    {
        let _ = (name, raw);
        BACKEND.driver()?;
        Err(crate::MissingFeature::LIVE.into())
    }
}

#[cfg(all(unix, feature = "live"))]
mod built {
    use crate::session::camera::{ChosenCamera, Devices, Driver, Near};
    use boresight_capture::{Pipe, RawForm, without_secrets};

    /// Driver without listing: commands come from the person.
    pub(super) const DRIVER: Driver = Driver {
        near: Near::default,
        modes: |_| Vec::new(),
        find: |name, _| Ok(chosen(name, None)),
        devices: Devices::default,
    };

    pub(super) fn chosen(name: &str, raw: Option<RawForm>) -> ChosenCamera {
        let command = name.to_owned();
        ChosenCamera::new(without_secrets(name), move |_| Ok(Box::new(Pipe::open(&command, raw)?)))
    }
}
