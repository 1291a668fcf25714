//! The words of the list of sessions.

use std::path::Path;

use boresight_geometry::frame::ImageSize;

/// Note in place of a verdict.
pub const NO_RESULT: &str = "No calibration yet";

/// Camera of a session, with the picture size.
pub fn camera(name: &str, size: ImageSize) -> String {
    format!("{}, {} × {}", super::camera::printable(name), size.width_px, size.height_px)
}

/// Cameras of a session of several, with the number of common places of the board.
pub fn cameras(names: &[&str], places: usize) -> String {
    let names: Vec<String> = names.iter().map(|name| super::camera::printable(name)).collect();
    format!("{}: {}", names.join(", "), super::rig::places(places))
}

/// Number of views of a session.
pub fn views(count: Option<usize>) -> String {
    match count {
        None => "no result".into(),
        Some(1) => "1 view".into(),
        Some(count) => format!("{count} views"),
    }
}

/// Button to show the result of a session.
pub const RESULT: (&str, &str) = ("Show result", "Show the result, with its charts and exports.");
/// Button to continue a session.
pub const GO_ON: (&str, &str) = ("Continue", "Take more views with the same camera and settings.");
/// Button to show the report of a session.
pub const REPORT: (&str, &str) = ("Report", "Open the report.");
/// Button to export a session.
pub const EXPORT: (&str, &str) = ("Export", "Write the result in another program's format.");
/// Button to step through a session.
pub const REPLAY: (&str, &str) = ("Replay", "Step through every decision.");
/// Button to delete a session.
pub const DELETE: (&str, &str) =
    ("Delete", "Move the session to the bin, from which you can restore it.");

/// Note about a session in the bin.
pub fn deleted(folder: &Path) -> String {
    let name = folder.file_name().unwrap_or(folder.as_os_str()).to_string_lossy();
    format!("{name} is in the bin")
}

/// Action after a failure to delete.
pub const DELETE_BY_HAND: &str = "Delete the folder with your file manager.";
/// Error of deleting the running session.
pub const RUNS: &str = "This session is running. Finish it first";
/// Action while another session runs.
pub const FINISH_FIRST: &str = "Finish the running session first.";
/// Note while a result is being opened.
pub const OPENING: &str = "Opening the result…";
/// Note while a session is calibrated again.
pub const CORRECTING: &str = "Calibrating again…";
/// Error of a session's result that couldn't be opened for an unknown reason.
pub const NOT_OPENED: &str = "The result couldn't be opened";

/// Note about a calibration file dropped onto the window before a result exists.
pub fn compared_later(file: &Path) -> String {
    let name = file.file_name().unwrap_or(file.as_os_str()).to_string_lossy();
    format!("The next result will be compared with {name}")
}

/// Note about a folder of pictures or a video dropped onto the window.
pub fn source_chosen(source: &str) -> String {
    format!("Source: {source}")
}
