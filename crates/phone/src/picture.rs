//! Small JPEGs of frames, made once for all pages.

use std::{
    sync::Arc,
    time::{Duration, Instant},
};

use axum::body::Bytes;
use image::{ExtendedColorType, GrayImage, ImageEncoder, codecs::jpeg::JpegEncoder};

use super::hub::Picture;

/// Maximum width of a sent picture.
const WIDEST_PX: u32 = 720;
const QUALITY: u8 = 55;
/// Minimum time between two pictures for a page.
const SHORTEST: Duration = Duration::from_millis(66);

/// Last picture made.
#[derive(Default)]
pub(super) struct Pictures {
    last: Option<Made>,
    small: GrayImage,
}

/// Picture ready to send.
#[derive(Clone, Debug)]
pub(super) struct Made {
    pub(super) number: u64,
    /// Arrival time of the frame from the camera.
    pub(super) came: Instant,
    pub(super) jpeg: Bytes,
    made: Instant,
}

impl Pictures {
    /// JPEG of `picture`, or the time until one may be made. A recent JPEG is reused if newer than
    /// number `seen`.
    pub(super) fn make(&mut self, picture: &Picture, seen: u64) -> Result<Made, Duration> {
        if let Some(last) = &self.last {
            let age = last.made.elapsed();
            if last.number == picture.number || (age < SHORTEST && last.number > seen) {
                return Ok(last.clone());
            }
            if age < SHORTEST {
                return Err(SHORTEST - age);
            }
        }
        let image = &picture.frame.image;
        let factor = image.width().div_ceil(WIDEST_PX).max(1);
        let image = if factor == 1 {
            image
        } else {
            shrink(image, factor, &mut self.small);
            &self.small
        };
        let mut jpeg = Vec::with_capacity(32 << 10);
        let encoder = JpegEncoder::new_with_quality(&mut jpeg, QUALITY);
        let (width, height) = image.dimensions();
        // Encoding fails only without pixels, or beyond JPEG's size; the page then shows no
        // picture.
        encoder.write_image(image, width, height, ExtendedColorType::L8).ok();
        let made = Made {
            number: picture.number,
            came: picture.came,
            jpeg: jpeg.into(),
            made: Instant::now(),
        };
        self.last = Some(made.clone());
        Ok(made)
    }
}

/// Means over squares of `factor` pixels.
fn shrink(image: &GrayImage, factor: u32, small: &mut GrayImage) {
    let (width, height) = (image.width() / factor, image.height() / factor);
    if small.dimensions() != (width, height) {
        *small = GrayImage::new(width, height);
    }
    let (stride, side) = (image.width() as usize, factor as usize);
    let pixels = image.as_raw();
    let area = factor * factor;
    for (y, row) in small.chunks_exact_mut(width.max(1) as usize).enumerate() {
        for (x, pixel) in row.iter_mut().enumerate() {
            let mut sum = 0;
            for line in 0..side {
                let from = (y * side + line) * stride + x * side;
                sum += pixels[from..from + side].iter().map(|p| u32::from(*p)).sum::<u32>();
            }
            *pixel = (sum / area) as u8;
        }
    }
}

/// Last picture, shared between pages on a thread.
pub(super) type SharedPictures = Arc<std::sync::Mutex<Pictures>>;

#[cfg(test)]
mod tests {
    use super::*;
    use boresight_geometry::frame::{CaptureTime, Frame, FrameId, FrameKind};

    fn picture(number: u64, image: GrayImage) -> Picture {
        let frame = Frame {
            id: FrameId(number),
            captured_at: CaptureTime { nanos: 0 },
            kind: FrameKind::Video,
            name: String::new(),
            image,
        };
        Picture { number, frame: Arc::new(frame), came: Instant::now() }
    }

    #[test]
    fn a_picture_is_small_and_made_once() {
        let image =
            GrayImage::from_fn(1921, 1081, |x, y| image::Luma([((x / 8 + y / 8) % 200) as u8]));
        let mut pictures = Pictures::default();
        let made = pictures.make(&picture(1, image.clone()), 0).expect("nothing was made before");
        let read = image::load_from_memory(&made.jpeg).expect("a JPEG");
        assert_eq!((read.width(), read.height()), (640, 360));
        let again = pictures.make(&picture(1, image.clone()), 0).expect("the same");
        assert_eq!(again.jpeg.as_ptr(), made.jpeg.as_ptr());
        let soon = pictures.make(&picture(2, image.clone()), 0).expect("the one before will do");
        assert_eq!(soon.number, 1);
        assert!(pictures.make(&picture(2, image), 1).is_err_and(|wait| wait <= SHORTEST));
    }

    #[test]
    fn an_empty_picture_stops_nothing() {
        let mut pictures = Pictures::default();
        assert!(pictures.make(&picture(1, GrayImage::new(0, 0)), 0).is_ok());
    }
}
