//! The live camera in words.

use boresight_geometry::device::{CameraEvent, Control, ControlChange, Fault, Lock, Mode};
use boresight_guide::session::{CameraState, Stream};

/// Answer to the question for cameras, without any.
pub const NO_CAMERA: &str =
    "No camera found. Plug one in, or try `boresight demo`, which simulates one.";

/// Meaning of a fault, and the next action.
pub fn fault(fault: Fault) -> (&'static str, &'static str) {
    match fault {
        Fault::NotFound => {
            ("Camera not found", "Plug it in. `boresight devices` lists the connected cameras.")
        }
        Fault::NotPermitted => (
            "No permission to use the camera",
            if cfg!(not(target_os = "linux")) {
                "Allow camera access in the system's privacy settings, then start again."
            } else {
                "Run: sudo usermod -aG video $USER, then log out and in. In a container or snap, pass the camera through."
            },
        ),
        Fault::Busy => ("Another program is using the camera", "Close that program."),
        Fault::NotACamera => (
            "This device isn't a camera",
            "Choose another one. `boresight devices` lists the cameras.",
        ),
        Fault::Virtual => (
            "This camera is virtual: another program feeds it",
            "Choose a real one. Otherwise you calibrate what that program sends.",
        ),
        Fault::Infrared => (
            "This looks like an infrared camera: every other picture is dark",
            "Choose the colour camera beside it: see `boresight devices`.",
        ),
        Fault::OtherCamera => (
            "A different camera is connected",
            "Plug the first one back in. To calibrate the other one, start a new session.",
        ),
        Fault::Twin => (
            "Two cameras have the same name and serial number",
            "Cover the lens with your hand to check which one it is. For the other one, give its own name from `boresight devices`.",
        ),
        Fault::NoFormat => (
            "The camera offers no picture of that size in a supported format",
            "Choose a size that it offers (camera.mode). Supported formats are MJPG, YUYV, NV12, GREY, Y10, Y12, Y16, RGB3, BGR3 and 8-bit Bayer. See `boresight devices`, or try another camera with --source.",
        ),
        Fault::OtherMode => (
            "The camera chose a different mode",
            "That mode is used. The calibration is valid for that mode only.",
        ),
        Fault::NoBandwidth => (
            "Not enough USB bandwidth for this camera",
            "Unplug other cameras, use another USB port, or choose a smaller mode: --set camera.mode=640x480",
        ),
        Fault::Transfer => (
            "Pictures from the camera don't arrive",
            "Unplug it and plug it back in. Try another cable or port, without a hub.",
        ),
        Fault::NoFirstFrame => (
            "The camera sends no pictures",
            "Unplug it and plug it back in. Close other programs that used it.",
        ),
        Fault::Stalled => (
            "The camera has stopped sending pictures",
            "Restarting… If it doesn't return, unplug it and plug it back in.",
        ),
        Fault::Unplugged => (
            "The camera is unplugged",
            "Plug it back into any port to continue. Your views are safe.",
        ),
        Fault::Suspended => (
            "The computer went to sleep",
            "Restarting… If it doesn't return, unplug it and plug it back in.",
        ),
        Fault::DriverBroken => (
            "The camera driver is misbehaving",
            "Unplug it and plug it back in. If that doesn't help, use another mode or camera.",
        ),
        Fault::DamagedFrames => (
            "Most pictures arrive damaged",
            "Try another cable or port, a smaller mode, or more light.",
        ),
        Fault::Frozen => {
            ("The camera keeps sending the same picture", "Unplug it and plug it back in.")
        }
        Fault::Dark => {
            ("The pictures are black", "Open the camera's shutter, or switch on the light.")
        }
        Fault::Slow => (
            "The frame rate is much lower than expected",
            "Add light if the exposure is long. Use a smaller mode, another port or network, or a computer that's less busy.",
        ),
        Fault::ControlIgnored => (
            "The camera doesn't keep a setting",
            "Set it in the camera's own program or by hand, then start again.",
        ),
        Fault::GeometryMoved => (
            "Focus or zoom moved",
            "Switch off autofocus and automatic framing in the camera's own program.",
        ),
        Fault::Unwatched => (
            "Focus, zoom and exposure can't be locked from here",
            "Switch off autofocus and automatic framing in the camera's own program.",
        ),
        Fault::NoReader => (
            "This source needs ffmpeg, which isn't installed",
            "Install it: sudo apt install ffmpeg",
        ),
        Fault::ReaderFailed => (
            "ffmpeg couldn't read this source",
            "Check the name or address. Try it with `ffmpeg -i` in a terminal.",
        ),
        Fault::StreamLost => (
            "The network stream has stopped",
            "Reconnecting… Your views are safe. Check the camera's power and the network.",
        ),
        Fault::NotLoggedIn => (
            "The network camera refuses this user name or password",
            "Give both in the address: rtsp://USER:PASSWORD@CAMERA/… In a password, write %40 for @, %2F for / and %3A for :.",
        ),
        Fault::NoSuchStream => (
            "The network camera has no stream at this address",
            "Check the part after the host name; the camera's manual or its web page names it.",
        ),
        Fault::Unreachable => (
            "No network camera answers at this address",
            "Check the host name and port, the camera's power, and that this computer is on its network.",
        ),
        Fault::NoCommand => (
            "The command can't be started",
            "Check how it's written; a terminal must find it, too. If it needs a shell, ask for one: pipe:sh -c '…'",
        ),
        Fault::CommandEnded => (
            "The command that sends the pictures has ended",
            "Starting it again… Your views are safe. If it doesn't return, run it in a terminal to see why.",
        ),
        Fault::NoPictures => (
            "No picture comes through the pipe",
            "Waiting for one… Your views are safe. If none comes, run the command in a terminal: it must write pictures to its standard output.",
        ),
        Fault::NotPictures => (
            "What comes through the pipe can't be read as pictures",
            "Let the command write YUV4MPEG2, JPEG or PNG, or describe raw pictures: --raw 1280x720:gray@30",
        ),
        Fault::OtherSize => (
            "The pictures have another size now",
            "Go back to the session's size, or start a new session: a calibration holds for one size.",
        ),
        Fault::BrokenPicture => (
            "A picture can't be read and is left out",
            "Leave the file out, or replace it with an undamaged one.",
        ),
        Fault::NoSuchTopic => (
            "No pictures are published on this ROS 2 topic",
            "Start the camera's driver. `boresight devices` lists the image topics; ROS_DOMAIN_ID must be the driver's.",
        ),
    }
}

