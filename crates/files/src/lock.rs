//! Lock of a file, held by a program during changes.

use std::{
    ffi::OsString,
    fs::{File, TryLockError},
    io,
    path::{Path, PathBuf},
};

use super::{
    FileError,
    patient::Patient,
    plain::{file_or_nothing, options},
};

/// The right to change a file, until dropped or until the program ends.
#[derive(Debug)]
pub struct FileLock {
    _file: File,
    beside: PathBuf,
}

impl FileLock {
    /// Waits for the lock of the file at `path`, and takes the lock. The file itself is replaced on
    /// writing, so the lock is an empty file beside it, `.NAME.lock`, which stays. On a file system
    /// without locks, there is no waiting.
    ///
    /// # Errors
    ///
    /// [`FileError::NotAFile`] or [`FileError::Write`] if there can be no file beside it.
    pub fn wait_for(path: &Path) -> Result<Self, FileError> {
        let (file, beside) = opened(path)?;
        let mut patient = Patient::new(());
        loop {
            match patient.call(|()| file.lock()) {
                Err(err) if err.kind() == io::ErrorKind::Interrupted => {}
                Err(err) if err.kind() != io::ErrorKind::Unsupported => {
                    return Err(FileError::writing(&beside)(err));
                }
                _ => return Ok(Self { _file: file, beside }),
            }
        }
    }

    /// Takes the lock like [`Self::wait_for`], but returns `None` at once if the lock is taken.
    ///
    /// # Errors
    ///
    /// As [`Self::wait_for`].
    pub fn try_for(path: &Path) -> Result<Option<Self>, FileError> {
        let (file, beside) = opened(path)?;
        match file.try_lock() {
            Ok(()) => Ok(Some(Self { _file: file, beside })),
            Err(TryLockError::WouldBlock) => Ok(None),
            Err(TryLockError::Error(err)) if err.kind() == io::ErrorKind::Unsupported => {
                Ok(Some(Self { _file: file, beside }))
            }
            Err(TryLockError::Error(err)) => Err(FileError::writing(&beside)(err)),
        }
    }

    /// Releases the lock, and removes the lock file. Only correct if no program relies on the lock
    /// any more: later requests get another file.
    pub fn finish(self) {
        // A leftover is harmless.
        let _ = std::fs::remove_file(&self.beside);
    }
}

/// The empty file beside `path`, and the name.
fn opened(path: &Path) -> Result<(File, PathBuf), FileError> {
    let beside = beside(path);
    file_or_nothing(&beside)?;
    let file = options(true)
        .write(true)
        .create(true)
        .truncate(false)
        .open(&beside)
        .map_err(FileError::writing(&beside))?;
    Ok((file, beside))
}

fn beside(path: &Path) -> PathBuf {
    let mut name = OsString::from(".");
    name.push(path.file_name().unwrap_or_default());
    name.push(".lock");
    path.with_file_name(name)
}

#[cfg(test)]
mod tests {
    use std::{
        sync::{Barrier, atomic::AtomicUsize, atomic::Ordering},
        thread::scope,
    };

    use super::*;
    use crate::{Links, Overwrite, read_text, save};

    #[test]
    fn what_several_threads_add_is_all_there() {
        let place = tempfile::tempdir().expect("a folder");
        let path = place.path().join("count");
        save(&path, b"0", Overwrite::Never).expect("written");
        let (start, inside) = (Barrier::new(8), AtomicUsize::new(0));
        let add = || {
            start.wait();
            for _ in 0..20 {
                let _lock = FileLock::wait_for(&path).expect("locked");
                assert_eq!(inside.fetch_add(1, Ordering::SeqCst), 0);
                let text = read_text(&path, 100, Links::Refused).expect("read");
                let count: usize = text.parse().expect("a number");
                let more = (count + 1).to_string();
                save(&path, more.as_bytes(), Overwrite::Allowed).expect("written");
                inside.fetch_sub(1, Ordering::SeqCst);
            }
        };
        scope(|threads| {
            for _ in 0..8 {
                threads.spawn(add);
            }
        });
        assert_eq!(read_text(&path, 100, Links::Refused).expect("read"), "160");
    }

    #[test]
    fn a_lock_that_another_has_is_not_waited_for() {
        let place = tempfile::tempdir().expect("a folder");
        let path = place.path().join("row");
        let first = FileLock::try_for(&path).expect("locked").expect("free");
        assert!(FileLock::try_for(&path).expect("looked").is_none());
        drop(first);
        assert!(FileLock::try_for(&path).expect("looked").is_some());
    }

    #[cfg(unix)]
    #[test]
    fn a_link_in_its_place_is_refused() {
        let place = tempfile::tempdir().expect("a folder");
        let path = place.path().join("index");
        std::os::unix::fs::symlink(place.path().join("elsewhere"), beside(&path)).expect("made");
        assert!(matches!(FileLock::wait_for(&path), Err(FileError::NotAFile { .. })));
    }
}
