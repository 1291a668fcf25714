//! Names of what is kept somewhere.

/// Folder of new sessions.
pub const SESSIONS: &str = "new sessions";
/// The history's index.
pub const HISTORY: &str = "history's index";
/// Stores of watched cameras.
pub const WATCH: &str = "watched cameras";
/// What the window remembers.
pub const WINDOW: &str = "window's memory";
/// Where the system names no folder.
pub const NOWHERE: &str = "nowhere: this system names no folder for settings";
