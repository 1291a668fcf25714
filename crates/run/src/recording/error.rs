//! Errors of reading and writing session folders.

use std::path::PathBuf;

use boresight_files::FileError;

/// A journal line changed after writing.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Damage {
    /// Number of the line, from 1.
    pub line: usize,
    /// The damage, in words.
    pub reason: String,
}

/// Error of reading or writing a session folder.
#[derive(Debug, thiserror::Error)]
pub enum RecordingError {
    /// A file could not be read or written.
    #[error(transparent)]
    File(#[from] FileError),
    /// The folder for a new session isn't empty.
    #[error("there is something in this folder already: {path:?}")]
    NotNew {
        /// Path of the folder.
        path: PathBuf,
    },
    /// The program's version can't read `session.toml`.
    #[error("not a session this version can read ({reason}): {path:?}")]
    Header {
        /// The mistake, in words.
        reason: String,
        /// True if written by a newer version.
        newer: bool,
        /// Path of the file.
        path: PathBuf,
    },
    /// `session.toml` was changed after the session began.
    #[error("the journal was recorded with another session.toml: {path:?}")]
    OtherHeader {
        /// Path of the session's folder.
        path: PathBuf,
    },
    /// A journal line is damaged.
    #[error("line {} of the journal is damaged ({}): {path:?}", damage.line, damage.reason)]
    Damaged {
        /// The first damaged line.
        damage: Damage,
        /// Path of the file.
        path: PathBuf,
    },
    /// A journal line is whole, but has contents unknown to the program's version.
    #[error("a newer boresight wrote line {line} of the journal ({reason}): {path:?}")]
    Newer {
        /// Number of the line, from 1.
        line: usize,
        /// The unknown part, in words.
        reason: String,
        /// Path of the file.
        path: PathBuf,
    },
    /// The journal lacks lines known to have been written.
    #[error("lines are missing from the journal ({reason}): {path:?}")]
    LinesMissing {
        /// Evidence of the missing lines, in words.
        reason: String,
        /// Path of the file.
        path: PathBuf,
    },
    /// A stored picture is missing or damaged.
    #[error("a stored picture is damaged ({reason}): {path:?}")]
    Frame {
        /// The damage, in words.
        reason: String,
        /// Path of the file.
        path: PathBuf,
    },
    /// The file system refused to lock the session, so nothing would keep a second process out.
    #[error("could not lock the session against a second program: {path:?}")]
    NoLock {
        /// The system's error.
        source: std::io::Error,
        /// Path of the session's folder.
        path: PathBuf,
    },
    /// Another process has the session open.
    #[error("another boresight has this session open: {path:?}")]
    Locked {
        /// Path of the session's folder.
        path: PathBuf,
    },
}

impl RecordingError {
    /// Stable name, for files and programs.
    pub fn code(&self) -> &'static str {
        match self {
            Self::File(err) => err.code(),
            Self::NotNew { .. } => "NOT-NEW",
            Self::Header { newer: true, .. } | Self::Newer { .. } => "SESSION-NEWER",
            Self::Header { newer: false, .. } => "HEADER-DAMAGED",
            Self::OtherHeader { .. } => "OTHER-HEADER",
            Self::Damaged { .. } => "JOURNAL-DAMAGED",
            Self::LinesMissing { .. } => "LINES-MISSING",
            Self::Frame { .. } => "PICTURE-DAMAGED",
            Self::NoLock { .. } => "NO-LOCK",
            Self::Locked { .. } => "LOCKED",
        }
    }
}
