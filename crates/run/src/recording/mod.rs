//! Sessions as bytes: a folder that stays readable after every kind of stop.
//!
//! ```text
//! SESSION/
//!   session.toml      schema, source, picture size, effective configuration, camera; written once
//!   journal.jsonl     one checksummed input with its decision per line; only ever appended to
//!   frames/           pictures, lossless, named by frame number
//!   calibration.json  the result
//! ```
//!
//! Invariant: a view is shown as accepted only after its picture and then its journal line are
//! synced to disk. So a crash at any instant loses at most unacknowledged data. A cut last line is
//! dropped when the session is opened again, and so are the remains, after a power cut, of lines
//! not synced yet; a damaged line anywhere else is named and refused. The first line holds a
//! checksum of `session.toml`.
//!
//! ```
//! use boresight_geometry::frame::ImageSize;
//! use boresight_guide::session::{Input, Session};
//! use boresight_run::{config::Config, recording::{Header, SessionFolder}};
//!
//! let place = tempfile::tempdir()?;
//! let path = place.path().join("session");
//! let (config, image_size) = (Config::load(None, &[])?, ImageSize { width_px: 1280, height_px: 720 });
//! let mut session = Session::new(config.session(image_size)?);
//! let mut folder = SessionFolder::create(&path, &Header::new("an example", image_size, config))?;
//! // Each input is decided, then written with its decision; `true` syncs it to disk.
//! let decision = session.handle(&Input::Stop);
//! folder.journal_mut().append(&Input::Stop, &decision, None, true)?;
//! assert_eq!(SessionFolder::journal(&path)?.lines.len(), 1);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod camera_line;
mod camera_table;
mod envelope;
mod error;
mod folder;
mod format;
mod journal;
mod journal_text;
mod lines;
mod recovery;
mod replay;
mod rig_folder;

pub use camera_line::{CameraLine, ControlLine, FaultLine, LayoutLine, LockLine, ModeLine};
pub use camera_table::CameraTable;
pub use error::{Damage, RecordingError};
pub use folder::{Header, SessionFolder, stored_frame, stored_png, views_taken};
#[cfg(feature = "schemas")]
pub use format::journal_line_schema;
pub use format::{Line, Stored};
pub use journal::{Journal, JournalContents};
pub use journal_text::JournalText;
pub use lines::{Lines, LinesWalk};
pub use recovery::{Recovered, copy_for_others, hide_in_json, recover};
pub use replay::{Difference, MOST_KEPT, RecordedOutcome, Replayed, Rounding, replay};
pub use rig_folder::{RigSessionCamera, RigSessionFile, is_name};
