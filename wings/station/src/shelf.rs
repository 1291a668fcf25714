//! Learning pictures of a camera.

use std::path::{Path, PathBuf};

use image::{GrayImage, ImageFormat};

use boresight_capture::{Upright, decoded, read_picture};
use boresight_files::{FileError, Overwrite, entries, make_folder, remove, save};
use boresight_watch::Shelf;

/// Folder name of the learning pictures.
pub(super) const LEARNING: &str = "learning";

/// Learning pictures: in a folder, or only in memory where no picture may be stored.
#[derive(Debug)]
pub struct PictureShelf {
    folder: Option<PathBuf>,
    in_memory: Vec<(u64, f64, Vec<u8>)>,
    dropped: Vec<u64>,
}

impl PictureShelf {
    pub(super) fn at(folder: &Path, patches_only: bool) -> Self {
        Self {
            folder: (!patches_only).then(|| folder.join(LEARNING)),
            in_memory: Vec::new(),
            dropped: Vec::new(),
        }
    }

    /// Numbers and times of the pictures in the folder, oldest first.
    pub(super) fn kept(&self) -> Vec<(u64, f64)> {
        let Some(folder) = &self.folder else { return Vec::new() };
        let of = |path: PathBuf| {
            let stem = path.file_stem()?.to_str()?.to_owned();
            let (number, at) = stem.split_once('-')?;
            Some((number.parse().ok()?, at.parse().ok()?))
        };
        entries(folder).into_iter().filter_map(of).collect()
    }

    /// Removes dropped pictures: references learned from them are stored by now.
    pub(super) fn clear_dropped(&mut self) {
        for number in std::mem::take(&mut self.dropped) {
            self.in_memory.retain(|(n, _, _)| *n != number);
            if let Some(path) = self.path(number) {
                // A leftover is dropped again when learning ends.
                let _ = remove(&path);
            }
        }
    }

    fn path(&self, number: u64) -> Option<PathBuf> {
        let prefix = format!("{number:08}-");
        let is_it = |path: &PathBuf| {
            path.file_name().and_then(|n| n.to_str()).is_some_and(|n| n.starts_with(&prefix))
        };
        entries(self.folder.as_ref()?).into_iter().find(is_it)
    }

    fn put_or(&mut self, number: u64, at_secs: f64, grey: &GrayImage) -> Result<(), FileError> {
        let Ok(png) = png(grey) else { return Ok(()) };
        match &self.folder {
            None => self.in_memory.push((number, at_secs, png)),
            Some(folder) => {
                make_folder(folder)?;
                save(&folder.join(format!("{number:08}-{at_secs}.png")), &png, Overwrite::Allowed)?;
            }
        }
        Ok(())
    }
}

impl Shelf for PictureShelf {
    fn put(&mut self, number: u64, at_secs: f64, grey: &GrayImage) {
        // A lost picture is missing from learning, and nothing else.
        let _ = self.put_or(number, at_secs, grey);
    }

    fn take(&mut self, number: u64) -> Option<GrayImage> {
        if self.folder.is_some() {
            return read_picture(&self.path(number)?).ok();
        }
        let (_, _, png) = self.in_memory.iter().find(|(n, _, _)| *n == number)?;
        decoded(std::io::Cursor::new(png), ImageFormat::Png, Upright::AsStored).ok()
    }

    fn drop(&mut self, number: u64) {
        self.dropped.push(number);
    }
}

/// A grey picture as PNG.
pub(super) fn png(grey: &GrayImage) -> anyhow::Result<Vec<u8>> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    grey.write_to(&mut bytes, ImageFormat::Png)?;
    Ok(bytes.into_inner())
}
