//! The words of a replay in the window.

use std::path::Path;

use boresight_guide::session::{Outcome, Prompt, Snapshot};

/// Decision of a step, and the reason.
pub fn why(snapshot: &Snapshot) -> String {
    match &snapshot.decision.outcome {
        Outcome::Refused { .. } if snapshot.shown.prompt == Prompt::Taken => {
            "Just after a view: nothing is asked for yet".into()
        }
        Outcome::Refused { refusal } => {
            format!("Not taken: {}", super::window::refused(refusal, snapshot.live.as_deref()))
        }
        Outcome::Noted => "Not a frame: a command or a camera event".into(),
        outcome => super::outcome(outcome, snapshot, false).unwrap_or_default(),
    }
}

/// Place of a step in the recording.
pub fn place(step: usize, steps: usize, frame: Option<u64>, secs: f64) -> String {
    match frame {
        Some(frame) => format!("Decision {} of {steps}, frame {frame}, {secs:.2} s", step + 1),
        None => format!("Decision {} of {steps}, {secs:.2} s", step + 1),
    }
}

/// The decision is not the recorded one.
pub const DIFFERS: &str = "The recording has a different decision here";
/// No picture of this frame was stored.
pub const NO_PICTURE: &str = "This frame was recorded without its picture";
/// Label of the slider over all decisions.
pub const SCRUBBER: &str = "Decision";
/// Label of the fold with the measured values.
pub const NUMBERS: &str = "Numbers";
/// See [`NUMBERS`].
pub const NUMBERS_TIP: &str = "Show or hide what was measured, and the views taken so far.";
/// Explanation of the strip.
pub const STRIP: &str =
    "All decisions: green taken, amber held, grey not taken, red different from the recording";

/// Heading where no recording is open.
pub const PICK: &str = "Open a session";
/// Before the field for its folder.
pub const FOLDER: &str = "Folder";
/// See [`FOLDER`].
pub const FOLDER_TIP: &str = "Type the path of a session folder, choose one below, or drop it onto the window. Opens read-only.";
/// The button that opens it.
pub const OPEN: &str = "Open";
/// Heading of the list.
pub const RECENT: &str = "Sessions";
/// Note in place of an empty list of recordings.
pub const NO_RECORDINGS: &str =
    "No recorded sessions yet. Each session is recorded: start one, and it appears here.";
/// Back to the list.
pub const ANOTHER: &str = "Open another";
/// See [`ANOTHER`].
pub const ANOTHER_TIP: &str = "Close this recording and choose another.";
/// Error of a recording that could not be opened for an unknown reason.
pub const NOT_OPENED: &str = "The recording couldn't be opened";

/// While it is being opened.
pub fn opening(folder: &Path) -> String {
    format!("Opening {}", folder.display())
}

/// The last journal line was cut.
pub const CUT: &str = "The last entry was incomplete (never shown as saved) and was dropped.";

/// This build would have accepted other views than the recorded ones, which it decided by the same rules or by others.
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

/// The rules of guidance have changed since the recording was made.
pub const EARLIER_RULES: &str = "Recorded under earlier rules, so many decisions differ: a view is now taken for what it tells about the lens. Tilt, size, place, blur and motion make it tell less, and have no limits any more; directions must differ significantly, and the corners are corrected for a rolling shutter.";

/// The recording names rules of guidance that this version doesn't know.
pub const LATER_RULES: &str = "Recorded under rules of a newer boresight, so decisions may differ. The recorded views are kept.";

/// What to say of a recording under the rules `recorded` of guidance, if this version has the rules `own` and decides
/// differently.
pub fn other_rules(recorded: u32, own: u32) -> Option<&'static str> {
    match recorded.cmp(&own) {
        std::cmp::Ordering::Less => Some(EARLIER_RULES),
        std::cmp::Ordering::Equal => None,
        std::cmp::Ordering::Greater => Some(LATER_RULES),
    }
}

/// A control: label, key, what it does.
pub type Step = (&'static str, &'static str, &'static str);

/// Button to the decision before.
pub const BACK: Step = ("Back", "Left", "Previous decision.");
/// Button to the next decision.
pub const ON: Step = ("Next", "Right", "Next decision.");
/// Button to the view taken before.
pub const VIEW_BACK: Step = ("Previous view", "PageUp", "Previous view taken.");
/// Button to the next view taken.
pub const VIEW_ON: Step = ("Next view", "PageDown", "Next view taken.");
/// Play or stop.
pub const PLAY: Step = ("Play", "Space", "Play at recorded speed, or pause.");
