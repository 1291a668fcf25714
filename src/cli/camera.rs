//! Which live camera is used.

use anyhow::bail;

use crate::{capture::FrameSource, config::Config, device::Wanted};
#[cfg(target_os = "linux")]
use crate::{
    capture::{
        CaptureError,
        v4l2::{Camera, Found, Linux, LiveCamera, discover, find, mode::layout},
    },
    device::{Fault, Mode},
    frame::ImageSize,
    text,
};

/// Whether `name` is that of a camera and of nothing else.
pub(super) fn is_name(name: &str) -> bool {
    ["/dev/", "usb:", "place:"].iter().any(|start| name.starts_with(start))
}

/// A camera that was found, not yet opened.
#[derive(Clone, Debug)]
pub(super) struct ChosenCamera {
    #[cfg(target_os = "linux")]
    camera: Camera,
    #[cfg_attr(not(target_os = "linux"), expect(dead_code, reason = "no camera can be opened"))]
    wanted: Wanted,
}

/// What the configuration, which was checked when it was read, wants of the mode.
fn wanted(config: &Config) -> Wanted {
    config.camera.wanted().unwrap_or_default()
}

/// The cameras that are there: what finds each again, and what it calls itself.
#[cfg(target_os = "linux")]
pub(super) fn names() -> Vec<(String, String)> {
    let found = discover(&mut Linux::default());
    found
        .cameras
        .iter()
        .map(|camera| (camera.stable_name(), text::camera::printable(&camera.name)))
        .collect()
}

/// The modes of the camera called `name` that can be read, as the settings name them; none without such a
/// camera.
#[cfg(target_os = "linux")]
pub(super) fn modes(name: &str) -> Vec<String> {
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

#[cfg(target_os = "linux")]
fn round(hz: f64) -> f64 {
    (100.0 * hz).round() / 100.0
}

/// There are no live cameras on this system.
#[cfg(not(target_os = "linux"))]
pub(super) fn modes(_name: &str) -> Vec<String> {
    Vec::new()
}

/// There are no live cameras on this system.
#[cfg(not(target_os = "linux"))]
pub(super) fn names() -> Vec<(String, String)> {
    Vec::new()
}

#[cfg(target_os = "linux")]
impl ChosenCamera {
    /// The camera that `name` means.
    pub(super) fn named(name: &str, config: &Config) -> anyhow::Result<Self> {
        let found = discover(&mut Linux::default());
        let camera =
            find(&found, name).map_err(|(fault, detail)| CaptureError::Camera { fault, detail })?;
        Ok(Self { camera, wanted: wanted(config) })
    }

    /// The only camera that is no virtual or infrared one; `None` if there is none.
    pub(super) fn only(config: &Config) -> anyhow::Result<Option<Self>> {
        let Found { cameras, others } = discover(&mut Linux::default());
        let mut ordinary: Vec<Camera> = cameras.into_iter().filter(Camera::is_ordinary).collect();
        if ordinary.len() > 1 {
            let names: Vec<String> = ordinary
                .iter()
                .map(|camera| {
                    format!("  {}  {}", camera.stable_name(), text::camera::printable(&camera.name))
                })
                .collect();
            bail!("there are several cameras; say which with --source:\n{}", names.join("\n"));
        }
        let Some(camera) = ordinary.pop() else {
            // A camera that is there and cannot be used must not be passed over in silence.
            for other in
                others.iter().filter(|o| matches!(o.why, Fault::Busy | Fault::NotPermitted))
            {
                let (cause, action) = text::camera::with_detail(other.why, &other.detail);
                super::say(&format!("{}: {cause}. {action}", other.why.code()));
            }
            return Ok(None);
        };
        super::say(&format!(
            "Camera: {} ({})",
            text::camera::printable(&camera.name),
            camera.stable_name()
        ));
        Ok(Some(Self { camera, wanted: wanted(config) }))
    }

    /// What finds it again.
    pub(super) fn stable_name(&self) -> String {
        self.camera.stable_name()
    }

    /// Opens it.
    pub(super) fn open(&self) -> anyhow::Result<Box<dyn FrameSource>> {
        Ok(Box::new(LiveCamera::open(Linux::default(), self.camera.clone(), &self.wanted)?))
    }
}

#[cfg(not(target_os = "linux"))]
impl ChosenCamera {
    /// There are no live cameras on this system.
    pub(super) fn named(name: &str, _config: &Config) -> anyhow::Result<Self> {
        bail!("{name:?}: live cameras are supported on Linux only")
    }

    /// There is none.
    pub(super) fn only(config: &Config) -> anyhow::Result<Option<Self>> {
        let _ = wanted(config);
        Ok(None)
    }

    /// Never called: there is none.
    pub(super) fn stable_name(&self) -> String {
        String::new()
    }

    /// Never called: there is none.
    pub(super) fn open(&self) -> anyhow::Result<Box<dyn FrameSource>> {
        bail!("live cameras are supported on Linux only")
    }
}