/// Action when a camera returns with another mode than the session's.
const OTHER_MODE_WAITS: &str = "The session's mode is asked for until the camera grants it; plug it into the port where it was. For the other mode, start a new session.";

/// Action while a camera is lost by `fault`.
pub(super) fn action_while_lost(lost: Fault) -> &'static str {
    // Without the session's mode the camera isn't used at all.
    if lost == Fault::OtherMode { OTHER_MODE_WAITS } else { fault(lost).1 }
}

/// Obstacle to taking views, and the next action; `None` without an obstacle.
pub fn obstacle(camera: &CameraState) -> Option<(String, String)> {
    if let Stream::Lost { fault: lost, detail } = &camera.stream {
        let (cause, _) = with_detail(*lost, detail);
        return Some((cause, action_while_lost(*lost).into()));
    }
    geometry_moved(camera).or_else(|| {
        let (doubt, detail) = camera.doubts.get_key_value(&Fault::Frozen)?;
        Some(with_detail(*doubt, detail))
    })
}

/// Moved focus or zoom, and the next action.
pub(super) fn geometry_moved(camera: &CameraState) -> Option<(String, String)> {
    let change = camera.changed.values().find(|change| change.control.moves_geometry())?;
    if camera.set_by_hand.contains(&change.control) {
        return Some((
            format!("{}. Capture is paused", set(change)),
            format!(
                "The views were taken at {0}. Set it back to {0}, or start a new session at {1}.",
                change.from, change.to
            ),
        ));
    }
    let what = format!("{}. Set it back to continue", moved(change));
    Some((what, fault(Fault::GeometryMoved).1.into()))
}

/// Changed control, such as `Focus changed (30 → 45)`.
fn moved(change: &ControlChange) -> String {
    format!("{} changed ({} to {})", capital(control(change.control)), change.from, change.to)
}

