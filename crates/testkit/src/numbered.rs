//! Numbered pictures: a test reads the number back from the pixels.

use image::{ExtendedColorType, GrayImage, codecs::jpeg::JpegEncoder};

/// Width and height of a [`picture`].
pub const SIZE: (u32, u32) = (96, 64);

/// Picture `number`: its number in the first row, the rest computed from it.
pub fn picture(number: u64) -> GrayImage {
    GrayImage::from_fn(SIZE.0, SIZE.1, |x, y| {
        let value = if y == 0 {
            if x < 32 && number >> x & 1 == 1 { 200 } else { 60 }
        } else {
            60 + ((u64::from(x) * 7 + u64::from(y) * 13 + number * 31) % 120) as u8
        };
        image::Luma([value])
    })
}

/// Number of a picture exactly equal to a [`picture`].
pub fn number(image: &GrayImage) -> Option<u64> {
    let bit = |x: u32| u64::from(image.get_pixel(x, 0).0[0] > 130) << x;
    let number = (0..32).map(bit).sum();
    (*image == picture(number)).then_some(number)
}

/// Pictures of a motion-JPEG camera: a moving pattern, compressed as by a camera.
pub fn jpeg_picture(number: u64, (width, height): (u32, u32)) -> GrayImage {
    GrayImage::from_fn(width, height, |x, y| {
        let (x, y) = (f64::from(x), f64::from(y));
        let shift = (number % 17) as f64 * 1.3;
        let square = ((x + shift) / 23.0).floor() + ((y + 0.3 * shift) / 19.0).floor();
        let wave = 22.0 * ((x * 0.11 + shift).sin() + (y * 0.23).cos());
        image::Luma([(if square as i64 % 2 == 0 { 70.0 } else { 170.0 } + wave) as u8])
    })
}

/// Compressed [`jpeg_picture`].
pub fn jpeg(number: u64, size: (u32, u32)) -> Vec<u8> {
    let picture = jpeg_picture(number, size);
    // Grey as colour, as cameras send it: three components.
    let rgb: Vec<u8> = picture.as_raw().iter().flat_map(|value| [*value; 3]).collect();
    let mut bytes = Vec::new();
    JpegEncoder::new_with_quality(&mut bytes, 80)
        .encode(&rgb, size.0, size.1, ExtendedColorType::Rgb8)
        .expect("encodes");
    bytes
}
