//! The words of the settings page.

/// Heading of the settings for new sessions.
pub const NEW_SESSIONS: &str = "New sessions";
/// Storage folder of sessions.
pub const FOLDER: (&str, &str) =
    ("Folder", "New sessions are stored here. Leave it empty for ./sessions.");
/// Folder in an empty field.
pub const FOLDER_HINT: &str = "./sessions";
/// Goal setting.
pub const GOAL: (&str, &str) = (
    "Goal",
    "Largest acceptable error: 0.2px, or length 800mm at 2m <= 2mm. Leave it empty for the plan's own.",
);
/// Goals in an empty field.
pub const GOAL_HINT: &str = "0.2px, or length 800mm at 2m <= 2mm";
/// Error for a text that isn't a goal.
pub const NO_GOAL: &str = "Write a goal as 0.2px, or as length 800mm at 2m <= 2mm.";
/// Setting of the lens models.
pub const LENS: (&str, &str) =
    ("Lens", "Lens models to choose from. Wide lenses are recognised with auto.");
/// Choice of every lens model.
pub const ANY_LENS: &str = "auto";
/// Setting of the board's error.
pub const BOARD_ERROR: (&str, &str) = (
    "Board error",
    "How exactly you know the squares' side: 0.1 % with a ruler, 0.02 % with a caliper over the whole board.",
);
/// Heading of the certificate's fields.
pub const CERTIFICATE: &str = "Certificate";
/// See [`CERTIFICATE`].
pub const CERTIFICATE_TIP: &str =
    "New sessions print this on sheet 1 of the report. What you leave empty is left for a pen.";
/// Heading of the session's settings.
pub const SESSION: &str = "While you hold the board";
/// See [`SESSION`].
pub const SOUND: &str = "Sound";
/// Button to test the voice.
pub const TEST_VOICE: &str = "Test the voice";
/// See [`TEST_VOICE`].
pub const TEST_VOICE_TIP: &str =
    "Turn the voice on and say something, through spd-say or espeak-ng.";
/// See [`SESSION`].
pub const WINDOW: &str = "Window";
/// Hint to other settings on the Start page.
pub const NEXT: &str = "Camera, board and plan are on the Start page.";
/// Interface size.
pub const ZOOM: &str = "Interface size";
/// See [`ZOOM`].
pub const ZOOM_TIP: &str = "Also Ctrl with plus, minus or 0.";
/// Text of a list before a choice.
pub const CHOOSE: &str = "Choose…";
