//! A logo inside the page.

use std::io::Cursor;

use base64::{Engine, engine::general_purpose::STANDARD};
use image::{ImageFormat, ImageReader};

/// Maximum side length of a logo.
const LONGEST_PX: u32 = 8192;

/// PNG or JPEG, with the bytes of its file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Logo {
    address: String,
    width_px: u32,
    height_px: u32,
}

impl Logo {
    /// Logo from the bytes of a file. `None` unless PNG or JPEG with sides up to 8192 pixels.
    pub fn of(bytes: &[u8]) -> Option<Self> {
        let reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format().ok()?;
        let kind = match reader.format()? {
            ImageFormat::Png => "png",
            ImageFormat::Jpeg => "jpeg",
            _ => return None,
        };
        let (width_px, height_px) = reader.into_dimensions().ok()?;
        let is_side = |side: u32| (1..=LONGEST_PX).contains(&side);
        let address = format!("data:image/{kind};base64,{}", STANDARD.encode(bytes));
        (is_side(width_px) && is_side(height_px)).then_some(Self { address, width_px, height_px })
    }

    /// SVG drawing with the logo's aspect ratio.
    pub(super) fn svg(&self) -> String {
        let Self { address, width_px, height_px } = self;
        format!(
            "<svg class=\"logo\" viewBox=\"0 0 {width_px} {height_px}\" role=\"img\" aria-hidden=\"true\"><image href=\"{address}\" width=\"{width_px}\" height=\"{height_px}\"/></svg>"
        )
    }
}

#[cfg(test)]
mod tests {
    use image::GrayImage;

    use super::*;

    #[test]
    fn a_picture_is_a_logo_and_nothing_else_is() {
        let mut png = Cursor::new(Vec::new());
        GrayImage::new(30, 10).write_to(&mut png, ImageFormat::Png).expect("written");
        let logo = Logo::of(png.get_ref()).expect("a logo");
        assert!(logo.svg().contains("viewBox=\"0 0 30 10\""));
        assert!(logo.svg().contains("data:image/png;base64,iVBOR"));
        assert_eq!(Logo::of(b"<svg onload='alert(1)'/>"), None);
        assert_eq!(Logo::of(&[]), None);
    }
}
