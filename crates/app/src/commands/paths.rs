//! Locations of stored files.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::{session::opening::SESSIONS, window::memory};

/// Name and version of [`PathsFile`].
pub const PATHS_SCHEMA: &str = "boresight.paths/1";
/// Index file of `history`, in the working directory.
pub const HISTORY: &str = "history.jsonl";
/// Folder of the stores of `watch`, in the working directory.
pub const WATCH: &str = "watch";

/// `boresight.paths/1`: where things are kept, as `paths --json` prints it. Nothing needs to be there yet.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
pub struct PathsFile {
    /// [`PATHS_SCHEMA`].
    #[cfg_attr(feature = "schemas", schemars(extend("const" = "boresight.paths/1")))]
    pub schema: String,
    /// New sessions, unless `--out` or the window's settings name another folder.
    pub sessions: PathBuf,
    /// The index of `history`, unless `--index` names another file.
    pub history: PathBuf,
    /// Stores of `watch`, unless `--store` names another folder.
    pub watch: PathBuf,
    /// What the window remembers from one start to the next; null if the system names no folder for it.
    pub window: Option<PathBuf>,
}

/// Locations for a command started in `folder`.
pub fn paths(folder: &Path) -> PathsFile {
    PathsFile {
        schema: PATHS_SCHEMA.into(),
        sessions: folder.join(SESSIONS),
        history: folder.join(HISTORY),
        watch: folder.join(WATCH),
        window: memory::usual_path(),
    }
}
