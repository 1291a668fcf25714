//! All actions in the window: one list for buttons, keyboard and help.

/// Control: label, explanation, and key.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Control {
    /// Label of the button.
    pub label: &'static str,
    /// Explanation for a tooltip.
    pub tip: &'static str,
    /// Name of the key.
    pub key: &'static str,
}

macro_rules! controls {
    ($($act:ident, $label:literal, $key:literal, $tip:literal;)*) => {
        /// Action without arguments.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum Act {
            $(#[doc = $tip] $act,)*
        }

        impl Act {
            /// All actions, in the order of the help.
            pub const ALL: &[Self] = &[$(Self::$act,)*];

            /// Words of the control.
            pub fn words(self) -> Control {
                match self {
                    $(Self::$act => Control { label: $label, tip: $tip, key: $key },)*
                }
            }
        }
    };
}

controls! {
    Force, "Take now", "Space", "Take a photo now, even if it isn't what was asked for.";
    Undo, "Undo", "U", "Remove the newest view.";
    Restore, "Restore", "R", "Restore the view that was removed last.";
    Pause, "Pause", "P", "Pause. Press again to resume.";
    Finish, "Finish", "E", "Finish and see the result. You can continue later.";
    GoOn, "Continue", "G", "Continue this session: take more views, or remove and retake some.";
    New, "New session", "N", "Start a new session. This one stays in its folder.";
    Mirror, "Mirror", "M", "Mirror the picture, so left and right match yours.";
    Tone, "Tone", "T", "Play a tone for each view.";
    Speech, "Speak", "S", "Speak the sentence.";
    Panels, "Numbers", "H", "Show or hide the numbers beside the picture.";
    FullScreen, "Full screen", "F11", "Fill the screen.";
    Distance, "Distance", "B", "The picture alone, without bar and panels. Comes up when mouse and keys rest for two seconds in a session.";
    Lines, "Lines", "L", "Show or hide corners, covered area and principal lines.";
    Theme, "Colours", "D", "Switch between dark, light and sunlight.";
    Help, "Keys", "F12", "List all keys.";
    StartPage, "Start", "F6", "Choose camera, board and plan.";
    GuidePage, "Guide", "F1", "Live picture and what to do next.";
    ResultPage, "Result", "F2", "Calibration so far, with checks and exports.";
    SettingsPage, "Settings", "F4", "How the window looks and sounds.";
    ReplayPage, "Sessions", "F5", "Your sessions: result, report, exports, replay.";
}
