//! The words of the window: sentences, labels, tooltips.

use crate::{
    detection::{Miss, Side},
    device::{Adjustable, Control},
    guidance::{Advice, GuidanceParams, Plan, Progress, Refusal},
    session::{CameraState, LiveView, Snapshot, Stream, ViewSummary},
};

use super::{deg, edge, numbers::signed};
pub use super::{gauge::*, numbers::*, result::*};

/// The window's title.
pub const TITLE: &str = "boresight";

/// The one sentence that is read from across the room. With `mirrored`, left and right are those of the
/// person who stands in front of the camera.
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

/// Said for a moment after a view was taken: "Taken: 3 of 8".
pub fn taken(views: usize, views_to_go: Option<usize>) -> String {
    match views_to_go {
        Some(to_go) => format!("Taken: {views} of {}", views + to_go),
        None => format!("Taken: {views}"),
    }
}

/// Before the first frame has been looked at.
pub const STARTING: &str = "Starting";

/// While the result is being computed and stored.
pub const ENDING: &str = "Storing the result";

fn mirrored_slot(slot_rad: f64) -> f64 {
    std::f64::consts::PI - slot_rad
}

/// The advice with left and right exchanged.
fn mirrored_advice(advice: &Advice) -> Advice {
    match *advice {
        Advice::TipTowards { slot_rad, wanted_rad } => Advice::TipTowards {
            slot_rad: slot_rad.map(mirrored_slot),
            wanted_rad: mirrored_slot(wanted_rad),
        },
        Advice::Tilt { tilt_rad, wanted_rad, slot_rad } => {
            Advice::Tilt { tilt_rad, wanted_rad, slot_rad: mirrored_slot(slot_rad) }
        }
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

/// Name of a direction of the wheel, as seen in the picture.
pub fn slot_name(slot_rad: f64, mirrored: bool) -> &'static str {
    edge(if mirrored { mirrored_slot(slot_rad) } else { slot_rad })
}

/// State of one slot of the wheel.
pub fn slot_state(slot_rad: f64, taken: Option<usize>, wanted: bool, mirrored: bool) -> String {
    let name = slot_name(slot_rad, mirrored);
    match (taken, wanted) {
        (_, true) => format!("{name} edge away: wanted now"),
        (Some(view), false) => format!("{name} edge away: view {}", view + 1),
        (None, false) => format!("{name} edge away: open"),
    }
}

/// What the wheel is.
pub const WHEEL: &str = "Directions";
/// Its explanation.
pub const WHEEL_TIP: &str = "Each dot is a direction in which the board is tipped away from the camera. Opposite dots are partners: together they cancel what the lens does to each.";

/// Below a thumbnail.
pub fn thumbnail(number: usize, view: &ViewSummary, mirrored: bool) -> String {
    let off = signed(view.pl_residual_px);
    format!("{number} {} {off} px", slot_name(view.slot_rad, mirrored))
}

/// All that is known of an accepted view.
pub fn thumbnail_tip(number: usize, view: &ViewSummary, mirrored: bool) -> String {
    let tilt = view.tilt_rad.map_or("?".into(), deg);
    let partner = match view.partner {
        Some(partner) => format!("Partner: view {}.", partner + 1),
        None => "No partner yet.".into(),
    };
    let rms = view.rms_px.map_or(String::new(), |rms| format!(" Corners fit to {rms:.2} px."));
    format!(
        "View {number}: {} edge away, tilt {tilt}°. Its principal line passes the principal point at {} px. {partner}{rms}",
        slot_name(view.slot_rad, mirrored),
        signed(view.pl_residual_px)
    )
}

/// On a thumbnail's button.
pub fn remove_view(number: usize) -> String {
    format!("Remove view {number}")
}

/// How old the drawing on the picture is.
pub fn overlay_age(age_secs: f64) -> String {
    format!("drawing {:.0} ms old", 1e3 * age_secs.max(0.0))
}

/// What came from the source, and what newer frames replaced.
pub fn frames(per_sec: Option<f64>, replaced: u64) -> String {
    let rate = per_sec.map_or("no pictures".into(), |rate| format!("{rate:.0} pictures/s"));
    match replaced {
        0 => rate,
        1 => format!("{rate}, 1 skipped"),
        n => format!("{rate}, {n} skipped"),
    }
}

/// What "skipped" means.
pub const FRAMES_TIP: &str = "Pictures from the source. A skipped one came while the one before was still being looked at; it was shown, but not measured.";

/// No new picture for a while.
pub fn stalled(secs: f64) -> String {
    format!("No picture for {secs:.0} s")
}

/// What to do when no picture comes.
pub const STALLED_ACTION: &str =
    "The views are safe. Check the cable; the session goes on by itself when pictures come again.";

/// A worker that failed.
pub fn failed(worker: &str, reason: &str) -> String {
    format!("The {worker} failed: {}", super::camera::printable(reason))
}

/// What to do then.
pub const FAILED_ACTION: &str = "Every view that was shown as taken is safe. Mend the cause, then go on with this session on the Result page.";

/// The live picture, for those who do not see it.
pub const PICTURE: &str = "Live picture";
/// Before the first view.
pub const NO_VIEWS: &str =
    "No views yet. They are taken by themselves when the board is held still on the outline.";
/// What removing does.
pub const REMOVE_TIP: &str = "Take this view back. \"Bring back\" (R) undoes it.";
/// Heading of the camera's controls.
pub const CAMERA: &str = "Camera";
/// What they are.
pub const CAMERA_TIP: &str = "How the controls stand, as read back from the camera. Focus and zoom must not change during a session.";

/// The live camera's mode, controls but those of `adjustables`, and losses; nothing if the source is none.
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

/// Why the newest frame was not taken, for replay.
pub fn refused(refusal: &Refusal, live: Option<&LiveView>) -> String {
    match (refusal, live.map(|live| &live.corners_px)) {
        (Refusal::NotFound, Some(Err(miss))) => super::miss(miss),
        (refusal, _) => super::refusal(refusal),
    }
}

/// What a plan is.
pub fn plan(plan: Plan) -> (&'static str, &'static str) {
    match plan {
        Plan::Quick => ("Quick", "Two opposed pairs at right angles: four views."),
        Plan::Full => ("Full", "Four opposed pairs, 45° apart: eight views."),
        Plan::Adaptive => {
            ("Adaptive", "Two pairs, then pairs where they tell most, until it is precise enough.")
        }
    }
}

/// How far apart directions must be, in words for the wheel's tooltip.
pub fn wanted_tilt(guidance: &GuidanceParams) -> String {
    format!("tilt {}–{}°", deg(guidance.min_tilt_rad), deg(guidance.max_tilt_rad))
}

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
        let right = Advice::TipTowards { slot_rad: None, wanted_rad: 0.0 };
        assert_eq!(super::super::advice(&mirrored_advice(&right), None), "Tip the left edge away");
        let top = Advice::Tilt { tilt_rad: 0.3, wanted_rad: 0.7, slot_rad: 270_f64.to_radians() };
        assert_eq!(
            super::super::advice(&mirrored_advice(&top), None),
            super::super::advice(&top, None)
        );
        let shift = Advice::Shift { right_px: 40.0, down_px: 0.0 };
        assert_eq!(super::super::advice(&mirrored_advice(&shift), None), "Move left: 40 px");
    }
}
