//! The words of the start page.

use super::boards::circles;
pub use super::boards::{KINDS, KindWords, board, board_to_use, square};
use boresight_detect::OtherBoard;
use boresight_geometry::{
    boards::BoardChoice,
    markers::{Dictionary, InvalidMarkers},
};
use boresight_guide::guidance::Plan;

/// Headings of the sheet.
pub const CAMERA: &str = "Camera";
/// See [`CAMERA`].
pub const BOARD: &str = "Board";
/// Button for the sheet.
pub const CHANGE: &str = "Change…";
/// Picture of the chosen camera.
pub const LIVE: &str = "The camera's picture";

/// Sentence without a camera.
pub const NO_CAMERA: &str = "Plug a camera in";
/// Sentence before a board is known.
pub const HOLD_UP: &str = "Hold up any board";
/// Line below a board named by its code.
pub const FROM_CODE: &str = "Read from your board's code";
/// Line below a board with squares of an assumed size.
pub const SIZE_OPEN: &str = "Only distances depend on the size";
/// Line below a board remembered or chosen, and not in view.
pub const ANOTHER: &str = "Another board? Hold it up";
/// Note while a camera starts.
pub const WAITING: &str = "Waiting for a picture";
/// Button that starts with the simulated camera.
pub const SIMULATION: &str = "Try the simulation";
/// See [`SIMULATION`].
pub const SIMULATION_TIP: &str =
    "Watch a simulated person follow the guidance. It calibrates nothing.";
/// Button for recordings.
pub const RECORDINGS: &str = "Recordings";
/// See [`RECORDINGS`].
pub const RECORDINGS_TIP: &str = "Step through a session you recorded before.";
/// Field for any other source.
pub const OTHER: &str = "Stream or file";
/// See [`OTHER`].
pub const OTHER_TIP: &str = "An address such as rtsp://…, pipe: and a command that sends pictures, ros2: and a topic, gige: and a camera's address, a video file, a recorded bag, a folder of pictures, or sim:SCENE.toml.";
/// Hint in the empty field.
pub const OTHER_HINT: &str = "rtsp://… or a file";
/// Tooltip of a stream used before.
pub const RECENT_TIP: &str = "Used before. Passwords aren't stored: add yours again.";
/// Choice of several cameras for one session.
pub const RIG: &str = "Several cameras together";
/// See [`RIG`].
pub const RIG_TIP: &str = "All see one board, and you learn where they are to each other, too. They need no trigger: pictures are taken while the board rests.";
/// Reason why no session of several cameras can start.
pub const RIG_TROUBLE: &str = "Choose two to eight cameras";
/// Label of the chosen camera's mode.
pub const MODE: &str = "Mode";
/// Choice of the best mode.
pub const BEST_MODE: &str = "Best mode";
/// Question about the mirror.
pub const MIRROR: &str = "Does the camera face you?";
/// See [`MIRROR`].
pub const MIRROR_TIP: &str = "If it does, the picture is shown as in a mirror, so left and right match yours. M changes it later.";
/// Answers to the question about the mirror.
pub const YES: &str = "Yes, mirror it";
/// See [`YES`].
pub const NO: &str = "No";

/// Size of a camera's pictures.
pub fn mode(width_px: u32, height_px: u32) -> String {
    format!("{width_px} × {height_px}")
}

/// Camera for a screen reader.
pub fn camera(name: &str, mode: &str) -> String {
    if mode.is_empty() { name.into() } else { format!("{name}, {mode}") }
}

/// Cameras chosen for one session.
pub fn rig(names: &[&str]) -> String {
    format!("{} cameras: {}", names.len(), names.join(", "))
}

/// Label of the space between tags.
pub const SPACING: &str = "Space";
/// See [`SPACING`].
pub const SPACING_TIP: &str = "Between tags, as a share of their side: tagSpacing in Kalibr.";
/// Label of the number of the first tag.
pub const FIRST_TAG: &str = "First tag";
/// See [`FIRST_TAG`].
pub const FIRST_TAG_TIP: &str = "Number of the tag in the lower left corner; 0 on most boards.";

/// Label of the dictionary.
pub const DICTIONARY: &str = "Dictionary";
/// See [`DICTIONARY`].
pub const DICTIONARY_TIP: &str = "The set that the markers are from. It's usually printed on the board, and in the program that made it.";
/// Label of the side of a marker.
pub const MARKER: &str = "Marker";
/// See [`MARKER`].
pub const MARKER_TIP: &str =
    "Side of a marker with its black frame. Measure it: corners are found between the markers.";

/// Short name of a dictionary, as in OpenCV.
pub fn dictionary(dictionary: Dictionary) -> String {
    dictionary.name().trim_start_matches("DICT_").to_owned()
}

/// Reason for markers being impossible in squares of `square_m` metres, and the next action.
pub fn impossible(why: &InvalidMarkers, square_m: f64) -> (String, &'static str) {
    match why {
        InvalidMarkers::Count { needed, dictionary, count, .. } => (
            format!("This board has {needed} markers, and {dictionary} has {count}"),
            "Choose a larger dictionary, or fewer squares.",
        ),
        InvalidMarkers::Side { .. } => {
            let [least_m, most_m] = InvalidMarkers::SIDES_SQUARES.map(|share| share * square_m);
            let sides = format!("{} to {}", square(least_m), square(most_m));
            (format!("Markers in these squares have sides of {sides}"), "Measure both again.")
        }
        InvalidMarkers::Tags { .. }
        | InvalidMarkers::Spacing { .. }
        | InvalidMarkers::Numbers { .. } => (why.to_string(), "Count the tags again."),
    }
}

