//! Sentences, labels and tooltips of the window.

use crate::{
    detection::{Miss, Side},
    device::{Adjustable, Control},
    guidance::{Advice, Plan, Progress, Refusal},
    session::{CameraState, LiveView, Snapshot, Stream, ViewNumber, ViewSummary},
};

use super::{deg, edge, numbers::signed, view_name};
pub use super::{gauge::*, numbers::*, result::*};

/// The window's title.
pub const TITLE: &str = "boresight";

/// The one sentence to read from across the room. With `mirrored`, left and right are those of a person who
/// faces the camera.
pub fn sentence(snapshot: &Snapshot, mirrored: bool) -> String {
    if snapshot.decision.progress != Progress::Collecting {
        return super::progress(snapshot.decision.progress).into();
    }
    if !snapshot.failures.is_empty() {
        return "The session has stopped".into();
    }
    if let Some((what, _)) = super::camera::obstacle(&snapshot.camera) {
        return what;
    }
    if snapshot.paused {
        return "Paused".into();
    }
    if snapshot.source_ended {
        return "There are no more pictures".into();
    }
    let advice = &snapshot.decision.advice;
    let miss = snapshot.live.as_ref().and_then(|live| live.corners_px.as_ref().err());
    if mirrored {
        super::advice(&mirrored_advice(advice), miss.map(mirrored_miss).as_ref())
    } else {
        super::advice(advice, miss)
    }
}

/// Shown for a moment after a view was taken: how many of how many, "Taken: 3 of 8".
pub fn taken(views: usize, views_to_go: Option<usize>) -> String {
    match views_to_go {
        Some(to_go) => format!("Taken: {views} of {}", views + to_go),
        None => format!("Taken: {views}"),
    }
}

/// Shown before the first frame is processed.
pub const STARTING: &str = "Starting";

/// Shown while the result is computed and stored.
pub const ENDING: &str = "Storing the result";

fn mirrored_direction(direction_rad: f64) -> f64 {
    std::f64::consts::PI - direction_rad
}

/// The advice with left and right exchanged.
fn mirrored_advice(advice: &Advice) -> Advice {
    match *advice {
        Advice::TipTowards { tilt_azimuth_rad, wanted_rad } => Advice::TipTowards {
            tilt_azimuth_rad: tilt_azimuth_rad.map(mirrored_direction),
            wanted_rad: mirrored_direction(wanted_rad),
        },
        Advice::Tilt { tilt_rad, wanted_rad, tilt_azimuth_rad } => Advice::Tilt {
            tilt_rad,
            wanted_rad,
            tilt_azimuth_rad: mirrored_direction(tilt_azimuth_rad),
        },
        Advice::Shift { right_px, down_px } => Advice::Shift { right_px: -right_px, down_px },
        other => other,
    }
}

fn mirrored_miss(miss: &Miss) -> Miss {
    match *miss {
        Miss::PartialBoard { found, wanted, cut_off_by: Some(Side::Left) } => {
            Miss::PartialBoard { found, wanted, cut_off_by: Some(Side::Right) }
        }
        Miss::PartialBoard { found, wanted, cut_off_by: Some(Side::Right) } => {
            Miss::PartialBoard { found, wanted, cut_off_by: Some(Side::Left) }
        }
        other => other,
    }
}

/// Name of a direction in the picture, by the edge of the board that is tipped away.
pub fn direction_name(direction_rad: f64, mirrored: bool) -> &'static str {
    edge(if mirrored { mirrored_direction(direction_rad) } else { direction_rad })
}

/// State of one slot of the wheel; `taken` is the newest view in it.
pub fn slot_state(
    slot_rad: f64,
    taken: Option<ViewNumber>,
    wanted: bool,
    mirrored: bool,
) -> String {
    let name = direction_name(slot_rad, mirrored);
    match (taken, wanted) {
        (_, true) => format!("{name} edge away: wanted now"),
        (Some(view), false) => format!("{name} edge away: {}", view_name(view)),
        (None, false) => format!("{name} edge away: open"),
    }
}

