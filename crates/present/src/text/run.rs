//! Sentences of a session's run in the terminal.

use std::path::Path;

use super::prompt;
use boresight_guide::session::Prompt;

/// A session is resumed with `views` accepted views.
pub fn resuming(views: usize) -> String {
    format!("Resuming with {views} {}.", if views == 1 { "view" } else { "views" })
}

/// The session ended because a worker failed.
pub fn views_are_safe(session: &Path) -> String {
    format!("Your views are safe. To resume: boresight guide --session {}", session.display())
}

/// The simulated person has shown nothing new for so many seconds, while `asked_for` was on the screen.
pub fn simulated_gave_up(secs: u64, asked_for: Prompt) -> String {
    format!(
        "Ended: no view was taken for {secs} s of the scene's time, while \"{}\" was asked for. The scene's person can't show more, or the views there are say enough.",
        prompt(asked_for)
    )
}
