//! Temporary files.

use std::{
    fs::{self, File},
    io,
    path::Path,
};

use super::FileError;

/// A new folder for the owner only, removed with all contents on drop. After a killed program it's
/// left below the system's folder for temporary files. Nothing in it is synced.
#[derive(Debug)]
pub struct Scratch {
    folder: tempfile::TempDir,
}

impl Scratch {
    /// Makes the folder below the system's folder for temporary files.
    ///
    /// # Errors
    ///
    /// [`FileError::Write`].
    pub fn new() -> Result<Self, FileError> {
        let mut builder = tempfile::Builder::new();
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o700));
        let folder = builder.prefix("boresight-").tempdir();
        Ok(Self { folder: folder.map_err(FileError::writing(&tempfile::env::temp_dir()))? })
    }

    /// Path of the folder.
    pub fn path(&self) -> &Path {
        self.folder.path()
    }

    /// Makes a new file, and missing folders above.
    ///
    /// # Errors
    ///
    /// [`FileError::Exists`] or [`FileError::Write`].
    pub fn create(&self, below: &Path) -> Result<File, FileError> {
        let path = self.path().join(below);
        if let Some(folder) = path.parent() {
            fs::create_dir_all(folder).map_err(FileError::writing(folder))?;
        }
        File::create_new(&path).map_err(|err| match err.kind() {
            io::ErrorKind::AlreadyExists => FileError::Exists { path: path.clone() },
            _ => FileError::writing(&path)(err),
        })
    }

    /// Removes a file, or a folder with all contents, if present.
    ///
    /// # Errors
    ///
    /// [`FileError::Write`].
    pub fn remove(&self, below: &Path) -> Result<(), FileError> {
        let path = self.path().join(below);
        let removed = match path.symlink_metadata() {
            Err(_) => return Ok(()),
            Ok(there) if there.is_dir() => fs::remove_dir_all(&path),
            Ok(_) => fs::remove_file(&path),
        };
        removed.map_err(FileError::writing(&path))
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::*;
    use crate::{Links, read};

    #[test]
    fn what_is_made_is_private_and_goes() {
        let scratch = Scratch::new().expect("made");
        let own = scratch.path().to_path_buf();
        let below = Path::new("one/two/file");
        scratch.create(below).expect("made").write_all(b"held").expect("written");
        assert!(matches!(scratch.create(below), Err(FileError::Exists { .. })));
        assert_eq!(read(&own.join(below), 10, Links::Refused).expect("readable"), b"held");
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            assert_eq!(own.metadata().expect("there").permissions().mode() & 0o077, 0);
        }
        scratch.remove(Path::new("one/two")).expect("removed");
        scratch.remove(Path::new("one/two")).expect("nothing to remove");
        assert!(!own.join(below).exists());
        drop(scratch);
        assert!(!own.exists());
    }
}
