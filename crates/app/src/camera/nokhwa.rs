//! Cameras listed by nokhwa: on other systems, and in builds without the feature `live`.

use anyhow::bail;

use super::{
    super::{Announcer, MissingFeature},
    Unusable,
    wanted::{several, wanted},
};
use boresight_capture::{
    CaptureError, FrameSource,
    nokhwa::{NokhwaCamera, find, list},
};
use boresight_geometry::device::Wanted;
use boresight_present::text;
use boresight_run::config::Config;

/// Whether `name` can only mean a live camera.
pub fn is_name(name: &str) -> bool {
    ["nokhwa:"].iter().any(|start| name.starts_with(start))
}

/// A camera that was found but isn't open yet.
#[derive(Clone, Debug)]
pub struct ChosenCamera {
    /// Its name in nokhwa's list.
    source: String,
    wanted: Wanted,
}

/// Modes are not listed on this system.
pub fn modes(_name: &str) -> Vec<String> {
    Vec::new()
}

/// The connected cameras: the name that finds each again, and the product name.
pub fn names() -> Vec<(String, String)> {
    let listed = list().unwrap_or_default();
    listed
        .into_iter()
        .map(|camera| (camera.source, text::camera::printable(&camera.name)))
        .collect()
}

/// The connected cameras, as [`names`]; those that can't be used aren't known here.
pub fn near() -> (Vec<(String, String)>, Vec<Unusable>) {
    (names(), Vec::new())
}

impl ChosenCamera {
    /// The camera that `name` means.
    ///
    /// # Errors
    ///
    /// [`CaptureError::Camera`] if there is no such camera.
    pub fn named(name: &str, config: &Config) -> anyhow::Result<Self> {
        if !config.camera.backend.is_nokhwa() {
            if cfg!(target_os = "linux") {
                bail!(MissingFeature::LIVE);
            }
            bail!(text::backend::V4L_ELSEWHERE);
        }
        let failed = |(fault, detail)| CaptureError::Camera { fault, detail };
        let source = find(&list().map_err(failed)?, name).map_err(failed)?.source;
        Ok(Self { source, wanted: wanted(config) })
    }

    /// The only camera; `None` if there is none. Announces which.
    ///
    /// # Errors
    ///
    /// If there are several: the names to choose from.
    pub fn only(config: &Config, announcer: &Announcer) -> anyhow::Result<Option<Self>> {
        let names = names();
        match names.as_slice() {
            [] => Ok(None),
            [(source, name)] => {
                announcer.say(&format!("Camera: {name} ({source})"));
                Self::named(source, config).map(Some)
            }
            names => bail!(several(names)),
        }
    }

    /// The name that finds it again.
    pub fn stable_name(&self) -> String {
        self.source.clone()
    }

    /// Starts streaming.
    ///
    /// # Errors
    ///
    /// [`CaptureError::Camera`] with the fault.
    pub fn open(&self) -> anyhow::Result<Box<dyn FrameSource>> {
        Ok(Box::new(NokhwaCamera::named(&self.source, &self.wanted)?))
    }

    /// The same: nokhwa sets no control.
    ///
    /// # Errors
    ///
    /// As [`Self::open`].
    pub fn preview(&self) -> anyhow::Result<Box<dyn FrameSource>> {
        self.open()
    }
}
