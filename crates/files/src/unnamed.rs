//! Temporary files without a name.

use std::{
    fs::File,
    path::{Path, PathBuf},
};

use super::{FileError, Scratch};

/// A new temporary file without a name: gone with its last user, however the program ends. Where
/// the system has no such files, a named one, removed on drop.
#[derive(Debug)]
pub struct Unnamed {
    file: File,
    named: Option<(Scratch, PathBuf)>,
}

impl Unnamed {
    /// Makes the file in the system's folder for temporary files.
    ///
    /// # Errors
    ///
    /// [`FileError::Write`].
    pub fn new() -> Result<Self, FileError> {
        #[cfg(target_os = "linux")]
        if let Some(file) = nameless() {
            return Ok(Self { file, named: None });
        }
        let scratch = Scratch::new()?;
        let below = Path::new("file");
        let file = scratch.create(below)?;
        let path = scratch.path().join(below);
        Ok(Self { file, named: Some((scratch, path)) })
    }

    /// The open file, to write.
    pub fn file(&mut self) -> &mut File {
        &mut self.file
    }

    /// A path that opens the file in this process.
    pub fn path(&self) -> PathBuf {
        match &self.named {
            Some((_, path)) => path.clone(),
            None => own_path(&self.file),
        }
    }

    /// Calls `open` with an ordinary name of the file, which goes with the call: for libraries that
    /// open by name only.
    ///
    /// # Errors
    ///
    /// [`FileError::Write`].
    pub fn opened<T>(&self, open: impl FnOnce(&Path) -> T) -> Result<T, FileError> {
        if let Some((_, path)) = &self.named {
            return Ok(open(path));
        }
        let scratch = Scratch::new()?;
        let path = scratch.path().join("file");
        #[cfg(target_os = "linux")]
        {
            use rustix::fs::{AtFlags, CWD, linkat};
            linkat(CWD, own_path(&self.file), CWD, &path, AtFlags::SYMLINK_FOLLOW)
                .map_err(|err| FileError::writing(&path)(err.into()))?;
        }
        Ok(open(&path))
    }
}

#[cfg(target_os = "linux")]
fn nameless() -> Option<File> {
    use rustix::fs::{Mode, OFlags};
    let flags = OFlags::TMPFILE | OFlags::RDWR | OFlags::CLOEXEC;
    let mode = Mode::RUSR | Mode::WUSR;
    let file = File::from(rustix::fs::open(tempfile::env::temp_dir(), flags, mode).ok()?);
    // Without /proc, nothing could open it again.
    own_path(&file).exists().then_some(file)
}

#[cfg(target_os = "linux")]
fn own_path(file: &File) -> PathBuf {
    use std::os::fd::AsRawFd;
    Path::new("/proc/self/fd").join(file.as_raw_fd().to_string())
}

#[cfg(not(target_os = "linux"))]
fn own_path(_: &File) -> PathBuf {
    PathBuf::new()
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::*;
    use crate::{Links, read};

    #[test]
    fn a_file_without_a_name_is_read_again_and_leaves_nothing() {
        let mut unnamed = Unnamed::new().expect("made");
        unnamed.file().write_all(b"held").expect("written");
        assert_eq!(read(&unnamed.path(), 10, Links::Followed).expect("readable"), b"held");
        let named = |path: &Path| (path.to_path_buf(), File::open(path).is_ok());
        let (path, is_open) = unnamed.opened(named).expect("linked");
        assert!(is_open);
        if cfg!(target_os = "linux") && unnamed.named.is_none() {
            assert!(!path.exists());
        }
    }
}