/// Labels between the counts, and for a screen reader.
pub const SIDES: [&str; 2] = ["columns", "rows"];
/// Board of another kind seen by the camera.
pub fn detected_other(other: OtherBoard) -> String {
    match other {
        OtherBoard::Plain { .. } | OtherBoard::Larger { .. } => {
            "This board is larger. Show it whole".into()
        }
        OtherBoard::Charuco { dictionary, is_usual_side: true } => {
            format!("This is a ChArUco board, {dictionary}. Count its squares")
        }
        OtherBoard::Charuco { dictionary, is_usual_side: false } => {
            format!("This is a ChArUco board, {dictionary}. Count its squares and measure a marker")
        }
        OtherBoard::AprilGrid => "This is an AprilGrid. Count its tags".into(),
        OtherBoard::Circles { columns, rows, layout } => {
            format!("{} {columns} × {rows}", circles(layout))
        }
    }
}
/// Button to choose that board.
pub const TAKE_OTHER: &str = "Use it";

/// Button to print.
pub const PRINT: &str = "Print this board";
/// Link that prints a board for who has none.
pub const PRINT_ONE: &str = "Print one";
/// See [`PRINT`].
pub const PRINT_TIP: &str =
    "Write a PDF with the largest squares that fit, and open it. Nothing is overwritten.";
/// Label of the paper sizes.
pub const PAPER: &str = "Paper";

/// Link to a written board.
pub fn printed(file: &std::path::Path, square_m: f64) -> String {
    format!("Saved to {} ({} squares). Open", file.display(), square(square_m))
}

/// Button to show the board.
pub const SHOW: &str = "Show it on another screen";
/// See [`SHOW`].
pub const SHOW_TIP: &str = "Open a window with the board. Drag it to a flat screen and press F11. Move the camera instead of the board.";
/// Title of the board's window.
pub const SHOWN_TITLE: &str = "boresight board";

/// Line below the board on a screen.
pub fn shown(BoardChoice { columns, rows, .. }: BoardChoice) -> String {
    format!(
        "{columns} × {rows} inner corners. Measure the {} squares of a row and divide by {}. F11: full screen. Esc: close.",
        columns + 1,
        columns + 1
    )
}

/// Button to start.
pub const GO: &str = "Start session";
/// See [`GO`].
pub const GO_TIP: &str = "Begin. Photos are taken automatically.";
/// Label of the choice of a plan.
pub const PLAN: &str = "How thorough?";
/// Seconds per view, from the first frame on, for people of all kinds: 3 for most simulated people,
/// 4 for those who don't look or have a small picture.
const SECS_PER_VIEW: u32 = 4;

/// Expected duration of a session.
pub fn duration(plan: Plan) -> String {
    let views = match plan {
        Plan::Quick => 4,
        Plan::Adaptive => 6,
        Plan::Full => 8,
    };
    // In steps of five seconds.
    format!("about {} s", (SECS_PER_VIEW * views).div_ceil(5) * 5)
}
/// Hint for an impossible board.
pub const NO_BOARD: &str = "Correct the board first";
/// Hint without a source.
pub const NO_SOURCE: &str = "Choose a camera first";
/// Choice of full screen.
pub const FULL_SCREEN: &str = "Full screen while you hold the board";
/// See [`FULL_SCREEN`].
pub const FULL_SCREEN_TIP: &str =
    "Fills the screen once mouse and keys have rested for two seconds.";

/// Note while a session runs.
pub const RUNNING: &str = "A session is running";
/// See [`RUNNING`].
pub const RUNNING_ACTION: &str =
    "Finish it to choose another camera or board. Your views are safe.";
/// Button back to the session.
pub const BACK: &str = "Back to the session";

/// Report that the board in view is used from now on: as named by its code, or with unmeasured
/// squares.
pub fn switched(
    id: Option<&str>,
    BoardChoice { columns, rows, pattern }: BoardChoice,
    square_m: f64,
) -> String {
    if let Some(id) = id {
        let counts = [columns, rows].map(usize::from);
        return format!("{} is used now", named_board(id, counts, square_m));
    }
    let ([columns, rows], what, question) = match pattern.is_plain() {
        true => ([columns + 1, rows + 1], "squares", "Is a square"),
        false => ([columns, rows], "circles", "Are rows apart by"),
    };
    let square = square(square_m);
    format!(
        "The board in view is used now: {columns} × {rows} {what}. {question} {square}? {IF_NOT}"
    )
}

/// Action for squares of another size than the session assumes.
const IF_NOT: &str =
    "A wrong size changes distances, not the lens; set it on the start page of the next session";

/// Board as named by a printed code; `id` is empty without a code.
pub fn named_board(id: &str, [columns, rows]: [usize; 2], square_m: f64) -> String {
    let gap = if id.is_empty() { "" } else { " " };
    format!("Board{gap}{id}: {columns} × {rows}, {}", square(square_m))
}

/// Note about an assumed square size, given neither by the person nor by a code.
pub fn assumed_square(square_m: f64) -> String {
    format!("Is a square {}? {IF_NOT}", square(square_m))
}

/// Length typed in millimetres, in metres; `None` if no number.
pub fn parsed_millimetres(text: &str) -> Option<f64> {
    text.trim().trim_end_matches("mm").trim().parse::<f64>().ok().map(|length| 1e-3 * length)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_length_is_read_with_and_without_its_unit() {
        assert_eq!(parsed_millimetres("50 mm"), Some(0.05));
        assert_eq!(parsed_millimetres("50"), Some(0.05));
        assert_eq!(parsed_millimetres("wide"), None);
    }

    #[test]
    fn more_views_take_longer() {
        assert_eq!(duration(Plan::Quick), "about 20 s");
        assert_eq!(duration(Plan::Adaptive), "about 25 s");
        assert_eq!(duration(Plan::Full), "about 35 s");
    }
}
