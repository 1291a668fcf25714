//! The only place that opens and writes files: those of a session, and those named by a person.
//!
//! | | a session's files | files named by a person |
//! |---|---|---|
//! | links | refused | followed to read, refused to replace |
//! | devices, FIFOs, sockets, folders | refused | refused |
//! | size | bounded | bounded |
//! | mode | by the umask; a replaced file keeps its mode | the same |
//! | written | beside the target, synced, renamed, folder synced | the same |
//!
//! A session folder may come from another person: nothing in it may lead out of it, block, or fill
//! the memory.
//!
//! ```
//! use boresight_files::{Links, Overwrite, read_text, save};
//!
//! let place = tempfile::tempdir()?;
//! let path = place.path().join("result.json");
//! save(&path, b"{}", Overwrite::Never)?;
//! assert_eq!(read_text(&path, 1 << 20, Links::Refused)?, "{}");
//! assert!(save(&path, b"[]", Overwrite::Never).is_err());
//! assert!(read_text(&path, 1, Links::Refused).is_err());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! The feature `disk-log` logs every change of the disk, for tests of power cuts.
//!
//! Limitation: off Unix, a link or device that replaces a file between the check and the opening is
//! followed; on Unix, flags of the opening refuse it.

#![forbid(unsafe_code)]

mod append;
mod disk_log;
mod error;
mod folder;
mod lock;
mod patient;
mod plain;
mod plain_words;
mod private;
mod read;
mod save;
mod scratch;
mod unnamed;

pub use append::Appending;
#[cfg(feature = "disk-log")]
pub use disk_log::{DiskLog, LoggedChange};
pub use error::FileError;
pub use folder::{
    Draft, UNFINISHED, entries, is_own_folder, is_same_file, make_folder, sync_folder,
};
pub use lock::FileLock;
pub use patient::Patient;
pub use plain::is_still_at;
pub use plain_words::plain_words;
pub use private::read_or_make_private;
pub use read::{LineReader, Links, TEXT_LIMIT, open, read, read_text};
pub use save::{FileStream, Overwrite, copy, may_save, remove, save, save_streamed};
pub use scratch::Scratch;
pub use unnamed::Unnamed;
