//! Sentences, labels and tooltips of the window.

use boresight_detect::{Miss, OtherBoard};
use boresight_geometry::{
    boards::BoardChoice,
    device::{Adjustable, Control},
};
use boresight_guide::{
    guidance::{Plan, Refusal, Role},
    session::{CameraState, LiveView, Prompt, Snapshot, Stream, ViewNumber, ViewSummary},
};

use super::{boards::expected, camera::capital, deg, numbers::signed, view_name};
pub use super::{direction_name, gauge::*, numbers::*, part_away, result::*};

/// Title of the window.
pub const TITLE: &str = "boresight";

/// Title of the window while pictures come from `source`.
pub fn title(source: &str) -> String {
    format!("{source} – {TITLE}")
}

/// Label on the picture of a simulated camera.
pub const SIMULATED_CAMERA: &str = "SIMULATED";

/// Hint on the picture until a person's first view is taken.
pub const HINT: &str = "Match the outline with your board. boresight takes each photo for you.";

/// Hint on the picture of a paused session without a visible button.
pub const RESUME: &str = "Press P to resume.";

/// Note before the first frame is processed.
pub const STARTING: &str = "Starting";

/// Note while the result is computed and stored.
pub const ENDING: &str = "Saving the result";

/// State of a slot of the wheel; `taken` is its newest view.
pub fn slot_state(
    slot_rad: f64,
    taken: Option<ViewNumber>,
    wanted: bool,
    mirrored: bool,
) -> String {
    let name = part_away(slot_rad, mirrored);
    match (taken, wanted) {
        (_, true) => format!("{name} away: next"),
        (Some(view), false) => format!("{name} away: {}", view_name(view)),
        (None, false) => format!("{name} away: open"),
    }
}

/// Heading of the wheel.
pub const WHEEL: &str = "Directions";
/// Tooltip of the wheel.
pub const WHEEL_TIP: &str = "Each dot is a direction in which the board is tipped away from the camera. Opposite tilts cancel each other's lens error.";

/// Caption of a thumbnail.
pub fn thumbnail(view: &ViewSummary, mirrored: bool) -> String {
    let (number, off) = (view.number, signed(view.pl_residual_px));
    format!("{number} {} {off} px", direction_name(view.tilt_azimuth_rad, mirrored))
}

/// Tooltip of a thumbnail: measurements of the view.
pub fn thumbnail_tip(view: &ViewSummary, mirrored: bool) -> String {
    let tilt = view.tilt_rad.map_or("?".into(), deg);
    let partner = match view.partner {
        Some(partner) => format!("Partner: {}.", view_name(partner)),
        None if view.role == Role::Further => "It needs no partner.".into(),
        None => "No partner yet.".into(),
    };
    let rms = view.rms_px.map_or(String::new(), |rms| format!(" Corners fit to {rms:.2} px."));
    format!(
        "View {}: {} away, tilt {tilt}°. Its principal line misses the principal point by {} px. {partner}{rms}",
        view.number,
        part_away(view.tilt_azimuth_rad, mirrored),
        signed(view.pl_residual_px)
    )
}

/// Label of a thumbnail's button.
pub fn remove_view(number: ViewNumber) -> String {
    format!("Remove {}", view_name(number))
}

/// Frame rate of the source, and the number of skipped frames.
pub fn frames(per_sec: Option<f64>, replaced: u64) -> String {
    let rate = per_sec.map_or("no pictures".into(), |rate| format!("{rate:.0} pictures/s"));
    match replaced {
        0 => rate,
        1 => format!("{rate}, 1 skipped"),
        n => format!("{rate}, {n} skipped"),
    }
}

/// Tooltip that explains "skipped".
pub const FRAMES_TIP: &str = "Pictures from the source. Skipped pictures arrived while the previous one was being analysed. They were shown but not measured.";

/// Words on the picture of a lost camera.
pub fn lost_for(secs: f64) -> String {
    format!("{:.0} s", secs.max(0.0))
}

