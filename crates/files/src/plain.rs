//! Kinds of directory entries, and the refusal of all but files.

use std::{
    fs::{File, FileType, OpenOptions},
    io,
    path::Path,
};

use super::FileError;

/// Kind of a directory entry other than a file, with an article; `None` for a file.
pub(super) fn other_than_file(kind: FileType) -> Option<&'static str> {
    if kind.is_file() {
        return None;
    }
    #[cfg(unix)]
    {
        use std::os::unix::fs::FileTypeExt;
        if kind.is_fifo() {
            return Some("a FIFO");
        }
        if kind.is_socket() {
            return Some("a socket");
        }
        if kind.is_char_device() || kind.is_block_device() {
            return Some("a device");
        }
    }
    Some(if kind.is_symlink() {
        "a link"
    } else if kind.is_dir() {
        "a folder"
    } else {
        "something else"
    })
}

/// Refuses anything but a file at `path`; links aren't followed. `Ok(false)` if nothing is there.
pub(super) fn file_or_nothing(path: &Path) -> Result<bool, FileError> {
    match path.symlink_metadata() {
        Ok(found) => match other_than_file(found.file_type()) {
            None => Ok(true),
            Some(what) => Err(FileError::NotAFile { what, path: path.to_path_buf() }),
        },
        Err(err) if err.kind() == io::ErrorKind::NotFound => Ok(false),
        Err(source) => Err(FileError::Read { source, path: path.to_path_buf() }),
    }
}

/// True if the open `file` is still at `path`: its folder hasn't been renamed and replaced.
#[cfg(unix)]
pub fn is_still_at(file: &File, path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let place = |file: std::fs::Metadata| (file.dev(), file.ino());
    match (file.metadata(), path.symlink_metadata()) {
        (Ok(own), Ok(there)) => place(own) == place(there),
        _ => false,
    }
}

/// Always true: off Unix, an open file keeps the folder from being renamed.
#[cfg(not(unix))]
pub fn is_still_at(_: &File, _: &Path) -> bool {
    true
}

/// Options to open without waiting for another program; links are refused if `refuse_links`.
pub(super) fn options(refuse_links: bool) -> OpenOptions {
    #[cfg_attr(not(unix), expect(unused_mut, reason = "the flags are those of Unix"))]
    let mut options = OpenOptions::new();
    #[cfg(unix)]
    {
        use std::os::unix::fs::OpenOptionsExt;

        use rustix::fs::OFlags;
        let mut flags = OFlags::NONBLOCK;
        if refuse_links {
            flags |= OFlags::NOFOLLOW;
        }
        options.custom_flags(flags.bits().cast_signed());
    }
    #[cfg(not(unix))]
    let _ = refuse_links;
    options
}
