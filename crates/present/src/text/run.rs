//! Sentences of a session in the terminal.

use std::path::Path;

use super::prompt;
use boresight_guide::session::Prompt;

/// Note about a session resumed with `views` accepted views.
pub fn resuming(views: usize) -> String {
    format!("Resuming with {views} {}.", if views == 1 { "view" } else { "views" })
}

/// Note about a session ended by a failed worker.
pub fn views_are_safe(session: &Path) -> String {
    format!("Your views are safe. To resume: boresight guide --session {}", session.display())
}

/// Note that the simulated person has shown nothing new for `secs` seconds, in reply to
/// `asked_for`.
pub fn simulated_gave_up(secs: u64, asked_for: Prompt) -> String {
    format!(
        "Ended: no view was taken for {secs} s of the scene's time, while \"{}\" was asked for. The scene's person can't show more, or the views there are say enough.",
        prompt(asked_for)
    )
}