/// Heading of the words of a device or program.
pub const DETAILS: &str = "Details";

/// Note when no new picture has arrived for a while.
pub fn stalled(secs: f64) -> String {
    format!("No picture for {secs:.0} s")
}

/// Action when no picture arrives.
pub const STALLED_ACTION: &str =
    "Your views are safe. Check the cable; capture resumes when pictures arrive.";

/// Error of a failed worker.
pub fn failed(worker: &str, reason: &str) -> String {
    format!("The {worker} failed: {}", super::camera::printable(reason))
}

/// Action for a failed worker.
pub const FAILED_ACTION: &str =
    "Your views are safe. Fix the problem, then choose Continue on the Result page.";

/// Board shown instead of the chosen one, and the next action; `None` if it's the chosen board.
pub fn other_board(snapshot: &Snapshot) -> Option<(String, String)> {
    let Prompt::OtherBoard(other) = snapshot.shown.prompt else { return None };
    let this = match other {
        OtherBoard::Plain { columns, rows } => {
            format!("This board has {} × {} squares", columns + 1, rows + 1)
        }
        OtherBoard::Larger { columns, rows } => {
            format!("This board has {} × {} squares or more", columns + 1, rows + 1)
        }
        OtherBoard::Charuco { dictionary, is_usual_side: true } => {
            format!("This is a ChArUco board ({dictionary})")
        }
        OtherBoard::Charuco { dictionary, is_usual_side: false } => {
            format!("This ChArUco board ({dictionary}) has smaller or larger markers")
        }
        OtherBoard::AprilGrid => "This is an AprilGrid".into(),
        OtherBoard::Circles { columns, rows, .. } => {
            format!("This board has {columns} × {rows} circles")
        }
    };
    let action = match other.choice() {
        Some(_) if snapshot.keeps_views() => {
            "Show the first board, or use this one. Your photos are kept.".into()
        }
        Some(board) if board.pattern.is_plain() => {
            format!("Hold it a moment longer to {}.", use_it(&board))
        }
        Some(_) => "Show the chosen board, or use this one.".into(),
        None => "Show the chosen board, or choose this one on the Start page.".into(),
    };
    Some((format!("{this}. Expected: {}", expected(&snapshot.setup.board)), action))
}

/// Button to use another board.
pub fn use_board(board: &BoardChoice) -> String {
    capital(&use_it(board))
}

fn use_it(board: &BoardChoice) -> String {
    let (circles, more) = if board.pattern.is_plain() { ("", 1) } else { (" circles", 0) };
    format!("use {} × {}{circles}", board.columns + more, board.rows + more)
}

/// Note that a session has ended while another page is open.
pub const FINISHED: &str = "Finished. See Result (F2)";

/// Line below the small card of the board as held.
pub const NOW: &str = "now";
/// Line below the small card of the requested board pose.
pub const WANTED: &str = "like this";
/// Label of the live picture for screen readers.
pub const PICTURE: &str = "Live picture";
/// Note before the first view.
pub const NO_VIEWS: &str = "Match the outline and hold still. Photos are taken automatically.";
/// Tooltip of a thumbnail's button.
pub const REMOVE_TIP: &str = "Remove this view. Restore (R) undoes it.";
/// Heading of the camera's controls.
pub const CAMERA: &str = "Camera";
/// Tooltip of [`CAMERA`].
pub const CAMERA_TIP: &str = "Camera settings, as read back from the camera. Focus and zoom must not change during a session.";

/// Mode, controls except those in `adjustables`, and losses of the live camera; empty for other
/// sources.
pub fn camera_lines(
    camera: &CameraState,
    adjustables: &[Adjustable],
) -> Vec<(&'static str, String)> {
    if camera.stream == Stream::NotLive {
        return Vec::new();
    }
    let mut lines = Vec::new();
    lines.extend(camera.mode.as_ref().map(|mode| ("mode", super::camera::mode(mode))));
    for control in [Control::Focus, Control::Zoom, Control::Exposure] {
        if adjustables.iter().all(|adjustable| adjustable.control != control) {
            let lock = super::camera::lock(camera.locks.of(control));
            lines.push((super::camera::control(control), lock));
        }
    }
    lines.push(("lost frames", camera.dropped.to_string()));
    if camera.rejected > 0 {
        lines.push(("damaged", camera.rejected.to_string()));
    }
    lines
}

