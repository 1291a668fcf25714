//! Settings of the live camera.

use serde::{Deserialize, Serialize};

use boresight_capture::{NoRawForm, RawForm, Upright};
use boresight_geometry::{
    device::{PixelLayout, Wanted},
    frame::ImageSize,
};

/// The live camera.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
#[expect(missing_docs, reason = "explained in default.toml")]
pub struct CameraConfig {
    pub mode: String,
    pub backend: Backend,
    pub raw: String,
    pub topic: String,
    pub set_camera_info: bool,
    pub as_stored: bool,
}

/// Backend of a live camera: a name in the table of `app::camera`, checked there, or `auto`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Backend(String);

impl Backend {
    const AUTO: &str = "auto";

    /// The backend called `name`; for `auto`, the usual backend of the camera.
    pub fn named(name: &str) -> Self {
        Self(name.into())
    }

    /// Name of the backend; `None` for `auto`.
    pub fn name(&self) -> Option<&str> {
        (self.0 != Self::AUTO).then_some(&self.0)
    }
}

impl Default for Backend {
    fn default() -> Self {
        Self::named(Self::AUTO)
    }
}

impl Default for CameraConfig {
    fn default() -> Self {
        Self {
            mode: "auto".into(),
            backend: Backend::default(),
            raw: String::new(),
            topic: String::new(),
            set_camera_info: false,
            as_stored: false,
        }
    }
}

impl CameraConfig {
    /// Orientation of pictures in a folder.
    pub fn upright(&self) -> Upright {
        if self.as_stored { Upright::AsStored } else { Upright::AsMarked }
    }

    /// Form of raw pictures; `None` if unset.
    ///
    /// # Errors
    ///
    /// [`NoRawForm`] if the text describes none.
    pub fn raw_form(&self) -> Result<Option<RawForm>, NoRawForm> {
        if self.raw.is_empty() { Ok(None) } else { self.raw.parse().map(Some) }
    }

    /// Wanted mode; `None` if the text is no mode.
    pub fn wanted(&self) -> Option<Wanted> {
        let mut wanted = Wanted::default();
        if self.mode == "auto" {
            return Some(wanted);
        }
        let (text, format) = match self.mode.split_once(':') {
            Some((text, format)) => (text, Some(format)),
            None => (self.mode.as_str(), None),
        };
        let (size, rate) = match text.split_once('@') {
            Some((size, rate)) => (size, Some(rate)),
            None => (text, None),
        };
        if !size.is_empty() {
            let (width, height) = size.split_once('x')?;
            let side = |text: &str| text.parse().ok().filter(|side| *side > 0);
            wanted.size = Some(ImageSize { width_px: side(width)?, height_px: side(height)? });
        }
        if let Some(rate) = rate {
            wanted.rate_hz =
                Some(rate.parse().ok().filter(|hz: &f64| *hz > 0.0 && hz.is_finite())?);
        }
        if let Some(format) = format {
            let named = |layout: &PixelLayout| layout.name().eq_ignore_ascii_case(format);
            wanted.layout = Some(PixelLayout::OF_CAMERAS.into_iter().find(named)?);
        }
        Some(wanted)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn modes_are_named_by_size_rate_and_format() {
        let wanted =
            |mode: &str| CameraConfig { mode: mode.into(), ..CameraConfig::default() }.wanted();
        let size = Some(ImageSize { width_px: 1280, height_px: 720 });
        let none = Wanted::default();
        assert_eq!(wanted("auto"), Some(none));
        assert_eq!(wanted("1280x720"), Some(Wanted { size, ..none }));
        let all = Wanted { size, rate_hz: Some(7.5), layout: Some(PixelLayout::Mjpeg) };
        assert_eq!(wanted("1280x720@7.5:mjpg"), Some(all));
        assert_eq!(wanted(":YUYV"), Some(Wanted { layout: Some(PixelLayout::Yuyv), ..none }));
        for wrong in ["1280", "1280x", "0x720", "1280x720@", "@-3", ":H264"] {
            assert_eq!(wanted(wrong), None, "{wrong}");
        }
    }
}
