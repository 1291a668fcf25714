//! Writes whole files atomically: either the old or the new contents, never half of them.

use std::{
    io,
    io::{Read, Write},
    path::Path,
};

use super::{
    FileError,
    disk_log::{Change, note},
    folder::{UNFINISHED, sync_folder},
    patient::{Patient, sync_all},
    plain::file_or_nothing,
    read::{Links, open},
};

/// Treatment of an existing file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Overwrite {
    /// Refuse with [`FileError::Exists`].
    Never,
    /// Replace the file, with an unchanged mode. A link is refused, not followed.
    Allowed,
}

/// Checks, before any work is done, if [`save`] could write a file at `path`, as far as possible.
///
/// # Errors
///
/// As [`save`].
pub fn may_save(path: &Path, overwrite: Overwrite) -> Result<(), FileError> {
    if file_or_nothing(path)? && overwrite == Overwrite::Never {
        return Err(FileError::Exists { path: path.to_path_buf() });
    }
    let folder = folder_of(path);
    let kind = folder.metadata().map_err(FileError::writing(path))?;
    if kind.is_dir() {
        Ok(())
    } else {
        Err(FileError::writing(path)(io::ErrorKind::NotADirectory.into()))
    }
}

fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    }
}

/// Writes `bytes` beside `path`, syncs, renames, and syncs the folder.
///
/// # Errors
///
/// [`FileError::Exists`], [`FileError::NotAFile`] or [`FileError::Write`]; the contents of `path`
/// are then untouched.
pub fn save(path: &Path, bytes: &[u8], overwrite: Overwrite) -> Result<(), FileError> {
    // The umask removes the permissions a person doesn't share.
    save_with_mode(path, bytes, overwrite, 0o666)
}

/// Saves like [`save`]; a new file has `mode`, less the umask.
pub(super) fn save_with_mode(
    path: &Path,
    bytes: &[u8],
    overwrite: Overwrite,
    mode: u32,
) -> Result<(), FileError> {
    save_pieces(path, overwrite, mode, |piece| piece(bytes))
}

/// Removes a file, if present. A link or anything else isn't touched.
///
/// # Errors
///
/// [`FileError::NotAFile`] or [`FileError::Write`].
pub fn remove(path: &Path) -> Result<(), FileError> {
    if file_or_nothing(path)? {
        std::fs::remove_file(path).map_err(FileError::writing(path))?;
        note(&Change::Remove(path));
    }
    Ok(())
}

/// Copies the file at `from`, of any length, to `path`, written like [`save`].
///
/// # Errors
///
/// As [`open`] and [`save`].
pub fn copy(from: &Path, path: &Path, overwrite: Overwrite) -> Result<(), FileError> {
    let mut source = Patient::new(open(from, Links::Followed)?);
    let mut unread = None;
    let saved = save_pieces(path, overwrite, 0o666, |piece| {
        let mut buffer = vec![0; 1 << 16];
        loop {
            match source.read(&mut buffer) {
                Ok(0) => return Ok(()),
                Ok(got) => piece(&buffer[..got])?,
                Err(err) if err.kind() == io::ErrorKind::Interrupted => {}
                Err(err) => {
                    let kind = err.kind();
                    unread = Some(FileError::reading(from)(err));
                    return Err(kind.into());
                }
            }
        }
    });
    unread.map_or(saved, Err)
}

