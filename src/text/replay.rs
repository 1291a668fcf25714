//! The words of a replay in the window.

use crate::session::{Outcome, Snapshot};

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
