//! The words of a replay in the window.

use std::path::Path;

use boresight_guide::session::{Outcome, Prompt, Snapshot};

/// Decision of a step, with the reason; if `mirrored`, left and right are exchanged.
pub fn why(snapshot: &Snapshot, mirrored: bool) -> String {
    match &snapshot.decision.outcome {
        Outcome::Refused { .. } if snapshot.shown.prompt == Prompt::Taken => {
            "Just after a view: nothing is asked for yet".into()
        }
        Outcome::Refused { refusal } => {
            format!("Not taken: {}", super::window::refused(refusal, snapshot.live.as_deref()))
        }
        Outcome::Noted => "Not a frame: a command or a camera event".into(),
        outcome => super::outcome(outcome, snapshot, mirrored).unwrap_or_default(),
    }
}

/// Position of a step in the recording.
pub fn place(step: usize, steps: usize, frame: Option<u64>, secs: f64) -> String {
    match frame {
        Some(frame) => format!("Decision {} of {steps}, frame {frame}, {secs:.2} s", step + 1),
        None => format!("Decision {} of {steps}, {secs:.2} s", step + 1),
    }
}

/// Note about a decision that differs from the recorded one.
pub const DIFFERS: &str = "The recording has a different decision here";
/// Note about a frame without a stored picture.
pub const NO_PICTURE: &str = "This frame was recorded without its picture";
/// Label of the slider over all decisions.
pub const SCRUBBER: &str = "Decision";
/// Label of the fold with the measured values.
pub const NUMBERS: &str = "Numbers";
/// See [`NUMBERS`].
pub const NUMBERS_TIP: &str = "Show or hide what was measured, and the views taken so far.";
/// Tooltip of the strip.
pub const STRIP: &str =
    "All decisions: green taken, amber held, grey not taken, red different from the recording";

/// Heading without an open recording.
pub const PICK: &str = "Open a session";
/// Label of the field for a recording's folder.
pub const FOLDER: &str = "Folder";
/// See [`FOLDER`].
pub const FOLDER_TIP: &str = "Type the path of a session folder, choose one below, or drop it onto the window. Opens read-only.";
/// Hint in the empty field.
pub const FOLDER_HINT: &str = "path of a session's folder";
/// Button to open the folder.
pub const OPEN: &str = "Open";
/// Button to look for a session's folder.
pub const BROWSE: &str = "Browse…";
/// See [`BROWSE`].
pub const BROWSE_TIP: &str = "List the folders in this folder. Sessions are bright.";
/// Button to the folder around the listed one.
pub const UP: &str = "Up";

/// Tooltip of a listed folder.
pub fn folder_tip(folder: &Path, is_session: bool) -> String {
    let does = if is_session { "Open this session" } else { "Look into this folder" };
    format!("{does}: {}", folder.display())
}

/// Heading of the list of sessions.
pub const RECENT: &str = "Sessions";
/// Note in place of an empty list of recordings.
pub const NO_RECORDINGS: &str =
    "No recorded sessions yet. Each session is recorded: start one, and it appears here.";
/// Button back to the list.
pub const ANOTHER: &str = "Open another";
/// See [`ANOTHER`].
pub const ANOTHER_TIP: &str = "Close this recording and choose another.";
/// Error of a recording that couldn't be opened for an unknown reason.
pub const NOT_OPENED: &str = "The recording couldn't be opened";

/// Note while a recording is being opened.
pub fn opening(folder: &Path) -> String {
    format!("Opening {}", folder.display())
}

/// Note about a truncated last journal line.
pub const CUT: &str = "The last entry was incomplete (never shown as saved) and was dropped.";

/// Note that this build would have accepted other views than the recorded ones, under the same
/// rules or others.
pub fn restored(views: usize, by_these_rules: bool) -> String {
    let views = if views == 1 {
        "its 1 view is kept".to_owned()
    } else {
        format!("its {views} views are kept")
    };
    if by_these_rules {
        return format!(
            "This version would decide differently by the rules that the session names: {views} as recorded. `boresight doctor` looks for changes."
        );
    }
    format!(
        "Recorded by another version: {views} as recorded, though this version would decide differently."
    )
}

/// Note about a recording under earlier rules of guidance.
pub const EARLIER_RULES: &str = "Recorded under earlier rules, so many decisions differ: a view is now taken for what it tells about the lens. Tilt, size, place, blur and motion make it tell less, and have no limits any more; directions must differ significantly, and the corners are corrected for a rolling shutter.";

/// Note about a recording under rules whose goals weren't fixed.
pub const YIELDING_GOALS: &str = "Recorded under earlier rules, so decisions may differ: the goals no longer yield to the camera's noise.";

/// First rules that take views as these do.
const SAME_VIEWS: u32 = 8;

/// Note about a recording under rules of guidance unknown to this version.
pub const LATER_RULES: &str = "Recorded under rules of a newer boresight, so decisions may differ. The recorded views are kept.";

/// Note for a recording under the rules `recorded`, if this version has the rules `own` and decides
/// differently.
pub fn other_rules(recorded: u32, own: u32) -> Option<&'static str> {
    match recorded.cmp(&own) {
        std::cmp::Ordering::Less if recorded < SAME_VIEWS => Some(EARLIER_RULES),
        std::cmp::Ordering::Less => Some(YIELDING_GOALS),
        std::cmp::Ordering::Equal => None,
        std::cmp::Ordering::Greater => Some(LATER_RULES),
    }
}

/// Control: label, key, action.
pub type Step = (&'static str, &'static str, &'static str);

/// Button to the previous decision.
pub const BACK: Step = ("Back", "Left", "Previous decision.");
/// Button to the next decision.
pub const ON: Step = ("Next", "Right", "Next decision.");
/// Button to the previous view.
pub const VIEW_BACK: Step = ("Previous view", "PageUp", "Previous view taken.");
/// Button to the next view.
pub const VIEW_ON: Step = ("Next view", "PageDown", "Next view taken.");
/// Button to play or stop.
pub const PLAY: Step = ("Play", "Space", "Play at recorded speed, or pause.");