/// Reason for not taking a replayed frame.
pub fn refused(refusal: &Refusal, live: Option<&LiveView>) -> String {
    match (refusal, live.map(|live| &live.corners_px)) {
        // The sentence names the way, which it keeps for a while.
        (
            Refusal::NotFound,
            Some(Err(Miss::PartialBoard { found, wanted, cut_off_by: Some(_), .. })),
        ) => format!("Part of the board is out of view: {found} of {wanted} corners found"),
        (Refusal::NotFound, Some(Err(miss))) => super::miss(miss),
        (refusal, _) => super::refusal(refusal),
    }
}

/// Name and explanation of a plan.
pub fn plan(plan: Plan) -> (&'static str, &'static str) {
    match plan {
        Plan::Quick => ("Quick", "Four photos."),
        Plan::Full => ("Full", "Eight photos, tipped in every direction."),
        Plan::Adaptive => {
            ("Adaptive", "Four photos, then the most useful ones until it's accurate enough.")
        }
    }
}

/// Note after a second Ctrl-C.
pub const ENDED_AT_ONCE: &str = "Ended at once. Views shown as taken are on the disk; a camera's focus and exposure may still be locked: resume the session with --session to put them back.";

/// Note about a missing display.
pub const IN_TERMINAL: &str = "No display found. Guiding in this terminal instead.";
/// Note about a build without a window.
pub const BUILT_WITHOUT: &str = "This build has no window. Guiding in this terminal instead.";
/// Action without a display.
pub const NO_DISPLAY_ACTION: &str =
    "Use --headless for guidance in the terminal, or set DISPLAY or WAYLAND_DISPLAY.";
/// Action if the display was lost under an open window.
pub const LOST_DISPLAY_ACTION: &str =
    "Your views are saved. To continue: boresight guide --session DIR";
/// Action if the window system fails.
pub const NO_WINDOW_ACTION: &str = "Check that DISPLAY or WAYLAND_DISPLAY names an existing display. Install what's missing (Debian: sudo apt install libxkbcommon-x11-0 libgl1 libegl1 libgl1-mesa-dri), or use --headless for guidance in the terminal.";
/// Note about neither a named source nor a camera.
pub const NO_CAMERA: &str = "No camera found: showing a simulation";
/// Heading of the page for a session that couldn't be started.
pub const NOT_STARTED: &str = "The session couldn't start";
/// Button of that page to try again.
pub const TRY_AGAIN: &str = "Try again";
/// See [`TRY_AGAIN`].
pub const TRY_AGAIN_TIP: &str = "Try the same source again.";
/// See [`TRY_AGAIN`].
pub const OTHER_SOURCE: &str = "Choose another source";
/// See [`TRY_AGAIN`].
pub const SIMULATED: &str = "Try a simulation";
/// See [`TRY_AGAIN`].
pub const SIMULATED_TIP: &str =
    "Watch a simulated technician follow the guidance. No camera needed.";

/// Error of storing the result for an unknown reason.
pub const ENDING_FAILED: &str = "The result couldn't be saved";

/// Note that nobody is at this terminal and in front of the camera at once.
pub const OVER_SSH: &str =
    "The person at the camera can see this on a phone: start with --serve, and scan the code.";

/// Keys without a button, with their actions.
pub const OTHER_KEYS: [(&str, &str); 4] = [
    ("Ctrl +/−/0", "Everything larger, smaller, as usual"),
    ("← →", "In a recording: the frame before, the next"),
    ("PgUp PgDn", "In a recording: the view before, the next"),
    ("Space", "In a recording: play, stop"),
];

/// Heading of the list of keys.
pub const HELP: &str = "Keys";
