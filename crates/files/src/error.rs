//! Errors of reading and writing files.

use std::{io, path::Path, path::PathBuf};

/// Error of reading or writing a file.
#[derive(Debug, thiserror::Error)]
pub enum FileError {
    /// The system refused to read the file.
    #[error("could not read {path:?}")]
    Read {
        /// The system's error.
        source: io::Error,
        /// Path of the file.
        path: PathBuf,
    },
    /// The system refused to write the file.
    #[error("could not write {path:?}")]
    Write {
        /// The system's error.
        source: io::Error,
        /// Path of the file.
        path: PathBuf,
    },
    /// The file exists and must not be replaced.
    #[error("there is already a file {path:?}")]
    Exists {
        /// Path of the file.
        path: PathBuf,
    },
    /// The entry is no file.
    #[error("this is {what}, not a file: {path:?}")]
    NotAFile {
        /// Kind of directory entry, with an article.
        what: &'static str,
        /// The path.
        path: PathBuf,
    },
    /// The file is too large.
    #[error("larger than {limit_bytes} bytes: {path:?}")]
    TooLarge {
        /// Size limit in bytes.
        limit_bytes: u64,
        /// Path of the file.
        path: PathBuf,
    },
    /// The file holds a secret, and others may read the file.
    #[error("others can read this secret: {path:?}")]
    NotPrivate {
        /// Path of the file.
        path: PathBuf,
    },
    /// The file isn't text.
    #[error("not a text in UTF-8: {path:?}")]
    NotText {
        /// Path of the file.
        path: PathBuf,
    },
}

impl FileError {
    /// Turns a system error while reading `path` into an error.
    pub fn reading(path: &Path) -> impl Fn(io::Error) -> Self {
        move |source| Self::Read { source, path: path.to_path_buf() }
    }

    /// Turns a system error while writing `path` into an error.
    pub fn writing(path: &Path) -> impl Fn(io::Error) -> Self {
        move |source| Self::Write { source, path: path.to_path_buf() }
    }

    /// Stable name, for files and programs.
    pub fn code(&self) -> &'static str {
        match self {
            Self::Read { .. } if self.is_missing() => "FILE-MISSING",
            Self::Read { .. } => "FILE-UNREADABLE",
            Self::Write { .. } => "NOT-WRITTEN",
            Self::Exists { .. } => "FILE-EXISTS",
            Self::NotAFile { .. } => "NOT-A-FILE",
            Self::TooLarge { .. } => "FILE-TOO-LARGE",
            Self::NotPrivate { .. } => "NOT-PRIVATE",
            Self::NotText { .. } => "NOT-TEXT",
        }
    }

    /// True if the file isn't there.
    pub fn is_missing(&self) -> bool {
        matches!(self, Self::Read { source, .. } if source.kind() == io::ErrorKind::NotFound)
    }
}
