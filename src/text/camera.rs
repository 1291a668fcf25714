//! The live camera in words.

use crate::{
    device::{CameraEvent, Control, ControlChange, Fault, Lock, Mode},
    session::{CameraState, Stream},
};

/// What a fault means, and what to do.
pub fn fault(fault: Fault) -> (&'static str, &'static str) {
    match fault {
        Fault::NotFound => (
            "The camera is not there",
            "Plug it in; `boresight devices` lists the cameras that are there.",
        ),
        Fault::NotPermitted => (
            "This user may not open the camera",
            if cfg!(not(target_os = "linux")) {
                "Allow it in the system's settings for privacy and camera, then start again."
            } else {
                "Run: sudo usermod -aG video $USER, then log out and in; in a container or snap, pass the camera in."
            },
        ),
        Fault::Busy => ("Another program uses the camera", "Close that program."),
        Fault::NotACamera => (
            "This device takes no pictures",
            "Name another one: `boresight devices` lists those that do.",
        ),
        Fault::Virtual => (
            "This camera is virtual: another program feeds it",
            "Name a real one; what is calibrated here is what that program sends.",
        ),
        Fault::Infrared => (
            "This looks like an infrared camera: its pictures are lit in turn",
            "Name the colour camera beside it: see `boresight devices`.",
        ),
        Fault::OtherCamera => (
            "Another camera is where this one was",
            "Plug the first one in again; for the other one start a new session.",
        ),
        Fault::Twin => (
            "Two cameras cannot be told apart by name and serial number",
            "Hold a hand before the lens to check which one it is; it is known by its USB port from here on.",
        ),
        Fault::NoFormat => (
            "The camera offers no picture format that can be read",
            "Readable are MJPG, YUYV, NV12 and GREY: see `boresight devices`; try --source with another camera.",
        ),
        Fault::OtherMode => (
            "The driver grants another mode than was asked for",
            "The mode it grants is used; a calibration is good for that mode only.",
        ),
        Fault::NoBandwidth => (
            "The USB bus has no bandwidth left for this camera",
            "Unplug other cameras, use another USB port, or ask for a smaller mode: --set camera.mode=640x480",
        ),
        Fault::Transfer => (
            "The transfer from the camera fails",
            "Plug it out and in again; try another cable or port, without a hub.",
        ),
        Fault::NoFirstFrame => (
            "The camera sends no picture",
            "Plug it out and in again; close programs that used it before.",
        ),
        Fault::Stalled => (
            "The camera has stopped sending pictures",
            "Wait: it is started again. If it does not come, plug it out and in.",
        ),
        Fault::Unplugged => (
            "The camera is unplugged",
            "Plug it in again, at any port; the session goes on with its views.",
        ),
        Fault::Suspended => (
            "The computer slept, and the camera with it",
            "Wait: it is started again. If it does not come, plug it out and in.",
        ),
        Fault::DriverBroken => (
            "The camera's driver does not keep to the rules",
            "Plug it out and in again; if that does not help, use another mode or camera.",
        ),
        Fault::DamagedFrames => (
            "Most pictures arrive damaged",
            "Use another cable or port, a smaller mode, or more light.",
        ),
        Fault::Frozen => {
            ("The camera sends the same picture again and again", "Plug it out and in again.")
        }
        Fault::Dark => {
            ("The pictures are black", "Open the camera's shutter, or switch the light on.")
        }
        Fault::Slow => (
            "Far fewer pictures arrive than the camera promises",
            "More light shortens the exposure; or use another USB port or a smaller mode.",
        ),
        Fault::ControlIgnored => (
            "The camera does not keep a control as it was set",
            "Fix it in the camera's own program or by hand, then start again.",
        ),
        Fault::GeometryMoved => (
            "Focus or zoom moved",
            "Switch autofocus and automatic framing off in the camera's own program.",
        ),
        Fault::Unwatched => (
            "Focus, zoom and exposure are neither locked nor watched by the backend nokhwa",
            "Switch autofocus and automatic framing off in the camera's own program; on Linux --backend v4l does it.",
        ),
        Fault::NoReader => (
            "The program ffmpeg is needed to read this source and is not installed",
            "Install it: sudo apt install ffmpeg",
        ),
        Fault::ReaderFailed => (
            "ffmpeg could not read this source",
            "Check the address, and that `ffmpeg -i` with it works in a terminal.",
        ),
        Fault::StreamLost => (
            "The network stream has stopped",
            "Wait: it is asked for again until it is back, and the session keeps its views. Check the camera's power and the network.",
        ),
    }
}