/// Changed control that doesn't hold up the session: "Exposure changed (8000 to 33333). Setting it
/// back…".
pub fn put_right(change: &ControlChange) -> String {
    format!("{}. Setting it back…", moved(change))
}

/// Restored control: "Exposure is set back".
pub fn is_back(which: Control) -> String {
    format!("{} is set back", capital(control(which)))
}

/// Control set by the person.
fn set(change: &ControlChange) -> String {
    let name = capital(control(change.control));
    format!("{name} was set by hand ({} to {})", change.from, change.to)
}

/// Fault with details: cause and action.
pub fn with_detail(what: Fault, detail: &str) -> (String, String) {
    let (cause, action) = fault(what);
    let detail = printable(detail);
    let cause = if detail.is_empty() { cause.into() } else { format!("{cause} ({detail})") };
    (cause, action.into())
}

/// Event of the camera, for a list of events; `None` if it's no news.
pub fn event(event: &CameraEvent) -> Option<String> {
    Some(match event {
        CameraEvent::Started { mode: granted } => format!("streaming {}", mode(granted)),
        CameraEvent::Returned { mode: granted, .. } => format!("back, {}", mode(granted)),
        CameraEvent::Lost { fault, detail } | CameraEvent::Doubtful { fault, detail } => {
            format!("{}: {}", fault.code(), with_detail(*fault, detail).0)
        }
        CameraEvent::Dispelled { fault } => format!("{}: over", fault.code()),
        CameraEvent::ControlChanged(change) => moved(change),
        CameraEvent::ControlSet { control: which, lock: is, .. } => {
            format!("{} was set by hand: {}", capital(control(*which)), lock(*is))
        }
        CameraEvent::ControlRestored { control: which, .. } => is_back(*which),
        CameraEvent::Locked { .. } | CameraEvent::Counted { .. } => return None,
    })
}

/// Name of a control.
pub fn control(control: Control) -> &'static str {
    match control {
        Control::Focus => "focus",
        Control::Zoom => "zoom",
        Control::Exposure => "exposure",
        Control::Gain => "gain",
        Control::WhiteBalance => "white balance",
    }
}

/// State of a control.
pub fn lock(lock: Lock) -> String {
    match lock {
        Lock::Unknown => "unknown".into(),
        Lock::Absent => "fixed".into(),
        Lock::Free => "not locked".into(),
        Lock::Locked { value } => format!("locked at {value}"),
        Lock::Ignored { set, read } => format!("set to {set}, reads back {read}"),
    }
}

/// Camera mode, such as `1280x720 MJPG at 30 fps`.
pub fn mode(mode: &Mode) -> String {
    let size = format!("{} {}", mode.size, mode.layout.name());
    match mode.rate_hz() {
        Some(rate) => format!("{size} at {} fps", (rate * 10.0).round() / 10.0),
        None => size,
    }
}

/// Text from a device or a file without characters that control a terminal or the direction of
/// writing.
pub fn printable(text: &str) -> String {
    text.chars().filter(|c| is_harmless(*c)).collect()
}

/// False for control characters and for characters that change the direction of writing.
pub fn is_harmless(c: char) -> bool {
    !c.is_control()
        && !matches!(c, '\u{061C}' | '\u{200E}' | '\u{200F}' | '\u{2028}'..='\u{202E}' | '\u{2066}'..='\u{2069}')
}

/// `word` capitalised, as at the start of a line.
pub fn capital(word: &str) -> String {
    let mut letters = word.chars();
    letters.next().map_or(String::new(), |first| first.to_uppercase().chain(letters).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_of_devices_command_no_terminal() {
        assert_eq!(printable("a\u{1b}[2Jb\u{202e}c\u{2066}\nd – é"), "a[2Jbcd – é");
    }

    #[test]
    fn every_fault_has_a_cause_and_a_next_action() {
        for what in Fault::ALL {
            let (cause, action) = fault(what);
            assert!(!cause.is_empty() && !cause.ends_with('.'), "{what:?}: {cause}");
            assert!(action.len() > 10, "{what:?}: {action}");
        }
    }

    #[test]
    fn names_from_devices_command_no_terminal() {
        let (cause, _) = with_detail(Fault::Busy, "evil\u{1b}[2Jname\n");
        assert_eq!(cause, "Another program is using the camera (evil[2Jname)");
    }
}
