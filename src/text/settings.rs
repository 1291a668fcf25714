//! The words of the settings page.

/// Heading.
pub const NEXT: &str = "Next session";
/// Button that starts it.
pub const START: &str = "Start a new session";
/// See [`START`].
pub const START_TIP: &str = "Save the current session and start a new one with these settings.";
/// Heading.
pub const WINDOW: &str = "Window";
/// Size of the interface.
pub const ZOOM: &str = "Interface size";
/// See [`ZOOM`].
pub const ZOOM_TIP: &str = "Also Ctrl with plus, minus or 0.";
/// Where pictures come from.
pub const SOURCE: &str = "Source";
/// See [`SOURCE`].
pub const SOURCE_TIP: &str =
    "A camera, sim, sim:SCENE.toml, sim:random:SEED, a recorded session or a folder of pictures.";
/// On the list of sources.
pub const CHOOSE: &str = "Choose…";
/// The camera's mode.
pub const MODE: &str = "Camera mode";
/// See [`MODE`].
pub const MODE_TIP: &str = "auto: the largest with at least 15 frames per second. Or, for example, 1280x720@30:MJPG. The mode in use is shown beside the live picture. Applies to the next session.";
/// Beside the mode.
pub const MODE_WHEN: &str = "applies to the next session";
/// The board.
pub const BOARD: &str = "Board";
/// See [`BOARD`].
pub const BOARD_TIP: &str =
    "Inner corners, where four squares meet: one fewer than squares in each direction.";
/// After the numbers of inner corners.
pub const CORNERS: [&str; 2] = [" columns", " rows"];
/// Side of a square.
pub const SQUARE: &str = "Square size";
/// See [`SQUARE`].
pub const SQUARE_TIP: &str =
    "Measure several squares and divide. Affects distances only, not the lens.";
/// The plan.
pub const PLAN: &str = "Plan";
/// See [`PLAN`].
pub const PLAN_TIP: &str = "How many views to take.";
