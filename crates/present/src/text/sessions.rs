//! The words of the list of sessions.

use std::path::Path;

use boresight_calibrate::Verdict;
use boresight_geometry::frame::ImageSize;

/// The verdict of a session, short.
pub fn verdict(verdict: Verdict, unfinished: bool) -> &'static str {
    match verdict {
        Verdict::Good => "GOOD",
        Verdict::Care => "USE WITH CARE",
        Verdict::Untrustworthy if unfinished => "UNFINISHED",
        Verdict::Untrustworthy => "NOT TRUSTWORTHY",
    }
}

/// In place of a verdict.
pub const NO_RESULT: &str = "No calibration yet";

/// The camera of a session, and the size of its pictures.
pub fn camera(name: &str, size: ImageSize) -> String {
    format!("{}, {} × {}", super::camera::printable(name), size.width_px, size.height_px)
}

/// Number of views of a session.
pub fn views(count: Option<usize>) -> String {
    match count {
        None => "no result".into(),
        Some(1) => "1 view".into(),
        Some(count) => format!("{count} views"),
    }
}

/// Shows the result of a session.
pub const RESULT: (&str, &str) = ("Show result", "Show the result, with its charts and exports.");
/// Continues a session.
pub const GO_ON: (&str, &str) = ("Continue", "Take more views with the same camera and settings.");
/// Shows the report of a session.
pub const REPORT: (&str, &str) = ("Report", "Open the report.");
/// Exports a session.
pub const EXPORT: (&str, &str) = ("Export", "Write the result in another program's format.");
/// Steps through a session.
pub const REPLAY: (&str, &str) = ("Replay", "Step through every decision.");
/// Deletes a session.
pub const DELETE: (&str, &str) =
    ("Delete", "Move the session to the bin, from which you can restore it.");

/// A session is in the bin.
pub fn deleted(folder: &Path) -> String {
    let name = folder.file_name().unwrap_or(folder.as_os_str()).to_string_lossy();
    format!("{name} is in the bin")
}

/// The action after a failure to delete.
pub const DELETE_BY_HAND: &str = "Delete the folder with your file manager.";
/// The session that runs can't be deleted.
pub const RUNS: &str = "This session is running. Finish it first";
/// Another session runs.
pub const FINISH_FIRST: &str = "Finish the running session first.";
/// While a result is being opened.
pub const OPENING: &str = "Opening the result…";
/// The result of a session couldn't be opened for an unknown reason.
pub const NOT_OPENED: &str = "The result couldn't be opened";

/// A calibration file was dropped onto the window before there is a result.
pub fn compared_later(file: &Path) -> String {
    let name = file.file_name().unwrap_or(file.as_os_str()).to_string_lossy();
    format!("The next result will be compared with {name}")
}

/// A folder of pictures or a video was dropped onto the window.
pub fn source_chosen(source: &str) -> String {
    format!("Source: {source}")
}
