//! A growing file.

use std::{
    fs::File,
    io::Write,
    path::{Path, PathBuf},
};

use super::{
    FileError,
    disk_log::{Change, note},
    patient::{Patient, sync_all, sync_data},
    plain::{file_or_nothing, options, other_than_file},
};

/// A file for appending.
#[derive(Debug)]
pub struct Appending {
    file: File,
    path: PathBuf,
}

impl Appending {
    /// Creates an empty file at `path`, synced. The name is safe once the folder is synced, too.
    ///
    /// # Errors
    ///
    /// [`FileError::NotAFile`] or [`FileError::Write`], also if there is something at `path`.
    pub fn create(path: &Path) -> Result<Self, FileError> {
        let writing = FileError::writing(path);
        let file = options(true).append(true).create_new(true).open(path).map_err(&writing)?;
        note(&Change::Create(path));
        sync_all(&file).map_err(&writing)?;
        note(&Change::SyncFile(path));
        Ok(Self { file, path: path.to_path_buf() })
    }

    /// Opens the file at `path`. Changes nothing.
    ///
    /// # Errors
    ///
    /// [`FileError::NotAFile`] or [`FileError::Write`], also if there is no file.
    pub fn open(path: &Path) -> Result<Self, FileError> {
        let writing = FileError::writing(path);
        file_or_nothing(path)?;
        let file = options(true).append(true).open(path).map_err(&writing)?;
        match other_than_file(file.metadata().map_err(&writing)?.file_type()) {
            None => Ok(Self { file, path: path.to_path_buf() }),
            Some(what) => Err(FileError::NotAFile { what, path: path.to_path_buf() }),
        }
    }

    /// Drops everything after the first `bytes` bytes, and syncs.
    ///
    /// # Errors
    ///
    /// [`FileError::Write`].
    pub fn cut(&mut self, bytes: u64) -> Result<(), FileError> {
        self.file.set_len(bytes).map_err(FileError::writing(&self.path))?;
        note(&Change::Cut { path: &self.path, bytes });
        self.sync()
    }

    /// Appends `bytes` in a single write.
    ///
    /// # Errors
    ///
    /// [`FileError::Write`]; some of them may then be there.
    pub fn append(&mut self, bytes: &[u8]) -> Result<(), FileError> {
        Patient::new(&self.file).write_all(bytes).map_err(FileError::writing(&self.path))?;
        note(&Change::Append { path: &self.path, bytes });
        Ok(())
    }

    /// Returns when everything appended outlasts a power cut.
    ///
    /// # Errors
    ///
    /// [`FileError::Write`].
    pub fn sync(&mut self) -> Result<(), FileError> {
        sync_data(&self.file).map_err(FileError::writing(&self.path))?;
        note(&Change::SyncFile(&self.path));
        Ok(())
    }

    /// Path of the file.
    pub fn path(&self) -> &Path {
        &self.path
    }
}