/// Writes the output of `fill`, of any length, like [`save`]. If `fill` fails, the old contents of
/// `path` stay.
///
/// # Errors
///
/// The error of `fill`, or as [`save`].
pub fn save_streamed<T, E: From<FileError>>(
    path: &Path,
    overwrite: Overwrite,
    fill: impl FnOnce(&mut FileStream<'_>) -> Result<T, E>,
) -> Result<T, E> {
    let mut filled = None;
    let saved = save_pieces(path, overwrite, 0o666, |piece| {
        let outcome = fill(&mut FileStream { piece });
        let is_whole = outcome.is_ok();
        filled = Some(outcome);
        if is_whole { Ok(()) } else { Err(io::ErrorKind::Other.into()) }
    });
    match filled {
        Some(Err(err)) => Err(err),
        Some(Ok(filled)) => Ok(saved.map(|()| filled)?),
        None => Err(saved
            .err()
            .map_or_else(|| FileError::writing(path)(io::ErrorKind::Other.into()).into(), E::from)),
    }
}

/// Writes the next bytes of a file in pieces.
type Piece<'a> = dyn FnMut(&[u8]) -> io::Result<()> + Send + 'a;

/// A file during writing: see [`save_streamed`].
pub struct FileStream<'a> {
    piece: &'a mut Piece<'a>,
}

impl io::Write for FileStream<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        (self.piece)(bytes)?;
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// Writes the pieces from `fill`, in order.
fn save_pieces(
    path: &Path,
    overwrite: Overwrite,
    mode: u32,
    fill: impl FnOnce(&mut Piece<'_>) -> io::Result<()>,
) -> Result<(), FileError> {
    let writing = FileError::writing(path);
    let folder = folder_of(path);
    let replaces = match overwrite {
        Overwrite::Allowed => file_or_nothing(path)?,
        Overwrite::Never => false,
    };
    let mut builder = tempfile::Builder::new();
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(mode));
    #[cfg(not(unix))]
    let _ = mode;
    let beside = builder.prefix(UNFINISHED).tempfile_in(folder).map_err(&writing)?;
    let draft = beside.path().to_path_buf();
    note(&Change::Create(&draft));
    if replaces {
        let mode = path.metadata().map_err(&writing)?.permissions();
        beside.as_file().set_permissions(mode).map_err(&writing)?;
    }
    let written = fill(&mut |bytes| {
        let written = Patient::new(beside.as_file()).write_all(bytes);
        note(&Change::Append { path: &draft, bytes });
        written
    });
    let synced = written.and_then(|()| sync_all(beside.as_file()));
    note(&Change::SyncFile(&draft));
    if let Err(source) = synced {
        drop(beside);
        note(&Change::Remove(&draft));
        return Err(writing(source));
    }
    let renamed = match overwrite {
        Overwrite::Allowed => beside.persist(path),
        Overwrite::Never => beside.persist_noclobber(path),
    };
    if let Err(err) = renamed {
        // The draft is removed with the error.
        note(&Change::Remove(&draft));
        return Err(match err.error {
            taken
                if overwrite == Overwrite::Never
                    && taken.kind() == io::ErrorKind::AlreadyExists =>
            {
                FileError::Exists { path: path.to_path_buf() }
            }
            source => writing(source),
        });
    }
    note(&Change::Rename { from: &draft, to: path });
    sync_folder(folder)
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::*;

    #[test]
    fn a_stream_is_stored_whole_or_not_at_all() {
        let place = tempfile::tempdir().expect("folder");
        let path = place.path().join("table");
        let stored = save_streamed(&path, Overwrite::Never, |out| {
            out.write_all(b"one").and_then(|()| out.write_all(b", two")).expect("written");
            Ok::<_, FileError>(2)
        });
        assert_eq!(stored.expect("stored"), 2);
        let failed = save_streamed(&path, Overwrite::Allowed, |out| {
            out.write_all(b"three").expect("written");
            Err::<(), _>(FileError::NotText { path: path.clone() })
        });
        assert!(matches!(failed, Err(FileError::NotText { .. })));
        let again = save_streamed(&path, Overwrite::Never, |_| Ok::<_, FileError>(()));
        assert!(matches!(again, Err(FileError::Exists { .. })));
        let held = crate::read_text(&path, 100, Links::Refused).expect("readable");
        assert_eq!(held, "one, two");
        assert_eq!(place.path().read_dir().expect("listable").count(), 1);
    }
}
