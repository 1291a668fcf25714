//! Why a session folder couldn't be read or written.

/// A journal line that differs from what was written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Damage {
    /// Its number, from 1.
    pub line: usize,
    /// What is wrong with it.
    pub reason: String,
}

/// Why a session folder could not be read or written.
#[derive(Debug, thiserror::Error)]
pub enum RecordingError {
    /// The system refused to read a file.
    #[error("could not read {path:?}")]
    Read {
        /// What the system said.
        source: std::io::Error,
        /// The file.
        path: std::path::PathBuf,
    },
    /// The system refused to write a file.
    #[error("could not write {path:?}")]
    Write {
        /// What the system said.
        source: std::io::Error,
        /// The file.
        path: std::path::PathBuf,
    },
    /// The file exists and must not be overwritten.
    #[error("there is already a file {path:?}")]
    Exists {
        /// The file.
        path: std::path::PathBuf,
    },
    /// There is something in the folder that is to become a session.
    #[error("there is something in this folder already: {path:?}")]
    NotNew {
        /// The folder.
        path: std::path::PathBuf,
    },
    /// `session.toml` is not one that this version reads.
    #[error("not a session this version can read ({reason}): {path:?}")]
    Header {
        /// What is wrong with it.
        reason: String,
        /// The file.
        path: std::path::PathBuf,
    },
    /// A journal line is damaged.
    #[error("line {} of the journal is damaged ({}): {path:?}", damage.line, damage.reason)]
    Damaged {
        /// Which line, and how.
        damage: Damage,
        /// The file.
        path: std::path::PathBuf,
    },
    /// A stored picture is missing or damaged.
    #[error("a stored picture is damaged ({reason}): {path:?}")]
    Frame {
        /// What is wrong with it.
        reason: String,
        /// The file.
        path: std::path::PathBuf,
    },
    /// The file system refused to lock the session, so nothing would keep a second process out.
    #[error("could not lock the session against a second program: {path:?}")]
    NoLock {
        /// Cause.
        source: std::io::Error,
        /// The session.
        path: std::path::PathBuf,
    },
    /// Another process has the session open.
    #[error("another boresight has this session open: {path:?}")]
    Locked {
        /// The session.
        path: std::path::PathBuf,
    },
}
