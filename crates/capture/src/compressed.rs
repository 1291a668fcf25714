//! JPEG and PNG pictures in memory, one after the other, as brightness.

use std::io::Cursor;

use image::{GrayImage, ImageFormat};

use super::{
    PICTURE_LIMIT_PX, Unpacker, Upright, decoded,
    integrity::{Flaw, JpegGate},
};
use boresight_geometry::{device::PixelLayout, frame::ImageSize};

const PNG_START: &[u8] = b"\x89PNG\r\n\x1a\n";

/// Decodes the pictures of a stream. JPEG is checked and decoded like motion JPEG from a camera.
#[derive(Clone, Debug, Default)]
pub struct Decompressor {
    /// Unpacker for JPEG of the given size.
    unpacker: Option<(ImageSize, Unpacker)>,
}

impl Decompressor {
    /// The picture in `bytes`.
    ///
    /// # Errors
    ///
    /// [`Flaw`] if the bytes are no whole JPEG or PNG, or a picture larger than
    /// [`PICTURE_LIMIT_PX`] on a side.
    pub fn picture(&mut self, bytes: &[u8]) -> Result<GrayImage, Flaw> {
        if bytes.starts_with(PNG_START) {
            let png = decoded(Cursor::new(bytes), ImageFormat::Png, Upright::AsStored);
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

#[cfg(test)]
mod tests {
    use super::*;

    fn jpeg(number: u32) -> Vec<u8> {
        let image = GrayImage::from_fn(96, 64, |x, y| {
            image::Luma([((x * 7 + y * 13 + number * 29) % 251) as u8])
        });
        let mut bytes = Vec::new();
        image.write_to(&mut Cursor::new(&mut bytes), ImageFormat::Jpeg).expect("encodes");
        bytes
    }

    /// The JPEG without Huffman tables, as from cameras relying on the standard ones.
    fn without_tables(bytes: &[u8]) -> Vec<u8> {
        let mut rest = bytes.to_vec();
        while let Some(at) = rest.windows(2).position(|pair| pair == [0xFF, 0xC4]) {
            let length = usize::from(rest[at + 2]) << 8 | usize::from(rest[at + 3]);
            rest.drain(at..at + 2 + length);
        }
        rest
    }

    #[test]
    fn a_jpeg_counts_if_it_is_whole_and_one_picture() {
        let (one, other) = (jpeg(1), jpeg(2));
        let mut reader = Decompressor::default();
        let whole = reader.picture(&one).expect("whole");
        let plain = without_tables(&one);
        assert!(plain.len() < one.len());
        assert_eq!(reader.picture(&plain), Ok(whole));
        assert!(reader.picture(&one[..one.len() * 2 / 3]).is_err(), "cut");
        let half = one.len().min(other.len()) / 2;
        let joined = [&one[..half], &other[half..]].concat();
        assert!(reader.picture(&joined).is_err(), "two in one");
        assert!(reader.picture(&[]).is_err());
    }
}
