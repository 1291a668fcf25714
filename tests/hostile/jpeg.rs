//! Frames as sent by cameras: motion JPEG, and raw ones of any length.

use boresight::{capture::Unpacker, device::PixelLayout, frame::ImageSize};
use image::{ExtendedColorType, GrayImage, Luma, codecs::jpeg::JpegEncoder};

use crate::harness::run;

const SIZE: ImageSize = ImageSize { width_px: 160, height_px: 120 };

/// JPEGs in colour and in grey, coarse and fine.
pub(crate) fn jpegs() -> Vec<Vec<u8>> {
    let picture = GrayImage::from_fn(SIZE.width_px, SIZE.height_px, |x, y| {
        Luma([if (x / 20 + y / 20) % 2 == 0 { 30 } else { (190 + (x * y) % 50) as u8 }])
    });
    let rgb: Vec<u8> = picture.as_raw().iter().flat_map(|value| [*value; 3]).collect();
    let mut all = Vec::new();
    for quality in [20, 80, 95] {
        for (pixels, colour) in
            [(picture.as_raw(), ExtendedColorType::L8), (&rgb, ExtendedColorType::Rgb8)]
        {
            let mut jpeg = Vec::new();
            JpegEncoder::new_with_quality(&mut jpeg, quality)
                .encode(pixels, SIZE.width_px, SIZE.height_px, colour)
                .expect("encodes");
            all.push(jpeg);
        }
    }
    all
}

#[test]
fn motion_jpeg() {
    let seeds = jpegs();
    let mut whole = Unpacker::new(PixelLayout::Mjpeg, SIZE, 0);
    let huge = ImageSize { width_px: 65_535, height_px: 65_535 };
    let mut claimed = Unpacker::new(PixelLayout::Mjpeg, huge, 0);
    run(
        "jpeg",
        |mutator| mutator.bytes(&seeds),
        |input| {
            let _ = claimed.unpack(input);
            match whole.unpack(input) {
                Err(_) => Ok(false),
                Ok(picture) if picture.dimensions() == (SIZE.width_px, SIZE.height_px) => Ok(true),
                Ok(picture) => Err(format!("a picture of {:?}", picture.dimensions())),
            }
        },
    );
}

#[test]
fn raw_frames() {
    run(
        "raw",
        |mutator| {
            let count = mutator.below(400);
            (0..9 + count).map(|_| mutator.bits() as u8).collect()
        },
        |input| {
            let [layout, width, height, a, b, c, d, wide, low, rest @ ..] = input else {
                return Ok(false);
            };
            let layouts = PixelLayout::OF_CAMERAS.map(|layout| match layout {
                PixelLayout::Mjpeg => PixelLayout::Decoded,
                raw => raw,
            });
            let size = if wide % 8 == 0 {
                ImageSize { width_px: u32::from(*wide) << 24, height_px: u32::from(*low) << 24 }
            } else {
                ImageSize { width_px: u32::from(width % 24), height_px: u32::from(height % 24) }
            };
            let per_line = if low % 4 == 0 { u32::from_le_bytes([*a, *b, *c, *d]) } else { 0 };
            let layout = layouts[usize::from(*layout) % layouts.len()];
            match Unpacker::new(layout, size, per_line).unpack(rest) {
                Err(_) => Ok(false),
                Ok(picture) if picture.dimensions() == (size.width_px, size.height_px) => Ok(true),
                Ok(picture) => Err(format!("a picture of {:?}", picture.dimensions())),
            }
        },
    );
}