/// What to do when a camera returns with another mode than the session's.
const OTHER_MODE_WAITS: &str = "The session's mode is asked for until the camera grants it; plug it into the port where it was. For the other mode, start a new session.";

/// What keeps pictures from being taken, and what to do; `None` if nothing does.
pub fn obstacle(camera: &CameraState) -> Option<(String, String)> {
    if let Stream::Lost { fault: lost, detail } = &camera.stream {
        let (cause, action) = with_detail(*lost, detail);
        // Without the session's mode it isn't used at all.
        let waits = (*lost == Fault::OtherMode).then(|| OTHER_MODE_WAITS.to_owned());
        return Some((cause, waits.unwrap_or(action)));
    }
    if let Some(change) = camera.changed.values().find(|change| change.control.moves_geometry()) {
        if camera.set_by_hand.contains(&change.control) {
            return Some((
                format!("{}: nothing is taken until it is back", set(change)),
                format!(
                    "The views were taken at {0}. Set it back to {0}, or start a new session: it begins with {1}.",
                    change.from, change.to
                ),
            ));
        }
        return Some((
            format!("{}: nothing is taken until it is back", moved(change)),
            fault(Fault::GeometryMoved).1.into(),
        ));
    }
    let (doubt, detail) = camera.doubts.get_key_value(&Fault::Frozen)?;
    Some(with_detail(*doubt, detail))
}

/// A control that is not what it was, such as `Focus moved from 30 to 45`.
fn moved(change: &ControlChange) -> String {
    format!("{} moved from {} to {}", capital(control(change.control)), change.from, change.to)
}

/// A control that the person set.
fn set(change: &ControlChange) -> String {
    let name = capital(control(change.control));
    format!("{name} was set from {} to {}", change.from, change.to)
}

/// A fault with its details: what happened, and what to do.
pub fn with_detail(what: Fault, detail: &str) -> (String, String) {
    let (cause, action) = fault(what);
    let detail = printable(detail);
    let cause = if detail.is_empty() { cause.into() } else { format!("{cause} ({detail})") };
    (cause, action.into())
}

/// What happened to the camera, for a list of such; `None` for what is no news.
pub fn event(event: &CameraEvent) -> Option<String> {
    Some(match event {
        CameraEvent::Started { mode: granted } => format!("streams {}", mode(granted)),
        CameraEvent::Returned { mode: granted, .. } => format!("is back, {}", mode(granted)),
        CameraEvent::Lost { fault, detail } | CameraEvent::Doubtful { fault, detail } => {
            format!("{}: {}", fault.code(), with_detail(*fault, detail).0)
        }
        CameraEvent::Dispelled { fault } => format!("{}: over", fault.code()),
        CameraEvent::ControlChanged(change) => moved(change),
        CameraEvent::ControlSet { control: which, lock: is, .. } => {
            format!("{} was set by hand: {}", capital(control(*which)), lock(*is))
        }
        CameraEvent::ControlRestored { control: which, .. } => {
            format!("{} is back where it was", capital(control(*which)))
        }
        CameraEvent::Locked { .. } | CameraEvent::Counted { .. } => return None,
    })
}

/// The name of a control.
pub fn control(control: Control) -> &'static str {
    match control {
        Control::Focus => "focus",
        Control::Zoom => "zoom",
        Control::Exposure => "exposure",
        Control::Gain => "gain",
        Control::WhiteBalance => "white balance",
    }
}

/// How a control stands.
pub fn lock(lock: Lock) -> String {
    match lock {
        Lock::Unknown => "not known".into(),
        Lock::Absent => "fixed".into(),
        Lock::Free => "not locked".into(),
        Lock::Locked { value } => format!("locked at {value}"),
        Lock::Ignored { set, read } => format!("set to {set}, reads {read}"),
    }
}

/// A camera's mode, such as `1280x720 MJPG at 30 fps`.
pub fn mode(mode: &Mode) -> String {
    let size = format!("{}x{} {}", mode.size.width_px, mode.size.height_px, mode.layout.name());
    match mode.rate_hz() {
        Some(rate) => format!("{size} at {} fps", (rate * 10.0).round() / 10.0),
        None => size,
    }
}

/// Text from a device without what could command a terminal.
pub fn printable(text: &str) -> String {
    text.chars().filter(|c| !c.is_control()).collect()
}

/// With a capital letter, as at the start of a line.
pub fn capital(word: &str) -> String {
    let mut letters = word.chars();
    letters.next().map_or(String::new(), |first| first.to_uppercase().chain(letters).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

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
        assert_eq!(cause, "Another program uses the camera (evil[2Jname)");
    }
}