/// Heading of the wheel.
pub const WHEEL: &str = "Directions";
/// Tooltip of the wheel.
pub const WHEEL_TIP: &str = "Each dot is a direction in which the board is tipped away from the camera. Opposite dots are partners: together they cancel what the lens does to each.";

/// Caption of a thumbnail.
pub fn thumbnail(view: &ViewSummary, mirrored: bool) -> String {
    let (number, off) = (view.number, signed(view.pl_residual_px));
    format!("{number} {} {off} px", direction_name(view.tilt_azimuth_rad, mirrored))
}

/// Tooltip of a thumbnail: what the view measures.
pub fn thumbnail_tip(view: &ViewSummary, mirrored: bool) -> String {
    let tilt = view.tilt_rad.map_or("?".into(), deg);
    let partner = match view.partner {
        Some(partner) => format!("Partner: {}.", view_name(partner)),
        None => "No partner yet.".into(),
    };
    let rms = view.rms_px.map_or(String::new(), |rms| format!(" Corners fit to {rms:.2} px."));
    format!(
        "View {}: {} edge away, tilt {tilt}°. Its principal line passes the principal point at {} px. {partner}{rms}",
        view.number,
        direction_name(view.tilt_azimuth_rad, mirrored),
        signed(view.pl_residual_px)
    )
}

/// Label of a thumbnail's button.
pub fn remove_view(number: ViewNumber) -> String {
    format!("Remove {}", view_name(number))
}

/// Age of the drawing on the picture.
pub fn overlay_age(age_secs: f64) -> String {
    format!("drawing {:.0} ms old", 1e3 * age_secs.max(0.0))
}

/// Frame rate of the source, and how many frames newer ones replaced.
pub fn frames(per_sec: Option<f64>, replaced: u64) -> String {
    let rate = per_sec.map_or("no pictures".into(), |rate| format!("{rate:.0} pictures/s"));
    match replaced {
        0 => rate,
        1 => format!("{rate}, 1 skipped"),
        n => format!("{rate}, {n} skipped"),
    }
}

/// Tooltip that explains "skipped".
pub const FRAMES_TIP: &str = "Pictures from the source. A skipped one arrived while the one before was still being searched; it was shown, but not measured.";

/// Shown when no new picture has arrived for a while.
pub fn stalled(secs: f64) -> String {
    format!("No picture for {secs:.0} s")
}

/// What to do when no picture comes.
pub const STALLED_ACTION: &str = "The views are safe. Check the cable; the session resumes by itself when pictures arrive again.";

/// A worker that failed.
pub fn failed(worker: &str, reason: &str) -> String {
    format!("The {worker} failed: {}", super::camera::printable(reason))
}

/// What to do about a failed worker.
pub const FAILED_ACTION: &str = "Every view that was shown as taken is safe. Fix the cause, then resume this session on the Result page.";

/// Label of the live picture for screen readers.
pub const PICTURE: &str = "Live picture";
/// Shown before the first view.
pub const NO_VIEWS: &str =
    "No views yet. They are taken by themselves when the board is held still on the outline.";
/// Tooltip of a thumbnail's button.
pub const REMOVE_TIP: &str = "Remove this view. \"Bring back\" (R) undoes it.";
/// Heading of the camera's controls.
pub const CAMERA: &str = "Camera";
/// Its tooltip.
pub const CAMERA_TIP: &str = "State of the controls, as read back from the camera. Focus and zoom must not change during a session.";

/// The live camera's mode, controls except those in `adjustables`, and losses; empty if the source is no live
/// camera.
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
    lines.push(("lost pictures", camera.dropped.to_string()));
    if camera.rejected > 0 {
        lines.push(("damaged", camera.rejected.to_string()));
    }
    lines
}

