//! The cameras of Linux, found through V4L2.

use anyhow::bail;

#[cfg(not(feature = "nokhwa"))]
use super::super::MissingFeature;
use super::{
    super::{Announcer, host::UserError},
    Unusable,
    wanted::{several, wanted},
};
#[cfg(feature = "nokhwa")]
use boresight_capture::nokhwa::NokhwaCamera;
use boresight_capture::{
    CaptureError, FrameSource, layout,
    v4l2::{Camera, Found, Linux, LiveCamera, discover, find},
};
use boresight_geometry::{
    device::{Fault, Mode, Wanted},
    frame::ImageSize,
};
use boresight_present::text;
use boresight_run::config::{Backend, Config};

/// Whether `name` can only mean a live camera.
pub fn is_name(name: &str) -> bool {
    ["/dev/", "usb:", "place:"].iter().any(|start| name.starts_with(start))
}

/// A camera that was found but isn't open yet.
#[derive(Clone, Debug)]
pub struct ChosenCamera {
    camera: Camera,
    backend: Backend,
    wanted: Wanted,
}

/// The connected cameras: the name that finds each again, and the product name.
pub fn names() -> Vec<(String, String)> {
    named(&discover(&mut Linux::default()).cameras)
}

/// The connected cameras, as [`names`], and those that can't be used now: node, name, and why.
pub fn near() -> (Vec<(String, String)>, Vec<Unusable>) {
    let Found { cameras, others } = discover(&mut Linux::default());
    let unusable = others
        .into_iter()
        .filter(|other| matches!(other.why, Fault::Busy | Fault::NotPermitted))
        .map(|other| {
            let node = other.node.path.display().to_string();
            let (what, action) = text::camera::with_detail(other.why, &other.detail);
            (node.clone(), node, UserError { what, action: Some(action) })
        })
        .collect();
    (named(&cameras), unusable)
}

fn named(cameras: &[Camera]) -> Vec<(String, String)> {
    cameras
        .iter()
        .map(|camera| (camera.stable_name(), text::camera::printable(&camera.name)))
        .collect()
}

/// The modes of the camera called `name` that can be read, as the settings name them; none without such a
/// camera.
pub fn modes(name: &str) -> Vec<String> {
    if !is_name(name) {
        return Vec::new();
    }
    let Ok(camera) = find(&discover(&mut Linux::default()), name) else { return Vec::new() };
    let mut modes: Vec<(u32, String)> = camera
        .offers
        .iter()
        .filter_map(|offer| {
            let layout = layout(offer.fourcc)?;
            let ImageSize { width_px, height_px } = offer.size;
            let interval_secs = offer.interval.map(|fraction| (fraction.0, fraction.1));
            let mode = Mode { size: offer.size, layout, interval_secs };
            let rate = mode.rate_hz().map_or(String::new(), |hz| format!("@{}", round(hz)));
            let mode = format!("{width_px}x{height_px}{rate}:{}", layout.name());
            Some((width_px * height_px, mode))
        })
        .collect();
    modes.sort_by(|a, b| b.cmp(a));
    modes.dedup();
    modes.into_iter().map(|(_, mode)| mode).collect()
}

fn round(hz: f64) -> f64 {
    (100.0 * hz).round() / 100.0
}

impl ChosenCamera {
    fn new(camera: Camera, config: &Config) -> Self {
        Self { camera, backend: config.camera.backend, wanted: wanted(config) }
    }

    /// The camera that `name` means.
    ///
    /// # Errors
    ///
    /// [`CaptureError::Camera`] if there is no such camera.
    pub fn named(name: &str, config: &Config) -> anyhow::Result<Self> {
        let found = discover(&mut Linux::default());
        let camera =
            find(&found, name).map_err(|(fault, detail)| CaptureError::Camera { fault, detail })?;
        Ok(Self::new(camera, config))
    }

    /// The only camera that isn't virtual or infrared; `None` if there is none. Announces which, or why one
    /// that is connected can't be used.
    ///
    /// # Errors
    ///
    /// If there are several: the names to choose from.
    pub fn only(config: &Config, announcer: &Announcer) -> anyhow::Result<Option<Self>> {
        let Found { cameras, others } = discover(&mut Linux::default());
        let mut ordinary: Vec<Camera> = cameras.into_iter().filter(Camera::is_ordinary).collect();
        if ordinary.len() > 1 {
            bail!(several(&named(&ordinary)));
        }
        let Some(camera) = ordinary.pop() else {
            // A camera that is there and cannot be used must not be passed over in silence.
            for other in
                others.iter().filter(|o| matches!(o.why, Fault::Busy | Fault::NotPermitted))
            {
                let (cause, action) = text::camera::with_detail(other.why, &other.detail);
                announcer.say(&format!("{}: {cause}. {action}", other.why.code()));
            }
            return Ok(None);
        };
        announcer.say(&format!(
            "Camera: {} ({})",
            text::camera::printable(&camera.name),
            camera.stable_name()
        ));
        Ok(Some(Self::new(camera, config)))
    }

    /// The name that finds it again.
    pub fn stable_name(&self) -> String {
        self.camera.stable_name()
    }

    /// Starts streaming.
    ///
    /// # Errors
    ///
    /// [`CaptureError::Camera`] with the fault.
    pub fn open(&self) -> anyhow::Result<Box<dyn FrameSource>> {
        if self.backend.is_nokhwa() {
            #[cfg(feature = "nokhwa")]
            return Ok(Box::new(NokhwaCamera::of(&self.camera, &self.wanted)?));
            #[cfg(not(feature = "nokhwa"))]
            bail!(MissingFeature::NOKHWA);
        }
        Ok(Box::new(LiveCamera::open(Linux::default(), self.camera.clone(), &self.wanted)?))
    }

    /// Starts streaming without setting any control: somebody only looks.
    ///
    /// # Errors
    ///
    /// As [`Self::open`].
    pub fn preview(&self) -> anyhow::Result<Box<dyn FrameSource>> {
        if self.backend.is_nokhwa() {
            // It sets none.
            return self.open();
        }
        Ok(Box::new(LiveCamera::preview(Linux::default(), self.camera.clone(), &self.wanted)?))
    }
}
