//! Contents of the simulated USB camera's pictures: from a folder, or a chessboard.
//!
//! Files are read before the camera is plugged in, and a picture is packed once: a slow machine has
//! no time for either while frames are due.

use std::{
    collections::BTreeMap,
    path::Path,
    sync::{Arc, Mutex, PoisonError},
};

use image::{ExtendedColorType, GrayImage, codecs::jpeg::JpegEncoder, imageops};

use crate::modes::{Format, Mode};

/// Subject of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Sight {
    /// A chessboard of 9 by 6 inner corners.
    Chessboard,
    /// A wall, while a program settles the camera.
    Wall,
    /// A picture of the folder.
    File(usize),
}

/// Packed pictures.
type Packed = BTreeMap<(Format, (u16, u16), Sight), Arc<Vec<u8>>>;

/// A supply of frames.
pub(crate) struct Pictures {
    /// Number of frames of the wall before the first file.
    before: u64,
    files: Vec<GrayImage>,
    packed: Mutex<Packed>,
}

impl Pictures {
    /// The PNG files of `folder` in the order of names, after `before` pictures of a wall; a
    /// chessboard without files.
    ///
    /// # Errors
    ///
    /// A file other than a picture.
    pub(crate) fn of(folder: Option<&Path>, before: u64) -> std::io::Result<Self> {
        let entries = folder.and_then(|folder| std::fs::read_dir(folder).ok());
        let mut paths: Vec<_> = entries
            .into_iter()
            .flatten()
            .flatten()
            .map(|entry| entry.path())
            .filter(|path| path.extension().is_some_and(|extension| extension == "png"))
            .collect();
        paths.sort();
        let read = |path| image::open(path).map(image::DynamicImage::into_luma8);
        let files =
            paths.iter().map(read).collect::<Result<_, _>>().map_err(std::io::Error::other)?;
        Ok(Self { before, files, packed: Mutex::default() })
    }

    /// Frame `number` in `mode`, with bytes unlike the previous frame's; after the last file the
    /// first follows.
    pub(crate) fn frame(&self, mode: Mode, number: u64) -> Vec<u8> {
        let sight = match number.checked_sub(self.before) {
            _ if self.files.is_empty() => Sight::Chessboard,
            None => Sight::Wall,
            Some(number) => Sight::File((number % self.files.len() as u64) as usize),
        };
        let mut frame = self.packed(mode, sight).to_vec();
        if let Sight::File(_) = sight {
            return frame;
        }
        // A sensor has noise: no two of its pictures are the same bytes.
        let [low, high, ..] = number.to_le_bytes();
        match mode.format {
            Format::Yuyv => frame[..2].copy_from_slice(&[low, high]),
            // Comment, four bytes long.
            Format::Mjpeg => drop(frame.splice(2..2, [0xff, 0xfe, 0, 4, low, high])),
        }
        frame
    }

    fn packed(&self, mode: Mode, sight: Sight) -> Arc<Vec<u8>> {
        let mut packed = self.packed.lock().unwrap_or_else(PoisonError::into_inner);
        let entry = packed.entry((mode.format, mode.size, sight));
        Arc::clone(
            entry.or_insert_with(|| Arc::new(pack(&self.picture(mode.size, sight), mode.format))),
        )
    }

    fn picture(&self, (width, height): (u16, u16), sight: Sight) -> GrayImage {
        let size = (u32::from(width), u32::from(height));
        match sight {
            Sight::Chessboard => chessboard(size),
            Sight::Wall => GrayImage::from_fn(size.0, size.1, |x, _| {
                image::Luma([90 + (x * 60 / size.0) as u8])
            }),
            Sight::File(which) if self.files[which].dimensions() == size => {
                self.files[which].clone()
            }
            Sight::File(which) => {
                imageops::resize(&self.files[which], size.0, size.1, imageops::FilterType::Triangle)
            }
        }
    }
}

/// A chessboard of 9 by 6 inner corners.
fn chessboard((width, height): (u32, u32)) -> GrayImage {
    let square = height / 10;
    let (left, top) = ((width - 10 * square) / 2, (height - 7 * square) / 2);
    GrayImage::from_fn(width, height, |x, y| {
        let inside =
            (left..left + 10 * square).contains(&x) && (top..top + 7 * square).contains(&y);
        let dark = inside && ((x - left) / square + (y - top) / square).is_multiple_of(2);
        image::Luma([if dark { 20 } else { 235 }])
    })
}

fn pack(picture: &GrayImage, format: Format) -> Vec<u8> {
    match format {
        Format::Yuyv => picture.as_raw().iter().flat_map(|value| [*value, 128]).collect(),
        Format::Mjpeg => {
            let rgb: Vec<u8> = picture.as_raw().iter().flat_map(|value| [*value; 3]).collect();
            let (width, height) = picture.dimensions();
            let mut bytes = Vec::new();
            let encoder = &mut JpegEncoder::new_with_quality(&mut bytes, 85);
            match encoder.encode(&rgb, width, height, ExtendedColorType::Rgb8) {
                Ok(()) => bytes,
                Err(err) => {
                    eprintln!("uvcsim: {err}");
                    Vec::new()
                }
            }
        }
    }
}
/// The frame without Huffman tables, as sent by many webcams.
pub(crate) fn without_tables(frame: &[u8]) -> Vec<u8> {
    let mut kept = frame[..2].to_vec();
    let mut at = 2;
    while at + 4 <= frame.len() && frame[at] == 0xff {
        let length = 2 + usize::from(u16::from_be_bytes([frame[at + 2], frame[at + 3]]));
        if frame[at + 1] != 0xc4 {
            kept.extend(&frame[at..at + length]);
        }
        at += length;
        if frame[at - length + 1] == 0xda {
            break;
        }
    }
    kept.extend(&frame[at..]);
    kept
}
