//! Picture files as brightness.

use std::{
    io::{BufRead, Seek, SeekFrom},
    sync::{Mutex, PoisonError},
};

use image::{
    DynamicImage, GrayImage, ImageDecoder, ImageError, ImageFormat, ImageReader, Limits, Luma,
    metadata::Orientation,
};

use boresight_geometry::panic_message::caught;

/// Longest side of a readable picture; a larger file is more likely hostile than a photograph.
pub const PICTURE_LIMIT_PX: u32 = 16_384;

/// Size of a decoded picture, in bytes, from which pictures are decoded one at a time, however many
/// cores there are.
const LARGE: u64 = 1 << 27;
static LARGE_PICTURE: Mutex<()> = Mutex::new(());

/// Orientation of a picture file: phones store the sensor's pixels, with a mark (EXIF orientation)
/// of how the phone was held.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Upright {
    /// Turned or mirrored by the file's mark, like in `cv2.imread` and picture viewers.
    #[default]
    AsMarked,
    /// As the pixels are stored.
    AsStored,
}

/// Brightness of the picture in `bytes`, oriented by `upright`. 16 bits are scaled to 8, or the
/// lowest 10 or 12 of them if the others are empty. Colours are weighted as from a camera, see
/// `pixel_format`; transparency is ignored.
///
/// # Errors
///
/// Message of the decoder, also after a panic: no picture, a cut picture, or one larger than
/// [`PICTURE_LIMIT_PX`] on a side.
pub fn decoded(
    mut bytes: impl BufRead + Seek,
    format: ImageFormat,
    upright: Upright,
) -> Result<GrayImage, String> {
    let decode = || {
        let length = bytes.seek(SeekFrom::End(0))?;
        bytes.rewind()?;
        let mut reader = ImageReader::with_format(bytes, format);
        let mut limits = Limits::default();
        limits.max_image_width = Some(PICTURE_LIMIT_PX);
        limits.max_image_height = Some(PICTURE_LIMIT_PX);
        reader.limits(limits.clone());
        let mut decoder = reader.into_decoder()?;
        let orientation = match upright {
            Upright::AsMarked => decoder.orientation()?,
            Upright::AsStored => Orientation::NoTransforms,
        };
        if format == ImageFormat::Jpeg && length < least_jpeg(decoder.dimensions()) {
            let short = std::io::Error::other("its data are too short for its size");
            return Err(ImageError::IoError(short));
        }
        limits.reserve(decoder.total_bytes())?;
        let alone = (decoder.total_bytes() > LARGE)
            .then(|| LARGE_PICTURE.lock().unwrap_or_else(PoisonError::into_inner));
        let picture = DynamicImage::from_decoder(decoder).map(to_grey);
        drop(alone);
        let mut picture = DynamicImage::from(picture?);
        picture.apply_orientation(orientation);
        Ok::<_, ImageError>(picture.into_luma8())
    };
    match caught(decode) {
        Ok(decoded) => decoded.map_err(|err| err.to_string()),
        Err(panic) => Err(format!("its decoder gave up: {panic}")),
    }
}

/// Least bytes of a JPEG of that size: every block of 8 by 8 pixels has a bit. The decoder fills
/// what is missing.
fn least_jpeg((width, height): (u32, u32)) -> u64 {
    u64::from(width.div_ceil(8)) * u64::from(height.div_ceil(8)) / 8
}

/// Largest values of 10, 12 and 16 bits.
const FULL: [u16; 3] = [1023, 4095, u16::MAX];

fn to_grey(picture: DynamicImage) -> GrayImage {
    use DynamicImage::{ImageLuma16, ImageLumaA16, ImageRgb16, ImageRgba16};
    if !matches!(picture, ImageLuma16(_) | ImageLumaA16(_) | ImageRgb16(_) | ImageRgba16(_)) {
        return picture.into_luma8();
    }
    let deep = picture.into_luma16();
    let lightest = deep.iter().copied().max().unwrap_or_default();
    let full = FULL.into_iter().find(|full| lightest <= *full).map_or(1, u32::from);
    let level = |value: u16| ((u32::from(value) * 255 + full / 2) / full) as u8;
    GrayImage::from_fn(deep.width(), deep.height(), |x, y| Luma([level(deep.get_pixel(x, y).0[0])]))
}

#[cfg(test)]
mod tests {
    use std::{
        io::{BufReader, Cursor, Read},
        sync::Barrier,
        thread,
        time::Duration,
    };

