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
        let reader = ImageReader::new(Cursor::new(&head)).with_guessed_format().ok()?;
        reader.into_decoder().ok()?.exif_metadata().ok()?
    };
    exif_of_jpeg(&head).or_else(|| caught(exif).ok()?)
}

/// EXIF data in the `head` of a JPEG file. Its decoder needs all blocks before the picture, and
/// phones write megabytes of depth there.
fn exif_of_jpeg(head: &[u8]) -> Option<Vec<u8>> {
    let mut rest = head.strip_prefix(&[0xff, 0xd8])?;
    while let [0xff, mark, high, low, ..] = *rest {
        let end = 2 + usize::from(u16::from_be_bytes([high, low]));
        let block = rest.get(4..end)?;
        if let (0xe1, Some(exif)) = (mark, block.strip_prefix(b"Exif\0\0")) {
            return Some(exif.to_vec());
        }
        rest = &rest[end..];
    }
    None
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

    /// Kinds of fields: text, a number of two bytes and of four, a fraction, and unnamed bytes.
    const TEXT: u16 = 2;
    const SHORT: u16 = 3;
    const LONG: u16 = 4;
    const FRACTION: u16 = 5;
    const UNNAMED: u16 = 7;
    /// Beside [`SETTINGS`], the first list has the place of another.
    const POSITION: u16 = 0x8825;

    /// A field: tag, kind, count, and its value or what lies elsewhere.
    type Field = (u16, u16, u32, &'static [u8]);

    /// EXIF data with a `first` list and the settings, after `gap` bytes that nothing names.
    fn exif(is_little: bool, first: &[Field], settings: &[Field], gap: usize) -> Vec<u8> {
        let short = |n: u16| if is_little { n.to_le_bytes() } else { n.to_be_bytes() };
        let number = |n: usize| {
            let n = u32::try_from(n).expect("short");
            if is_little { n.to_le_bytes() } else { n.to_be_bytes() }
        };
        let mark: &[u8] = if is_little { b"II*\0" } else { b"MM\0*" };
        let mut bytes = [mark, &number(8)].concat();
        for list in [first, settings] {
            let count = u16::try_from(list.len()).expect("few");
            bytes.extend(short(count));
            let mut elsewhere = Vec::new();
            let end = bytes.len() + 12 * list.len() + 4;
            let length: usize = list.iter().map(|field| field.3.len()).filter(|n| *n > 4).sum();
            for (tag, kind, count, value) in list {
                bytes.extend([short(*tag), short(*kind)].concat());
                bytes.extend(number(*count as usize));
                match *value {
                    _ if *tag == SETTINGS => bytes.extend(number(end + length + gap)),
                    [high, low] => {
                        bytes.extend(short(u16::from_be_bytes([*high, *low])));
                        bytes.extend([0; 2]);
                    }
                    _ if value.len() > 4 => {
                        bytes.extend(number(end + elsewhere.len()));
                        elsewhere.extend_from_slice(value);
                    }
                    _ => {
                        bytes.extend_from_slice(value);
                        bytes.extend(vec![0; 4 - value.len()]);
                    }
                }
            }
            bytes.extend([0; 4]);
            bytes.extend(elsewhere);
            bytes.extend(vec![0; gap]);
        }
        bytes
    }

    const AT: Field = (TAKEN, TEXT, 20, b"2026:03:12 14:05:00\0");
    const FROM_UTC: Field = (OFFSET, TEXT, 7, b"+02:00\0");
    const ON_FILM: Field = (FILM_LENGTH, SHORT, 1, &[0, 26]);
    const NEXT: Field = (SETTINGS, LONG, 1, &[]);
    const TURNED: Field = (0x0112, SHORT, 1, &[0, 6]);
    const SHARE: &[u8] = &[0, 0, 0, 1, 0, 0, 0, 50];

    /// A JPEG file with `segments` after its first mark.
    fn jpeg(segments: &[(u8, Vec<u8>)]) -> Vec<u8> {
        let mut plain = Vec::new();
        let encoder = JpegEncoder::new(&mut plain);
        encoder.write_image(&[0; 64], 8, 8, image::ExtendedColorType::L8).expect("encoded");
        let mut bytes = plain[..2].to_vec();
        for (mark, segment) in segments {
            let length = u16::try_from(segment.len() + 2).expect("a segment's length");
            bytes.extend([0xff, *mark]);
            bytes.extend(length.to_be_bytes());
            bytes.extend_from_slice(segment);
        }
        bytes.extend_from_slice(&plain[2..]);
        bytes
    }

    fn read(bytes: &[u8]) -> (Option<(String, Option<String>)>, Option<f64>) {
        let place = tempfile::tempdir().expect("a folder");
        let path = place.path().join("a.jpg");
        std::fs::write(&path, bytes).expect("written");
        (exif_time(&path), film_length_mm(&path))
    }

    fn segment(exif: &[u8]) -> (u8, Vec<u8>) {
        (0xe1, [b"Exif\0\0", exif].concat())
    }

    /// As the phones of three makers write it: in order of the tags with the maker's own bytes; the
    /// other byte order; and in no order, at odd places, with text of 5 bytes.
    #[test]
    fn time_and_focal_length_are_read_as_phones_write_them() {
        let maker = (0x927c, UNNAMED, 300, &[7; 300][..]);
        let named = [(0x010f, TEXT, 6, &b"Apple\0"[..]), TURNED, (0x011a, FRACTION, 1, SHARE)];
        let ordered = [(0x829a, FRACTION, 1, SHARE), AT, FROM_UTC, maker, ON_FILM];
        let first = [&named[..], &[NEXT, (POSITION, LONG, 1, &[0, 0, 9, 9])]].concat();
        let mixed = [(0x0131, TEXT, 5, &b"1.0 \0"[..]), (POSITION, LONG, 1, &[0; 4]), NEXT, TURNED];
        let unordered = [ON_FILM, (0xa420, TEXT, 33, &[b'7'; 33][..]), FROM_UTC, maker, AT];
        let time = Some(("2026:03:12 14:05:00".to_owned(), Some("+02:00".to_owned())));
        for (is_little, first, settings, gap) in [
            (false, &first[..], &ordered, 0),
            (true, &first[..], &ordered, 0),
            (false, &mixed[..], &unordered, 1),
        ] {
            let exif = exif(is_little, first, settings, gap);
            let wanted = (time.clone(), Some(26.0));
            assert_eq!(read(&jpeg(&[segment(&exif)])), wanted, "{is_little}, {gap}");
            // Others' blocks around it: a thumbnail's mark, editing notes, and depth of megabytes.
            let notes = (0xe1, b"http://ns.adobe.com/xap/1.0/\0<x:xmpmeta/>".to_vec());
            let depth =
                (0xe1, [b"http://ns.adobe.com/xmp/extension/\0", &[9; 60_000][..]].concat());
            let mark = (0xe0, b"JFIF\0\x01\x01\0\0\x01\0\x01\0\0".to_vec());
            let around = [vec![mark, notes, segment(&exif)], vec![depth; 20]].concat();
            assert_eq!(read(&jpeg(&around)), wanted, "{is_little}, {gap}");
            // A cut block has no time, or the same.
            for length in 0..exif.len() {
                assert!(film_length_in(&exif[..length]).is_none_or(|mm| mm == 26.0));
                let found = time_in(&exif[..length]);
                assert!(found.is_none_or(|(time, _)| time == wanted.0.as_ref().expect("set").0));
            }
        }
        // 0 stands for an unknown one.
        let unknown = exif(true, &[NEXT], &[(FILM_LENGTH, SHORT, 1, &[0, 0])], 0);
        assert_eq!(read(&jpeg(&[segment(&unknown)])), (None, None));
    }
}
