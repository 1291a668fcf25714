//! What the simulated USB camera sees: pictures from a folder, or a chessboard that moves.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
    sync::{Mutex, PoisonError},
};

use image::{ExtendedColorType, GrayImage, codecs::jpeg::JpegEncoder, imageops};

use crate::modes::{Format, Mode};

/// Frames ready to be sent: by format, size, whether they are drawn, and number.
type Ready = BTreeMap<(Format, (u16, u16), bool, usize), Vec<u8>>;

/// A supply of frames. Those that are asked for again are kept.
pub(crate) struct Pictures {
    /// Drawn pictures before the first file: while a program settles its camera.
    before: u64,
    files: Vec<PathBuf>,
    ready: Mutex<Ready>,
}

/// Pictures that the moving chessboard repeats.
const DRAWN: u64 = 16;
/// Frames that are kept.
const KEPT: usize = 64;

impl Pictures {
    /// The PNG files of `folder` in the order of their names; drawn pictures if there are none.
    pub(crate) fn of(folder: Option<&Path>, before: u64) -> Self {
        let entries = folder.and_then(|folder| std::fs::read_dir(folder).ok());
        let mut files: Vec<PathBuf> = entries
            .into_iter()
            .flatten()
            .flatten()
            .map(|entry| entry.path())
            .filter(|path| path.extension().is_some_and(|extension| extension == "png"))
            .collect();
        files.sort();
        Self { before, files, ready: Mutex::default() }
    }

    /// Frame `number` in `mode`; after the last file the first follows.
    pub(crate) fn frame(&self, mode: Mode, number: u64) -> Vec<u8> {
        let is_drawn = self.files.is_empty() || number < self.before;
        let which = if is_drawn {
            (number % DRAWN) as usize
        } else {
            ((number - self.before) % self.files.len() as u64) as usize
        };
        let key = (mode.format, mode.size, is_drawn, which);
        let mut ready = self.ready.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(frame) = ready.get(&key) {
            return frame.clone();
        }
        let frame = encoded(&self.picture(mode.size, is_drawn, which), mode.format);
        if ready.len() < KEPT {
            ready.insert(key, frame.clone());
        }
        frame
    }

    fn picture(&self, (width, height): (u16, u16), is_drawn: bool, which: usize) -> GrayImage {
        let size = (u32::from(width), u32::from(height));
        let file = self.files.get(which).filter(|_| !is_drawn);
        match file.and_then(|path| image::open(path).ok()) {
            Some(picture) => {
                let picture = picture.into_luma8();
                if picture.dimensions() == size {
                    picture
                } else {
                    imageops::resize(&picture, size.0, size.1, imageops::FilterType::Triangle)
                }
            }
            None => drawn(size, which as u32),
        }
    }
}

/// A chessboard of 9 by 6 inner corners, further right in each picture.
fn drawn((width, height): (u32, u32), which: u32) -> GrayImage {
    let square = height / 10;
    let (left, top) = ((width - 10 * square) / 2 + which, (height - 7 * square) / 2);
    GrayImage::from_fn(width, height, |x, y| {
        let inside =
            (left..left + 10 * square).contains(&x) && (top..top + 7 * square).contains(&y);
        let dark = inside && ((x - left) / square + (y - top) / square).is_multiple_of(2);
        image::Luma([if dark { 20 } else { 235 }])
    })
}

fn encoded(picture: &GrayImage, format: Format) -> Vec<u8> {
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

/// The frame without its Huffman tables, as many webcams send it.
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
