//! EXIF data of JPEG files: time, focal length, and which way is up.

use std::fs;

use boresight::capture::{exif_time, film_length_mm, read_picture};
use image::{ExtendedColorType, codecs::jpeg::JpegEncoder};

use crate::{
    harness::{run, scratch},
    mutator::Mutator,
};

/// Widths of numbers in EXIF data.
#[derive(Clone, Copy)]
enum Order {
    Little,
    Big,
}

impl Order {
    fn short(self, number: u16) -> [u8; 2] {
        match self {
            Self::Little => number.to_le_bytes(),
            Self::Big => number.to_be_bytes(),
        }
    }

    fn long(self, number: u32) -> [u8; 4] {
        match self {
            Self::Little => number.to_le_bytes(),
            Self::Big => number.to_be_bytes(),
        }
    }

    /// A field with a number, or with a place.
    fn field(self, tag: u16, kind: u16, count: u32, value: u32) -> Vec<u8> {
        let value = if kind == 3 {
            [self.short(value as u16), [0, 0]].concat()
        } else {
            self.long(value).into()
        };
        [&self.short(tag)[..], &self.short(kind), &self.long(count), &value].concat()
    }

    /// EXIF data with an orientation, times and a focal length.
    fn exif(self) -> Vec<u8> {
        let start: &[u8] = match self {
            Self::Little => b"II*\0",
            Self::Big => b"MM\0*",
        };
        let first = [
            self.field(0x0112, 3, 1, 6),
            self.field(0x0132, 2, 20, 110),
            self.field(0x8769, 4, 1, 60),
        ];
        let settings = [
            self.field(0x9003, 2, 20, 130),
            self.field(0x9011, 2, 7, 150),
            self.field(0xA405, 3, 1, 28),
        ];
        let block = |fields: &[Vec<u8>]| {
            [&self.short(fields.len() as u16)[..], &fields.concat(), &self.long(0)].concat()
        };
        let mut exif = [start, &self.long(8)].concat();
        exif.extend(block(&first));
        exif.resize(60, 0);
        exif.extend(block(&settings));
        exif.resize(110, 0);
        exif.extend(b"2026:03:12 14:05:00\0");
        exif.extend(b"2026:03:12 14:05:01\0");
        exif.extend(b"+02:00\0");
        exif
    }
}

/// A JPEG with a block of EXIF data.
fn with(exif: &[u8], jpeg: &[u8]) -> Vec<u8> {
    let exif = &exif[..exif.len().min(60_000)];
    let length = (exif.len() as u16 + 8).to_be_bytes();
    [&jpeg[..2], &[0xff, 0xe1], &length, b"Exif\0\0", exif, &jpeg[2..]].concat()
}

#[test]
fn exif_data() {
    let place = scratch();
    let file = place.path().join("picture.jpg");
    let mut jpeg = Vec::new();
    JpegEncoder::new(&mut jpeg)
        .encode(&[90; 16 * 8], 16, 8, ExtendedColorType::L8)
        .expect("a JPEG");
    let blocks = [Order::Little, Order::Big].map(Order::exif);
    for block in &blocks {
        fs::write(&file, with(block, &jpeg)).expect("written");
        let (time, offset) = exif_time(&file).expect("a time");
        assert_eq!((time.as_str(), offset.as_deref()), ("2026:03:12 14:05:01", Some("+02:00")));
        assert_eq!(film_length_mm(&file), Some(28.0));
        assert_eq!(read_picture(&file).expect("a picture").dimensions(), (8, 16));
    }
    let mutated = |mutator: &mut Mutator| {
        let all = with(&mutator.bytes(&blocks), &jpeg);
        if mutator.chance(0.1) { mutator.bytes(&[all]) } else { all }
    };
    run("exif", mutated, |input| {
        fs::write(&file, input).expect("written");
        let (time, length) = (exif_time(&file), film_length_mm(&file));
        if length.is_some_and(|mm| !(mm > 0.0 && mm.is_finite())) {
            return Err(format!("{length:?}"));
        }
        let picture = read_picture(&file);
        if picture.is_ok_and(|image| image.is_empty()) {
            return Err("an empty picture".into());
        }
        Ok(time.is_some())
    });
}
