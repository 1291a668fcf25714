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
mod error;
mod folder;
mod format;
mod journal;
mod replay;
pub mod save;

pub use camera_line::{CameraLine, ControlLine, FaultLine, LayoutLine, LockLine, ModeLine};
pub use camera_table::CameraTable;
pub use error::{Damage, RecordingError};
pub use folder::{Header, SessionFolder, stored_frame};
#[cfg(feature = "schemas")]
pub use format::journal_line_schema;
pub use format::{Line, Stored};
pub use journal::{Journal, JournalContents};
pub use replay::{Difference, RecordedOutcome, Rounding, replay, take_rounding};
