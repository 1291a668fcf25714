//! Names of storage places.

/// Folder of new sessions.
pub const SESSIONS: &str = "new sessions";
/// Index of the history.
pub const HISTORY: &str = "history's index";
/// Stores of watched cameras.
pub const WATCH: &str = "watched cameras";
/// Memory of the window.
pub const WINDOW: &str = "window's memory";
/// Place where the system names no folder.
pub const NOWHERE: &str = "nowhere: this system names no folder for settings";