/// Why a replayed frame wasn't taken.
pub fn refused(refusal: &Refusal, live: Option<&LiveView>) -> String {
    match (refusal, live.map(|live| &live.corners_px)) {
        (Refusal::NotFound, Some(Err(miss))) => super::miss(miss),
        (refusal, _) => super::refusal(refusal),
    }
}

/// Name and explanation of a plan.
pub fn plan(plan: Plan) -> (&'static str, &'static str) {
    match plan {
        Plan::Quick => ("Quick", "Two opposed pairs at right angles: four views."),
        Plan::Full => ("Full", "Four opposed pairs, 45° apart: eight views."),
        Plan::Adaptive => {
            ("Adaptive", "Two pairs, then the most informative pairs, until it is precise enough.")
        }
    }
}

/// A second Ctrl-C.
pub const ENDED_AT_ONCE: &str = "Ended at once. Views shown as taken are on the disk; a camera's focus and exposure may still be locked: resume the session with --session to put them back.";

/// There is no display to open a window on.
pub const IN_TERMINAL: &str = "There is no display: boresight guides by words in this terminal.";
/// The build has no window.
pub const BUILT_WITHOUT: &str =
    "This build has no window: boresight guides by words in this terminal.";
/// What to do without a display.
pub const NO_DISPLAY_ACTION: &str =
    "Use --headless to be guided by words in the terminal, or set DISPLAY or WAYLAND_DISPLAY.";
/// What to do if the display went away under an open window.
pub const LOST_DISPLAY_ACTION: &str =
    "Every view that was shown as taken is stored; guide --session DIR goes on where it stopped.";
/// What to do if the window system refuses.
pub const NO_WINDOW_ACTION: &str = "Check that DISPLAY or WAYLAND_DISPLAY names a display that is there; install what is missing (Debian: sudo apt install libxkbcommon-x11-0 libgl1 libegl1 libgl1-mesa-dri), or use --headless to be guided by words in the terminal.";
/// The source was not named and no camera is there.
pub const NO_CAMERA: &str =
    "There is no camera: this is the simulated camera with a simulated technician.";
/// Sources that are always there.
pub const SOURCE_AUTO: &str = "The camera if there is one, else the simulated one.";
/// See [`SOURCE_AUTO`].
pub const SOURCE_SIMULATED: &str = "A simulated camera with a simulated technician.";

/// Heading of the page for a session that could not be started.
pub const NOT_STARTED: &str = "The session could not be started";
/// Its buttons and what they do.
pub const TRY_AGAIN: &str = "Try again";
/// See [`TRY_AGAIN`].
pub const TRY_AGAIN_TIP: &str = "The same source once more.";
/// See [`TRY_AGAIN`].
pub const OTHER_SOURCE: &str = "Choose another source";
/// See [`TRY_AGAIN`].
pub const SIMULATED: &str = "Try it with the simulated camera";
/// See [`TRY_AGAIN`].
pub const SIMULATED_TIP: &str = "A simulated technician follows the guidance; nothing is needed.";

/// The result could not be stored and nobody knows why.
pub const ENDING_FAILED: &str = "Storing the result failed";
/// A file was dropped where it means nothing.
pub const DROP_TIP: &str = "A session's folder can be dropped here at any time, an older calibration once the session has ended.";

/// Heading of the list of keys.
pub const HELP: &str = "Keys";
#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mirror_exchanges_left_and_right_only() {
        let right = Advice::TipTowards { tilt_azimuth_rad: None, wanted_rad: 0.0 };
        assert_eq!(super::super::advice(&mirrored_advice(&right), None), "Tip the left edge away");
        let tilt_azimuth_rad = 270_f64.to_radians();
        let top = Advice::Tilt { tilt_rad: 0.3, wanted_rad: 0.7, tilt_azimuth_rad };
        assert_eq!(
            super::super::advice(&mirrored_advice(&top), None),
            super::super::advice(&top, None)
        );
        let shift = Advice::Shift { right_px: 40.0, down_px: 0.0 };
        assert_eq!(super::super::advice(&mirrored_advice(&shift), None), "Move left: 40 px");
    }
}
