//! Everything that can be done in the window: one list for buttons, keyboard and help.

/// A control: what stands on it, what it does, and the name of its key.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Control {
    /// What stands on it.
    pub label: &'static str,
    /// What it does.
    pub tip: &'static str,
    /// Name of its key.
    pub key: &'static str,
}

macro_rules! controls {
    ($($act:ident, $label:literal, $key:literal, $tip:literal;)*) => {
        /// Something the person can ask for without naming anything.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum Act {
            $(#[doc = $tip] $act,)*
        }

        impl Act {
            /// All, in the order of the help.
            pub const ALL: &[Self] = &[$(Self::$act,)*];

            /// Its words.
            pub fn words(self) -> Control {
                match self {
                    $(Self::$act => Control { label: $label, tip: $tip, key: $key },)*
                }
            }
        }
    };
}

controls! {
    Force, "Take now", "Space", "Take the next picture with a board, whatever the plan thinks of it.";
    Undo, "Undo", "U", "Take back the newest view.";
    Restore, "Bring back", "R", "Bring back the view that was taken back last.";
    Pause, "Pause", "P", "Take nothing until it is pressed again.";
    Finish, "End", "E", "End the session and see the result. It can be gone on with.";
    GoOn, "Go on", "G", "Go on with this session: take more views, remove some, take some again.";
    New, "New session", "N", "Start a new session; this one stays in its folder.";
    Mirror, "Mirror", "M", "Show the picture as a mirror does; left and right are then those of the person in front of the camera.";
    Tone, "Tone", "T", "A tone for each view taken.";
    Speech, "Speak", "S", "Say the sentence aloud.";
    Panels, "Numbers", "H", "Show or hide the numbers beside the picture.";
    FullScreen, "Whole screen", "F11", "Fill the screen.";
    Theme, "Light or dark", "L", "Change between light and dark.";
    Help, "Keys", "F12", "All keys and what they do.";
    GuidePage, "Guide", "F1", "The live picture and what to do next.";
    ResultPage, "Result", "F2", "The calibration so far, its checks and exports.";
    ExplorePage, "Explore", "F3", "What lens distortion does to a principal line, to play with.";
    SettingsPage, "Settings", "F4", "Source, board and plan of the next session.";
    ReplayPage, "Replay", "F5", "A recorded session, decision by decision.";
}