    use super::*;

    /// A chunk of a PNG file.
    fn chunk(kind: &[u8; 4], data: &[u8]) -> Vec<u8> {
        let body = [kind, data].concat();
        let crc32 = crc32fast::hash(&body).to_be_bytes();
        [&(data.len() as u32).to_be_bytes()[..], &body, &crc32].concat()
    }

    /// A picture's bytes, and the last reader: its number is noted at each read but the first.
    struct Noted<'a> {
        bytes: Cursor<&'a [u8]>,
        number: usize,
        notes: &'a Mutex<Vec<usize>>,
    }

    impl Read for Noted<'_> {
        fn read(&mut self, into: &mut [u8]) -> std::io::Result<usize> {
            if self.bytes.position() > 0 {
                self.notes.lock().expect("no panic").push(self.number);
                // Time for the other one to come between.
                thread::sleep(Duration::from_millis(20));
            }
            self.bytes.read(into)
        }
    }

    impl Seek for Noted<'_> {
        fn seek(&mut self, to: std::io::SeekFrom) -> std::io::Result<u64> {
            self.bytes.seek(to)
        }
    }

    #[test]
    fn large_pictures_are_decoded_one_at_a_time() {
        // More than `LARGE` bytes.
        let (width, height) = (PICTURE_LIMIT_PX, 8200);
        let mut png = Vec::new();
        let grey = GrayImage::new(width, height);
        grey.write_to(&mut Cursor::new(&mut png), ImageFormat::Png).expect("encodes");
        let (notes, start) = (Mutex::new(Vec::new()), Barrier::new(2));
        thread::scope(|scope| {
            for number in 0..2 {
                let bytes = Noted { bytes: Cursor::new(png.as_slice()), number, notes: &notes };
                let start = &start;
                scope.spawn(move || {
                    start.wait();
                    let read = decoded(BufReader::new(bytes), ImageFormat::Png, Upright::AsMarked)
                        .expect("a picture");
                    assert_eq!(read.dimensions(), (width, height));
                });
            }
        });
        let notes = notes.into_inner().expect("no panic");
        let turns = notes.windows(2).filter(|pair| pair[0] != pair[1]).count();
        assert!(notes.len() > 4 && turns == 1, "{notes:?}");
    }

    #[test]
    fn a_jpeg_that_says_to_be_huge_is_no_picture() {
        let mut jpeg = Cursor::new(Vec::new());
        GrayImage::new(320, 240).write_to(&mut jpeg, ImageFormat::Jpeg).expect("encodes");
        let jpeg = jpeg.into_inner();
        let read = |bytes: &[u8]| decoded(Cursor::new(bytes), ImageFormat::Jpeg, Upright::AsMarked);
        assert_eq!(read(&jpeg).expect("a picture").dimensions(), (320, 240));
        // Height and width stand behind the mark of the frame, its length and its depth.
        let at = jpeg.windows(2).position(|mark| mark == [0xFF, 0xC0]).expect("a frame") + 5;
        let huge = [&jpeg[..at], &[0x40, 0, 0x40, 0], &jpeg[at + 4..]].concat();
        assert!(read(&huge).expect_err("too short").contains("too short"));
    }

    #[test]
    fn a_palette_of_broken_colours_is_an_error() {
        let header = [0, 0, 0, 4, 0, 0, 0, 4, 8, 3, 0, 0, 0];
        // Four rows of four pixels, each row after its filter, in a stored block of zlib.
        let rows = [0; 20];
        let zlib = [&[0x78, 1, 1, 20, 0, 235, 255][..], &rows, &[0, 20, 0, 1]].concat();
        let png = |palette: &[u8]| {
            let start = b"\x89PNG\r\n\x1a\n".to_vec();
            let chunks = [
                chunk(b"IHDR", &header),
                chunk(b"PLTE", palette),
                chunk(b"tRNS", &[0]),
                chunk(b"IDAT", &zlib),
                chunk(b"IEND", &[]),
            ];
            Cursor::new([start, chunks.concat()].concat())
        };
        let whole =
            decoded(png(&[9, 9, 9]), ImageFormat::Png, Upright::AsMarked).expect("a picture");
        assert_eq!(whole.into_raw(), [9; 16]);
        for length in [1, 2, 4, 5] {
            decoded(png(&vec![9; length]), ImageFormat::Png, Upright::AsMarked)
                .expect_err("no whole colours");
        }
    }
}
