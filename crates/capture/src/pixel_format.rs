//! The bytes of a frame as brightness in 8 bits.
//!
//! Deeper samples are scaled by their whole range: `v` of `n` bits becomes 255 v / (2ⁿ - 1),
//! rounded. Colours are weighted like in picture files: 0.2126 red, 0.7152 green, 0.0722 blue; a
//! Bayer mosaic ¼, ½, ¼.

use image::GrayImage;
use zune_core::{bytestream::ZCursor, colorspace::ColorSpace, options::DecoderOptions};
use zune_jpeg::JpegDecoder;

use super::integrity::{Flaw, JpegGate, raw};
use boresight_geometry::{device::PixelLayout, frame::ImageSize, panic_message::caught};

/// Turns the frames of a stream into pictures.
#[derive(Clone, Debug)]
pub struct Unpacker {
    layout: PixelLayout,
    size: ImageSize,
    bytes_per_row: usize,
    gate: JpegGate,
}

impl Unpacker {
    /// Converter for frames of `layout` and `size`; `bytes_per_line` is the driver's number, 0 if
    /// unstated.
    pub fn new(layout: PixelLayout, size: ImageSize, bytes_per_line: u32) -> Self {
        let least = size.width_px as usize * layout.bytes_per_pixel();
        let bytes_per_row = (bytes_per_line as usize).max(least);
        Self { layout, size, bytes_per_row, gate: JpegGate::default() }
    }

    /// The picture in `bytes`, exactly those of a frame.
    ///
    /// # Errors
    ///
    /// [`Flaw`] if the frame is not whole.
    pub fn unpack(&mut self, bytes: &[u8]) -> Result<GrayImage, Flaw> {
        if self.size.width_px == 0 || self.size.height_px == 0 {
            return Err(Flaw::Empty);
        }
        if self.layout == PixelLayout::Mjpeg {
            let whole = self.gate.check(bytes, self.size)?;
            return decode(&whole.bytes, self.size);
        }
        let rows = self.size.height_px as usize;
        // Half as many rows of colour follow.
        let colour = if self.layout == PixelLayout::Nv12 { rows.div_ceil(2) } else { 0 };
        raw(bytes.len(), rows + colour, self.bytes_per_row)?;
        Ok(match self.layout {
            PixelLayout::Yuyv => self.each(bytes, |[brightness, _]| brightness),
            PixelLayout::Y10 => self.each(bytes, shallow::<10>),
            PixelLayout::Y12 => self.each(bytes, shallow::<12>),
            PixelLayout::Y16 => self.each(bytes, shallow::<16>),
            PixelLayout::Rgb => self.each(bytes, brightness),
            PixelLayout::Bgr => self.each(bytes, |[b, g, r]| brightness([r, g, b])),
            PixelLayout::Bayer => self.without_colours(bytes),
            PixelLayout::Grey | PixelLayout::Nv12 | PixelLayout::Decoded | PixelLayout::Mjpeg => {
                self.each(bytes, |[brightness]| brightness)
            }
        })
    }

    /// The picture of pixels of `BYTES` bytes each.
    fn each<const BYTES: usize>(
        &self,
        bytes: &[u8],
        grey: impl Fn([u8; BYTES]) -> u8,
    ) -> GrayImage {
        let (width, height) = (self.size.width_px as usize, self.size.height_px as usize);
        let mut pixels = Vec::with_capacity(width * height);
        for row in bytes.chunks(self.bytes_per_row).take(height) {
            let (row, _) = row.as_chunks();
            pixels.extend(row.iter().take(width).map(|pixel| grey(*pixel)));
        }
        picture(self.size, pixels)
    }

    /// The picture behind a Bayer filter: each pixel with its neighbours, weighted 1-2-1 both ways.
    /// Wherever the squares of the filter begin, the sum is a quarter of red, half of green and a
    /// quarter of blue, and moves no edge.
    fn without_colours(&self, bytes: &[u8]) -> GrayImage {
        let (width, height) = (self.size.width_px as usize, self.size.height_px as usize);
        let row = |y: usize| &bytes[y * self.bytes_per_row..][..width];
        let mut pixels = Vec::with_capacity(width * height);
        let mut sums = vec![0_u16; width];
        for y in 0..height {
            let (above, below) = neighbours(y, height);
            let rows = row(above).iter().zip(row(y)).zip(row(below));
            for (sum, ((above, here), below)) in sums.iter_mut().zip(rows) {
                *sum = u16::from(*above) + 2 * u16::from(*here) + u16::from(*below);
            }
            pixels.extend((0..width).map(|x| {
                let (left, right) = neighbours(x, width);
                ((sums[left] + 2 * sums[x] + sums[right] + 8) / 16) as u8
            }));
        }
        picture(self.size, pixels)
    }
}

