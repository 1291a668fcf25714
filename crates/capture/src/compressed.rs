//! JPEG and PNG pictures in memory, one after the other, as brightness.

use std::io::Cursor;

use image::{GrayImage, ImageFormat};

use super::{
    PICTURE_LIMIT_PX, Unpacker, decoded,
    integrity::{Flaw, JpegGate},
};
use boresight_geometry::{device::PixelLayout, frame::ImageSize};

const PNG_START: &[u8] = b"\x89PNG\r\n\x1a\n";

/// Decodes the pictures of one stream. JPEG is checked and decoded as a motion-JPEG camera's is.
#[derive(Clone, Debug, Default)]
pub struct Decompressor {
    /// For JPEG of that size.
    unpacker: Option<(ImageSize, Unpacker)>,
}

impl Decompressor {
    /// The picture in `bytes`.
    ///
    /// # Errors
    ///
    /// [`Flaw`] if they are no whole JPEG or PNG, or one that is larger than [`PICTURE_LIMIT_PX`] on a side.
    pub fn picture(&mut self, bytes: &[u8]) -> Result<GrayImage, Flaw> {
        if bytes.starts_with(PNG_START) {
            let png = decoded(Cursor::new(bytes), ImageFormat::Png);
            return png.map_err(|_| Flaw::Undecodable);
        }
        let size = JpegGate::size(bytes)?;
        if size.width_px.max(size.height_px) > PICTURE_LIMIT_PX {
            return Err(Flaw::BadHeader);
        }
        match &mut self.unpacker {
            Some((known, unpacker)) if *known == size => unpacker.unpack(bytes),
            other => {
                let unpacker = Unpacker::new(PixelLayout::Mjpeg, size, 0);
                other.insert((size, unpacker)).1.unpack(bytes)
            }
        }
    }
}
