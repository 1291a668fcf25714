//! Time and lens of a picture in its EXIF data.

use std::{
    io::{Cursor, Read},
    path::Path,
};

use image::{ImageDecoder, ImageReader};

use boresight_files::{Links, open};
use boresight_geometry::panic_message::caught;

/// Bytes at the start of a file that hold its EXIF data: a block of at most 64 kB, after a few
/// small ones.
const HEAD: u64 = 1 << 17;

/// Tags: the block of the camera's settings, the time of the exposure with its offset from UTC, the
/// time of the file, and the focal length on 35 mm film.
const SETTINGS: u16 = 0x8769;
const TAKEN: u16 = 0x9003;
const OFFSET: u16 = 0x9011;
const CHANGED: u16 = 0x0132;
const FILM_LENGTH: u16 = 0xA405;

/// Time in the EXIF data of the picture at `path`, as stored: `2026:03:12 14:05:00`, and the offset
/// from UTC, `+02:00`, if given.
pub fn exif_time(path: &Path) -> Option<(String, Option<String>)> {
    time_in(&exif_of(path)?)
}

/// Focal length in the EXIF data of the picture at `path`, in millimetres: the one with the same
/// field of view on 35 mm film. `None` if it isn't stated.
pub fn film_length_mm(path: &Path) -> Option<f64> {
    film_length_in(&exif_of(path)?)
}

fn exif_of(path: &Path) -> Option<Vec<u8>> {
    let mut head = Vec::new();
    open(path, Links::Followed).ok()?.take(HEAD).read_to_end(&mut head).ok()?;
    let exif = || {
        let reader = ImageReader::new(Cursor::new(head)).with_guessed_format().ok()?;
        reader.into_decoder().ok()?.exif_metadata().ok()?
    };
    caught(exif).ok()?
}

/// Time in EXIF data (TIFF 6.0, section 2; EXIF 2.31, 4.6.5).
fn time_in(exif: &[u8]) -> Option<(String, Option<String>)> {
    let tiff = Tiff::of(exif);
    let (first, settings) = (tiff.number(4)?, tiff.settings());
    let in_settings = |tag| tiff.text(settings?, tag);
    match in_settings(TAKEN) {
        Some(taken) => Some((taken, in_settings(OFFSET))),
        None => Some((tiff.text(first, CHANGED)?, None)),
    }
}

/// Focal length in EXIF data; 0 stands for an unknown one.
fn film_length_in(exif: &[u8]) -> Option<f64> {
    let tiff = Tiff::of(exif);
    let (_, at) = tiff.field(tiff.settings()?, FILM_LENGTH)?;
    tiff.short(at).filter(|mm| *mm > 0).map(f64::from)
}

struct Tiff<'a> {
    bytes: &'a [u8],
    is_little: bool,
}

impl<'a> Tiff<'a> {
    fn of(bytes: &'a [u8]) -> Self {
        Self { bytes, is_little: bytes.starts_with(b"II") }
    }

    /// Place of the list of the camera's settings.
    fn settings(&self) -> Option<usize> {
        self.number(self.field(self.number(4)?, SETTINGS)?.1)
    }

    fn short(&self, at: usize) -> Option<u16> {
        let two = self.bytes.get(at..at.checked_add(2)?)?.try_into().ok()?;
        Some(if self.is_little { u16::from_le_bytes(two) } else { u16::from_be_bytes(two) })
    }

    fn number(&self, at: usize) -> Option<usize> {
        let four = self.bytes.get(at..at.checked_add(4)?)?.try_into().ok()?;
        let is_little = self.is_little;
        Some((if is_little { u32::from_le_bytes(four) } else { u32::from_be_bytes(four) }) as usize)
    }

    /// Count and place of the value of a field in the list at `list`.
    fn field(&self, list: usize, tag: u16) -> Option<(usize, usize)> {
        let fields = (0..usize::from(self.short(list)?)).map(|n| list + 2 + 12 * n);
        let at = fields.into_iter().find(|at| self.short(*at) == Some(tag))?;
        Some((self.number(at + 4)?, at + 8))
    }

    fn text(&self, list: usize, tag: u16) -> Option<String> {
        let (count, place) = self.field(list, tag)?;
        let at = if count <= 4 { place } else { self.number(place)? };
        let text = self.bytes.get(at..at.checked_add(count)?)?;
        Some(String::from_utf8_lossy(text).trim_end_matches('\0').to_owned())
    }
}

#[cfg(test)]
mod tests {
    use image::{ImageEncoder, codecs::jpeg::JpegEncoder};

    use super::*;

    /// A field of text at the place `at`.
    fn text(tag: u16, count: u32, at: u32) -> Vec<u8> {
        let (tag, kind) = (tag.to_be_bytes(), 2_u16.to_be_bytes());
        [&tag[..], &kind, &count.to_be_bytes(), &at.to_be_bytes()].concat()
    }

    #[test]
    fn time_and_focal_length_of_the_exposure_are_read() {
        let settings = [&SETTINGS.to_be_bytes()[..], &[0, 4, 0, 0, 0, 1, 0, 0, 0, 26]].concat();
        let film_length = [&FILM_LENGTH.to_be_bytes()[..], &[0, 3, 0, 0, 0, 1, 0, 26, 0, 0]];
        let fields = [text(TAKEN, 20, 68), text(OFFSET, 7, 88), film_length.concat()].concat();
        let exif = [
            &b"MM\0*\0\0\0\x08\0\x01"[..],
            &settings,
            &[0; 4],
            &[0, 3],
            &fields,
            &[0; 4],
            b"2026:03:12 14:05:00\0+02:00\0",
        ]
        .concat();
        let place = tempfile::tempdir().expect("a folder");
        let path = place.path().join("a.jpg");
        let mut bytes = Vec::new();
        let mut encoder = JpegEncoder::new(&mut bytes);
        encoder.set_exif_metadata(exif.clone()).expect("JPEG has room for it");
        encoder.encode_image(&image::GrayImage::new(8, 8)).expect("encoded");
        std::fs::write(&path, bytes).expect("written");
        let wanted = Some(("2026:03:12 14:05:00".to_owned(), Some("+02:00".to_owned())));
        assert_eq!((exif_time(&path), film_length_mm(&path)), (wanted.clone(), Some(26.0)));
        // A cut block has no time, or the same.
        for length in 0..exif.len() {
            assert!(film_length_in(&exif[..length]).is_none_or(|mm| mm == 26.0));
            assert!(
                time_in(&exif[..length])
                    .is_none_or(|(time, _)| Some(time) == wanted.clone().map(|w| w.0))
            );
        }
    }
}
