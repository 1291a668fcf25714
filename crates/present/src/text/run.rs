//! Sentences of a session's run in the terminal.

use std::path::Path;

/// A session is resumed with `views` accepted views.
pub fn resuming(views: usize) -> String {
    format!("Resuming with {views} {}.", if views == 1 { "view" } else { "views" })
}

/// The session ended because a worker failed.
pub fn views_are_safe(session: &Path) -> String {
    format!("Your views are safe. To resume: boresight guide --session {}", session.display())
}
