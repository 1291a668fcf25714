//! Places of sessions and results: a folder, or a prefix in an object store.

use std::path::{Path, PathBuf};

use super::{address::is_cloud, buckets::Prefix};
use boresight_files::{FileError, Links, Overwrite, make_folder, read, save};
use boresight_geometry::parallel;

/// Files read at a time: waits for a disk or a file server overlap.
const READERS: usize = 8;

/// A folder, or a prefix in an object store. Names below it have slashes.
#[derive(Clone, Debug)]
pub(super) enum Place {
    /// A folder of the computer.
    Folder(PathBuf),
    /// A prefix in an object store.
    Cloud(Prefix),
}

impl Place {
    /// Opens the place at `path`.
    ///
    /// # Errors
    ///
    /// If an object store can't be used with this build, the settings or the credentials.
    pub(super) fn at(path: &Path) -> anyhow::Result<Self> {
        if is_cloud(path) {
            return Ok(Self::Cloud(Prefix::open(path)?));
        }
        Ok(Self::Folder(path.to_path_buf()))
    }

    /// Path or address of `below`, for a person; of the place itself for an empty `below`.
    pub(super) fn path(&self, below: &str) -> PathBuf {
        match self {
            Self::Folder(folder) if below.is_empty() => folder.clone(),
            Self::Folder(folder) => folder.join(below),
            Self::Cloud(prefix) => PathBuf::from(prefix.name(below)),
        }
    }

    /// Reads a file of at most `limit_bytes`; `None` if missing.
    ///
    /// # Errors
    ///
    /// If the file can't be read.
    pub(super) fn read(&self, below: &str, limit_bytes: u64) -> anyhow::Result<Option<Vec<u8>>> {
        match self {
            Self::Folder(folder) => read_there(&folder.join(below), limit_bytes),
            Self::Cloud(prefix) => prefix.read(below, limit_bytes),
        }
    }

    /// Reads each of `below` as [`Place::read`], in order.
    ///
    /// # Errors
    ///
    /// If an object store doesn't answer; the error of a single file is in its place.
    pub(super) fn read_each(
        &self,
        below: &[String],
        limit_bytes: u64,
    ) -> anyhow::Result<Vec<anyhow::Result<Option<Vec<u8>>>>> {
        match self {
            Self::Folder(folder) => Ok(parallel::map(READERS, below.len(), |index| {
                read_there(&folder.join(&below[index]), limit_bytes)
            })),
            Self::Cloud(prefix) => prefix.read_each(below, limit_bytes),
        }
    }

    /// Stores a new file; false if it exists, without a change.
    ///
    /// # Errors
    ///
    /// If the file can't be stored.
    pub(super) fn create(&self, below: &str, bytes: &[u8]) -> anyhow::Result<bool> {
        match self {
            Self::Folder(folder) => match save_there(folder, below, bytes, Overwrite::Never) {
                Ok(()) => Ok(true),
                Err(FileError::Exists { .. }) => Ok(false),
                Err(err) => Err(err.into()),
            },
            Self::Cloud(prefix) => prefix.create(below, bytes),
        }
    }

    /// Stores or replaces a file.
    ///
    /// # Errors
    ///
    /// If the file can't be stored.
    pub(super) fn replace(&self, below: &str, bytes: &[u8]) -> anyhow::Result<()> {
        match self {
            Self::Folder(folder) => Ok(save_there(folder, below, bytes, Overwrite::Allowed)?),
            Self::Cloud(prefix) => prefix.replace(below, bytes),
        }
    }
}

fn read_there(path: &Path, limit_bytes: u64) -> anyhow::Result<Option<Vec<u8>>> {
    match read(path, limit_bytes, Links::Refused) {
        Ok(bytes) => Ok(Some(bytes)),
        Err(err) if err.is_missing() => Ok(None),
        Err(err) => Err(err.into()),
    }
}

fn save_there(
    folder: &Path,
    below: &str,
    bytes: &[u8],
    overwrite: Overwrite,
) -> Result<(), FileError> {
    let path = folder.join(below);
    make_folder(path.parent().unwrap_or(folder))?;
    save(&path, bytes, overwrite)
}
