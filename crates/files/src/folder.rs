//! Folders.

use std::{
    fs::{self, File},
    io,
    path::{Path, PathBuf},
};

use super::{
    FileError,
    disk_log::{Change, note},
    patient::sync_all,
};

/// Prefix of the names of incomplete files and folders.
pub const UNFINISHED: &str = ".boresight-";

/// Creates the folder `path` and missing parents, and syncs the new names.
///
/// # Errors
///
/// [`FileError::Write`].
pub fn make_folder(path: &Path) -> Result<(), FileError> {
    let writing = FileError::writing(path);
    let missing: Vec<&Path> = path
        .ancestors()
        .take_while(|folder| !folder.as_os_str().is_empty() && !folder.exists())
        .collect();
    for folder in missing.into_iter().rev() {
        match fs::create_dir(folder) {
            Ok(()) => {}
            // Another program may have made it meanwhile.
            Err(err) if err.kind() == io::ErrorKind::AlreadyExists && folder.is_dir() => {}
            Err(err) => return Err(writing(err)),
        }
        note(&Change::MakeFolder(folder));
        sync_folder(parent(folder))?;
    }
    if path.is_dir() { Ok(()) } else { Err(writing(io::ErrorKind::NotADirectory.into())) }
}

/// Syncs the names in `folder`: without this, a power cut could lose a new name itself. Only Unix
/// opens folders as files.
///
/// # Errors
///
/// [`FileError::Write`].
pub fn sync_folder(folder: &Path) -> Result<(), FileError> {
    if cfg!(unix) {
        let opened = File::open(folder).and_then(|open| sync_all(&open));
        opened.map_err(FileError::writing(folder))?;
    }
    note(&Change::SyncFolder(folder));
    Ok(())
}

/// True if `path` is a folder, not a link to a folder.
pub fn is_own_folder(path: &Path) -> bool {
    path.symlink_metadata().is_ok_and(|found| found.is_dir())
}

/// True if two files have the same bytes.
pub fn is_same_file(one: &Path, other: &Path) -> bool {
    let length = |path: &Path| path.metadata().ok().map(|found| found.len());
    let is_as_long = length(one).is_some() && length(one) == length(other);
    is_as_long && matches!((fs::read(one), fs::read(other)), (Ok(one), Ok(other)) if one == other)
}

/// Paths in a folder, sorted; none if it can't be listed.
pub fn entries(folder: &Path) -> Vec<PathBuf> {
    let mut paths: Vec<PathBuf> = folder
        .read_dir()
        .into_iter()
        .flatten()
        .filter_map(|entry| Some(entry.ok()?.path()))
        .collect();
    paths.sort_unstable();
    paths
}

fn parent(path: &Path) -> &Path {
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    }
}

/// A new folder, visible under the final name when complete. Removed if dropped before.
#[derive(Debug)]
pub struct Draft {
    folder: tempfile::TempDir,
    wanted: PathBuf,
}

impl Draft {
    /// Begins a folder beside `wanted`.
    ///
    /// # Errors
    ///
    /// [`FileError::Exists`] or [`FileError::Write`].
    pub fn begin(wanted: &Path) -> Result<Self, FileError> {
        let beside = parent(wanted);
        if wanted.symlink_metadata().is_ok() {
            return Err(FileError::Exists { path: wanted.to_path_buf() });
        }
        make_folder(beside)?;
        let mut builder = tempfile::Builder::new();
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o777));
        let folder =
            builder.prefix(UNFINISHED).tempdir_in(beside).map_err(FileError::writing(wanted))?;
        note(&Change::MakeFolder(folder.path()));
        Ok(Self { folder, wanted: wanted.to_path_buf() })
    }

    /// Path of the folder until complete.
    pub fn path(&self) -> &Path {
        self.folder.path()
    }

    /// Gives the folder the final name, and syncs the name.
    ///
    /// # Errors
    ///
    /// [`FileError::Exists`] or [`FileError::Write`].
    pub fn complete(self) -> Result<(), FileError> {
        let Self { folder, wanted } = self;
        if wanted.symlink_metadata().is_ok() {
            return Err(FileError::Exists { path: wanted });
        }
        fs::rename(folder.path(), &wanted).map_err(FileError::writing(&wanted))?;
        let draft = folder.keep();
        note(&Change::Rename { from: &draft, to: &wanted });
        sync_folder(parent(&wanted))
    }
}