/// Places before and after `at` among `count`; at an end, the inner place twice, of equal colour.
fn neighbours(at: usize, count: usize) -> (usize, usize) {
    let inside = |place: usize| place.min(count - 1);
    if at == 0 {
        (inside(1), inside(1))
    } else if at + 1 == count {
        (at - 1, at - 1)
    } else {
        (at - 1, at + 1)
    }
}

/// Brightness of a colour: red, green, blue.
fn brightness(rgb: [u8; 3]) -> u8 {
    let [r, g, b] = rgb.map(u32::from);
    ((2126 * r + 7152 * g + 722 * b + 5000) / 10_000) as u8
}

/// Scales brightness of `BITS` bits to 8: the whole range, rounded. Larger numbers, impossible for
/// such a camera, are white.
pub(super) fn shallow<const BITS: u32>(bytes: [u8; 2]) -> u8 {
    let white = (1_u32 << BITS) - 1;
    let value = u32::from(u16::from_le_bytes(bytes)).min(white);
    ((255 * value + white / 2) / white) as u8
}

/// The picture of `pixels`, whose number was checked by the caller.
fn picture(size: ImageSize, pixels: Vec<u8>) -> GrayImage {
    GrayImage::from_raw(size.width_px, size.height_px, pixels)
        .unwrap_or_else(|| GrayImage::new(size.width_px, size.height_px))
}

/// Decodes a whole JPEG. A panic of the decoder costs a frame.
fn decode(jpeg: &[u8], size: ImageSize) -> Result<GrayImage, Flaw> {
    let options = DecoderOptions::default()
        .set_strict_mode(true)
        .set_max_width(size.width_px as usize)
        .set_max_height(size.height_px as usize)
        .jpeg_set_out_colorspace(ColorSpace::Luma);
    let pixels = caught(|| JpegDecoder::new_with_options(ZCursor::new(jpeg), options).decode())
        .ok()
        .and_then(Result::ok)
        .ok_or(Flaw::Undecodable)?;
    GrayImage::from_raw(size.width_px, size.height_px, pixels).ok_or(Flaw::Undecodable)
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: ImageSize = ImageSize { width_px: 4, height_px: 2 };

    fn unpacked(layout: PixelLayout, bytes: &[u8]) -> Vec<u8> {
        Unpacker::new(layout, SIZE, 0).unpack(bytes).expect("whole").into_raw()
    }

    #[test]
    fn deep_brightness_is_scaled_by_its_whole_range() {
        for (layout, white) in
            [(PixelLayout::Y10, 1023_u16), (PixelLayout::Y12, 4095), (PixelLayout::Y16, 65535)]
        {
            let values = [0, white / 3, white / 2, white, white - white / 255, 1, white / 5, white];
            let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
            let wanted = values.map(|value| (255.0 * f64::from(value) / f64::from(white)).round());
            assert_eq!(unpacked(layout, &bytes), wanted.map(|grey| grey as u8), "{layout:?}");
            // Eight bits are unchanged.
            for grey in 0..=255_u8 {
                let deep = (f64::from(grey) / 255.0 * f64::from(white)).round() as u16;
                assert_eq!(unpacked(layout, &deep.to_le_bytes().repeat(8)), [grey; 8]);
            }
        }
        assert_eq!(unpacked(PixelLayout::Y10, &[0xFF; 16]), [255; 8], "beyond white is white");
    }

    #[test]
    fn colours_are_weighed_as_in_files() {
        let pixels = [[255, 0, 0], [0, 255, 0], [0, 0, 255], [255; 3], [0; 3], [9, 80, 3], [70; 3]];
        let rgb: Vec<u8> = pixels.iter().flatten().copied().chain([1, 2, 3]).collect();
        let bgr: Vec<u8> = rgb.chunks(3).flat_map(|pixel| [pixel[2], pixel[1], pixel[0]]).collect();
        let file = image::RgbImage::from_raw(4, 2, rgb.clone()).expect("as many");
        let file = image::DynamicImage::ImageRgb8(file).into_luma8().into_raw();
        assert_eq!(unpacked(PixelLayout::Rgb, &rgb), file);
        assert_eq!(unpacked(PixelLayout::Bgr, &bgr), file);
        assert_eq!(file[..5], [54, 182, 18, 255, 0]);
    }

    #[test]
    fn a_bayer_mosaic_is_even_wherever_its_squares_begin() {
        let size = ImageSize { width_px: 7, height_px: 5 };
        let colours = [[200, 100], [100, 40]];
        for (right, down) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
            let mosaic: Vec<u8> =
                (0..35).map(|at| colours[(at / 7 + down) % 2][(at % 7 + right) % 2]).collect();
            let even = Unpacker::new(PixelLayout::Bayer, size, 0).unpack(&mosaic).expect("whole");
            assert_eq!(even.into_raw(), [110; 35]);
        }
        let thin = ImageSize { width_px: 1, height_px: 1 };
        let thin = Unpacker::new(PixelLayout::Bayer, thin, 0).unpack(&[7]).expect("whole");
        assert_eq!(thin.into_raw(), [7]);
    }
}
