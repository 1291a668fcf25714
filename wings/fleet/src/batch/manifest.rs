//! Sessions of a batch, line by line.

use std::path::{Path, PathBuf};

use super::{
    address::{FETCHED, is_cloud, missing},
    buckets::Prefix,
    item::Item,
};
use boresight_app::session::session_folders::sessions_and_bags;
use boresight_files::{FileError, LineReader, Links, Scratch};

/// Longest line of a manifest, in bytes.
const LINE_LIMIT: u64 = 1 << 16;

/// Error of reading a manifest.
#[derive(Debug, thiserror::Error)]
pub enum ManifestError {
    /// The file can't be read.
    #[error(transparent)]
    File(#[from] FileError),
    /// A line without an item.
    #[error(
        "line {line} is no line of a manifest ({reason}); write it again with `boresight batch plan`: {path:?}"
    )]
    Line {
        /// Number of the line, from 1.
        line: u64,
        /// The mistake in the line.
        reason: String,
        /// Path of the file.
        path: PathBuf,
    },
}

/// Finds the sessions and recorded bags in and below each of `roots`, in the order of paths, and
/// hands each to `found`. Links below a root aren't followed. A root may be `s3://BUCKET/PREFIX`,
/// without support for bags. Returns the paths left out for not being UTF-8.
///
/// # Errors
///
/// If a root is neither, a store doesn't answer, or `found` fails.
pub fn plan(
    roots: &[PathBuf],
    found: &mut dyn FnMut(&Item) -> anyhow::Result<()>,
) -> anyhow::Result<Vec<PathBuf>> {
    let mut left_out = Vec::new();
    for root in roots {
        if is_cloud(root) {
            Prefix::open(root)?.sessions(found)?;
            continue;
        }
        sessions_and_bags(root, &mut |folder| match Item::of(folder) {
            Some(item) => found(&item),
            None => {
                left_out.push(folder.to_path_buf());
                Ok(())
            }
        })?;
    }
    Ok(left_out)
}

/// A manifest as a file, perhaps from an object store.
#[derive(Debug)]
pub(super) struct ManifestFile {
    /// Path of a readable copy.
    pub(super) path: PathBuf,
    /// Name of the manifest for people.
    shown: PathBuf,
    /// Owner of the copy, if any.
    _copy: Option<Scratch>,
}

impl ManifestFile {
    /// Opens the manifest at `path`, fetched if in an object store.
    ///
    /// # Errors
    ///
    /// If the store doesn't answer, has no such object, or the copy can't be written.
    pub(super) fn at(path: &Path) -> anyhow::Result<Self> {
        let own = path.to_path_buf();
        if !is_cloud(path) {
            return Ok(Self { path: own.clone(), shown: own, _copy: None });
        }
        let copy = Prefix::open(path)?.fetched("")?;
        let copy = copy.ok_or_else(|| missing(path))?;
        Ok(Self { path: copy.path().join(FETCHED), shown: own, _copy: Some(copy) })
    }

    /// Reads the items.
    ///
    /// # Errors
    ///
    /// [`ManifestError::File`].
    pub(super) fn items(&self) -> Result<Manifest, ManifestError> {
        Ok(Manifest { path: self.shown.clone(), ..Manifest::open(&self.path)? })
    }
}

/// Items of a manifest, read in sequence.
#[derive(Debug)]
pub struct Manifest {
    lines: LineReader,
    path: PathBuf,
    number: u64,
    line: Vec<u8>,
}

impl Manifest {
    /// Opens the manifest at `path`.
    ///
    /// # Errors
    ///
    /// [`ManifestError::File`].
    pub fn open(path: &Path) -> Result<Self, ManifestError> {
        let lines = LineReader::open(path, LINE_LIMIT, Links::Followed)?;
        Ok(Self { lines, path: path.to_path_buf(), number: 0, line: Vec::new() })
    }

    fn read(&mut self) -> Result<Option<Item>, ManifestError> {
        if !self.lines.read(&mut self.line)? {
            return Ok(None);
        }
        self.number += 1;
        let wrong = |reason: String| ManifestError::Line {
            line: self.number,
            reason,
            path: self.path.clone(),
        };
        if self.line.last() != Some(&b'\n') {
            return Err(wrong("its end is missing".into()));
        }
        serde_json::from_slice(&self.line).map(Some).map_err(|err| wrong(err.to_string()))
    }
}

impl Iterator for Manifest {
    type Item = Result<Item, ManifestError>;

    fn next(&mut self) -> Option<Self::Item> {
        self.read().transpose()
    }
}
