//! The words of the settings page.

/// Heading.
pub const NEXT: &str = "Next session";
/// Button that starts it.
pub const START: &str = "Start a new session";
/// See [`START`].
pub const START_TIP: &str = "Ends the running session, which stays in its folder with its result, and starts one with these settings.";
/// Heading.
pub const WINDOW: &str = "Window";
/// Size of everything.
pub const ZOOM: &str = "Size of everything";
/// See [`ZOOM`].
pub const ZOOM_TIP: &str = "Also Ctrl and plus, minus or 0.";
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
pub const MODE_TIP: &str = "auto: the largest that keeps 15 pictures per second. Or, for example, 1280x720@30:MJPG. What the driver grants stands beside the live picture. It applies when the next session starts.";
/// Beside the mode.
pub const MODE_WHEN: &str = "from the next session on";
/// The board.
pub const BOARD: &str = "Board";
/// See [`BOARD`].
pub const BOARD_TIP: &str =
    "Inner corners, where four squares meet: one less than squares each way.";
/// After the numbers of inner corners.
pub const CORNERS: [&str; 2] = [" columns", " rows"];
/// Side of a square.
pub const SQUARE: &str = "Side of a square";
/// See [`SQUARE`].
pub const SQUARE_TIP: &str =
    "Measure across many squares and divide. It scales distances; the lens does not depend on it.";
/// The plan.
pub const PLAN: &str = "Plan";
/// See [`PLAN`].
pub const PLAN_TIP: &str = "How many views are asked for.";
