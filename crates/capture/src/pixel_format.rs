//! The bytes of a frame as brightness.

use std::panic::{AssertUnwindSafe, catch_unwind};

use image::GrayImage;
use zune_core::{bytestream::ZCursor, colorspace::ColorSpace, options::DecoderOptions};
use zune_jpeg::JpegDecoder;

use super::integrity::{Flaw, JpegGate, raw};
use boresight_geometry::{device::PixelLayout, frame::ImageSize};

/// Turns the frames of one stream into pictures.
#[derive(Clone, Debug)]
pub struct Unpacker {
    layout: PixelLayout,
    size: ImageSize,
    bytes_per_row: usize,
    gate: JpegGate,
}

impl Unpacker {
    /// For frames of `layout` and `size`; `bytes_per_line` is what the driver says, 0 if it says nothing.
    pub fn new(layout: PixelLayout, size: ImageSize, bytes_per_line: u32) -> Self {
        let least = size.width_px as usize * if layout == PixelLayout::Yuyv { 2 } else { 1 };
        let bytes_per_row = (bytes_per_line as usize).max(least);
        Self { layout, size, bytes_per_row, gate: JpegGate::default() }
    }

    /// The picture in `bytes`, which are those of one frame and no more.
    ///
    /// # Errors
    ///
    /// [`Flaw`] if the frame is not whole.
    pub fn unpack(&mut self, bytes: &[u8]) -> Result<GrayImage, Flaw> {
        if self.size.width_px == 0 || self.size.height_px == 0 {
            return Err(Flaw::Empty);
        }
        let rows = self.size.height_px as usize;
        match self.layout {
            PixelLayout::Mjpeg => {
                let whole = self.gate.check(bytes, self.size)?;
                decode(&whole.bytes, self.size)
            }
            PixelLayout::Grey | PixelLayout::Decoded => {
                raw(bytes.len(), rows, self.bytes_per_row)?;
                Ok(self.pick(bytes, 1))
            }
            PixelLayout::Yuyv => {
                raw(bytes.len(), rows, self.bytes_per_row)?;
                Ok(self.pick(bytes, 2))
            }
            PixelLayout::Nv12 => {
                // Half as many rows of colour follow.
                raw(bytes.len(), rows + rows.div_ceil(2), self.bytes_per_row)?;
                Ok(self.pick(bytes, 1))
            }
        }
    }

    /// Every `step`-th byte of each row.
    fn pick(&self, bytes: &[u8], step: usize) -> GrayImage {
        let (width, height) = (self.size.width_px as usize, self.size.height_px as usize);
        let mut pixels = Vec::with_capacity(width * height);
        for row in bytes.chunks(self.bytes_per_row).take(height) {
            if step == 1 {
                pixels.extend_from_slice(&row[..width]);
            } else {
                pixels.extend(row.chunks_exact(step).take(width).map(|pixel| pixel[0]));
            }
        }
        picture(self.size, pixels)
    }
}

/// `pixels` are as many as `size` says: every caller has checked that.
fn picture(size: ImageSize, pixels: Vec<u8>) -> GrayImage {
    GrayImage::from_raw(size.width_px, size.height_px, pixels)
        .unwrap_or_else(|| GrayImage::new(size.width_px, size.height_px))
}

/// Decodes a whole JPEG. A panic of the decoder is one bad frame.
fn decode(jpeg: &[u8], size: ImageSize) -> Result<GrayImage, Flaw> {
    let options = DecoderOptions::default()
        .set_strict_mode(true)
        .set_max_width(size.width_px as usize)
        .set_max_height(size.height_px as usize)
        .jpeg_set_out_colorspace(ColorSpace::Luma);
    let pixels = catch_unwind(AssertUnwindSafe(|| {
        JpegDecoder::new_with_options(ZCursor::new(jpeg), options).decode()
    }))
    .ok()
    .and_then(Result::ok)
    .ok_or(Flaw::Undecodable)?;
    GrayImage::from_raw(size.width_px, size.height_px, pixels).ok_or(Flaw::Undecodable)
}
