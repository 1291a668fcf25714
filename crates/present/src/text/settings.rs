//! The words of the settings page.

/// Headings of the page.
pub const SESSION: &str = "While you hold the board";
/// See [`SESSION`].
pub const SOUND: &str = "Sound";
/// The button that tries the voice.
pub const TEST_VOICE: &str = "Test the voice";
/// See [`TEST_VOICE`].
pub const TEST_VOICE_TIP: &str =
    "Turn the voice on and say something, through spd-say or espeak-ng.";
/// See [`SESSION`].
pub const WINDOW: &str = "Window";
/// Hint that all other settings are on the Start page.
pub const NEXT: &str = "Camera, board and plan are on the Start page.";
/// Size of the interface.
pub const ZOOM: &str = "Interface size";
/// See [`ZOOM`].
pub const ZOOM_TIP: &str = "Also Ctrl with plus, minus or 0.";
/// Text of a list before a choice.
pub const CHOOSE: &str = "Choose…";
