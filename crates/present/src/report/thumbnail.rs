//! A small picture inside the page.

use base64::{Engine, engine::general_purpose::STANDARD};
use image::{ExtendedColorType, GrayImage, ImageEncoder, codecs::jpeg::JpegEncoder, imageops};

use boresight_geometry::frame::ImageSize;

const WIDEST_PX: u32 = 320;
const QUALITY: u8 = 72;

/// Reduced picture.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Thumbnail {
    jpeg: Vec<u8>,
    /// Size of the original picture.
    full: ImageSize,
    /// Size of the reduced picture.
    pub(super) small: ImageSize,
}

impl Thumbnail {
    /// Thumbnail of a picture. `None` without pixels.
    pub fn of(picture: &GrayImage) -> Option<Self> {
        Self::within(picture, WIDEST_PX)
    }

    /// Thumbnail whose longer side is at most `longest_px`. `None` without pixels.
    pub(super) fn within(picture: &GrayImage, longest_px: u32) -> Option<Self> {
        let full = ImageSize::of(picture);
        let longest = full.width_px.max(full.height_px);
        if full.width_px == 0 || full.height_px == 0 {
            return None;
        }
        let scaled = |side: u32| {
            let share = f64::from(longest_px.min(longest)) / f64::from(longest);
            ((f64::from(side) * share).round() as u32).max(1)
        };
        let small = imageops::thumbnail(picture, scaled(full.width_px), scaled(full.height_px));
        let mut jpeg = Vec::new();
        JpegEncoder::new_with_quality(&mut jpeg, QUALITY)
            .write_image(small.as_raw(), small.width(), small.height(), ExtendedColorType::L8)
            .ok()?;
        Some(Self { jpeg, full, small: ImageSize::of(&small) })
    }

    /// Size of the original picture.
    pub fn full_size(&self) -> ImageSize {
        self.full
    }

    /// The picture as a JPEG file of grey pixels.
    pub(super) fn jpeg(&self) -> &[u8] {
        &self.jpeg
    }

    /// Data URI of the picture.
    pub(super) fn data_uri(&self) -> String {
        format!("data:image/jpeg;base64,{}", STANDARD.encode(&self.jpeg))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn large_pictures_become_small_and_keep_their_shape() {
        let thumbnail = Thumbnail::of(&GrayImage::new(4000, 3000)).expect("has pixels");
        let small = image::load_from_memory(&thumbnail.jpeg).expect("a JPEG");
        assert_eq!((small.width(), small.height()), (320, 240));
        assert_eq!(thumbnail.full_size(), ImageSize { width_px: 4000, height_px: 3000 });
        let tiny = Thumbnail::of(&GrayImage::new(20, 10)).expect("has pixels");
        let small = image::load_from_memory(&tiny.jpeg).expect("a JPEG");
        assert_eq!((small.width(), small.height()), (20, 10));
        assert!(tiny.data_uri().starts_with("data:image/jpeg;base64,/9j/"));
        assert_eq!(Thumbnail::of(&GrayImage::new(0, 10)), None);
    }
}
