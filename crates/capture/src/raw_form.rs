//! A person's description of raw pictures, whose bytes don't describe themselves.

use std::str::FromStr;

use super::{PICTURE_LIMIT_PX, pixels::Pixels};
use boresight_geometry::frame::ImageSize;

/// Size, format and rate of raw pictures: `1280x720:GRAY8@30`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RawForm {
    /// Size of every picture.
    pub size: ImageSize,
    /// Format of the pixels.
    pub pixels: Pixels,
    /// Pictures per second, if given.
    pub rate_hz: Option<f64>,
}

/// Error of a text that describes no raw pictures.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NoRawForm {
    /// Size, colon or format is missing, or a number makes no sense.
    #[error(
        "raw pictures are described as WIDTHxHEIGHT:FORMAT@RATE, such as 1280x720:gray@30 (@RATE may be left out)"
    )]
    Text,
    /// The format isn't known.
    #[error(
        "pixel format {0:?} can't be read; try gray, gray16le, rgb24, bgr24, yuv420p, nv12, yuyv422, uyvy422 or bayer_rggb8"
    )]
    Format(String),
}

impl FromStr for RawForm {
    type Err = NoRawForm;

    fn from_str(text: &str) -> Result<Self, NoRawForm> {
        let (size, rest) = text.split_once(':').ok_or(NoRawForm::Text)?;
        let (width, height) = size.split_once('x').ok_or(NoRawForm::Text)?;
        let side = |text: &str| {
            let side = text.trim().parse().ok();
            side.filter(|side| (1..=PICTURE_LIMIT_PX).contains(side)).ok_or(NoRawForm::Text)
        };
        let size = ImageSize { width_px: side(width)?, height_px: side(height)? };
        let (format, rate) = match rest.split_once('@') {
            Some((format, rate)) => (format, Some(rate)),
            None => (rest, None),
        };
        let sane = |hz: &f64| (0.01..=10_000.0).contains(hz);
        let rate_hz = match rate {
            Some(rate) => Some(rate.parse().ok().filter(sane).ok_or(NoRawForm::Text)?),
            None => None,
        };
        let unknown = || NoRawForm::Format(format.into());
        Ok(Self { size, pixels: Pixels::named(format).ok_or_else(unknown)?, rate_hz })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn raw_pictures_are_described_by_size_format_and_rate() {
        let form: RawForm = "1280x720:GRAY8@29.97".parse().expect("a form");
        let size = ImageSize { width_px: 1280, height_px: 720 };
        let pixels = Pixels::named("mono8").expect("known");
        assert_eq!(form, RawForm { size, pixels, rate_hz: Some(29.97) });
        assert_eq!("640x480:nv12".parse::<RawForm>().expect("a form").rate_hz, None);
        for wrong in [
            "",
            "640x480",
            "640:gray",
            "0x480:gray",
            "640x480:gray@",
            "640x480:gray@-3",
            "99999x9:gray",
        ] {
            assert_eq!(wrong.parse::<RawForm>(), Err(NoRawForm::Text), "{wrong}");
        }
        assert_eq!("64x48:h264".parse::<RawForm>(), Err(NoRawForm::Format("h264".into())));
    }
}
