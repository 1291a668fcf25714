//! A lock that a program holds while it changes a file.

use std::{
    ffi::OsString,
    fs::File,
    io,
    path::{Path, PathBuf},
};

use super::{
    FileError,
    plain::{file_or_nothing, options},
};

/// The right to change a file, until it's dropped or the program ends.
#[derive(Debug)]
pub struct FileLock {
    _file: File,
}

impl FileLock {
    /// Waits until no other program changes the file at `path` under this lock, and keeps others from it. The file itself is
    /// replaced when it's written, so what is locked is an empty one beside it, `.NAME.lock`, which stays. On a file system
    /// without locks, nobody waits.
    ///
    /// # Errors
    ///
    /// [`FileError::NotAFile`] or [`FileError::Write`] if there can be no file beside it.
    pub fn wait_for(path: &Path) -> Result<Self, FileError> {
        let beside = beside(path);
        let writing = FileError::writing(&beside);
        file_or_nothing(&beside)?;
        let file = options(true)
            .write(true)
            .create(true)
            .truncate(false)
            .open(&beside)
            .map_err(&writing)?;
        loop {
            match file.lock() {
                Err(err) if err.kind() == io::ErrorKind::Interrupted => {}
                Err(err) if err.kind() != io::ErrorKind::Unsupported => return Err(writing(err)),
                _ => return Ok(Self { _file: file }),
            }
        }
    }
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

    #[cfg(unix)]
    #[test]
    fn a_link_in_its_place_is_refused() {
        let place = tempfile::tempdir().expect("a folder");
        let path = place.path().join("index");
        std::os::unix::fs::symlink(place.path().join("elsewhere"), beside(&path)).expect("made");
        assert!(matches!(FileLock::wait_for(&path), Err(FileError::NotAFile { .. })));
    }
}
