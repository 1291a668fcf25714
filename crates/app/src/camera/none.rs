//! A build without live cameras.

use anyhow::bail;

use super::{
    super::{Announcer, MissingFeature},
    Unusable,
};
use boresight_capture::FrameSource;
use boresight_run::config::Config;

/// Whether `name` can only mean a live camera.
pub fn is_name(name: &str) -> bool {
    ["/dev/", "usb:", "place:", "nokhwa:"].iter().any(|start| name.starts_with(start))
}

/// A live camera, of which this build has none.
#[derive(Clone, Debug)]
pub enum ChosenCamera {}

/// The connected cameras, of which this build sees none.
pub fn names() -> Vec<(String, String)> {
    Vec::new()
}

/// No cameras, and none that can't be used.
pub fn near() -> (Vec<(String, String)>, Vec<Unusable>) {
    (names(), Vec::new())
}

/// The modes of a camera, of which this build knows none.
pub fn modes(_name: &str) -> Vec<String> {
    Vec::new()
}

impl ChosenCamera {
    /// No camera.
    ///
    /// # Errors
    ///
    /// [`MissingFeature::LIVE`], always.
    pub fn named(_name: &str, _config: &Config) -> anyhow::Result<Self> {
        bail!(MissingFeature::LIVE)
    }

    /// No camera.
    ///
    /// # Errors
    ///
    /// None.
    pub fn only(_config: &Config, _announcer: &Announcer) -> anyhow::Result<Option<Self>> {
        Ok(None)
    }

    /// The name that finds it again.
    pub fn stable_name(&self) -> String {
        match *self {}
    }

    /// Starts streaming.
    ///
    /// # Errors
    ///
    /// None: there is no such camera.
    pub fn open(&self) -> anyhow::Result<Box<dyn FrameSource>> {
        match *self {}
    }

    /// Starts streaming without setting any control.
    ///
    /// # Errors
    ///
    /// None: there is no such camera.
    pub fn preview(&self) -> anyhow::Result<Box<dyn FrameSource>> {
        match *self {}
    }
}
