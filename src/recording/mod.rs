//! Sessions as bytes: a folder that is always readable, whatever happened to the program.
//!
//! ```text
//! SESSION/
//!   session.toml      schema, source, picture size, effective configuration, camera; written once
//!   journal.jsonl     one checksummed input with its decision per line; only ever appended to
//!   frames/           pictures, lossless, named by frame number
//!   calibration.json  the result
//! ```
//!
//! Invariant: a view is shown as accepted only after its picture and then its journal line are synced
//! to disk. So a crash at any instant loses at most what nobody was told of. A last line that was cut is
//! dropped when the session is opened again; a damaged line anywhere else is named and refused.

mod camera_line;
mod camera_table;
mod folder;
mod format;
mod journal;
mod replay;
pub mod save;

pub use camera_line::{CameraLine, ControlLine, FaultLine, LayoutLine, LockLine, ModeLine};
pub use camera_table::CameraTable;
pub use folder::{Header, SessionFolder, stored_frame};
#[cfg(feature = "schemas")]
pub use format::journal_line_schema;
pub use format::{Line, Stored};
pub use journal::{Damage, Journal, JournalContents};
pub use replay::{Difference, RecordedOutcome, Rounding, replay, take_rounding};

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
    /// The file is there already and must not be overwritten.
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
    /// Another process has the session open.
    #[error("another boresight has this session open: {path:?}")]
    Locked {
        /// The session.
        path: std::path::PathBuf,
    },
}
