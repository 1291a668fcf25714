//! Why a file couldn't be read or written.

use std::{io, path::Path, path::PathBuf};

/// Why a file couldn't be read or written.
#[derive(Debug, thiserror::Error)]
pub enum FileError {
    /// The system refused to read it.
    #[error("could not read {path:?}")]
    Read {
        /// The system's error.
        source: io::Error,
        /// Path of the file.
        path: PathBuf,
    },
    /// The system refused to write it.
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
    /// Something else than a file stands there.
    #[error("this is {what}, not a file: {path:?}")]
    NotAFile {
        /// Kind of directory entry, with its article.
        what: &'static str,
        /// The path.
        path: PathBuf,
    },
    /// The file is larger than any of its kind.
    #[error("larger than {limit_bytes} bytes: {path:?}")]
    TooLarge {
        /// The largest that is read.
        limit_bytes: u64,
        /// Path of the file.
        path: PathBuf,
    },
    /// The file holds a secret, and others may read it.
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
    /// Turns what the system said while reading `path` into an error.
    pub fn reading(path: &Path) -> impl Fn(io::Error) -> Self {
        move |source| Self::Read { source, path: path.to_path_buf() }
    }

    /// Turns what the system said while writing `path` into an error.
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
