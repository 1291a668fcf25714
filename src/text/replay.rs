//! The words of a replay in the window.

use std::path::Path;

use crate::{
    frame::ImageSize,
    session::{Outcome, Snapshot},
};

/// What was decided at a step, and why.
pub fn why(snapshot: &Snapshot) -> String {
    match &snapshot.decision.outcome {
        Outcome::Refused { refusal } => {
            format!("Not taken: {}", super::window::refused(refusal, snapshot.live.as_deref()))
        }
        Outcome::Noted => "Nothing changed for the views: a command, or the camera's words".into(),
        outcome => super::outcome(outcome, snapshot).unwrap_or_default(),
    }
}

/// Where in the recording a step is.
pub fn place(step: usize, steps: usize, frame: Option<u64>, secs: f64) -> String {
    match frame {
        Some(frame) => format!("Decision {} of {steps}, frame {frame}, {secs:.2} s", step + 1),
        None => format!("Decision {} of {steps}, {secs:.2} s", step + 1),
    }
}

/// The decision is not the recorded one.
pub const DIFFERS: &str = "The recording decided differently here";
/// No picture of this frame was stored.
pub const NO_PICTURE: &str = "The picture of this frame was not stored; its corners were";
/// The slider.
pub const SCRUBBER: &str = "Decision";
/// What the strip shows.
pub const STRIP: &str = "All decisions: green taken, amber good and being held, grey not taken, red different from the recording";

/// Heading where no recording is open.
pub const PICK: &str = "Open a recording";
/// Before the field for its folder.
pub const FOLDER: &str = "Folder:";
/// See [`FOLDER`].
pub const FOLDER_TIP: &str = "A session's folder: type its path, choose a session below, or drop the folder onto the window. Nothing in it is changed.";
/// The button that opens it.
pub const OPEN: &str = "Open";
/// Heading of the list.
pub const RECENT: &str = "Sessions";
/// If there are none.
pub const NO_RECORDINGS: &str = "There are no recorded sessions yet.";
/// Back to the list.
pub const ANOTHER: &str = "Another recording";
/// See [`ANOTHER`].
pub const ANOTHER_TIP: &str = "Close this recording and choose another one.";
/// It could not be opened and nobody knows why.
pub const NOT_OPENED: &str = "The recording could not be opened";

/// While it is being opened.
pub fn opening(folder: &Path) -> String {
    format!("Opening {}", folder.display())
}

/// What the button for a session does.
pub fn open_tip(folder: &Path) -> String {
    format!("Step through the decisions of {}.", folder.display())
}

/// A recording in the list: when it began, of which source.
pub fn recording(created: &str, source: &str, size: ImageSize) -> String {
    let source = super::camera::printable(source);
    format!("{created}, {source}, {}x{}", size.width_px, size.height_px)
}

/// The last journal line was cut.
pub const CUT: &str =
    "The last line was cut before anything in it was shown as done. It is left out.";

/// This build would have accepted other views than the recorded ones.
pub fn restored(views: usize) -> String {
    let views = if views == 1 {
        "its 1 view stands".to_owned()
    } else {
        format!("its {views} views stand")
    };
    format!(
        "Another version decided this session: {views} as recorded, though this version would decide differently."
    )
}

/// The rules of guidance have changed since the recording was made.
pub const EARLIER_RULES: &str = "Recorded under earlier rules, so this version decides many pictures differently: stillness is now judged by the smear during the exposure instead of speed (still_widths_per_sec), a hold fades instead of starting over (hold_secs), a small board counts for little instead of being refused (min_fill), and any open direction is taken, not only the one asked for.";

/// A control: label, key, what it does.
pub type Step = (&'static str, &'static str, &'static str);

/// To the decision before.
pub const BACK: Step = ("Back", "Left", "One decision back.");
/// To the next decision.
pub const ON: Step = ("On", "Right", "One decision on.");
/// To the view taken before.
pub const VIEW_BACK: Step = ("View before", "PageUp", "Back to the view taken before.");
/// To the next view taken.
pub const VIEW_ON: Step = ("Next view", "PageDown", "On to the next view taken.");
/// Play or stop.
pub const PLAY: Step = ("Play", "Space", "Play at the speed of the recording, or stop.");
